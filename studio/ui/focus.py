"""Where the keyboard is: with the shown tab, whose keys work whatever was clicked, disabled or taken away."""

from __future__ import annotations

from collections.abc import Callable

import shiboken6
from PySide6.QtCore import QObject, QTimer
from PySide6.QtWidgets import QAbstractButton, QApplication, QComboBox, QWidget

AGAIN_MS = 10
"""How soon it is looked again whether a click is over."""


class FocusKeeper(QObject):
    """Gives the keyboard back to the shown tab, where Space does what the tab says.

    A button or a list of choices that was clicked has had its say: the next Space is the tab's again. By Tab
    they are reached as before, and Space presses them then. Where the widget with the focus is hidden,
    disabled or deleted, Qt passes the focus on to whatever comes next, often a button far away.

    Args:
        window: what is watched.
        tab: the tab that is shown now; None where there is none.
    """

    def __init__(self, window: QWidget, tab: Callable[[], QWidget | None]) -> None:
        super().__init__(window)
        self._window, self._tab = window, tab
        app = QApplication.instance()
        assert isinstance(app, QApplication)
        app.focusChanged.connect(self._on_focus)

    def _on_focus(self, old: QWidget | None, new: QWidget | None) -> None:
        if not shiboken6.isValid(self._window):
            return
        if new is None:
            QTimer.singleShot(0, self, self._fill)
        elif new.window() is not self._window:
            return
        elif QApplication.mouseButtons():
            chosen = isinstance(new, QComboBox) and not new.isEditable()
            if chosen or isinstance(new, QAbstractButton):
                self._after_click(new)
        # The old one is looked at now: later it may have been deleted.
        elif old is not None and old.window() is self._window and not (old.isVisible() and old.isEnabled()):
            QTimer.singleShot(0, self, lambda: self._follow(new))

    def _after_click(self, new: QWidget) -> None:
        """Give the focus back once the click is over: a button that lost it in between would not hear it."""
        if QApplication.mouseButtons() or QApplication.activePopupWidget() is not None:
            QTimer.singleShot(AGAIN_MS, self, lambda: self._after_click(new))
        else:
            self._follow(new)

    def _follow(self, new: QWidget) -> None:
        """Take the focus from what it fell to; whoever was given it since then is to keep it."""
        if QApplication.focusWidget() is new:
            self._give_back()

    def _fill(self) -> None:
        """Nothing has the focus, so that no key would reach the tab."""
        if QApplication.focusWidget() is None and self._window.isActiveWindow():
            self._give_back()

    def _give_back(self) -> None:
        tab = self._tab()
        if tab is not None:
            tab.setFocus()
