"""The stage: captured and predicted side by side or one over the other, each with a face."""

from __future__ import annotations

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QHBoxLayout, QWidget

from studio.motion.avatar import Avatar
from studio.ui.widgets.avatar_button import AvatarButton
from studio.ui.widgets.figure.pane import Pane


class Stage(QWidget):
    """Two panes that share one camera and one avatar; `set_layout` lays one figure over the other.

    Signals:
        avatar_too_slow: the avatar is left away from now on, since drawing it takes too long.
    """

    avatar_too_slow = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("stage")
        self.captured = Pane(
            "captured",
            self.tr("Captured"),
            self.tr("No captured motion goes with this sound."),
            "mdi6.account-voice",
            "ghost",
        )
        self.predicted = Pane(
            "predicted",
            self.tr("Predicted"),
            self.tr("Choose a run to see what it makes of this sound."),
            "mdi6.human-greeting",
            "figure",
        )
        self.avatar = AvatarButton(self)
        self.worn: Avatar | None = None
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        row.setSpacing(2)
        row.addWidget(self.captured, 1)
        row.addWidget(self.predicted, 1)
        self.avatar.raise_()
        self._ghost = False
        self.captured.figure.view_changed.connect(self.predicted.figure.set_orbit)
        self.predicted.figure.view_changed.connect(self.captured.figure.set_orbit)
        for pane in (self.predicted, self.captured):
            pane.figure.avatar_too_slow.connect(self.avatar_too_slow)
        self.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)

    def set_avatar(self, avatar: Avatar | None) -> None:
        """Wear an avatar in both panes; None for the stick figure."""
        self.worn = avatar
        self.avatar.show_avatar(avatar)
        for pane in (self.predicted, self.captured):
            pane.set_avatar(avatar)

    @property
    def ghost(self) -> bool:
        """Whether the captured figure is laid over the predicted one."""
        return self._ghost

    def set_layout(self, captured: bool, predicted: bool, ghost: bool) -> None:
        """Which panes are seen.

        Args:
            captured, predicted: whether each has a motion.
            ghost: lay one over the other where both have.
        """
        self._ghost = ghost and captured and predicted
        # The second colour tells two apart; alone, the captured one wears the first.
        self.captured.set_token("ghost" if predicted else "figure")
        self.captured.setVisible(captured and not self._ghost)
        self.predicted.setVisible(predicted or not captured)
        if not self._ghost:
            self.predicted.figure.show_ghost(None)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Keep the avatar's button in the lower right corner, over the picture."""
        super().resizeEvent(event)
        self.avatar.place(self.size())

    def set_view(self, name: str) -> None:
        """Look at both from "front", "three_quarter" or "side"."""
        self.predicted.figure.set_view(name)
        self.captured.figure.set_view(name)

    def warm_up(self) -> None:
        """Get OpenGL ready, when nothing else is going on."""
        for pane in (self.predicted, self.captured):
            pane.figure.warm_up()

    def dispose(self) -> None:
        """Free OpenGL."""
        for pane in (self.predicted, self.captured):
            pane.figure.dispose()
