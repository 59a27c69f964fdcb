"""A learning curve measured for real: three small trainings on shares of the takes."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from studio import cli
from studio.evaluation.learning_curve import load_curve
from studio.project import Project
from tests import toys

SMALL = ("units=8", "steps=3", "crops=4", "crop_frames=60", "epochs=1", "network.body=plain")


def test_shares_are_trained_and_the_curve_is_kept(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    project = toys.make(tmp_path / "Toy", ("train", "train", "val", "test"), seconds=11.0)
    words = [part for one in SMALL for part in ("--set", one)]
    assert cli.main(["curve", str(project.folder), *words, "--json"]) == 0
    *progress, done = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [point["seconds"] for point in done["points"]] == pytest.approx([5.5, 11.0, 22.0])
    assert (done["split"], done["takes"]) == ("test", ["Toy_004"])
    assert {one["number"] for one in progress if one["event"] == "progress"} == {1, 2, 3}
    kept = load_curve(project)
    assert kept is not None
    assert kept.train == ("Toy_001", "Toy_002")
    assert "silence" in kept.shares
    assert project.runs == (), "what was trained on the way is no run of the project"
    assert Project.open(project.folder, read_only=True).selected("train")[0][0].out_point is None


def test_too_little_is_said_before_anything_is_trained(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    project = toys.make(tmp_path / "Toy", ("train", "val"), seconds=5.0)
    assert cli.main(["curve", str(project.folder)]) == 2
    assert "5 seconds to learn from are too few" in capsys.readouterr().err
