"""Review's stage: two panes that share a camera, its views and turntable, and the face's meters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from PySide6.QtCore import QRectF, QSize, Qt, QTimer, Signal
from PySide6.QtGui import QAction, QPainter, QPaintEvent, QResizeEvent
from PySide6.QtWidgets import QHBoxLayout, QMenu, QSizePolicy, QToolButton, QWidget

from studio.motion.avatar import Avatar
from studio.render.background import Background
from studio.render.camera import Orbit
from studio.ui import theme
from studio.ui.widgets.avatar_button import AvatarButton
from studio.ui.widgets.background_menu import BackgroundMenu
from studio.ui.widgets.figure.pane import Pane
from studio.ui.widgets.figure.view_buttons import add_framings


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
        # Over the picture and in no layout: in one it made the picture smaller.
        self.avatar.raise_()
        self._ghost = False
        # Turned together: the same pose seen from two sides is hard to compare.
        self.captured.figure.view_changed.connect(self.predicted.figure.set_orbit)
        self.predicted.figure.view_changed.connect(self.captured.figure.set_orbit)
        for pane in (self.predicted, self.captured):
            pane.figure.avatar_too_slow.connect(self.avatar_too_slow)
        # A plain QWidget paints no background of the style sheet by itself.
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
            self.predicted.figure.show_ghost_stance(None)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Keep the avatar's button in the lower right corner, over the picture."""
        super().resizeEvent(event)
        self.avatar.place(self.size())

    def set_background(self, background: Background) -> None:
        """What is behind both."""
        for pane in (self.predicted, self.captured):
            pane.set_background(background)

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


TURN_MS = 33
TURN_DEGREES_S = 24.0
"""A round takes a quarter of a minute."""


class CameraButton(QToolButton):
    """A menu of views, and the turntable.

    Args:
        stage: what is looked at; its figures share one camera.
    """

    def __init__(self, stage: Stage, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._stage = stage
        self.setObjectName("camera_button")
        self.setAccessibleName(self.tr("Views"))
        self.setToolTip(self.tr("Where the figure is seen from"))
        theme.set_icon(self, "mdi6.video-outline", "muted")
        theme.as_role(self, "quiet")
        self.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        menu = QMenu(self)
        self.setMenu(menu)
        for name, text, orbit in (
            ("front", self.tr("Front"), Orbit.preset("front")),
            ("three_quarter", self.tr("Three-quarter"), Orbit.preset("three_quarter")),
            ("side", self.tr("Side"), Orbit.preset("side")),
            ("back", self.tr("Back"), Orbit(180.0, 4.0)),
        ):
            action = menu.addAction(text)
            action.setObjectName(f"view_{name}")
            action.triggered.connect(lambda _=False, seen=orbit: self._look_from(seen))
        menu.addSeparator()
        figure = stage.predicted.figure
        add_framings(menu, "view_", lambda: figure.seen, self._frame)
        menu.addSeparator()
        self.backgrounds = BackgroundMenu(menu, "review_")
        menu.addMenu(self.backgrounds)
        self.turntable: QAction = menu.addAction(self.tr("Turntable"))
        self.turntable.setObjectName("turntable")
        self.turntable.setCheckable(True)
        self._timer = QTimer(self)
        self._timer.setInterval(TURN_MS)
        self._timer.timeout.connect(self._turn)
        self.turntable.toggled.connect(self._on_turntable)

    def _on_turntable(self, on: bool) -> None:
        if on:
            self._timer.start()
        else:
            self._timer.stop()

    def _turn(self) -> None:
        """A step around; rests while the tab is not seen."""
        figure = self._stage.predicted.figure
        if self._stage.isVisible():
            figure.set_orbit(figure.orbit.turned(TURN_DEGREES_S * TURN_MS / 1000.0, 0.0))

    def _look_from(self, orbit: Orbit) -> None:
        """Another side, as near as before."""
        # A view that was chosen stays; the turntable would turn away from it.
        self.turntable.setChecked(False)
        figure = self._stage.predicted.figure
        figure.set_orbit(replace(orbit, zoom=figure.orbit.zoom))

    def _frame(self, name: str) -> None:
        """Nearer or farther, from the same side; the turntable goes on."""
        self._stage.predicted.figure.set_view(name)


ROW_PX = 20


class PairMeters(QWidget):
    """As many meters as fit, in a fixed order given by `set_names`."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("face_meters")
        self.setAccessibleName(self.tr("Face meters"))
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self._names: tuple[str, ...] = ()
        self._predicted: Mapping[str, float] | None = None
        self._captured: Mapping[str, float] | None = None

    def sizeHint(self) -> QSize:
        return QSize(260, 8 * ROW_PX)

    def minimumSizeHint(self) -> QSize:
        return QSize(180, 5 * ROW_PX)

    def set_names(self, names: Sequence[str]) -> None:
        """Which shapes, the most interesting first."""
        self._names = tuple(names)
        self.update()

    def show_values(
        self, predicted: Mapping[str, float] | None, captured: Mapping[str, float] | None
    ) -> None:
        """Values by name; None where there is no such motion."""
        self._predicted, self._captured = predicted, captured
        self.update()

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setFont(theme.figures_font(theme.CAPTION_PX))
        if not self._names:
            painter.setPen(theme.colour("muted"))
            painter.drawText(self.rect(), Qt.AlignmentFlag.AlignCenter, self.tr("No blend shapes to show."))
            return
        label_width = min(128, self.width() // 2)
        for row, name in enumerate(self._names[: max(self.height() // ROW_PX, 1)]):
            self._paint_row(painter, name, QRectF(0, row * ROW_PX, self.width(), ROW_PX), label_width)

    def _paint_row(self, painter: QPainter, name: str, row: QRectF, label_width: int) -> None:
        painter.setPen(theme.colour("muted"))
        text = painter.fontMetrics().elidedText(name, Qt.TextElideMode.ElideMiddle, label_width - 8)
        painter.drawText(QRectF(0, row.top(), label_width, ROW_PX), Qt.AlignmentFlag.AlignVCenter, text)
        first = self._predicted if self._predicted is not None else self._captured
        value = float((first or {}).get(name, 0.0))
        track = QRectF(label_width, row.top() + 6, row.width() - label_width - 38, 8)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(theme.colour("raised"))
        painter.drawRoundedRect(track, 3, 3)
        painter.setBrush(theme.colour("figure"))
        filled = QRectF(track)
        filled.setWidth(track.width() * min(max(value, 0.0), 1.0))
        if filled.width() > 1:
            painter.drawRoundedRect(filled, 3, 3)
        if self._predicted is not None and self._captured is not None and name in self._captured:
            x = track.left() + track.width() * min(max(self._captured[name], 0.0), 1.0)
            painter.setBrush(theme.colour("ghost"))
            painter.drawRect(QRectF(x - 1, track.top() - 3, 2.5, track.height() + 6))
        painter.setPen(theme.colour("text"))
        box = QRectF(row.right() - 34, row.top(), 34, ROW_PX)
        painter.drawText(box, Qt.AlignmentFlag.AlignVCenter | Qt.AlignmentFlag.AlignRight, f"{value:.2f}")
