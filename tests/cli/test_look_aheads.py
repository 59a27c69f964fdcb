"""The quality of each look-ahead, measured on takes a run has not learnt from, where Live finds it."""

from __future__ import annotations

import json
from collections.abc import Callable

import pytest

from studio.cli import main
from studio.project import Project
from tests.live.runs import add_run


@pytest.mark.parametrize("offered", ["0 100 500", ""])
def test_an_evaluation_keeps_the_figures_of_each_look_ahead(
    make_toy_project: Callable[..., Project], offered: str, capsys: pytest.CaptureFixture[str]
) -> None:
    project = make_toy_project(splits=("train", "test"), seconds=2.0)
    run = add_run(project, f"look_aheads={offered}", train=["Toy_001"])
    project.close()
    assert main(["evaluate", str(project.folder), run.id, "--no-baselines"]) == 0
    capsys.readouterr()
    report = json.loads((run.folder / "report.json").read_text(encoding="utf-8"))
    assert report["status"] == "done"
    if not offered:
        assert "look_aheads" not in report
        return
    assert [one["ms"] for one in report["look_aheads"]] == [0, 100, 500]
    assert [one["reach_ms"] for one in report["look_aheads"]] == pytest.approx([25, 91.7, 491.7], abs=0.1)
    assert all(one["rmse"] > 0 for one in report["look_aheads"])
    assert len({one["rmse"] for one in report["look_aheads"]}) == 3
    assert report["look_aheads_on"] == {"split": "test", "takes": ["Toy_002"]}
