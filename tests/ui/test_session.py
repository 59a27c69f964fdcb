"""The session: one open project, and everyone hears of changes."""

from pathlib import Path

import pytest
from PySide6.QtWidgets import QWidget

from studio import settings
from studio.errors import StudioError
from studio.project import Project
from studio.take.take import TakeInfo
from studio.ui.messages import Toast
from studio.ui.session import Session


@pytest.fixture
def session(qtbot) -> Session:
    return Session()


def test_opening_a_project_tells_everyone_and_is_remembered(session: Session, qtbot, tmp_path: Path) -> None:
    folder = tmp_path / "My 劇"
    with qtbot.waitSignal(session.project_opened):
        session.create_project(folder, "My 劇")
    assert session.project is not None
    assert session.project.name == "My 劇"
    assert settings.load().recent_projects == (str(folder),)


def test_what_cannot_be_opened_leaves_the_open_project(session: Session, tmp_path: Path) -> None:
    mine = session.create_project(tmp_path / "mine")
    with pytest.raises(StudioError, match=f"There is no project at {tmp_path / 'no'}"):
        session.open_project(tmp_path / "no")
    assert session.project is mine


def test_opening_the_open_project_again_keeps_it(session: Session, tmp_path: Path) -> None:
    mine = session.create_project(tmp_path / "mine")
    assert session.open_project(tmp_path / "mine") is mine
    assert not mine.read_only


def test_leaving_a_project_lets_another_window_change_it(session: Session, tmp_path: Path) -> None:
    session.create_project(tmp_path / "a")
    session.create_project(tmp_path / "b")
    assert not Project.open(tmp_path / "a").read_only


def test_edits_undo_and_redo_are_told(session: Session, qtbot, tmp_path: Path) -> None:
    from studio.dataset import edits

    project = session.create_project(tmp_path / "mine")
    project.add_take("Hello_001", TakeInfo("Hello"), None, None)
    changed = edits.set_stars(project.dataset, ["Hello_001"], 3)
    with qtbot.waitSignal(session.dataset_changed):
        session.edit("Keep Hello_001", changed)
    with qtbot.waitSignal(session.dataset_changed):
        assert session.undo() == "Keep Hello_001"
    assert project.dataset["Hello_001"].stars == 0
    with qtbot.waitSignal(session.dataset_changed):
        assert session.redo() == "Keep Hello_001"
    assert session.redo() == ""


def test_undoing_a_removal_brings_the_take_back(session: Session, qtbot, tmp_path: Path) -> None:
    project = session.create_project(tmp_path / "mine")
    session.adopt(project.add_take("Hello_001", TakeInfo("Hello"), None, None))
    session.remove_take("Hello_001")
    assert project.takes == ()
    with qtbot.waitSignal(session.takes_changed):
        session.undo()
    assert [take.id for take in project.takes] == ["Hello_001"]


def test_settings_are_kept(session: Session, qtbot) -> None:
    with qtbot.waitSignal(session.settings_changed):
        session.change_settings(countdown=5.0)
    assert settings.load().countdown == 5.0


def test_a_setting_that_cannot_be_kept_holds_and_is_said(
    session: Session, qtbot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "no folder").write_text("", encoding="utf-8")
    monkeypatch.setenv("SAIA_SETTINGS", str(tmp_path / "no folder"))
    window = QWidget()
    qtbot.addWidget(window)
    window.show()
    with qtbot.waitSignal(session.settings_changed):
        session.change_settings(slate="Night")
    assert session.settings.slate == "Night"
    toast = window.findChild(Toast)
    assert toast is not None
    assert toast.text.text().startswith("settings.json could not be written")
