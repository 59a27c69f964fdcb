"""Space does what the shown tab says, whatever was clicked, typed, disabled or taken away before."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QAbstractButton,
    QApplication,
    QCheckBox,
    QComboBox,
    QLineEdit,
    QPushButton,
    QToolButton,
    QWidget,
)
from pytestqt.qtbot import QtBot

from studio.project import Project
from studio.ui import app as application
from studio.ui import tasks
from studio.ui.main_window import MainWindow
from studio.ui.record.takes_view import TakeLine

KEY, LEFT = Qt.Key, Qt.MouseButton.LeftButton
OTHER_THINGS = {
    # Those that begin work, ask for a file, open a dialog or go to another tab; and the transport itself.
    "record_button", "practice_button", "refresh_microphones", "level_test", "sync_test", "add_tracker",
    "figure_empty_button", "take_redo", "take_play", "phone_connect", "to_curate",
    "play_button", "import_button", "split_for_me_button", "split_pauses_button", "align_button",
    "add_label_button", "to_fix_button",
    "add_sound", "batch_button", "go_to_curate", "review_go_train", "move_like_this", "avatar_button",
    "export_button", "send_button", "cancel_generate", "review_another", "qt_dockwidget",
}  # fmt: skip


@pytest.fixture
def window(toy_project: Project, qtbot: QtBot) -> Iterator[MainWindow]:
    toy_project.close()
    _, made = application.build([str(toy_project.folder)])
    qtbot.addWidget(made)
    made.resize(1440, 900)
    made.show()
    made.activateWindow()
    qtbot.waitUntil(made.isActiveWindow)
    yield made
    made.close()
    tasks.wait()


class Transport:
    """Counts how often a tab's Space was heard; nothing is played or recorded."""

    def __init__(self, window: MainWindow, qtbot: QtBot, tab: str) -> None:
        window.show_room(tab)
        self.view, presenter = window.room(tab)
        self._window, self._qtbot, self._heard = window, qtbot, 0
        if tab == "record":
            signal = self.view.record_requested  # type: ignore[attr-defined]
        elif tab == "curate":
            signal = self.view.bench.play_requested  # type: ignore[attr-defined]
            library = self.view.library  # type: ignore[attr-defined]
            qtbot.waitUntil(lambda: library.table.model().rowCount() == 3)
            library.select(["toy_001"])
        else:
            signal = self.view.play_toggled  # type: ignore[attr-defined]
            qtbot.waitUntil(lambda: presenter.model.tuned is not None)  # type: ignore[attr-defined]
        signal.disconnect()
        signal.connect(self._on_heard)

    def _on_heard(self) -> None:
        self._heard += 1

    def answers(self) -> bool:
        """Whether Space, pressed where the keyboard is now, is heard by the tab and by nothing else."""
        self._qtbot.wait(40)
        before = self._heard
        self._qtbot.keyClick(QApplication.focusWidget() or self._window, KEY.Key_Space)
        opened = QApplication.activePopupWidget()
        if opened is not None:
            opened.close()
        return self._heard == before + 1 and opened is None


def click(window: MainWindow, widget: QWidget) -> None:
    """Click as a mouse does, by way of the window: only so does Qt know that a button of it is down."""
    QTest.mouseClick(window.windowHandle(), LEFT, pos=widget.mapTo(window, widget.rect().center()))


def buttons(view: QWidget) -> list[QAbstractButton]:
    """What can be clicked in a tab without more happening than it says."""
    return [
        one
        for one in view.findChildren(QAbstractButton)
        if one.isVisible()
        and one.isEnabled()
        and isinstance(one, QPushButton | QToolButton | QCheckBox)
        and one.visibleRegion().contains(one.rect().center())
        and one.objectName() not in OTHER_THINGS
        and not (isinstance(one, QPushButton | QToolButton) and one.menu() is not None)
        and not one.objectName().startswith("qt_")
        and not isinstance(one.parent(), QLineEdit)
    ]


@pytest.mark.parametrize("tab", ["record", "curate", "review"])
def test_space_is_the_tab_s_after_every_click(window: MainWindow, qtbot: QtBot, tab: str) -> None:
    transport = Transport(window, qtbot, tab)
    assert transport.answers(), "before anything is clicked"
    found = buttons(transport.view)
    assert len(found) >= 3
    deaf = []
    for button in found:
        if not button.isVisible() or not button.isEnabled():
            continue  # what a click before this one took away
        name = button.objectName() or f"{button} in {button.parent()}"
        click(window, button)
        assert QApplication.activeModalWidget() is None, name
        if not transport.answers():
            deaf.append(name)
        assert window.shown_room == tab, name
    assert deaf == []


@pytest.mark.parametrize("tab", ["record", "curate", "review"])
def test_a_list_of_choices_has_the_keyboard_only_while_it_is_open(
    window: MainWindow, qtbot: QtBot, tab: str
) -> None:
    transport = Transport(window, qtbot, tab)
    boxes = [one for one in transport.view.findChildren(QComboBox) if one.isVisible() and one.isEnabled()]
    boxes = [one for one in boxes if one.visibleRegion().contains(one.rect().center())]
    assert boxes
    for box in boxes:
        if box.isEditable():
            continue
        click(window, box)
        qtbot.waitUntil(lambda: QApplication.activePopupWidget() is not None)
        popup = QApplication.activePopupWidget()
        assert popup is not None
        qtbot.keyClick(popup, KEY.Key_Escape)
        qtbot.waitUntil(lambda: QApplication.activePopupWidget() is None)
        assert transport.answers(), box.objectName()


def test_space_records_after_a_note(window: MainWindow, qtbot: QtBot) -> None:
    transport = Transport(window, qtbot, "record")

    line = TakeLine("toy_001", "0:06", "A")
    transport.view.takes.show_lines([line])  # type: ignore[attr-defined]
    note = transport.view.findChild(QToolButton, "take_note")
    assert note is not None
    qtbot.waitUntil(lambda: not note.visibleRegion().isEmpty())
    click(window, note)
    field = transport.view.findChild(QLineEdit, "take_note_text")
    qtbot.waitUntil(field.hasFocus)
    qtbot.keyClicks(field, "a good one")
    qtbot.keyClick(field, KEY.Key_Return)
    assert transport.answers()


@pytest.mark.parametrize("way", ["hide", "disable", "delete"])
def test_a_widget_that_goes_leaves_the_keyboard_with_the_tab(
    window: MainWindow, qtbot: QtBot, way: str
) -> None:
    transport = Transport(window, qtbot, "review")
    button = transport.view.findChild(QPushButton, "loop_button")
    button.setFocus(Qt.FocusReason.TabFocusReason)
    assert QApplication.focusWidget() is button, "the keyboard reaches it as before"
    {"hide": button.hide, "disable": lambda: button.setEnabled(False), "delete": button.deleteLater}[way]()
    qtbot.wait(10)
    assert not isinstance(QApplication.focusWidget(), QAbstractButton)
    assert transport.answers()


def test_escape_goes_back_one_step_at_a_time(window: MainWindow, qtbot: QtBot) -> None:
    transport = Transport(window, qtbot, "curate")
    library, bench = transport.view.library, transport.view.bench  # type: ignore[attr-defined]
    qtbot.keyClicks(library.search, "toy_001")
    library.fix_button.setChecked(True)
    bench.pauses_requested.emit()
    qtbot.waitUntil(bench.question.isVisible)
    library.search.setFocus()
    left = []
    for _ in range(3):
        qtbot.keyClick(QApplication.focusWidget(), KEY.Key_Escape)
        left.append((bench.question.isVisible(), library.fix_button.isChecked(), library.search.text()))
    assert left == [(False, True, "toy_001"), (False, False, "toy_001"), (False, False, "")]
    assert transport.answers()
