"""The Export page on real files: several formats, parts, spans, pictures, and an end in the middle of it."""

from __future__ import annotations

from pathlib import Path

import av
import numpy as np
import pytest
from PIL import Image
from PySide6.QtCore import QThreadPool
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QLabel
from pytestqt.qtbot import QtBot

from studio.formats import bvh
from studio.take.motion_file import read_motion
from studio.training.styles import RunSelection
from studio.ui.review.presenter import ReviewPresenter
from studio.ui.review.view import ReviewView

Tab = tuple[ReviewView, ReviewPresenter]


@pytest.fixture
def tab(tab: Tab) -> Tab:
    view, _ = tab
    view.tabs.setCurrentWidget(view.export)
    return tab


def _choose(view: ReviewView, first: str, *also: str) -> None:
    view.export.format.setCurrentIndex(view.export.format.findData(first))
    for name in also:
        action = view.export.more.findChild(QAction, f"more_{name}")
        assert action is not None
        action.trigger()


def _export(qtbot: QtBot, view: ReviewView) -> str:
    result = view.findChild(QLabel, "export_result")
    assert result is not None
    view.export.show_result("", False)
    view.export.export.click()
    qtbot.waitUntil(lambda: result.text() != "")
    return result.text()


def test_several_formats_of_a_selection_as_captured(qtbot: QtBot, tab: Tab, tmp_path: Path) -> None:
    view, presenter = tab
    _choose(view, "bvh", "arrow")
    view.export.folder.setText(str(tmp_path / "出力 folder"))
    view.export.name.setText("my: film")
    assert not view.export.options.span.isEnabled(), "nothing is selected"
    view.timeline.span_selected.emit((1.0, 3.0))
    view.export.options.span.setCurrentIndex(1)
    view.export.options.tuned.click()
    assert _export(qtbot, view) == "Exported and verified: my_ film.bvh, my_ film.arrow."
    found = read_motion(tmp_path / "出力 folder" / "my_ film.arrow")
    truth = presenter.model.captured.motion
    assert truth is not None
    np.testing.assert_allclose(found.shapes[0], truth.pose(1.0).shapes, atol=1e-4)
    assert (found.times[0], found.duration) == pytest.approx((0.0, 2.0), abs=0.05)
    body = bvh.read(tmp_path / "出力 folder" / "my_ film.bvh").motion
    assert body is not None
    assert body.duration == pytest.approx(2.0, abs=0.05)


def test_a_still_is_what_is_seen_and_a_face_alone_has_no_body(qtbot: QtBot, tab: Tab, tmp_path: Path) -> None:
    view, _ = tab
    _choose(view, "png", "bvh")
    assert view.export.options.picture.isVisible()
    view.export.folder.setText(str(tmp_path))
    view.export.options.picture.setCurrentIndex(view.export.options.picture.findText("640 x 360"))
    view.export.options.part.setCurrentIndex(1)
    view.export.options.background.chosen.emit("transparent")
    told = _export(qtbot, view)
    assert told == (
        "Exported and verified: toy_003.png.\n"
        "toy_003.bvh: There is no body motion to write to toy_003.bvh. Export it as SAIA CSV instead."
    )
    with Image.open(tmp_path / "toy_003.png") as still:
        assert (still.size, still.mode) == ((640, 360), "RGBA")
        assert np.asarray(still)[..., 3].min() == 0
    assert not (tmp_path / "toy_003.bvh").exists()


@pytest.mark.slow
def test_a_film_of_the_selection_has_its_length_and_its_sound(qtbot: QtBot, tab: Tab, tmp_path: Path) -> None:
    view, _ = tab
    _choose(view, "mp4")
    view.export.folder.setText(str(tmp_path))
    view.export.options.picture.setCurrentIndex(view.export.options.picture.findText("640 x 360"))
    view.timeline.span_selected.emit((1.0, 2.0))
    view.export.options.span.setCurrentIndex(1)
    assert _export(qtbot, view) == "Exported and verified: toy_003.mp4."
    with av.open(str(tmp_path / "toy_003.mp4")) as film:
        assert film.streams.audio
        assert sum(1 for _ in film.decode(video=0)) == 30


def test_what_is_behind_on_the_stage_is_proposed_and_pictures_of_any_size_are_made(
    qtbot: QtBot, tab: Tab, tmp_path: Path
) -> None:
    view, _ = tab
    view.camera.backgrounds.chosen.emit("transparent")
    assert view.stage.predicted.figure.background.is_clear
    _choose(view, "frames")
    view.export.folder.setText(str(tmp_path))
    view.export.options.picture.setEditText("96x64")
    view.timeline.span_selected.emit((1.0, 1.2))
    view.export.options.span.setCurrentIndex(1)
    assert _export(qtbot, view) == "Exported and verified: toy_003.frames."
    pictures = sorted((tmp_path / "toy_003.frames").iterdir())
    assert [one.name for one in pictures] == [f"toy_003_{number:05d}.png" for number in range(1, 7)]
    with Image.open(pictures[0]) as first:
        assert (first.size, first.mode) == ((96, 64), "RGBA")


def test_cancel_works_while_it_is_prepared(qtbot: QtBot, tab: Tab, tmp_path: Path) -> None:
    view, presenter = tab
    _choose(view, "bvh")
    view.export.folder.setText(str(tmp_path / "out"))
    exporting = presenter.export
    view.export.export.click()
    assert exporting.busy
    assert view.export.cancel.isVisible()
    view.export.cancel.click()  # before anything else of the event loop
    assert not exporting.busy
    result = view.findChild(QLabel, "export_result")
    assert result is not None
    assert result.text() == "Cancelled."
    QThreadPool.globalInstance().waitForDone(60_000)
    qtbot.wait(50)
    assert not (tmp_path / "out").exists()
    assert _export(qtbot, view) == "Exported and verified: toy_003.bvh.", "and the next one works"


def test_cancel_in_the_child_leaves_no_half_file(qtbot: QtBot, tab: Tab, tmp_path: Path) -> None:
    view, presenter = tab
    _choose(view, "mp4")
    out = tmp_path / "out"
    view.export.folder.setText(str(out))
    view.export.export.click()
    qtbot.waitUntil(lambda: out.is_dir() and any(out.iterdir()))  # it is being written beside
    view.export.cancel.click()
    result = view.findChild(QLabel, "export_result")
    assert result is not None
    qtbot.waitUntil(lambda: result.text() != "")
    qtbot.waitUntil(lambda: not presenter.export.busy)
    assert result.text() == "Cancelled."
    assert list(out.iterdir()) == []


def test_an_unwritable_place_is_one_sentence(qtbot: QtBot, tab: Tab, tmp_path: Path) -> None:
    view, _ = tab
    _choose(view, "bvh")
    blocked = tmp_path / "file"
    blocked.write_text("a file, not a folder")
    view.export.folder.setText(str(blocked))
    told = _export(qtbot, view)
    assert told == f"{blocked} is a file, not a folder. Choose another folder."


def test_a_run_whose_motion_is_still_to_come_is_waited_for(tab: Tab) -> None:
    """Export pressed right after Watch wrote the captured motion, which was what was seen until then."""
    view, presenter = tab
    model, panel = presenter.model, view.export
    assert panel.export.isEnabled()
    model.captured_only = False
    model.side.selection = RunSelection("quick_001")
    model.set_generating(True)
    assert not panel.export.isEnabled()
    assert not panel.what.isVisible()
    model.set_generating(False)
    assert panel.export.isEnabled(), "nothing came of it: what is seen is what is exported"
    assert panel.what.text() == "Exports the captured motion."
