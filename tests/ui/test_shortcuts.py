"""The list of keys says what is true: each key it shows does what it says."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest
from PySide6.QtGui import QAction, QKeySequence, QShortcut
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QAbstractButton, QToolButton, QWidget
from pytestqt.qtbot import QtBot

from studio.actions import ACTIONS, TABS
from studio.project import Project
from studio.ui import messages
from studio.ui.curate.view import CurateView
from studio.ui.live.stage_view import Controls
from studio.ui.live.view import LiveView
from studio.ui.main_window import MainWindow
from studio.ui.record.view import RecordView
from studio.ui.review.view import ReviewView
from studio.ui.session import Session
from studio.ui.shortcuts import key_groups, name_of, tip_of
from studio.ui.train.view import TrainView
from studio.ui.widgets.figure.figure import StickFigure

WINDOW = [one.id for one in ACTIONS.values() if one.keys and not one.places]
TABLE = {"select_all", "edit_cell"}
"""What Qt's own table does; see tests/ui/curate."""


def keys(*places: str) -> list[tuple[str, str]]:
    """(action, key) of each key of some places."""
    found = [one for one in ACTIONS.values() if set(places) & set(one.places) and one.id not in TABLE]
    return [(one.id, key) for one in found for key in one.keys]


def press(qtbot: QtBot, widget: QWidget, key: str) -> None:
    combination = QKeySequence(key)[0]
    QTest.keyClick(widget, combination.key(), combination.keyboardModifiers())


def shown(qtbot: QtBot, widget: QWidget) -> None:
    qtbot.addWidget(widget)
    widget.resize(1280, 754)
    widget.show()
    widget.activateWindow()
    qtbot.waitUntil(widget.isActiveWindow)  # keys of a window that is not active are heard by nobody
    widget.setFocus()


def counting(count: list[object]) -> Callable[..., None]:
    return lambda *_: count.append(None)


@pytest.fixture
def window(qtbot: QtBot, session: Session) -> Iterator[MainWindow]:
    found = MainWindow(session)
    qtbot.addWidget(found)
    found.show()
    yield found
    found.close()


@pytest.mark.parametrize("action", WINDOW)
def test_a_key_of_the_window_is_one_and_has_something_to_do(window: MainWindow, action: str) -> None:
    """By what has the key: pressed, half of them would ask for a file or close the window."""
    for key in ACTIONS[action].keys:
        wanted = QKeySequence(key)
        owners = [one.objectName() for one in window.findChildren(QAction) if wanted in one.shortcuts()]
        owners += [one.objectName() for one in window.findChildren(QToolButton) if one.shortcut() == wanted]
        owners += ["shortcut" for one in window.findChildren(QShortcut) if one.key() == wanted]
        assert len(owners) == 1, (key, owners)


@pytest.mark.parametrize(("action", "key"), keys("record"))
def test_a_key_of_record_asks_for_what_it_says(qtbot: QtBot, action: str, key: str) -> None:
    view = RecordView()
    shown(qtbot, view)
    signal = {
        "record_here": view.record_requested,
        "cancel_countdown": view.cancel_requested,
        "prompt_next": view.prompter.next_requested,
        "prompt_again": view.prompter.again_requested,
    }[action]
    asked: list[object] = []
    signal.connect(counting(asked))
    press(qtbot, view.figure, key)
    assert asked
    view.figure.dispose()


@pytest.mark.parametrize(("action", "key"), keys("curate"))
def test_a_key_of_curate_asks_for_what_it_says(qtbot: QtBot, action: str, key: str) -> None:
    view = CurateView()
    shown(qtbot, view)
    view.show_empty(False)
    bench = view.bench
    bench.exclude.setEnabled(True)
    bench.picture.setEnabled(True)
    bench.loop.setEnabled(True)
    view.library.fix_button.setChecked(action == "go_back")
    bench.timeline.set_duration(10.0)
    bench.timeline.show_span(4.0, 5.0)  # where there is room to go closer and wider
    asked: list[object] = []
    signals = {
        "play": bench.play_requested, "step_back": view.step_requested, "step_forward": view.step_requested,
        "first_frame": view.edge_requested, "last_frame": view.edge_requested, "loop": bench.loop.clicked,
        "in_point": view.mark_requested, "out_point": view.mark_requested, "exclude": bench.exclude.clicked,
        "remove_marked": view.delete_requested, "sound_picture": bench.picture.clicked,
        "go_back": view.library.fix_button.toggled,
        "compare_cleaning": bench.clean.compared, "zoom_in": bench.timeline.view_changed,
        "zoom_out": bench.timeline.view_changed, "zoom_fit": bench.timeline.view_changed,
        **{f"label_{n}": view.word_pressed for n in range(1, 10)},
    }  # fmt: skip
    signals[action].connect(counting(asked))
    press(qtbot, view, key)
    assert asked
    view.stage.figure.dispose()


@pytest.mark.parametrize(("action", "key"), keys("review"))
def test_a_key_of_review_asks_for_what_it_says(qtbot: QtBot, action: str, key: str) -> None:
    view = ReviewView()
    shown(qtbot, view)
    view.show_empty(False)
    view.bar.show_ghost_choice(True, True)
    view.bar.show_two(True)
    view.bar.vote.show()
    view.bar.vote.sides[0].setEnabled(True)
    if action == "go_back":
        view.bar.begin_vote((1, 0))
    asked: list[object] = []
    signals = {
        "play": view.play_toggled, "step_back": view.step_requested, "step_forward": view.step_requested,
        "first_frame": view.seek_requested, "last_frame": view.seek_requested, "loop": view.loop_toggled,
        "ghost": view.bar.ghost_toggled, "other_run": view.bar.vote.front_requested,
        "go_back": view.bar.vote.cancelled,
    }  # fmt: skip
    signals[action].connect(counting(asked))
    view.setFocus()
    press(qtbot, view, key)
    assert asked
    view.stage.dispose()


def test_esc_in_train_closes_what_is_open_one_at_each_press(qtbot: QtBot) -> None:
    view = TrainView()
    shown(qtbot, view)
    view.show_empty(False)
    opened = [view.runs.details, view.progress.details, view.recipe.advanced]
    for button in opened:
        button.setChecked(True)
    for left in (2, 1, 0, 0):
        press(qtbot, view, "Esc")
        assert sum(button.isChecked() for button in opened) == left
    # From a button as well, which the keyboard was on.
    view.recipe.advanced.click()
    press(qtbot, view.recipe.advanced, "Esc")
    assert not view.recipe.drawer.isVisible()


def test_esc_in_live_leaves_what_is_held_and_lets_nobody_be_heard(qtbot: QtBot) -> None:
    view = LiveView()
    shown(qtbot, view)
    controls = view.controls
    controls.show_live(True)
    controls.moods.show_moods(("happy",))
    for name in ("mute", "freeze", "neutral"):
        controls.button(name).click()
    controls.moods.chips["mood_1"].click()
    said: list[object] = []
    controls.switched.connect(lambda *what: said.append(what))
    controls.mood_chosen.connect(said.append)
    for _ in range(5):
        press(qtbot, view, "Esc")
    assert said == ["", ("freeze", False), ("neutral", False)]
    assert controls.button("mute").isChecked()


@pytest.mark.parametrize(("action", "key"), [one for one in keys("live") if one[0] != "let_go"])
def test_a_key_of_live_asks_for_what_it_says(qtbot: QtBot, action: str, key: str) -> None:
    controls = Controls()
    shown(qtbot, controls)
    controls.show_live(True)
    asked: list[object] = []
    controls.switched.connect(lambda *said: asked.append(said))
    controls.mood_chosen.connect(lambda name: asked.append((f"mood_{name or 0}", True)))
    controls.moods.show_moods("123456789")
    press(qtbot, controls.button(action) if not action.startswith("mood_") else controls, key)
    assert asked == [(action, True)]


@pytest.mark.parametrize(("action", "key"), keys("figure"))
def test_a_key_of_the_figure_moves_its_camera(qtbot: QtBot, action: str, key: str) -> None:
    figure = StickFigure(None, "")
    shown(qtbot, figure)
    before = figure.orbit
    press(qtbot, figure, key)
    assert figure.orbit != before
    figure.dispose()


def test_the_list_shows_each_key_once_with_what_it_does() -> None:
    titles = [title for title, _ in key_groups()]
    tabs = ["Record", "Curate and Review", "Curate", "Train", "Review", "Live"]
    assert titles == ["Everywhere", *tabs, "Figure"]
    everywhere = dict(key_groups()[0][1])
    assert everywhere["Ctrl+1 … 5"] == "Record, Curate, Train, Review, Live"
    assert everywhere["Ctrl+Z, Ctrl+Shift+Z"] == "Undo, redo (or Ctrl+Y) in this tab"
    assert dict(key_groups()[7][1])["Drag, ← → ↑ ↓"] == "Turn around the figure"
    assert dict(key_groups()[3][1])["Shift"] == "with ← → Home End: select a span"


def test_every_shortcut_of_the_window_comes_from_the_table(window: MainWindow, toy_project: Project) -> None:
    toy_project.close()
    window.session.open_project(toy_project.folder)
    for tab in TABS:
        window.show_room(tab)
    messages.show_note(window, "Here.")
    declared = {QKeySequence(key) for one in ACTIONS.values() for key in one.keys}
    found = [(one, key) for one in window.findChildren(QAction) for key in one.shortcuts()]
    found += [(one, one.key()) for one in window.findChildren(QShortcut)]
    found += [(one, one.shortcut()) for one in window.findChildren(QAbstractButton)]
    assert len(found) > 20
    strange = [(one.objectName(), key.toString()) for one, key in found if key not in declared]
    assert not [one for one in strange if one[1]]


def test_a_button_says_what_the_table_says(qtbot: QtBot) -> None:
    assert tip_of("mute") == "Mute your microphone (M)"
    assert tip_of("play") == "Play and pause (Space)"
    assert tip_of("split_takes") == ACTIONS["split_takes"].help
    assert tip_of("delete_run") == ""
    controls = Controls()
    qtbot.addWidget(controls)
    for name in ("mute", "freeze", "neutral"):
        assert controls.button(name).text() == f"{name_of(name)} ({ACTIONS[name].keys[0]})"
        assert controls.button(name).toolTip() == tip_of(name)
