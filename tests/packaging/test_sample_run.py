"""The command that trains the run which comes with the sample project, at toy size."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest

from studio.inference.offline import load_predictor
from studio.project import Run

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.slow
def test_the_samples_takes_make_its_run(tmp_path: Path) -> None:
    spec = importlib.util.spec_from_file_location("sample_run", ROOT / "packaging" / "sample_run.py")
    assert spec is not None
    assert spec.loader is not None
    command = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(command)
    small = ["epochs=1", "steps=2", "crops=2", "units=8"]
    words = ["--out", str(tmp_path / "run"), *(word for change in small for word in ("--set", change))]
    assert command.main(words) == 0
    run = Run.load(tmp_path / "run")
    assert len(run.facts.train) == 5
    assert (run.facts.pid, run.facts.host, run.facts.made_with) == (None, "", None)
    assert "Head" in load_predictor(run.folder).model.layout.bone_names
