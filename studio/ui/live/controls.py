"""Mute, freeze and the neutral pose: three switches with keys, for what must happen at once."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QObject, QSignalBlocker, Qt, Signal
from PySide6.QtGui import QKeyEvent, QKeySequence, QShortcut
from PySide6.QtWidgets import QHBoxLayout, QPushButton, QWidget

from studio.actions import ACTIONS
from studio.ui import theme

KEYS = {name: ACTIONS[name].keys[0] for name in ("mute", "freeze", "neutral")}


class Controls(QWidget):
    """The row of switches.

    Signals:
        switched: the switch's name and whether it is on now.
    """

    switched = Signal(str, bool)

    def __init__(self) -> None:
        super().__init__()
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(theme.INSIDE)
        self._buttons: dict[str, QPushButton] = {}
        for name, words, icon, tip in (
            ("mute", self.tr("Mute"), "mdi6.microphone-off", self.tr("The microphone is not listened to")),
            ("freeze", self.tr("Freeze"), "mdi6.snowflake", self.tr("The avatar holds still as it is")),
            (
                "neutral", self.tr("Neutral"), "mdi6.human-handsdown",
                self.tr("Panic key: the avatar goes to its neutral pose and stays there"),
            ),
        ):  # fmt: skip
            button = QPushButton(f"{words} ({KEYS[name]})")
            button.setObjectName(f"live_{name}")
            button.setCheckable(True)
            button.setToolTip(f"{tip} ({KEYS[name]})")
            # A button's own key would press it a tenth of a second later.
            QShortcut(QKeySequence(KEYS[name]), self, button.click)
            theme.set_icon(button, icon, "muted", "accent")
            button.toggled.connect(lambda on, name=name: self.switched.emit(name, on))
            row.addWidget(button)
            self._buttons[name] = button
        self.show_live(False)

    def heed_keys_of(self, widget: QWidget) -> None:
        """Take the switches' keys from a widget that would use them up: a list, a number."""
        widget.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if isinstance(event, QKeyEvent) and event.type() == QEvent.Type.KeyPress:
            name = next((name for name, key in KEYS.items() if event.text().upper() == key), "")
            if name and event.modifiers() == Qt.KeyboardModifier.NoModifier:
                self._buttons[name].click()
                return True
        return super().eventFilter(watched, event)

    def button(self, name: str) -> QPushButton:
        """One of the switches."""
        return self._buttons[name]

    def show_switch(self, name: str, on: bool) -> None:
        """Show a switch on or off without saying so."""
        with QSignalBlocker(self._buttons[name]):
            self._buttons[name].setChecked(on)

    def show_live(self, live: bool) -> None:
        """Enable them while it is live; they are off at the start."""
        for button in self._buttons.values():
            button.setEnabled(live)
            if not live:
                with QSignalBlocker(button):
                    button.setChecked(False)
