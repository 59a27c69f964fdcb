"""Drops: the same files mean different things in different rooms; and imports, seen and taken back."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFileDialog, QToolButton
from pytestqt.qtbot import QtBot

from studio.project import Project
from studio.ui import app as application
from studio.ui import tasks
from studio.ui.curate.library_view import Library
from studio.ui.imports import Drop, sort_drop
from studio.ui.main_window import MainWindow
from studio.ui.messages import Toast
from tests.formats.examples import a_sound


def test_a_project_folder_is_opened(tmp_path: Path) -> None:
    (tmp_path / "project.json").write_text("{}")
    assert sort_drop((tmp_path,), "record") == Drop(project=tmp_path)
    assert sort_drop((tmp_path / "project.json",), "") == Drop(project=tmp_path)


def test_one_sound_dropped_in_review_is_generated_from(tmp_path: Path) -> None:
    sound = tmp_path / "声 1.WAV"
    assert sort_drop((sound,), "review") == Drop(sounds=(sound,))
    assert sort_drop((sound,), "curate") == Drop(imports=(sound,))


def test_several_sounds_dropped_in_review_are_generated_from(tmp_path: Path) -> None:
    both = (tmp_path / "a.wav", tmp_path / "b.MP4")
    assert sort_drop(both, "review") == Drop(sounds=both)
    assert sort_drop(both, "curate") == sort_drop(both, "record") == Drop(imports=both)


def test_sounds_dropped_in_live_are_performed(tmp_path: Path) -> None:
    both = (tmp_path / "a.wav", tmp_path / "b.MP4")
    assert sort_drop(both, "live") == Drop(performed=both)
    assert sort_drop((tmp_path / "a.csv",), "live") == Drop(imports=(tmp_path / "a.csv",))
    assert sort_drop((tmp_path / "me.vrm",), "live") == Drop(avatar=tmp_path / "me.vrm")


def test_a_folder_of_sounds_dropped_in_review_is_a_batch(tmp_path: Path) -> None:
    folder = tmp_path / "台詞.d"
    folder.mkdir()
    assert sort_drop((folder,), "review") == Drop(imports=(folder,)), "there is nothing in it"
    for name in ("a.wav", "b.MP3", ".DS_Store"):
        (folder / name).touch()
    assert sort_drop((folder,), "review") == Drop(batch=folder)
    assert sort_drop((folder,), "curate") == Drop(imports=(folder,))
    (folder / "a.bvh").touch()
    assert sort_drop((folder,), "review") == Drop(imports=(folder,)), "with its motion it is a take"


def test_sounds_with_motion_are_imported_everywhere(tmp_path: Path) -> None:
    both = (tmp_path / "a.wav", tmp_path / "a.csv")
    assert sort_drop(both, "review") == Drop(imports=both)


def test_a_packed_project_is_opened_in_every_room(tmp_path: Path) -> None:
    packed = tmp_path / "P.ZIP"
    assert sort_drop((packed,), "review") == sort_drop((packed,), "") == Drop(packed=packed)


def test_a_run_is_brought_in_in_every_room(tmp_path: Path) -> None:
    run = tmp_path / "best_001.SAIARUN"
    assert sort_drop((run,), "review") == sort_drop((run,), "curate") == Drop(run=run)


@pytest.fixture
def window(qtbot: QtBot, toy_project: Project) -> Iterator[MainWindow]:
    toy_project.close()
    _, made = application.build([str(toy_project.folder)])
    qtbot.addWidget(made)
    made.show()
    made.activateWindow()
    qtbot.waitUntil(made.isActiveWindow)
    yield made
    made.close()
    tasks.wait()


def _told(window: MainWindow) -> tuple[str, str, str]:
    """What the message says, what to do about it, and its button; "" for none."""
    toast = window.findChild(Toast)
    assert toast is not None
    action = toast.action.text() if toast.action.isVisibleTo(toast) else ""
    return toast.text.text(), toast.remedy.text() if toast.remedy.isVisibleTo(toast) else "", action


def _library(window: MainWindow) -> Library:
    view = window.room("curate")[0].findChild(Library)
    assert view is not None
    return view


@pytest.mark.slow
def test_imported_takes_are_seen_selected_and_one_step_of_undo(
    window: MainWindow, tmp_path: Path, qtbot: QtBot
) -> None:
    names = ["朝", "昼", "夜"]
    paths = [a_sound(tmp_path / f"{name}.wav") for name in names]
    (tmp_path / "broken.wav").write_bytes(b"no sound")
    project = window.session.project
    assert project is not None
    before = project.dataset
    window.take_paths((*paths, tmp_path / "broken.wav"))
    assert window.shown_room == "curate", "how far it has come is seen there"
    library = _library(window)
    # Neither a search nor the list of what to fix hides what comes in.
    library.search.setText("toy")
    library.fix_button.setChecked(True)
    qtbot.waitUntil(lambda: _told(window)[2] == "Undo")
    assert _told(window)[0] == "3 takes imported. 1 file could not be read."
    assert sorted(library.chosen) == sorted(names)
    assert library.table.isVisible()
    seen = library.table.viewport().rect()
    places = [library.filter.mapFromSource(library.model.index_of(one)) for one in library.chosen]
    assert all(seen.intersects(library.table.visualRect(place)) for place in places)
    assert {project.dataset[name].split for name in names} == {""}
    qtbot.waitUntil(lambda: not window.importer.running)
    toast = window.findChild(Toast)
    assert toast is not None
    qtbot.mouseClick(toast.action, Qt.MouseButton.LeftButton)
    assert project.dataset == before
    assert sorted(one.name for one in (project.folder / ".trash").iterdir()) == sorted(names)
    assert _told(window) == ("Undone: Import 3 takes", "", "Redo")
    qtbot.keyClick(library.table, Qt.Key.Key_Y, Qt.KeyboardModifier.ControlModifier)
    assert {take.id for take in project.takes} >= set(names)
    assert _told(window) == ("Redone: Import 3 takes", "", "Undo")
    window.show_room("train")
    window.take_paths((a_sound(tmp_path / "独り.wav"),))
    qtbot.waitUntil(lambda: _told(window)[0] == "1 take imported.")
    assert _told(window)[1:] == ("It is not used: training needs both sound and motion.", "Undo")
    assert (window.shown_room, library.chosen) == ("curate", ("独り",))
    assert project.undo_name == "Import 独り"


def test_one_button_asks_for_files_and_for_folders(
    window: MainWindow, tmp_path: Path, qtbot: QtBot, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []
    monkeypatch.setattr(QFileDialog, "getOpenFileNames", lambda *_: asked.append("files") or ([], ""))
    monkeypatch.setattr(QFileDialog, "getExistingDirectory", lambda *_: asked.append("folder") or "")
    window.show_room("curate")
    button = window.findChild(QToolButton, "import_button")
    assert button is not None
    qtbot.mouseClick(button, Qt.MouseButton.LeftButton, pos=button.rect().center() / 2)
    assert asked == ["files"]
    entries = {entry.text(): entry for entry in button.menu().actions()}
    assert list(entries) == ["Import files…", "Import a folder…"]
    entries["Import a folder…"].trigger()
    assert asked == ["files", "folder"]
