"""The strip of next steps: read from the project, one line, dismissed and brought back."""

from __future__ import annotations

import os
import platform

import pytest
from PySide6.QtWidgets import QPushButton, QToolButton

from studio.project import Project
from studio.project.run import RunReport
from studio.ui.main_window import MainWindow
from studio.ui.next_steps_presenter import RECORD_SECONDS, steps_done, used_seconds
from studio.ui.session import Session


@pytest.fixture
def window(qtbot, toy_project: Project):
    """The window on a project of three short takes."""
    folder = toy_project.folder
    toy_project.close()
    window = MainWindow(Session())
    qtbot.addWidget(window)
    window.show()
    window.start.open_project(folder)
    yield window
    window.close()


def train(project: Project, name: str = "quick_001") -> None:
    (project.runs_folder / name).mkdir(parents=True)
    (project.runs_folder / name / "best.safetensors").touch()


def ticked(window: MainWindow) -> list[str]:
    buttons = window.steps.strip.buttons
    return [step for step, button in buttons.items() if button.accessibleName().endswith(", done")]


def test_a_project_tells_what_is_done(toy_project: Project) -> None:
    assert sum(take.info.duration for take in toy_project.takes) < RECORD_SECONDS
    assert steps_done(toy_project, ()) == ()
    train(toy_project)
    assert steps_done(toy_project, ("check",)) == ("record", "check", "train"), "who has trained had enough"


def test_a_training_under_way_is_not_done(toy_project: Project) -> None:
    train(toy_project)
    report = RunReport(status="running", pid=os.getpid(), host=platform.node())
    report.save(toy_project.runs_folder / "quick_001")
    assert "train" not in steps_done(toy_project, ())
    RunReport(status="done").save(toy_project.runs_folder / "quick_001")
    assert "train" in steps_done(toy_project, ())


def test_check_is_ticked_by_who_plays_a_take_or_looks_what_to_fix(window: MainWindow, qtbot) -> None:
    window.steps.strip.buttons["check"].click()
    assert window.shown_room == "curate"
    bench = window.room("curate")[0].bench
    qtbot.waitUntil(bench.play.isEnabled)
    qtbot.waitUntil(lambda: window.room("curate")[1].model.playing.player is not None)
    assert ticked(window) == [], "a tab that opens checks nothing"
    bench.play.click()
    qtbot.waitUntil(lambda: ticked(window) == ["check"])


def test_the_first_step_says_how_much_there_is(window: MainWindow) -> None:
    record, project = window.steps.strip.buttons["record"], window.session.project
    seconds = int(used_seconds(project))
    assert 1 <= seconds < 60
    assert record.text() == f"Record: 0:{seconds:02d} of 2:00"
    train(project)
    window.session.runs_changed.emit()
    assert record.text() == "Record two minutes", "ticked, it wants no more"


def test_steps_tick_themselves_off(window: MainWindow, qtbot) -> None:
    strip, project = window.steps.strip, window.session.project
    assert strip.isVisible()
    assert ticked(window) == []
    strip.buttons["check"].click()
    assert window.shown_room == "curate"
    window.findChild(QToolButton, "to_fix_button").click()
    assert ticked(window) == ["check"]
    train(project)
    window.session.runs_changed.emit()
    assert ticked(window) == ["record", "check", "train"]
    window.show_room("review")
    window.show_room("live")
    assert ticked(window) == ["record", "check", "train"], "looking in does nothing yet"
    window.session.step_done.emit("watch")
    window.session.step_done.emit("live")
    assert ticked(window) == ["record", "check", "train", "watch", "live"]
    window.close_project()
    assert not strip.isVisible()
    window.start.open_project(project.folder)
    assert ticked(window) == ["record", "check", "train", "watch", "live"], "what no file tells is remembered"


def test_watch_tells_which_run_it_shows_so_that_its_message_can_go(window: MainWindow) -> None:
    train(window.session.project)
    window.session.runs_changed.emit()
    told: list[str] = []
    window.session.review_requested.connect(told.append)
    window.steps.strip.buttons["watch"].click()
    assert (told, window.shown_room) == (["quick_001"], "review")


def test_a_step_puts_the_focus_on_its_button(window: MainWindow, qtbot) -> None:
    window.activateWindow()
    qtbot.waitActive(window)
    window.findChild(QPushButton, "step_train").click()
    assert window.shown_room == "train"
    button = window.room("train")[0].findChild(QPushButton, "start_training")
    qtbot.waitUntil(lambda: window.focusWidget() is button)


def test_the_strip_folds_goes_and_comes_back(window: MainWindow, qtbot) -> None:
    strip = window.steps.strip
    window.resize(1040, 640)
    qtbot.waitUntil(lambda: [s for s, b in strip.buttons.items() if b.isVisible()] == ["record"])
    window.resize(1300, 800)
    qtbot.waitUntil(lambda: all(button.isVisible() for button in strip.buttons.values()))
    window.findChild(QToolButton, "next_steps_close").click()
    assert not strip.isVisible()
    window.menus.next_steps.trigger()
    assert strip.isVisible()
