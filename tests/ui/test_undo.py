"""Undo belongs to the tab where it is pressed, and whatever it does is said, with the way back beside it."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import soundfile
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QApplication, QLineEdit, QPushButton, QWidget
from pytestqt.qtbot import QtBot

from studio.dataset import edits
from studio.playback.layers import Tuning, presets
from studio.project import Project
from studio.project.run import new_run_folder
from studio.ui import app as application
from studio.ui import messages, tasks
from studio.ui.main_window import MainWindow
from studio.ui.messages import Toast
from studio.ui.review.tune_view import TunePanel

Key, CTRL = Qt.Key, Qt.KeyboardModifier.ControlModifier
NONE = Qt.KeyboardModifier.NoModifier
STARS = "Stars of toy_002"
OTHER_TABS = ("record", "train", "review", "live")
UNDO_KEYS = ((Key.Key_Z, CTRL), (Key.Key_Z, CTRL | Qt.KeyboardModifier.ShiftModifier), (Key.Key_Y, CTRL))
EDIT_KEYS = (
    *((key, NONE) for key in (Key.Key_Delete, Key.Key_Backspace, Key.Key_X, Key.Key_I, Key.Key_O, Key.Key_1)),
    *((key, CTRL) for key in (Key.Key_D, Key.Key_X, Key.Key_V, Key.Key_A)),
)
"""Keys that change takes where Curate is shown, or do so in other programs."""

Open = Callable[[Path], MainWindow]


@pytest.fixture
def sound(tmp_path: Path) -> Path:
    """One that Review can be given."""
    path = tmp_path / "声.wav"
    soundfile.write(path, np.random.default_rng(1).normal(0, 0.1, 16_000).astype(np.float32), 16_000)
    return path


@pytest.fixture
def open_window(qtbot: QtBot) -> Iterator[Open]:
    """Opens a project in a window, in place of the one before: a restart."""
    windows: list[MainWindow] = []

    def close() -> None:
        for window in windows:
            window.close()
        windows.clear()
        tasks.wait()

    def make(folder: Path) -> MainWindow:
        close()
        _, window = application.build([str(folder)])
        qtbot.addWidget(window)
        windows.append(window)
        window.show()
        window.activateWindow()
        qtbot.waitUntil(window.isActiveWindow)
        return window

    yield make
    close()


@pytest.fixture
def edited(toy_project: Project) -> Path:
    """A project whose last step was made before this start of the program."""
    toy_project.edit(STARS, edits.set_stars(toy_project.dataset, ["toy_002"], 4))
    toy_project.close()
    return toy_project.folder


def choices(folder: Path) -> list[dict[str, Any]]:
    """What dataset.json says of the takes."""
    content = json.loads((folder / "dataset.json").read_text(encoding="utf-8"))
    return list(content["selections"])


def stars(folder: Path) -> int:
    return next(one.get("stars", 0) for one in choices(folder) if one["id"] == "toy_002")


def focusable(view: QWidget) -> list[QWidget]:
    """Every widget of a tab that takes the keys now."""
    found = (one for one in view.findChildren(QWidget) if one.isVisible() and one.isEnabled())
    return [one for one in found if one.focusPolicy() & Qt.FocusPolicy.TabFocus and not one.focusProxy()]


def offered(window: MainWindow) -> list[tuple[str, bool]]:
    """Undo and Redo in the Edit menu: their words, and whether they can be chosen."""
    return [(action.text(), action.isEnabled()) for action in (window.menus.undo, window.menus.redo)]


def toast_of(window: MainWindow) -> Toast:
    found = window.findChild(Toast)
    assert found is not None
    return found


def told(window: MainWindow) -> tuple[str, str]:
    """What the message says, and its button; "" for none."""
    toast = toast_of(window)
    return toast.text.text(), toast.action.text() if toast.action.isVisible() else ""


def press(qtbot: QtBot, window: MainWindow, key: Qt.Key = Key.Key_Z, held: Any = CTRL) -> None:
    qtbot.keyClick(QApplication.focusWidget() or window, key, held)


def show(qtbot: QtBot, window: MainWindow, tab: str) -> QWidget:
    """A tab, with everything in it there."""
    window.show_room(tab)
    view, presenter = window.room(tab)
    if tab == "review":
        qtbot.waitUntil(lambda: presenter.model.tuned is not None)  # type: ignore[attr-defined]
    return view


def test_no_key_in_another_tab_changes_what_curate_holds(
    open_window: Open, edited: Path, qtbot: QtBot
) -> None:
    before = choices(edited)
    window = open_window(edited)
    show(qtbot, window, "curate")
    changed: list[str] = []
    for tab in OTHER_TABS:
        view = show(qtbot, window, tab)
        assert offered(window) == [("Undo", False), ("Redo", False)]
        widgets = focusable(view)
        assert len(widgets) >= (1 if tab == "live" else 5)
        for widget in widgets:
            where = window.session.dataset_changed.connect(lambda w=widget: changed.append(w.objectName()))
            for key, held in (*UNDO_KEYS, *EDIT_KEYS):
                widget.setFocus()
                press(qtbot, window, key, held)
            window.session.dataset_changed.disconnect(where)
    assert changed == [], "undone and done again is a change too"
    assert choices(edited) == before
    assert window.session.project is not None
    assert window.session.project.undo_name == STARS


def test_keys_of_record_and_live_rest_while_another_tab_is_shown(
    open_window: Open, edited: Path, qtbot: QtBot
) -> None:
    run = new_run_folder(edited / "runs", "quick")
    (run / "best.safetensors").write_bytes(b"weights")  # Live shows its controls where there is one
    (run / "report.json").write_text(json.dumps({"status": "done"}), encoding="utf-8")
    window = open_window(edited)
    heard: list[object] = []
    record, live = show(qtbot, window, "record"), show(qtbot, window, "live")
    record.record_requested.connect(lambda: heard.append("record"))  # type: ignore[attr-defined]
    live.controls.show_live(True)  # type: ignore[attr-defined]
    live.controls.switched.connect(lambda *what: heard.append(what))  # type: ignore[attr-defined]
    keys = (Key.Key_Space, Key.Key_Escape, Key.Key_M, Key.Key_F, Key.Key_N)
    for tab in ("curate", "train", "review"):
        view = show(qtbot, window, tab)
        for key in keys:
            view.setFocus()
            press(qtbot, window, key, NONE)
    assert heard == []
    window.show_room("live")
    live.setFocus()
    press(qtbot, window, Key.Key_M, NONE)
    assert heard == [("mute", True)]


def test_undo_of_an_earlier_start_is_said_shown_and_made_again_in_curate(
    open_window: Open, edited: Path, qtbot: QtBot
) -> None:
    window = open_window(edited)
    window.show_room("curate")
    library = window.room("curate")[0].library  # type: ignore[attr-defined]
    library.search.setText("toy_001")
    qtbot.waitUntil(lambda: library.filter.rowCount() == 1)
    library.table.setFocus()
    assert offered(window) == [(f"Undo: {STARS}", True), ("Redo", False)]
    press(qtbot, window)
    assert stars(edited) == 0
    assert told(window) == (f"Undone: {STARS}", "Redo")
    assert library.chosen == ("toy_002",), "a row that the search had hidden"
    assert library.delegate.flashed == {"toy_002"}
    assert offered(window) == [("Undo: Keep one for validation", True), (f"Redo: {STARS}", True)]
    toast_of(window).action.click()
    assert stars(edited) == 4
    assert told(window) == (f"Redone: {STARS}", "Undo")
    toast_of(window).action.click()
    assert stars(edited) == 0
    assert told(window) == (f"Undone: {STARS}", "Redo")
    press(qtbot, window, Key.Key_Y)
    assert stars(edited) == 4
    window.findChild(QWidget, "undo_button").click()
    assert told(window) == (f"Undone: {STARS}", "Redo"), "a button is no other way than a key"


def test_a_text_field_keeps_its_own_undo(open_window: Open, edited: Path, qtbot: QtBot) -> None:
    window = open_window(edited)
    window.show_room("curate")
    for name in ("library_search", "inspector_tags", "inspector_note"):
        field = window.findChild(QWidget, name)
        field.setFocus()
        qtbot.keyClicks(field, "abc")
        for _ in range(9):
            press(qtbot, window)
        text = field.text() if isinstance(field, QLineEdit) else field.toPlainText()
        assert text == ""
        assert stars(edited) == 4, name


def test_undo_in_review_is_the_tunings_whatever_has_the_keys(
    open_window: Open, edited: Path, qtbot: QtBot
) -> None:
    before = choices(edited)
    window = open_window(edited)
    view = show(qtbot, window, "review")
    tune = view.tune  # type: ignore[attr-defined]
    assert isinstance(tune, TunePanel)
    row = tune.rows["expressiveness"]
    for name in ("sources", "tune_expressiveness_slider", "tune_expressiveness", "play_button", "timeline"):
        row.box.setValue(1.5)
        assert offered(window) == [("Undo: Expression", True), ("Redo", False)]
        view.tabs.setCurrentWidget(view.tune)  # type: ignore[attr-defined]
        widget = view.findChild(QWidget, name)
        widget.setFocus()
        assert widget.hasFocus()
        press(qtbot, window)
        assert tune.tuning == Tuning(), name
        assert told(window) == ("Undone: Expression", "Redo")
        assert offered(window) == [("Undo", False), ("Redo: Expression", True)]
    view.tabs.setCurrentWidget(view.export)  # type: ignore[attr-defined]
    toast_of(window).action.click()
    assert tune.tuning == Tuning(expressiveness=1.5)
    assert view.tabs.currentWidget() is tune, "what changed is seen"  # type: ignore[attr-defined]
    assert told(window) == ("Redone: Expression", "Undo")
    tune.reset.click()
    assert told(window) == ("Redone: Expression", ""), "its Undo would take the reset back"
    assert offered(window)[0] == ("Undo: Reset all", True)
    assert choices(edited) == before
    window.show_room("curate")
    assert offered(window)[0] == (f"Undo: {STARS}", True)


def test_undo_in_record_takes_back_what_was_done_in_record_alone(
    open_window: Open, edited: Path, qtbot: QtBot
) -> None:
    window = open_window(edited)
    window.show_room("record")
    record = window.room("record")[0].takes  # type: ignore[attr-defined]
    record.note_written.emit("toy_001", "smile more")
    assert offered(window) == [("Undo: Note on toy_001", True), ("Redo", False)]
    press(qtbot, window)
    assert told(window) == ("Undone: Note on toy_001", "Redo")
    assert offered(window) == [("Undo", False), ("Redo: Note on toy_001", True)], "before it, all is Curate's"
    press(qtbot, window, Key.Key_Y)
    assert next(one["note"] for one in choices(edited) if one["id"] == "toy_001") == "smile more"
    project = window.session.project
    assert project is not None
    window.session.edit("Trim toy_001", edits.trim(project.dataset, "toy_001", 1.0, None))
    assert offered(window) == [("Undo", False), ("Redo", False)], "something else was done since, in Curate"
    window = open_window(edited)
    window.show_room("record")
    assert offered(window) == [("Undo", False), ("Redo", False)]


def test_undo_in_train_brings_runs_back_and_takes_set_aside(
    open_window: Open, edited: Path, qtbot: QtBot
) -> None:
    window = open_window(edited)
    project = window.session.project
    assert project is not None
    window.session.edit("Split", edits.set_split(project.dataset, ["toy_003"], "train"))
    folder = project.new_run_folder("quick")
    show(qtbot, window, "train")
    presenter = window.room("train")[1]
    presenter.model.set_aside()  # type: ignore[attr-defined]
    (chosen,) = (one["id"] for one in choices(edited) if one["split"] == "val")
    assert told(window) == (f"{chosen} is kept for validation.", "Undo")
    presenter.model.trash.remove(folder, "Removed quick_001.")  # type: ignore[attr-defined]
    aside = f"Set {chosen} aside for validation"
    for key, undone, runs, kept, left in (
        (Key.Key_Z, "Undone: Remove quick_001", 1, 1, aside),
        (Key.Key_Z, f"Undone: {aside}", 1, 0, ""),
        (Key.Key_Y, f"Redone: {aside}", 1, 1, aside),
        (Key.Key_Y, "Redone: Remove quick_001", 0, 1, "Remove quick_001"),
    ):
        press(qtbot, window, key)
        assert told(window)[0] == undone
        assert len(project.runs) == runs
        assert sum(one["split"] == "val" for one in choices(edited)) == kept
        assert offered(window)[0] == ((f"Undo: {left}", True) if left else ("Undo", False))
    toast_of(window).action.click()
    assert [run.id for run in project.runs] == ["quick_001"]
    assert told(window) == ("Undone: Remove quick_001", "Redo")


def test_a_message_offers_undo_only_while_its_change_is_the_last(
    open_window: Open, edited: Path, qtbot: QtBot
) -> None:
    window = open_window(edited)
    view = show(qtbot, window, "curate")
    view.findChild(QPushButton, "split_for_me_button").click()
    assert told(window)[1] == "Undo"
    divided = choices(edited)
    view.findChild(QPushButton, "split_for_me_button").click()
    assert choices(edited) == divided
    assert told(window)[1] == "", "nothing was changed, so Undo would take back something else"
    view.menu_chosen.emit("remove", None)  # type: ignore[attr-defined]
    assert told(window) == ("1 take removed.", "Undo")
    window.session.edit(STARS, edits.set_stars(window.session.project.dataset, ["toy_003"], 1))
    assert told(window) == ("1 take removed.", ""), "its Undo would take the stars away"
    press(qtbot, window)
    assert told(window) == (f"Undone: {STARS}", "Redo")


def test_the_undo_of_a_message_goes_where_the_change_is_seen(
    open_window: Open, edited: Path, qtbot: QtBot
) -> None:
    before = choices(edited)
    window = open_window(edited)
    view = show(qtbot, window, "curate")
    view.menu_chosen.emit("remove", None)  # type: ignore[attr-defined]
    show(qtbot, window, "review")
    toast_of(window).action.click()
    assert choices(edited) == before
    assert window.shown_room == "curate"
    assert view.library.chosen == ("toy_001",)  # type: ignore[attr-defined]
    assert told(window) == ("Undone: Remove toy_001", "Redo")


def test_a_nudge_that_is_not_written_yet_is_what_undo_takes_back(
    open_window: Open, edited: Path, qtbot: QtBot
) -> None:
    before = choices(edited)
    window = open_window(edited)
    view = show(qtbot, window, "curate")
    playing = window.room("curate")[1].model.playing  # type: ignore[attr-defined]
    qtbot.waitUntil(lambda: playing.take is not None)
    view.library.table.setFocus()  # type: ignore[attr-defined]
    view.bench.offset.setValue(40)  # type: ignore[attr-defined]
    press(qtbot, window)
    assert told(window) == ("Undone: Move the motion of toy_001", "Redo")
    assert choices(edited) == before


def test_undo_that_cannot_be_written_is_said(open_window: Open, edited: Path, qtbot: QtBot) -> None:
    window = open_window(edited)
    show(qtbot, window, "curate")
    (edited / "dataset.json").unlink()
    (edited / "dataset.json").mkdir()
    try:
        press(qtbot, window)
        said, button = told(window)
        assert said.startswith("dataset.json could not be written: ")  # the reason is the system's own words
        assert button == ""
        assert offered(window)[1] == (f"Redo: {STARS}", True)
    finally:
        (edited / "dataset.json").rmdir()


def back_and_forth(qtbot: QtBot, window: MainWindow, name: str, before: Any, after: Any, now: Any) -> None:
    """Press a message's button over and over: what it says and what there is go back and forth."""
    for said, button, there in (
        (f"Undone: {name}", "Redo", before),
        (f"Redone: {name}", "Undo", after),
        (f"Undone: {name}", "Redo", before),
    ):
        assert now() != there
        toast_of(window).action.click()
        assert told(window) == (said, button)
        assert now() == there


def test_messages_of_files_that_were_changed_lead_back_and_forth(
    open_window: Open, edited: Path, qtbot: QtBot, sound: Path
) -> None:
    window = open_window(edited)
    view = show(qtbot, window, "review")
    tune, presenter = view.tune, window.room("review")[1]  # type: ignore[attr-defined]

    def kept() -> list[tuple[str, Tuning]]:
        return [(one.title, one.tuning) for one in presets.saved(edited / presets.FOLDER)[0]]

    for value in (1.2, 1.5):
        tune.rows["expressiveness"].box.setValue(value)
        messages.show_note(window, "Something else.")
        tune.presets.save_requested.emit("Evening")
        qtbot.waitUntil(lambda value=value: kept() == [("Evening", Tuning(expressiveness=value))])
        qtbot.waitUntil(lambda: told(window) == ("Saved as the preset Evening.", "Undo"))
    first, second = ([("Evening", Tuning(expressiveness=value))] for value in (1.2, 1.5))
    assert offered(window)[0] == ("Undo: Save the preset Evening", True)
    back_and_forth(qtbot, window, "Save the preset Evening", first, second, kept)
    (preset,) = presets.saved(edited / presets.FOLDER)[0]
    tune.presets.delete_requested.emit(preset)
    qtbot.waitUntil(lambda: told(window) == ("Preset Evening deleted.", "Undo"))
    back_and_forth(qtbot, window, "Delete the preset Evening", first, [], kept)

    presenter.sources.add([sound])  # type: ignore[attr-defined]
    qtbot.waitUntil(lambda: view.sources.count() == 4)  # type: ignore[attr-defined]
    view.sources.setCurrentRow(0)  # type: ignore[attr-defined]
    view.sources.setFocus()  # type: ignore[attr-defined]
    press(qtbot, window, Key.Key_Delete, NONE)
    assert told(window) == (f"{sound.name} is in the project's trash.", "Undo")

    def listed() -> tuple[int, list[str]]:
        return view.sources.count(), [path.name for path in (edited / "sounds").glob("[!.]*")]  # type: ignore[attr-defined]

    back_and_forth(qtbot, window, f"Remove {sound.name}", (4, [sound.name]), (3, []), listed)


def test_a_run_that_is_trained_on_is_not_undone_away(open_window: Open, edited: Path, qtbot: QtBot) -> None:
    window = open_window(edited)
    show(qtbot, window, "train")
    project, presenter = window.session.project, window.room("train")[1]
    assert project is not None
    folder = project.new_run_folder("quick")

    def runs() -> list[str]:
        return [run.id for run in project.runs]

    presenter.model.add_run(folder, "mine.saiarun is quick_001 now.")  # type: ignore[attr-defined]
    assert told(window) == ("mine.saiarun is quick_001 now.", "Undo")
    back_and_forth(qtbot, window, "Import quick_001", [], ["quick_001"], runs)
    toast_of(window).action.click()
    training = presenter.model.training  # type: ignore[attr-defined]
    training.running, training.folder = True, folder
    press(qtbot, window)
    assert told(window) == ("quick_001 is being trained.", "")
    assert runs() == ["quick_001"]
    training.running = False
