"""Where Tune's sliders stood last stays with the project."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from pytestqt.qtbot import QtBot

from studio.motion.channels import BONES, VRM0_SHAPES
from studio.playback.layers import Tuning, presets
from studio.project import Project
from studio.settings import Settings
from studio.ui.messages import Toast
from studio.ui.review.tune_presenter import FILE, LastTuning
from studio.ui.review.tune_view import TunePanel
from studio.ui.session import Session

Start = Callable[[Path], tuple[TunePanel, LastTuning, Session]]


@pytest.fixture
def start(qtbot: QtBot) -> Start:
    """A studio as it comes up with a project, the sliders where it puts them."""

    def begin(folder: Path) -> tuple[TunePanel, LastTuning, Session]:
        panel, session = TunePanel(), Session(Settings())
        qtbot.addWidget(panel)
        panel.show_motion(VRM0_SHAPES, BONES)
        panel.show()
        session.project = Project.open_or_create(folder)
        last = LastTuning(panel, session)
        qtbot.waitUntil(lambda: last.folder is not None)
        return panel, last, session

    return begin


def _kept(folder: Path) -> Tuning | None:
    return presets.read(folder / FILE).tuning if (folder / FILE).is_file() else None


def _end(last: LastTuning, session: Session) -> None:
    last.close()
    assert session.project is not None
    session.project.close()


def test_sliders_that_were_not_saved_stand_there_at_the_next_start(
    qtbot: QtBot, start: Start, tmp_path: Path
) -> None:
    folder = tmp_path / "配信 project"
    panel, last, session = start(folder)
    assert not (folder / FILE).exists(), "what changes nothing needs no file"
    panel.rows["head"].box.setValue(0.3)
    qtbot.waitUntil(lambda: _kept(folder) == Tuning(head=0.3))
    panel.rows["mouth"].box.setValue(1.2)
    _end(last, session)  # it has not rested yet
    assert _kept(folder) == Tuning(head=0.3, mouth=1.2)
    panel, last, session = start(folder)
    assert panel.tuning == Tuning(head=0.3, mouth=1.2)
    assert panel.rows["head"].box.value() == pytest.approx(0.3)
    assert not panel.undo_button.isEnabled(), "there is nothing before it"
    panel.rows["head"].box.setValue(0.5)
    panel.undo_scope.undo()
    assert panel.tuning == Tuning(head=0.3, mouth=1.2)
    panel.reset.click()
    assert panel.tuning == Tuning()
    _end(last, session)
    assert start(folder)[0].tuning == Tuning()


def test_each_project_has_its_own(qtbot: QtBot, start: Start, tmp_path: Path) -> None:
    first, second = tmp_path / "first", tmp_path / "second"
    panel, last, session = start(first)
    told: list[Tuning] = []
    panel.tuning_changed.connect(told.append)
    panel.set_tuning(Tuning(arms=0.2))
    session.create_project(second)  # before the sliders have rested
    qtbot.waitUntil(lambda: last.folder == second)
    assert panel.tuning == Tuning()
    assert told == [Tuning(arms=0.2), Tuning()], "what is seen and sent follows"
    session.open_project(first)
    qtbot.waitUntil(lambda: panel.tuning == Tuning(arms=0.2))
    last.close()
    assert not (second / FILE).exists()


@pytest.mark.parametrize("content", ["{", '{"format": "saia-tuning", "tuning": {"head": 99}}'])
def test_a_damaged_file_is_told_of_and_tunes_nothing(
    qtbot: QtBot, start: Start, tmp_path: Path, content: str
) -> None:
    folder = tmp_path / "project"
    Project.create(folder).close()
    (folder / FILE).write_text(content, encoding="utf-8")
    panel, last, _ = start(folder)
    assert panel.tuning == Tuning()
    toast = panel.window().findChild(Toast)
    assert toast is not None
    assert "The last Tune settings could not be read." in toast.text.text()
    panel.set_tuning(Tuning(head=0.4))
    last.close()
    assert _kept(folder) == Tuning(head=0.4)


def test_what_could_not_be_written_is_written_when_the_window_closes(
    qtbot: QtBot, start: Start, tmp_path: Path
) -> None:
    folder = tmp_path / "project"
    panel, last, _ = start(folder)
    (folder / FILE).mkdir()  # in the way, as a full disk is
    panel.set_tuning(Tuning(head=0.4))
    qtbot.waitUntil(lambda: panel.window().findChild(Toast) is not None)
    (folder / FILE).rmdir()
    last.close()
    assert _kept(folder) == Tuning(head=0.4)


def test_what_a_newer_studio_kept_is_left_alone(qtbot: QtBot, tmp_path: Path) -> None:
    folder = tmp_path / "project"
    panel, session = TunePanel(), Session(Settings())
    qtbot.addWidget(panel)
    panel.set_tuning(Tuning(arms=0.2))  # of the project before
    session.project = Project.create(folder)
    newer = json.dumps({"format": "saia-tuning", "version": 99, "tuning": {}})
    (folder / FILE).write_text(newer, encoding="utf-8")
    last = LastTuning(panel, session)
    qtbot.waitUntil(lambda: panel.window().findChild(Toast) is not None)
    assert panel.tuning == Tuning()
    panel.set_tuning(Tuning(head=0.4))
    last.close()
    assert (folder / FILE).read_text(encoding="utf-8") == newer


def test_a_project_only_to_look_at_keeps_nothing(qtbot: QtBot, tmp_path: Path) -> None:
    folder = tmp_path / "project"
    Project.create(folder).close()
    (folder / FILE).write_text(json.dumps(
        {"format": "saia-tuning", "version": 1, "title": "Last", "tuning": {"head": 0.2}}
    ))  # fmt: skip
    panel, session = TunePanel(), Session(Settings())
    qtbot.addWidget(panel)
    session.project = Project.open(folder, read_only=True)
    assert session.project.read_only
    last = LastTuning(panel, session)
    qtbot.waitUntil(lambda: panel.tuning == Tuning(head=0.2))
    panel.set_tuning(Tuning(head=0.4))
    last.close()
    assert _kept(folder) == Tuning(head=0.2)


def test_a_project_that_was_removed_does_not_come_back(start: Start, tmp_path: Path) -> None:
    folder = tmp_path / "project"
    panel, last, _ = start(folder)
    shutil.rmtree(folder)
    panel.set_tuning(Tuning(head=0.4))
    last.close()
    assert not folder.exists()
