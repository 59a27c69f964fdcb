"""A run whose papers were damaged is still a run: what cannot be understood is left out."""

from __future__ import annotations

import json
from pathlib import Path

from studio.project.run import Run, RunReport


def test_lines_that_are_no_epochs_are_left_out(tmp_path: Path) -> None:
    good = {"event": "epoch", "epoch": 1, "val": {"rmse": 0.1}}
    bad = ['{"epoch": "x"}', '{"epoch": null}', "[]", "\xff\x00", '{"epoch": 2, "val": [1]}', '{"epoch"']
    bad.append("[" * 100_000 + "]" * 100_000)
    text = "\n".join([*bad, json.dumps(good), '{"epoch": 2}'])
    (tmp_path / "metrics.jsonl").write_bytes(text.encode("latin-1"))
    assert Run.load(tmp_path).epochs() == [good, {"epoch": 2}]


def test_facts_of_a_report_that_cannot_be_are_left_out(tmp_path: Path) -> None:
    odd = {"train": 3, "fps": "x", "status": "done", "best_val": [], "seed": 1, "val": None, "styles": "ab"}
    (tmp_path / "report.json").write_text(json.dumps(odd), encoding="utf-8")
    run = Run.load(tmp_path)
    assert run.status == "done"
    assert run.report == RunReport(status="done", seed=1)
