"""Ctrl+K finds actions, settings, takes and runs by typing, and does what is chosen."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QAction
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QLineEdit, QWidget
from pytestqt.qtbot import QtBot

from studio.ui.command_palette import CommandPalette
from studio.ui.curate.view import CurateView
from studio.ui.main_window import MainWindow
from studio.ui.review.view import ReviewView
from studio.ui.session import Session


@pytest.fixture
def window(qtbot: QtBot, session: Session) -> Iterator[MainWindow]:
    found = MainWindow(session)
    qtbot.addWidget(found)
    found.show()
    yield found
    found.close()


def find(qtbot: QtBot, window: MainWindow, typed: str) -> CommandPalette:
    opening = window.findChild(QAction, "action_open_palette")
    assert opening is not None
    opening.trigger()
    palette = window.findChildren(CommandPalette)[-1]
    QTest.keyClicks(palette.search, typed)
    return palette


def lines(palette: CommandPalette) -> list[str]:
    items = [palette.list.topLevelItem(row) for row in range(palette.list.topLevelItemCount())]
    return [f"{item.text(0)} | {item.text(1)}" for item in items if item is not None]


def choose(qtbot: QtBot, palette: CommandPalette) -> None:
    QTest.keyClick(palette.search, Qt.Key.Key_Return)
    qtbot.waitUntil(lambda: not palette.isVisible())


def test_a_tab_a_take_a_run_and_a_setting_are_reached(qtbot: QtBot, window: MainWindow) -> None:
    take = window.session.project.takes[-1].id  # type: ignore[union-attr]
    palette = find(qtbot, window, take)
    assert f"{take} | Take" in lines(palette)
    choose(qtbot, palette)
    curate = window.room("curate")[0]
    assert isinstance(curate, CurateView)
    qtbot.waitUntil(lambda: window.shown_room == "curate" and curate.inspector.title.text() == take)
    choose(qtbot, find(qtbot, window, "base voice"))
    qtbot.waitUntil(lambda: window.shown_room == "review")
    choose(qtbot, find(qtbot, window, "slate"))
    qtbot.waitUntil(lambda: window.findChild(QWidget, "setting_slate") is not None)
    slate = window.findChild(QLineEdit, "setting_slate")
    assert slate is not None
    assert slate.window().focusWidget() is slate


def test_an_action_of_another_tab_is_done_there(qtbot: QtBot, window: MainWindow) -> None:
    window.show_room("live")
    review = window.room("review")[0]
    assert isinstance(review, ReviewView)
    looping = review.loop.isChecked()
    palette = find(qtbot, window, "loop")
    assert lines(palette)[0].startswith("Loop | ")
    QTest.keyClick(palette.search, Qt.Key.Key_Escape)
    window.show_room("review")
    palette = find(qtbot, window, "loop")
    assert lines(palette)[0] == "Loop | Review"
    choose(qtbot, palette)
    qtbot.waitUntil(lambda: review.loop.isChecked() is not looping)


def test_what_matches_nothing_says_so_and_does_nothing(qtbot: QtBot, window: MainWindow) -> None:
    palette = find(qtbot, window, "qqqq")
    assert lines(palette) == ["Nothing matches. | "]
    QTest.keyClick(palette.search, Qt.Key.Key_Return)
    assert palette.isVisible()
