"""The few seconds people see while a model trains: the liveliest ones, bounded, and never in the way."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from studio.motion import Motion
from studio.project import Project
from studio.training import preview
from studio.training.preview import PreviewWriter, liveliest, read_preview, stamp


def motion(seconds: float = 12.0, strength: float = 1.0) -> Motion:
    """A mouth that moves from second 6 to 9."""
    times = np.arange(int(seconds * 30)) / 30
    values = strength * np.where((times >= 6) & (times < 9), np.sin(9 * times) ** 2, 0.0)
    return Motion.build(times, ("A",), values[:, None])


def test_the_liveliest_seconds_are_seen() -> None:
    start, end = liveliest(motion())
    assert end - start == pytest.approx(preview.SECONDS)
    assert start <= 6.0
    assert end >= 9.0
    assert liveliest(motion(2.0)) == (0.0, pytest.approx(2.0 - 1 / 30))


def test_the_newest_and_the_best_epoch_are_kept_and_nothing_more(tmp_path: Path) -> None:
    previewing = PreviewWriter(tmp_path, 60)
    seen = set()
    for epoch in range(1, 61):
        best = epoch in (2, 40)
        previewing.show("Chat_001", motion(), motion(strength=epoch / 100), epoch, best)
        found = read_preview(tmp_path)
        seen.add(found.epochs["latest"] if found is not None else 0)
    assert seen == {0, 2, 40, *range(3, 61, 3)}, "each third epoch, and the best"
    found = read_preview(tmp_path)
    assert found is not None
    assert (found.take, found.epochs) == ("Chat_001", {"latest": 60, "best": 40})
    assert 5.0 <= found.start <= 6.0
    assert sorted(path.name for path in found.folder.iterdir()) == [
        "best.arrow",
        "captured.arrow",
        "latest.arrow",
        "preview.json",
    ]
    peaks = {which: float(found.motion(which).shapes.max()) for which in ("captured", "latest", "best")}
    assert peaks["latest"] == pytest.approx(0.6 * peaks["captured"], rel=1e-3)
    assert peaks["best"] == pytest.approx(0.4 * peaks["captured"], rel=1e-3)
    assert found.motion("best").times[0] == pytest.approx(0.0, abs=1 / 30)


def test_a_resumed_training_goes_on_with_the_same_preview(tmp_path: Path) -> None:
    PreviewWriter(tmp_path, 4).show("Chat_001", motion(), motion(), 1, True)
    PreviewWriter(tmp_path, 4).show("Chat_001", motion(), motion(), 2, False)
    found = read_preview(tmp_path)
    assert found is not None
    assert found.epochs == {"latest": 2, "best": 1}


def test_a_folder_that_cannot_be_written_ends_no_training(tmp_path: Path) -> None:
    (tmp_path / "preview").write_text("a file in the way", encoding="utf-8")
    PreviewWriter(tmp_path, 4).show("Chat_001", motion(), motion(), 1, True)
    assert read_preview(tmp_path) is None
    assert stamp(tmp_path) == 0


@pytest.mark.parametrize("content", ["", "[]", "{}", '{"take": "x", "start": "soon", "epochs": {}}'])
def test_a_damaged_preview_is_none(tmp_path: Path, content: str) -> None:
    (tmp_path / "preview").mkdir()
    (tmp_path / "preview" / "preview.json").write_text(content, encoding="utf-8")
    assert read_preview(tmp_path) is None


def test_a_training_shows_what_it_has_learnt(make_toy_project: Callable[..., Project]) -> None:
    from studio.training.loop.train import train
    from studio.training.recipe import load_recipe

    project = make_toy_project(("train", "val"))
    recipe = load_recipe("quick").with_overrides(["units=8", "steps=2", "epochs=2"])
    run = train(project, recipe, on_event=lambda event: None)
    found = read_preview(run.folder)
    assert found is not None
    assert (found.take, found.epochs["latest"]) == ("Toy_002", 2)
    captured, latest = found.motion("captured"), found.motion("latest")
    assert captured.duration == pytest.approx(4.0, abs=0.1)
    assert (latest.shape_names, latest.bone_names) == (captured.shape_names, captured.bone_names)
    assert np.isfinite(latest.rotations).all()
    assert np.abs(replace(latest).rotations - captured.rotations).max() > 1e-3
