"""The stage of Live: the performer as it is sent, and under it the switches for what must happen at once."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import QEvent, QObject, QSignalBlocker, Qt, Signal
from PySide6.QtGui import QKeyEvent, QResizeEvent, QShortcut
from PySide6.QtWidgets import (
    QButtonGroup,
    QComboBox,
    QGridLayout,
    QHBoxLayout,
    QPushButton,
    QSizePolicy,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from studio.motion.avatar import Avatar
from studio.render.world_pose import WorldPose
from studio.ui import theme
from studio.ui.shortcuts import name_of, pressed, sequence, tip_of
from studio.ui.widgets.avatar_button import AvatarButton
from studio.ui.widgets.background_menu import BackgroundButton
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
        self.backgrounds = BackgroundButton("live_")
        theme.as_role(self.backgrounds, "chip")
        self.figure.add_tool(self.backgrounds)
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


A_ROW = 5
"""Chips side by side: with all of its moods a run has two rows."""


class MoodChips(QWidget):
    """The moods of a run as chips with their keys, "none" first; hidden where it knows none.

    Signals:
        chosen: a mood's name, "" for none.

    Attributes:
        chips: by the action that each does.
    """

    chosen = Signal(str)

    def __init__(self) -> None:
        super().__init__()
        self.setObjectName("live_moods")
        self.chips: dict[str, QToolButton] = {}
        self._names: tuple[str, ...] = ()
        self._group = QButtonGroup(self)
        self._grid = QGridLayout(self)
        self._grid.setContentsMargins(0, 0, 0, 0)
        self._grid.setSpacing(theme.TIGHT)
        self.hide()

    def show_moods(self, names: Sequence[str]) -> None:
        """Offer these, none of them chosen."""
        if tuple(names) == self._names:
            return
        for chip in self.chips.values():
            # Hidden at once: its key must not stay beside that of its successor until Qt comes to delete it.
            chip.hide()
            chip.setParent(None)
            chip.deleteLater()
        self.chips, self._names = {}, tuple(names)
        for number, name in enumerate(("", *self._names) if self._names else ()):
            action = f"mood_{number}"
            chip = QToolButton()
            chip.setObjectName(f"live_{action}")
            chip.setText(f"{number}  {name}" if name else self.tr("{0}  none").format(number))
            chip.setToolTip(
                self.tr("Move as where you labelled {0}").format(name) if name else tip_of(action)
            )
            chip.setCheckable(True)
            chip.setChecked(not name)
            theme.as_role(chip, "chip")
            QShortcut(sequence(action), chip, chip.click)
            chip.clicked.connect(lambda _=False, name=name: self.chosen.emit(name))
            self._group.addButton(chip)
            # A long label is cut, and the stage stays as narrow as it may be.
            chip.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)
            chip.setMinimumWidth(52)
            self._grid.addWidget(chip, number // A_ROW, number % A_ROW)
            self.chips[action] = chip
        self.setVisible(bool(self._names))

    def show_mood(self, name: str) -> None:
        """Which one is played, without saying so."""
        for chip, one in zip(self.chips.values(), ("", *self._names), strict=False):
            chip.setChecked(one == name)


class Controls(QWidget):
    """Mute, freeze and the neutral pose: three switches with keys; over them the moods of the run.

    Signals:
        switched: the switch's name and whether it is on now.
        mood_chosen: a mood's name, "" for none.
    """

    switched = Signal(str, bool)
    mood_chosen = Signal(str)

    def __init__(self) -> None:
        super().__init__()
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(theme.INSIDE)
        self.moods = MoodChips()
        self.moods.chosen.connect(self.mood_chosen)
        column.addWidget(self.moods)
        row = QHBoxLayout()
        row.setSpacing(theme.INSIDE)
        column.addLayout(row)
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
            # Not where digits are typed, as in a port's number.
            lists = isinstance(watched, QComboBox) and not watched.isEditable()
            buttons = self._buttons | (self.moods.chips if lists else {})
            if name in buttons and event.modifiers() == Qt.KeyboardModifier.NoModifier:
                buttons[name].click()
                return True
        return super().eventFilter(watched, event)

    def let_go(self) -> None:
        """Leave a mood, else the freeze, else the neutral pose. Mute stays: nobody is heard by mistake."""
        none = self.moods.chips.get("mood_0")
        held = [self._buttons[name] for name in ("freeze", "neutral") if self._buttons[name].isChecked()]
        if none is not None and none.isEnabled() and not none.isChecked():
            none.click()
        elif held:
            held[0].click()

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
        self.moods.setEnabled(live)
