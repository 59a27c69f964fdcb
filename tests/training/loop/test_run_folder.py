"""Curves for TensorBoard, read back with TensorBoard's own reader."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from studio import cli
from studio.project import Project, Run

MakeProject = Callable[..., Project]
TINY = [w for pair in ("units=8", "steps=2", "crops=2", "crop_frames=45") for w in ("--set", pair)]


def scalars(folder: Path) -> dict[str, dict[int, float]]:
    """Every curve in a folder of event files: its values by step."""
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    found = EventAccumulator(str(folder))
    found.Reload()
    return {tag: {e.step: e.value for e in found.Scalars(tag)} for tag in found.Tags()["scalars"]}


def expected(run: Run) -> dict[str, dict[int, float]]:
    """The curves in metrics.jsonl."""
    curves: dict[str, dict[int, float]] = {}
    for epoch in run.epochs():
        values = {"loss/train": epoch["train_loss"], "loss/validation": epoch["val_loss"]}
        for name, value in (values | {f"validation/{k}": v for k, v in epoch["val"].items()}).items():
            if value is not None:
                curves.setdefault(name, {})[epoch["epoch"]] = value
    return curves


def test_tensorboard_shows_the_curves_of_a_run_that_was_resumed(
    make_toy_project: MakeProject, capsys: pytest.CaptureFixture[str]
) -> None:
    project = make_toy_project(("train", "val"))
    words = ["train", str(project.folder), "--tensorboard", *TINY]
    assert cli.main([*words, "--set", "epochs=2"]) == 0
    resumed = ["train", str(project.folder), "--tensorboard", "--resume", "balanced_001"]
    assert cli.main([*resumed, "--set", "epochs=3"]) == 0
    run = project.run("balanced_001")
    written, told = scalars(run.folder / "tensorboard"), expected(run)
    assert written.keys() == told.keys()
    assert {"loss/train", "loss/validation", "validation/rmse", "validation/motion_ratio"} <= written.keys()
    for name, curve in told.items():
        assert written[name] == pytest.approx(curve, rel=1e-5), name


def test_without_being_asked_nothing_is_written(
    make_toy_project: MakeProject, capsys: pytest.CaptureFixture[str]
) -> None:
    project = make_toy_project(("train", "val"))
    assert cli.main(["train", str(project.folder), *TINY, "--set", "epochs=1"]) == 0
    assert not (project.run("balanced_001").folder / "tensorboard").exists()


def test_where_it_is_not_installed_a_sentence_says_how(make_toy_project: MakeProject, tmp_path: Path) -> None:
    import os
    import subprocess
    import sys

    # A Python that finds everything but TensorBoard, as it is without the extra.
    (tmp_path / "sitecustomize.py").write_text(
        "import importlib.util as u\n"
        "real = u.find_spec\n"
        "u.find_spec = lambda name, *rest: None if name == 'tensorboard' else real(name, *rest)\n",
        encoding="utf-8",
    )
    done = subprocess.run(
        [sys.executable, "-m", "studio", "train", str(make_toy_project().folder), "--tensorboard"],
        env={**os.environ, "PYTHONPATH": f"{tmp_path}{os.pathsep}{Path.cwd()}"},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert done.stderr == (
        "TensorBoard is not installed here. Install it with `pip install tensorboard`, or leave "
        "--tensorboard out.\n"
    )
