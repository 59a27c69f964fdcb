"""The command that makes the run which comes with the studio, at toy size."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import pytest

from studio.inference.offline import load_predictor
from studio.performer import espeak
from studio.project import Run

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.skipif(not espeak.available(), reason="espeak-ng is not installed")
def test_performers_alone_make_a_run(tmp_path: Path) -> None:
    spec = importlib.util.spec_from_file_location("base_voice", ROOT / "packaging" / "base_voice.py")
    assert spec is not None
    assert spec.loader is not None
    command = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(command)
    out = tmp_path / "made" / "base_voice"
    small = ["epochs=1", "steps=2", "crops=2", "units=8"]
    words = ["--out", str(out), "--voices", "2", "--seconds", "6"]
    assert command.main([*words, *(word for change in small for word in ("--set", change))]) == 0
    run = Run.load(out)
    assert run.facts.notes == ("Learnt from 2 practice performers; no person's recording went into it.",)
    assert sorted(path.name for path in out.iterdir()) == ["best.safetensors", "recipe.toml", "report.json"]
    model = load_predictor(out).model
    assert {"A", "Blink"} <= set(model.layout.shape_names)
    assert "Head" in model.layout.bone_names
