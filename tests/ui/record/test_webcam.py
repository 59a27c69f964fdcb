"""The webcam's page, with a film played as the camera: picture, hints, motion in the window, and its end."""

import os
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLabel, QPushButton, QToolButton

from studio.errors import StudioError
from studio.tracking.face import SHAPES
from studio.tracking.webcam import load_calibration
from studio.ui import messages
from studio.ui.record.presenter import RecordPresenter
from studio.ui.record.view import RecordView
from studio.ui.session import Session
from tests.tracking.faces import Look, needs_tracking, use_model, write_video

Tab = tuple[RecordView, RecordPresenter, Session]


def open_page(view: RecordView) -> None:
    view.inputs.trackers.click()
    tile = view.trackers.findChild(QToolButton, "tracker_webcam")
    assert tile is not None
    tile.click()


@needs_tracking()
def test_a_face_in_the_camera_moves_the_window_until_it_is_stopped(
    tab: Tab, qtbot, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    use_model(monkeypatch, tmp_path)
    view, presenter, _session = tab
    page, pane = view.trackers, view.trackers.webcam
    film = write_video(tmp_path / "me.mp4", [Look(roll=i / 4) for i in range(40)])
    open_page(view)
    assert pane.isVisible()
    assert "never stored" in pane.picture.text()
    qtbot.waitUntil(lambda: pane.device.count() > 1, timeout=20_000)
    pane.device_chosen.emit(str(film))
    assert pane.device.currentText() == "me.mp4"
    pane.toggle.click()
    qtbot.waitUntil(lambda: not pane.picture.pixmap().isNull(), timeout=30_000)
    tile = page.findChild(QToolButton, "tracker_webcam")
    qtbot.waitUntil(lambda: tile.property("heard") is True, timeout=20_000)
    assert pane.isVisible(), "its own motion takes nobody to another card"
    lit = page.findChild(QToolButton, "tracker_other").property("heard")
    assert not lit, "it is no other VMC program"
    snap = presenter.model.recorder.snapshot()
    assert set(SHAPES) <= set(snap.shape_names)
    qtbot.waitUntil(lambda: pane.hint.text().startswith("Your face is tracked."), timeout=20_000)
    qtbot.waitUntil(lambda: "frames a second" in pane.rate.text(), timeout=20_000)
    if folder := os.environ.get("SAIA_SHOTS"):
        page.grab().save(f"{folder}/webcam_on.png")
    pane.gain.setValue(150)
    pane.calibrate.click()
    qtbot.waitUntil(lambda: pane.calibrate.text().startswith("Hold still"), timeout=20_000)
    page.findChild(QPushButton, "webcam_done").click()
    assert not page.isVisible()
    assert presenter.webcam.on, "it goes on with the page closed"
    stop = view.inputs.webcam
    assert stop.isVisible()
    stop.click()
    assert not stop.isVisible()
    qtbot.waitUntil(lambda: not presenter.webcam.on and presenter.model.webcam_sender == "")
    kept = load_calibration()
    assert kept is not None
    assert kept.gains == {"JawOpen": 1.5}
    open_page(view)
    qtbot.waitUntil(lambda: pane.gain.value() == 150)


def test_without_the_model_its_facts_are_shown_before_it_is_fetched(
    tab: Tab, qtbot, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    pytest.importorskip("mediapipe", reason="without MediaPipe the page names that instead")
    monkeypatch.setenv("SAIA_FACE_MODEL", str(tmp_path / "none" / "face_landmarker.task"))
    view = tab[0]
    open_page(view)
    pane = view.trackers.webcam
    text = pane.findChild(QLabel, "webcam_model")
    qtbot.waitUntil(lambda: text.isVisible(), timeout=20_000)
    for fact in ("3.8 MB", "Apache-2.0", "storage.googleapis.com", "64184e229b26"):
        assert fact in text.text()
    digits = text.toolTip().split()[-1]
    assert len(digits) == 64
    assert digits not in text.text(), "whole in the tooltip only"
    assert not pane.toggle.isEnabled()
    assert pane.toggle.toolTip() == text.text(), "a grey button says why"
    assert not pane.gain.isEnabled()
    assert "Start the webcam" in pane.gain.toolTip()
    if folder := os.environ.get("SAIA_SHOTS"):
        view.trackers.grab().save(f"{folder}/webcam_model.png")


def test_without_mediapipe_a_button_gets_it(
    tab: Tab, qtbot, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    # Children do not find it, and pip finds nothing on the network.
    hidden = "import importlib.util as u; f = u.find_spec; "
    hidden += "u.find_spec = lambda name, *more: None if name == 'mediapipe' else f(name, *more)"
    (tmp_path / "sitecustomize.py").write_text(hidden)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    errors: list[StudioError] = []
    monkeypatch.setattr(messages, "show_error", lambda _widget, error: errors.append(error))
    view = tab[0]
    open_page(view)
    pane = view.trackers.webcam
    text = pane.findChild(QLabel, "webcam_model")
    qtbot.waitUntil(lambda: pane.get_model.isVisible(), timeout=20_000)
    assert pane.get_model.text() == "Get MediaPipe"
    assert "about 335 MB" in text.text()
    assert "pip" not in text.text()
    assert not pane.choose_model.isVisible()
    assert not pane.toggle.isEnabled()
    if folder := os.environ.get("SAIA_SHOTS"):
        view.trackers.grab().save(f"{folder}/webcam_mediapipe.png")
    pane.get_model.click()
    assert pane.get_model.text() == "Cancel"
    qtbot.waitUntil(lambda: bool(errors), timeout=30_000)
    assert errors[0].what.startswith("MediaPipe could not be installed")
    assert pane.get_model.text() == "Get MediaPipe"


def test_size_and_rate_are_chosen_and_remembered(tab: Tab, qtbot) -> None:
    view, _presenter, session = tab
    open_page(view)
    pane = view.trackers.webcam
    assert pane.mode.currentText() == "640 × 480, 30 fps"
    pane.mode.setFocus()
    qtbot.keyClick(pane.mode, Qt.Key.Key_Down)
    qtbot.keyClick(pane.mode, Qt.Key.Key_Down)
    assert pane.mode.currentText() == "1280 × 720, 30 fps"
    assert session.settings.camera_mode == "1280x720@30"
    pane.show_running(True)
    assert not pane.mode.isEnabled()
    if folder := os.environ.get("SAIA_SHOTS"):
        view.trackers.grab().save(f"{folder}/webcam_mode.png")


def test_a_camera_that_cannot_be_opened_is_said_on_the_page(tab: Tab, qtbot, tmp_path: Path) -> None:
    view, presenter, _session = tab
    open_page(view)
    pane = view.trackers.webcam
    qtbot.waitUntil(lambda: pane.device.count() > 1, timeout=20_000)
    pane.device_chosen.emit(str(tmp_path / "gone.mp4"))
    presenter.webcam.set_on(True)
    qtbot.waitUntil(lambda: not presenter.webcam.on, timeout=30_000)
    assert pane.hint.text() not in ("", "Opening the camera…")
    assert pane.toggle.text() == "Start the webcam"
