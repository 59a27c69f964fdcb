"""The stage of Live: the performer as it is sent, and under it the switches for what must happen at once."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QObject, QSignalBlocker, Qt, Signal
from PySide6.QtGui import QKeyEvent, QResizeEvent, QShortcut
from PySide6.QtWidgets import QHBoxLayout, QPushButton, QWidget

from studio.motion.avatar import Avatar
from studio.render.world_pose import WorldPose
from studio.ui import theme
from studio.ui.shortcuts import name_of, pressed, sequence, tip_of
from studio.ui.widgets.avatar_button import AvatarButton
from studio.ui.widgets.figure.pane import Pane


class LiveStage(QWidget):
    """One performer with the avatar's button over the picture.

    Signals:
        avatar_too_slow: the avatar is left away from now on, since drawing it takes too long.
    """

    avatar_too_slow = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._waiting = self.tr("Press Go live and speak. Your avatar moves here.")
        self._performs = False
        self.pane = Pane("live", "", self._waiting, "mdi6.human", "figure")
        self.figure = self.pane.figure
        self.figure.view_buttons_shown = True
        self.figure.avatar_too_slow.connect(self.avatar_too_slow)
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.addWidget(self.pane)
        self.avatar = AvatarButton(self, "live_")
        self.avatar.raise_()

    def set_avatar(self, avatar: Avatar | None) -> None:
        """Show an avatar; None for the stick figure."""
        self.avatar.show_avatar(avatar)
        self.pane.set_avatar(avatar)
        if not self._performs:
            self.show_nobody()

    def show_stance(self, stance: WorldPose) -> None:
        """Show the performer at this moment; bones or shapes may be missing."""
        self._performs = True
        self.pane.show_stance(stance)

    def show_nobody(self) -> None:
        """Nothing is live: an avatar is shown in its rest pose."""
        self._performs = False
        avatar = self.figure.avatar
        if avatar is not None:
            self.pane.show_stance(WorldPose.rest_pose(avatar.skeleton))
        else:
            self.pane.show_nothing(self._waiting)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self.avatar.place(self.size())


class Controls(QWidget):
    """Mute, freeze and the neutral pose: three switches with keys.

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
        for name, icon in (
            ("mute", "mdi6.microphone-off"),
            ("freeze", "mdi6.snowflake"),
            ("neutral", "mdi6.human-handsdown"),
        ):
            key = sequence(name)
            button = QPushButton(f"{name_of(name)} ({key.toString()})")
            button.setObjectName(f"live_{name}")
            button.setCheckable(True)
            button.setToolTip(tip_of(name))
            # A button's own key would press it a tenth of a second later.
            QShortcut(key, self, button.click)
            theme.set_icon(button, icon, "muted", "accent")
            button.toggled.connect(lambda on, name=name: self.switched.emit(name, on))
            row.addWidget(button)
            self._buttons[name] = button
        self.show_live(False)

    def claim_keys_of(self, widget: QWidget) -> None:
        """Turn the switches by their keys even while a widget that would use them has the keyboard."""
        widget.installEventFilter(self)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        if isinstance(event, QKeyEvent) and event.type() == QEvent.Type.KeyPress:
            name = pressed(event, "live")
            if name in self._buttons and event.modifiers() == Qt.KeyboardModifier.NoModifier:
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
