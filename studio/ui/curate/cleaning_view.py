"""The button that says how the sound of a take is cleaned, with the ways to choose from."""

from __future__ import annotations

from functools import partial

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QMenu, QPushButton, QWidget

from studio.ui.theme import set_icon


class CleanButton(QPushButton):
    """A button with a menu of ways.

    Signals:
        chosen: a way of cleaning the sound, "" for as recorded.
        compared: hear the recording in place of the cleaned sound, or back.
        stopped: do not go on making it.
    """

    chosen = Signal(str)
    compared = Signal()
    stopped = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("clean_button")
        self.setToolTip(self.tr("Use this take with less noise; the recording stays as it is"))
        self.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self._words = {"noise": self.tr("Less noise"), "voice": self.tr("Voice alone")}
        menu = QMenu(self)
        self._ways = {
            "": self._action(menu, self.tr("As recorded"), "clean_off"),
            "noise": self._action(menu, self.tr("Less noise: hiss, hum and fans"), "clean_noise"),
            "voice": self._action(menu, self.tr("Voice alone: also keys, clicks, traffic"), "clean_voice"),
        }
        for way, action in self._ways.items():
            action.setCheckable(True)
            action.triggered.connect(partial(self._on_chosen, way))
        menu.addSeparator()
        self._compare = self._action(menu, self.tr("Before and after\tB"), "clean_compare")
        self._compare.triggered.connect(lambda: self.compared.emit())
        self._stop = self._action(menu, self.tr("Stop"), "clean_stop")
        self._stop.triggered.connect(lambda: self.stopped.emit())
        self.setMenu(menu)
        self.show_way("", False)

    def show_way(self, way: str, before: bool) -> None:
        """How the sound is cleaned, and whether the recording is heard in its place."""
        words = self.tr("Heard as recorded") if before else self._words.get(way, self.tr("Clean sound"))
        self.setText(words)
        set_icon(self, "mdi6.creation", "accent" if way and not before else "muted")
        self._compare.setEnabled(bool(way))
        for key, action in self._ways.items():
            action.setChecked(key == way)
        self._show_working(False)

    def show_progress(self, fraction: float) -> None:
        """How much of the cleaned sound is made, 0..1."""
        self.setText(self.tr("Cleaning… {0}").format(f"{fraction:.0%}"))
        self._show_working(True)

    def _show_working(self, working: bool) -> None:
        for action in (*self._ways.values(), self._compare):
            action.setVisible(not working)
        self._stop.setVisible(working)

    def _on_chosen(self, way: str, _checked: bool = False) -> None:
        self.chosen.emit(way)

    def _action(self, menu: QMenu, text: str, name: str) -> QAction:
        action = menu.addAction(text)
        action.setObjectName(name)
        return action
