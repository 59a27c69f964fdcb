"""The stage of Live: the performer as it is sent, a stick figure or the performer's own avatar."""

from __future__ import annotations

from PySide6.QtCore import Signal
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QHBoxLayout, QWidget

from studio.motion.avatar import Avatar
from studio.render.world_pose import WorldPose
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
        self._waiting = self.tr("Press Go live, and speak: your avatar moves here.")
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
        """Wear an avatar; None for the stick figure."""
        self.avatar.show_avatar(avatar)
        self.pane.set_avatar(avatar)
        if not self._performs:
            self.show_nobody()

    def show_stance(self, stance: WorldPose) -> None:
        """Show the performer at this moment; bones or shapes may be missing."""
        self._performs = True
        self.pane.show_stance(stance)

    def show_nobody(self) -> None:
        """Nothing is live: the avatar waits, where one is worn."""
        self._performs = False
        worn = self.figure.avatar
        if worn is not None:
            self.pane.show_stance(WorldPose.rest_pose(worn.skeleton))
        else:
            self.pane.show_nothing(self._waiting)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self.avatar.place(self.size())
