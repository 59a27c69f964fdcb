"""Messages: a sentence and a remedy over the strip beside the tabs, no keyboard taken."""

import sys

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtWidgets import QApplication, QLineEdit, QWidget

from studio.errors import StudioError
from studio.ui import messages
from studio.ui.messages import Toast, counted


def toast_of(window: QWidget) -> Toast:
    found = window.findChild(Toast)
    assert found is not None
    return found


def test_an_error_shows_what_happened_and_what_to_do(window) -> None:
    messages.show_error(window, StudioError("Port 39539 is already in use.", "Choose another port."))
    toast = toast_of(window)
    assert toast.isVisible()
    assert toast.text.text() == "Port 39539 is already in use."
    assert toast.remedy.text() == "Choose another port."
    assert not toast.action.isVisible()


def test_a_message_takes_no_keyboard_and_stays_inside(window, qtbot) -> None:
    line = QLineEdit(window)
    line.show()
    line.setFocus()
    messages.show_note(window, "Saved. " * 40)
    toast = toast_of(window)
    assert QApplication.focusWidget() in (line, None)
    assert window.rect().contains(toast.geometry())
    window.resize(640, 480)
    qtbot.waitUntil(lambda: window.rect().contains(toast.geometry()))
    assert toast.text.heightForWidth(toast.text.width()) <= toast.text.height()


def test_a_message_lies_over_the_window_s_place_for_it(window) -> None:
    place = QWidget(window)
    place.setGeometry(460, 0, 430, 52)
    place.show()
    toast = Toast(window, place)
    messages.show_note(window, "Saved.")
    assert toast_of(window) is toast
    assert toast.geometry().right() == place.geometry().right()
    assert toast.geometry().bottom() <= place.geometry().bottom()
    # Where the tabs leave too little room, it lies in the corner: it covers no tab.
    place.setGeometry(600, 0, 280, 52)
    assert toast.geometry().bottom() > window.height() - 20
    assert window.rect().contains(toast.geometry())


def test_a_click_takes_a_message_away(window, qtbot) -> None:
    for part in ("toast", "toast_text"):
        messages.show_note(window, "Saved.")
        toast = toast_of(window)
        widget = toast if part == "toast" else toast.text
        qtbot.mouseClick(widget, Qt.MouseButton.LeftButton, pos=QPoint(3, widget.height() - 3))
        assert not toast.isVisible(), part


def test_the_keyboard_reaches_a_message(window, qtbot) -> None:
    messages.show_note(window, "Removed.", action=("Undo", lambda: None))
    toast = toast_of(window)
    assert toast.accessibleName() == "Removed."
    window.activateWindow()
    qtbot.waitUntil(lambda: QApplication.activeWindow() is window, timeout=30_000)
    qtbot.keyClick(window, Qt.Key.Key_F6)
    assert window.focusWidget() is toast.action
    qtbot.keyClick(toast.action, Qt.Key.Key_Escape)
    assert not toast.isVisible()


def test_the_next_message_takes_the_place_of_the_one_before(window) -> None:
    messages.show_note(window, "One.")
    messages.show_note(window, "Two.")
    assert len(window.findChildren(Toast)) == 1
    assert toast_of(window).text.text() == "Two."


def test_an_unexpected_exception_offers_a_report(window, capsys) -> None:
    try:
        raise ZeroDivisionError("by nought")
    except ZeroDivisionError as error:
        messages.show_error(window, error)
    toast = toast_of(window)
    assert toast.text.text() == "Something unexpected happened: ZeroDivisionError: by nought"
    toast.action.click()
    assert "ZeroDivisionError: by nought" in QApplication.clipboard().text()
    assert "Traceback" in capsys.readouterr().err


def test_exceptions_nobody_caught_are_shown(window, monkeypatch, capsys) -> None:
    monkeypatch.setattr(sys, "excepthook", sys.excepthook)
    messages.catch_unexpected()
    error = RuntimeError("lost")
    sys.excepthook(RuntimeError, error, None)
    assert toast_of(window).text.text() == "Something unexpected happened: RuntimeError: lost"
    assert "lost" in capsys.readouterr().err


def test_an_action_runs_once_and_closes_the_message(window) -> None:
    done = []
    messages.show_note(window, "Removed.", action=("Undo", lambda: done.append(1)))
    toast = toast_of(window)
    assert toast.action.text() == "Undo"
    toast.action.click()
    assert done == [1]
    assert not toast.isVisible()
    assert toast.pos() != QPoint(0, 0)


def test_an_error_goes_by_itself_later_than_a_note(window, qtbot) -> None:
    messages.Toast(window, error_ms=50)
    messages.show_error(window, StudioError("Port 39539 is already in use.", "Choose another port."))
    toast = toast_of(window)
    qtbot.waitUntil(lambda: not toast.isVisible(), timeout=30_000)


def test_going_on_takes_an_error_away_and_leaves_a_note(window) -> None:
    messages.dismiss_error(window)  # nothing was ever shown
    messages.show_error(window, StudioError("Port 39539 is already in use.", "Choose another port."))
    messages.dismiss_error(window)
    assert not toast_of(window).isVisible()
    messages.show_note(window, "Saved.")
    messages.dismiss_error(window)
    assert toast_of(window).isVisible()


@pytest.mark.parametrize(
    ("count", "said"), [(0, "0 labels in a.txt."), (1, "1 label in a.txt."), (2, "2 labels in a.txt.")]
)
def test_one_and_several_have_their_own_sentence(count: int, said: str) -> None:
    assert counted(count, "1 label in {1}.", "{0} labels in {1}.", "a.txt") == said
