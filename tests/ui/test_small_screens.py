"""From a small notebook to a large screen at 200 %: nothing is cut, covered or outside the window."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator

import pytest
from PySide6.QtCore import QPoint, QRect, QSize
from PySide6.QtWidgets import (
    QAbstractButton,
    QAbstractSlider,
    QAbstractSpinBox,
    QComboBox,
    QLineEdit,
    QPushButton,
    QScrollBar,
    QTabBar,
    QWidget,
)
from pytestqt.qtbot import QtBot

from studio.actions import TABS
from studio.errors import StudioError
from studio.project import Project
from studio.ui import app as application
from studio.ui import messages, tasks
from studio.ui.main_window import MainWindow
from studio.ui.window_place import FIRST_SIZE, LEAST_SIZE, first_place
from tests.ui.geometry import faults

SIZES = ((1024, 640), (1280, 800), (1707, 960), (1920, 1080))
"""Pixels as Qt counts them: 1707x960 is 2560x1440 at 150 %, 1920x1080 also 4K at 200 %."""
SETTLING_MS = 4_000
FACTS = {
    "rolling": "Recording", "job": "Cleaning 12 of 26", "train": "quick_001, 2:55 left",
    "motion": "60.0/s", "sound": "-18 dBFS", "sending": "VSeeFace", "disk": "412 GB",
}  # fmt: skip


@pytest.fixture
def window(toy_project: Project, qtbot: QtBot) -> Iterator[MainWindow]:
    toy_project.close()
    _, made = application.build([])
    qtbot.addWidget(made)
    made.show()
    yield made
    made.close()
    tasks.wait()


def settled(qtbot: QtBot, window: MainWindow) -> list[str]:
    """What is wrong once everything has found its place."""
    found = ["not looked at"]
    for _ in range(SETTLING_MS // 100):
        qtbot.wait(100)
        found = faults(window)
        if not found:
            break
    return found


def test_every_tab_fits_every_screen(window: MainWindow, toy_project: Project, qtbot: QtBot) -> None:
    wrong: dict[tuple[str, int], list[str]] = {}

    def look(name: str) -> None:
        for size in SIZES:
            window.resize(*size)
            qtbot.waitUntil(lambda size=size: (window.width(), window.height()) == size)
            if found := settled(qtbot, window):
                wrong[name, size[0]] = found

    look("welcome")
    window.session.open_project(toy_project.folder)
    for tab in TABS:
        window.show_room(tab)
        look(tab)
    assert wrong == {}


@pytest.mark.slow
@pytest.mark.parametrize("scale", ["1.5", "2"])
def test_a_scaled_screen_is_no_other(scale: str) -> None:
    test = f"{__file__}::{test_every_tab_fits_every_screen.__name__}"
    order = [sys.executable, "-m", "pytest", "-q", "-n0", "-p", "no:rerunfailures", test]
    done = subprocess.run(
        order, env=os.environ | {"QT_SCALE_FACTOR": scale}, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout


def test_facts_fold_to_symbols_and_tabs_to_icons_before_they_are_covered(
    window: MainWindow, toy_project: Project, qtbot: QtBot
) -> None:
    window.session.open_project(toy_project.folder)
    window.resize(LEAST_SIZE)
    for key, text in FACTS.items():
        window.status.show_fact(key, text)
    assert settled(qtbot, window) == []
    words = window.status.facts["motion"].words
    assert words.isHidden()
    assert window.status.facts["motion"].toolTip() == "60.0/s"
    window.resize(1920, 1080)
    qtbot.waitUntil(words.isVisible)
    assert window.status.facts["motion"].toolTip() == ""
    # The tabs' pages would keep it wider than that.
    window.stack.hide()
    window.setMinimumSize(0, 0)
    window.resize(700, 640)
    qtbot.waitUntil(lambda: window.tabs.tabText(1) == "")
    assert window.tabs.tabText(0) == "Record", "the tab that is shown keeps its name"
    assert window.tabs.tabToolTip(1) == "Curate"
    assert window.tabs.geometry().right() < window.status.mapTo(window, window.status.rect().topLeft()).x()


@pytest.mark.parametrize("size", SIZES)
def test_a_message_never_lies_over_the_tabs(
    window: MainWindow, toy_project: Project, qtbot: QtBot, size: tuple[int, int]
) -> None:
    window.session.open_project(toy_project.folder)
    window.resize(*size)
    qtbot.waitUntil(lambda: window.width() == size[0])
    long = "The microphone was unplugged while a take was recorded. " * 3
    messages.show_error(window, StudioError(long, "Plug it in again."))
    qtbot.wait(50)
    toast = messages.toast_of(window)
    assert toast is not None
    assert toast.isVisible()
    assert window.rect().contains(toast.geometry())
    for name in ("rooms", "project_menu", "main_menu", "record_button"):
        there = window.findChild(QWidget, name)
        place = QRect(there.mapTo(window, there.rect().topLeft()), there.size())
        assert not place.intersects(toast.geometry()), name


def usable(window: MainWindow) -> list[tuple[str, QRect]]:
    """Every enabled button and field that a person sees, by itself and not by how messages look for them."""
    found = []
    for one in window.findChildren(QWidget):
        fields = QAbstractButton | QComboBox | QLineEdit | QAbstractSpinBox | QAbstractSlider | QTabBar
        if (
            not isinstance(one, fields)
            or isinstance(one, QScrollBar)
            or not one.isVisible()
            or not one.isEnabled()
        ):
            continue
        seen = one.visibleRegion().boundingRect().translated(one.mapTo(window, QPoint()))
        if one.window() is window and not seen.isEmpty() and not within_toast(one):
            found.append((f"{one.objectName() or type(one).__name__} {one.accessibleName()}", seen))
    return found


def within_toast(widget: QWidget) -> bool:
    return isinstance(widget, messages.Toast) or (
        widget.parentWidget() is not None and within_toast(widget.parentWidget())
    )


MESSAGES = {
    "short": ("Saved.", "", None),
    "usual": ("Hello_001 is saved: 12.0 s.", "", ("Play", lambda: None)),
    "long": ("The microphone was unplugged while a take was recorded. " * 3, "Plug it in again.", None),
}


@pytest.mark.parametrize("size", SIZES[:2])
def test_a_message_covers_nothing_that_is_used_next(
    window: MainWindow, toy_project: Project, qtbot: QtBot, size: tuple[int, int]
) -> None:
    covered: dict[tuple[str, str], list[str]] = {}

    def look(tab: str) -> None:
        settled(qtbot, window)
        for kind, (text, remedy, action) in MESSAGES.items():
            messages.show_note(window, text, remedy, action)
            qtbot.wait(50)
            toast = messages.toast_of(window)
            assert toast is not None
            assert toast.isVisible()
            assert window.rect().contains(toast.geometry())
            assert toast.text.heightForWidth(toast.text.width()) <= toast.text.height(), "all of it is read"
            if under := [name for name, there in usable(window) if there.intersects(toast.geometry())]:
                covered[tab, kind] = under
            toast.hide()

    window.resize(*size)
    qtbot.waitUntil(lambda: (window.width(), window.height()) == size)
    look("welcome")
    window.session.open_project(toy_project.folder)
    for tab in TABS:
        window.show_room(tab)
        look(tab)
    assert covered == {}


@pytest.mark.parametrize("size", SIZES)
def test_a_message_leaves_the_facts_beside_the_tabs_readable(
    window: MainWindow, toy_project: Project, qtbot: QtBot, size: tuple[int, int]
) -> None:
    window.session.open_project(toy_project.folder)
    window.resize(*size)
    qtbot.waitUntil(lambda: window.width() == size[0])
    window.session.status_changed.emit("job", "Importing talk.mp4…", "")
    window.session.status_changed.emit("live", "Live", "good")
    settled(qtbot, window)
    for text, remedy, action in MESSAGES.values():
        messages.show_note(window, text, remedy, action)
        toast = messages.toast_of(window)
        assert toast is not None
        for fact in window.status.facts.values():
            there = QRect(fact.mapTo(window, QPoint()), fact.size())
            assert not (fact.isVisible() and there.intersects(toast.geometry())), (fact.key, text)
        assert window.rect().contains(toast.geometry())
        toast.hide()


def test_a_message_gives_way_to_the_next_tab_and_to_what_comes_under_it(
    window: MainWindow, toy_project: Project, qtbot: QtBot
) -> None:
    window.session.open_project(toy_project.folder)
    window.resize(*SIZES[0])
    for tab in TABS:
        window.show_room(tab)
        settled(qtbot, window)
    messages.show_note(window, "Hello_001 is saved: 12.0 s.", stays=True)
    toast = messages.toast_of(window)
    assert toast is not None
    for tab in TABS:
        window.show_room(tab)
        qtbot.waitUntil(lambda: not any(there.intersects(toast.geometry()) for _, there in usable(window)))
        assert toast.isVisible()
    late = QPushButton("Late", window)
    late.setGeometry(toast.geometry())
    late.show()
    qtbot.waitUntil(lambda: not late.geometry().intersects(toast.geometry()))


@pytest.mark.parametrize("screen", [(1024, 600), (1280, 760), (2560, 1400), (3840, 2100)])
def test_the_first_window_stays_on_its_screen(screen: tuple[int, int]) -> None:
    free = QRect(100, 24, *screen)
    place = first_place(free)
    assert free.contains(place)
    if screen[0] > FIRST_SIZE.width() / 0.9:
        assert place.size() == FIRST_SIZE
    else:
        assert place.size() == QSize(*screen) if screen[1] < 640 else place.width() <= 0.9 * screen[0]
