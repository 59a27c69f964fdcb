"""Videos brought into the window: the model offered, whose face asked, and the take that comes of it."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QColor, QPixmap
from PySide6.QtWidgets import QPushButton
from pytestqt.qtbot import QtBot

from studio.motion.filmed import HIDDEN
from studio.project import Project
from studio.take.motion_file import load_motion
from studio.ui import app as application
from studio.ui import messages, tasks
from studio.ui.main_window import MainWindow
from studio.ui.video_import import FacePicture, WhoseFaceDialog, videos_in
from tests.tracking.faces import (
    Look,
    bursts,
    needs_tracking,
    use_model,
    write_covered,
    write_two_faces,
    write_video,
)

FACES = ((0.1, 0.2, 0.2, 0.4), (0.6, 0.2, 0.3, 0.5))


@pytest.fixture
def window(qtbot: QtBot, toy_project: Project) -> Iterator[MainWindow]:
    toy_project.close()
    _, made = application.build([str(toy_project.folder)])
    qtbot.addWidget(made)
    made.show()
    yield made
    made.close()
    tasks.wait()


@pytest.fixture
def picture(qtbot: QtBot) -> FacePicture:
    pixmap = QPixmap(400, 200)
    pixmap.fill(QColor("grey"))
    made = FacePicture(pixmap, FACES)
    qtbot.addWidget(made)
    made.resize(400, 300)
    made.show()
    return made


def at(picture: FacePicture, x: float, y: float) -> QPoint:
    shown = picture.shown
    return QPointF(shown.x() + x * shown.width(), shown.y() + y * shown.height()).toPoint()


def test_a_click_chooses_a_face_and_so_do_the_arrow_keys(picture: FacePicture, qtbot: QtBot) -> None:
    told: list[tuple[int, object]] = []
    picture.chosen.connect(lambda face, box: told.append((face, box)))
    qtbot.mouseClick(picture, Qt.MouseButton.LeftButton, pos=at(picture, 0.7, 0.4))
    qtbot.mouseClick(picture, Qt.MouseButton.LeftButton, pos=at(picture, 0.45, 0.9))
    qtbot.keyClick(picture, Qt.Key.Key_Right)
    assert told == [(1, None), (0, None)]


def test_a_box_that_is_dragged_is_told_as_parts_of_the_picture(picture: FacePicture, qtbot: QtBot) -> None:
    told: list[tuple[int, object]] = []
    picture.chosen.connect(lambda face, box: told.append((face, box)))
    qtbot.mousePress(picture, Qt.MouseButton.LeftButton, pos=at(picture, 0.75, 0.5))
    qtbot.mouseMove(picture, at(picture, 1.2, 1.2))
    qtbot.mouseRelease(picture, Qt.MouseButton.LeftButton, pos=at(picture, 1.2, 1.2))
    ((face, box),) = told
    assert face == -1
    assert box == pytest.approx((0.75, 0.5, 0.25, 0.5), abs=0.01)


@needs_tracking()
def test_of_two_faces_the_one_that_was_clicked_is_tracked(
    window: MainWindow, qtbot: QtBot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    use_model(monkeypatch, tmp_path)
    film = write_two_faces(tmp_path / "duet.mp4")
    window.take_paths((film,))
    qtbot.waitUntil(lambda: window.findChild(WhoseFaceDialog) is not None, timeout=30_000)
    dialog = window.findChild(WhoseFaceDialog)
    assert dialog is not None
    assert dialog.args == ["--face", "1"], "the largest, until somebody says otherwise"
    if folder := os.environ.get("SAIA_SHOTS"):
        dialog.grab().save(f"{folder}/whose_face.png")
    qtbot.mouseClick(dialog.picture, Qt.MouseButton.LeftButton, pos=at(dialog.picture, 0.78, 0.5))
    assert dialog.args == ["--face", "2"]
    pictures: list[bytes] = []
    window.session.import_pictured.connect(pictures.append)
    dialog.go.click()
    project = window.session.project
    assert project is not None
    qtbot.waitUntil(lambda: "duet" in project.dataset, timeout=30_000)
    qtbot.waitUntil(lambda: not window.importer.running)
    assert pictures
    assert QPixmap().loadFromData(pictures[0], "JPEG")
    motion = load_motion(project.take("duet"))
    assert motion is not None
    assert np.ptp(motion.rotations[:, 0, 2]) > 0.06


@needs_tracking()
def test_the_note_names_the_hidden_mouths_that_are_left_out(
    window: MainWindow, qtbot: QtBot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    use_model(monkeypatch, tmp_path)
    window.take_paths((write_covered(tmp_path / "hand.mp4", "hand"),))
    project = window.session.project
    assert project is not None
    qtbot.waitUntil(lambda: "hand" in project.dataset and not window.importer.running)
    toast = messages.toast_of(window)
    assert toast is not None
    qtbot.waitUntil(lambda: toast.text.text() == "1 take imported.")
    hidden = sum(end - start for start, end, why in project.take("hand").info.left_out if why == HIDDEN)
    assert hidden > 0.8
    assert f"Left out of training: mouth hidden {hidden:.1f} s" in toast.remedy.text()


def test_without_the_model_the_sound_alone_may_be_taken(
    window: MainWindow, qtbot: QtBot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("mediapipe", reason="without MediaPipe a model would not help, and none is offered")
    monkeypatch.setenv("SAIA_FACE_MODEL", str(tmp_path / "none" / "face_landmarker.task"))
    asked: list[tuple[str, ...]] = []
    monkeypatch.setattr(messages, "ask", lambda _w, *words: asked.append(words) and False)
    film = write_video(tmp_path / "voice.mp4", [Look(gone=True)] * 10, bursts(0.4, (0.1,)))
    window.take_paths((film,))
    project = window.session.project
    assert project is not None
    qtbot.waitUntil(lambda: "voice" in project.dataset, timeout=30_000)
    assert "Apache-2.0" in asked[0][1]
    assert project.take("voice").info.motion_file is None
    qtbot.waitUntil(lambda: not window.importer.running)
    toast = window.findChild(messages.Toast)
    assert toast is not None
    qtbot.waitUntil(lambda: "Only the sound of voice.mp4 was imported." in toast.remedy.text())


def test_without_mediapipe_it_is_offered_with_its_size(
    window: MainWindow, qtbot: QtBot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("studio.tracking.face_model.find_spec", lambda _name: None)
    monkeypatch.setenv("SAIA_FACE_MODEL", str(tmp_path / "none" / "face_landmarker.task"))
    asked: list[tuple[str, ...]] = []
    monkeypatch.setattr(messages, "ask", lambda _w, *words: asked.append(words) and False)
    film = write_video(tmp_path / "voice.mp4", [Look(gone=True)] * 10, bursts(0.4, (0.1,)))
    window.take_paths((film,))
    project = window.session.project
    assert project is not None
    qtbot.waitUntil(lambda: "voice" in project.dataset, timeout=30_000)
    assert asked == [
        (
            "MediaPipe is needed to read motion from videos.",
            "It is fetched once: about 335 MB, Apache-2.0, from pypi.org.",
            "Get MediaPipe",
            "Import only the sound",
        )
    ]
    qtbot.waitUntil(lambda: not window.importer.running)


@needs_tracking()
def test_no_face_asks_for_a_box_and_cancel_imports_nothing(
    window: MainWindow, qtbot: QtBot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    use_model(monkeypatch, tmp_path)
    window.take_paths((write_video(tmp_path / "empty.mp4", [Look(gone=True)] * 10),))
    qtbot.waitUntil(lambda: window.findChild(WhoseFaceDialog) is not None, timeout=30_000)
    dialog = window.findChild(WhoseFaceDialog)
    assert dialog is not None
    assert not dialog.go.isEnabled()
    assert dialog.findChild(QPushButton, "whose_face_sound") is not None
    dialog.reject()
    assert not window.importer.running
    project = window.session.project
    assert project is not None
    assert "empty" not in project.dataset


def test_videos_are_found_in_folders_too(tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    for name in ("in/a.MOV", "b.webm", "c.wav"):
        (tmp_path / name).touch()
    assert set(videos_in((tmp_path / "in", tmp_path / "b.webm", tmp_path / "c.wav"))) == {
        tmp_path / "in" / "a.MOV",
        tmp_path / "b.webm",
    }
