"""Missing files in the window: shown, found in a folder, put back, and away again with undo."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
from pytestqt.qtbot import QtBot

from studio.project import Project
from studio.ui.curate.missing_media_presenter import MissingMediaPresenter
from studio.ui.curate.presenter import CuratePresenter
from studio.ui.curate.view import CurateView
from studio.ui.session import Session

LONG = 30_000


@dataclass
class Room:
    """The tab as tests ask it."""

    presenter: CuratePresenter
    view: CurateView
    session: Session

    @property
    def media(self) -> MissingMediaPresenter:
        return self.presenter.media


@pytest.fixture
def room(qtbot: QtBot, toy_project: Project, tmp_path: Path) -> Iterator[Room]:
    sound = toy_project.take("toy_002").audio_path
    assert sound is not None
    (tmp_path / "old disk").mkdir()
    shutil.move(sound, tmp_path / "old disk" / "toy_002.wav")
    session, view = Session(), CurateView()
    session.project = toy_project
    qtbot.addWidget(view)
    view.resize(1280, 748)
    view.show()
    made = CuratePresenter(view, session)
    made.activate()
    qtbot.waitUntil(lambda: len(made.media.missing) == 1, timeout=LONG)
    yield Room(made, view, session)
    made.close()


def test_a_missing_sound_is_shown_found_and_put_back(room: Room, qtbot: QtBot, tmp_path: Path) -> None:
    library, inspector = room.view.library, room.view.inspector
    assert [library.model.index(i, 0).data() for i in range(2)] == ["toy_001", "toy_002 (missing)"]
    assert library.find_action.isEnabled()
    library.select(["toy_001"])
    assert not inspector.find_button.isVisible()
    library.select(["toy_002"])
    assert inspector.find_button.isVisible()
    assert inspector.facts.text() == "audio.wav of this take is missing."
    room.media.find(tmp_path / "old disk")
    qtbot.waitUntil(lambda: room.media.missing == () and not room.media.searching, timeout=LONG)
    project = room.session.project
    assert project is not None
    assert project.undo_name == "Restore the files of toy_002"
    assert library.model.index(1, 0).data() == "toy_002"
    room.session.undo()
    sound = project.take("toy_002").audio_path
    assert sound is not None
    assert not sound.exists()
    qtbot.waitUntil(lambda: len(room.media.missing) == 1, timeout=LONG)
    room.session.redo()
    assert sound.exists()
    qtbot.waitUntil(lambda: room.media.missing == (), timeout=LONG)
    assert (tmp_path / "old disk" / "toy_002.wav").exists()


def test_what_is_not_found_stays_missing(room: Room, qtbot: QtBot, tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    room.media.find(tmp_path / "empty")
    qtbot.waitUntil(lambda: not room.media.searching, timeout=LONG)
    assert len(room.media.missing) == 1
    project = room.session.project
    assert project is not None
    assert project.undo_name == "Keep one for validation"
