"""The stick figure: a body in a room, moved at the display's rate, turned with the mouse."""

from __future__ import annotations

import time
from collections import deque
from dataclasses import replace

from PySide6.QtCore import QEvent, QPointF, QRectF, Qt, QTimer, Signal
from PySide6.QtGui import (
    QCloseEvent,
    QFocusEvent,
    QImage,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPen,
    QResizeEvent,
    QWheelEvent,
)
from PySide6.QtWidgets import QPushButton, QVBoxLayout, QWidget

from studio.actions import FIGURE
from studio.motion.avatar import Avatar
from studio.render.background import ROOM, Background
from studio.render.camera import FRAMINGS, Orbit
from studio.render.palette import Palette
from studio.render.scene import BODY, GHOST, RenderScene
from studio.render.world_pose import WorldPose
from studio.ui import theme
from studio.ui.shortcuts import pressed
from studio.ui.widgets.figure import sketch
from studio.ui.widgets.figure.picture import Detail, FigurePicture, background_image, draw_checkers, loaded
from studio.ui.widgets.figure.view_buttons import AROUND_PX, ViewButtons

FRAME_PX = 4
QUICK, QUICK_SHARE, SLOWEST_SHARE = 0.0125, 0.85, 0.5
"""Pictures may take this share of the GUI thread's time: those made within QUICK seconds hold up nobody and
reach the display's rate in software too; slow machines show fewer."""
MOST_PIXELS = 2_600_000
FINEST = 2
REST_MS, REST_COST = 300, 0.25
"""After which what stays is drawn once more in full; with smooth edges where that takes no longer (s)."""
TOO_SLOW, FAR_TOO_SLOW = 0.25, 2.0
"""Seconds a picture of an avatar may take; beyond, the stick figure of its proportions is drawn."""
_COSTS_KEPT, _COSTS_ENOUGH = 12, 3


class StickFigure(QWidget):
    """One figure, an optional ghost beside it in another colour, and the camera around them.

    `show_stance` may be called as often as one likes: the newest pose is drawn at the display's rate.
    Call `warm_up` while nothing else is going on; until then, and where OpenGL fails, lines are drawn.

    Signals:
        view_changed: the camera moved; carries an Orbit.
        empty_clicked: the button of the empty room.
        avatar_too_slow: the avatar's surfaces are left away from now on; with `keeps_avatar` they get coarse.
    """

    view_changed = Signal(object)
    empty_clicked = Signal()
    avatar_too_slow = Signal()

    def __init__(
        self,
        parent: QWidget | None = None,
        empty_text: str = "",
        empty_icon: str = "mdi6.human",
        empty_button: str = "",
    ) -> None:
        super().__init__(parent)
        self.setObjectName("stick_figure")
        self.setAccessibleName(self.tr("Stick figure"))
        self.setMinimumSize(160, 160)
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent)
        self.orbit = Orbit()
        self.view_buttons_shown = True
        """False where a tab offers one set of view buttons for several figures."""
        self.keeps_avatar = self._slow_told = False
        """Set where others watch: an avatar that takes too long gets coarse, and never a stick figure."""
        self.renders = 0
        """Pictures made so far; for measuring."""
        self._scene: RenderScene | None = None
        self._scene_failed = self._disposed = False
        self._stance: WorldPose | None = None
        self._ghost: WorldPose | None = None
        self._avatar: Avatar | None = None
        self._costs: deque[float] = deque(maxlen=_COSTS_KEPT)
        self._detail = Detail()
        self._picture: FigurePicture | None = None
        self._shown: tuple[WorldPose | None, WorldPose | None] = (None, None)
        """What the picture was made of."""
        self.background = ROOM
        self.checkered = True
        """False where a transparent background is to be seen through, and not shown by a board."""
        self.empty_text, self._empty_icon = empty_text or self.tr("No motion to show yet."), empty_icon
        self.rolling = self._ring = False
        self.caption = self.overlay = ""
        self._last_cost = 0.0
        self._next = QTimer(self)
        self._next.setSingleShot(True)
        self._next.setTimerType(Qt.TimerType.PreciseTimer)
        self._next.timeout.connect(self._draw_picture)
        self._last_drawn = 0.0
        self._rest = QTimer(self)
        self._rest.setSingleShot(True)
        self._rest.setInterval(REST_MS)
        self._rest.timeout.connect(self._draw_finely)
        self._token, self._close = "figure", False
        self._drag_from: QPointF | None = None
        self.empty_button = QPushButton(empty_button, self)
        self.empty_button.setObjectName("figure_empty_button")
        self.empty_button.clicked.connect(self.empty_clicked)
        theme.as_role(self.empty_button, "primary")
        self._add_view_buttons()

    # What is shown

    @property
    def stance(self) -> WorldPose | None:
        """How the performer stands; None until something was shown."""
        return self._stance

    def show_stance(self, stance: WorldPose) -> None:
        """Show a performer, as the avatar where the stance has turns and an avatar is worn."""
        if stance.usable:
            self._stance = stance
            self._request_if(stance, self._shown[0])

    def show_ghost_stance(self, stance: WorldPose | None) -> None:
        """Show a second performer in another colour; None hides it."""
        self._ghost = stance if stance is not None and stance.usable else None
        self._request_if(self._ghost, self._shown[1])

    def set_avatar(self, avatar: Avatar | None) -> None:
        """Draw an avatar instead of the stick figure; None for the stick figure."""
        if avatar is not self._avatar:
            self._avatar = avatar
            self._slow_told = False
            self._costs.clear()
            self._detail.begin_anew()
            self._request()

    def set_token(self, token: str) -> None:
        """Draw the stick figure in another colour: "figure" for predicted, "ghost" for captured."""
        if token != self._token:
            self._token = token
            if self._scene is not None:
                self._scene.set_palette(self._palette())
            self._request()

    def set_background(self, background: Background) -> None:
        """What is behind the performer."""
        if background != self.background:
            self.background = background
            self._request()

    @property
    def avatar(self) -> Avatar | None:
        """The avatar shown, without surfaces and face where drawing them takes too long."""
        return self._avatar

    @property
    def picture(self) -> QImage | None:
        """The picture that OpenGL made last; None where the lines are drawn instead."""
        return self._picture.image if self._picture is not None else None

    @property
    def drawing_soon(self) -> bool:
        """Whether another picture has been asked for, or a finer one of what rests."""
        return self._next.isActive() or self._rest.isActive()

    def clear(self, sentence: str = "", icon: str = "") -> None:
        """Show an empty room with a sentence, the last one where none is given."""
        self.empty_text = sentence or self.empty_text
        self._empty_icon = icon or self._empty_icon
        self._stance = self._ghost = self._picture = None
        self._shown = (None, None)
        self._update_buttons()
        self.update()

    @property
    def empty(self) -> bool:
        """Whether no pose is shown."""
        return self._stance is None

    def set_rolling(self, rolling: bool) -> None:
        """Put the red frame around the picture, or take it away."""
        if rolling != self.rolling:
            self.rolling = rolling
            self.update()

    def set_caption(self, text: str) -> None:
        """A word in the upper left corner, e.g. "Captured"."""
        if text != self.caption:
            self.caption = text
            self.update()

    def set_overlay(self, text: str) -> None:
        """A large word over the middle, e.g. a countdown's "3"; "" takes it away."""
        if text != self.overlay:
            self.overlay = text
            self.update()

    # The camera

    def set_view(self, name: str) -> None:
        """Look from "front", "three_quarter" or "side", or frame "face", "bust" or "body"."""
        self.set_orbit(self.orbit.framed(name) if name in FRAMINGS else Orbit.preset(name, self.orbit.zoom))

    @property
    def seen(self) -> Orbit:
        """The camera of the picture: close, where a face has no body and the whole of it would be shown."""
        return self.orbit.framed("face") if self._close and self.orbit.framing == "body" else self.orbit

    def set_close(self, close: bool) -> None:
        """Whether only the face moves: nobody needs to see a body that rests."""
        if close != self._close:
            self._close = close
            self._views.show_orbit(self.seen)
            self._request()

    def set_orbit(self, orbit: Orbit) -> None:
        """Look from somewhere; two figures side by side share one through `view_changed`."""
        if orbit != self.orbit:
            self.orbit = orbit
            self._views.show_orbit(self.seen)
            self.view_changed.emit(orbit)
            self._request()

    # OpenGL

    @property
    def warm(self) -> bool:
        """Whether pictures come from OpenGL."""
        return self._scene is not None

    @property
    def getting_ready(self) -> bool:
        """Whether an avatar is worn that OpenGL has yet to draw: nobody else stands in for it."""
        worn = self._avatar is not None and bool(self._avatar.surfaces)
        return worn and self._picture is None and not (self._scene_failed or self._disposed)

    def warm_up(self) -> None:
        """Load pyvista on another thread and make the first picture; blocks the GUI once for that picture.

        Call when the window is shown and nothing is being recorded.
        """
        if self._scene is not None or self._scene_failed or self._disposed:
            return
        if not loaded():
            QTimer.singleShot(100, self, self.warm_up)
            return
        try:
            self._scene = RenderScene(self._palette())
            self._scene.warm_up(max(self.width(), 8), max(self.height(), 8))
        except (ImportError, RuntimeError, OSError, AttributeError, ValueError):
            # No OpenGL here: the lines stay, and `saia doctor` says why.
            self._scene, self._scene_failed = None, True
        self._request()

    def dispose(self) -> None:
        """Free the OpenGL context, once, before the widget goes."""
        self._disposed = True
        self._next.stop()
        self._rest.stop()
        if self._scene is not None:
            self._scene.close()
            self._scene = self._picture = None

    # Qt

    def closeEvent(self, event: QCloseEvent) -> None:
        self.dispose()
        super().closeEvent(event)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._detail.begin_anew()
        self._place_empty_button()
        self._request()

    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        if event.type() == QEvent.Type.PaletteChange and not self._disposed:
            if self._scene is not None:
                self._scene.set_palette(self._palette())
            self._request()

    def focusInEvent(self, event: QFocusEvent) -> None:
        """Show the focus ring only to those who walk with the Tab key."""
        reasons = (Qt.FocusReason.TabFocusReason, Qt.FocusReason.BacktabFocusReason)
        self._ring = event.reason() in reasons
        super().focusInEvent(event)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        if event.button() == Qt.MouseButton.LeftButton:
            self._drag_from = event.position()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        if self._drag_from is not None:
            moved = event.position() - self._drag_from
            self._drag_from = event.position()
            self.set_orbit(self.orbit.turned(-moved.x() * 0.5, moved.y() * 0.4))

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        self._drag_from = None

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        self.set_orbit(Orbit())

    def wheelEvent(self, event: QWheelEvent) -> None:
        self.set_orbit(self.orbit.zoomed(0.999 ** event.angleDelta().y()))
        event.accept()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        turns = {"turn_left": (-8.0, 0.0), "turn_right": (8.0, 0.0), "turn_up": (0.0, 5.0),
                 "turn_down": (0.0, -5.0)}  # fmt: skip
        zooms = {"figure_closer": 0.9, "figure_further": 1 / 0.9}
        action = pressed(event, FIGURE)
        # With a modifier the arrows step through the take, also while the figure has the keyboard.
        if action in turns and not event.modifiers():
            self.set_orbit(self.orbit.turned(*turns[action]))
        elif action in zooms:
            self.set_orbit(self.orbit.zoomed(zooms[action]))
        else:
            super().keyPressEvent(event)

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        rect = QRectF(self.rect())
        if self._stance is None:
            sketch.draw_ground(painter, rect)
            sketch.draw_nobody(painter, rect, self._empty_icon, self._symbol_side(), self.empty_text)
        else:
            if self.background.is_clear and self.checkered:
                draw_checkers(painter, rect, theme.colour("surface"), theme.colour("raised"))
            if self._picture is not None:
                self._picture.paint(painter, rect)
            else:
                self._paint_behind(painter, rect)
                if self.getting_ready and self.keeps_avatar:
                    pass  # viewers read nothing of ours
                elif self.getting_ready:
                    words = self.tr("Getting ready…")
                    sketch.draw_nobody(painter, rect, self._empty_icon, self._symbol_side(), words)
                else:
                    self._paint_sketch(painter, rect)
        if self.caption:
            painter.setFont(theme.ui_font(semibold=True))
            room = (self._views.left if self._views.isVisible() else self.width()) - 28
            metrics = painter.fontMetrics()
            words = metrics.elidedText(self.caption, Qt.TextElideMode.ElideRight, max(room, 60))
            # On a ground of its own: a head may reach up behind it.
            behind = QRectF(8, 10, metrics.horizontalAdvance(words) + 12, 26)
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(theme.colour("ground", 190))
            painter.drawRoundedRect(behind, 6, 6)
            painter.setPen(theme.colour("text"))
            painter.drawText(QPointF(14, 28), words)
        if self.overlay:
            painter.fillRect(rect, theme.colour("ground", 120))
            painter.setFont(theme.figures_font(min(int(rect.height() * 0.35), 180), semibold=True))
            painter.setPen(theme.colour("text"))
            painter.drawText(rect, int(Qt.AlignmentFlag.AlignCenter), self.overlay)
        edge = "record" if self.rolling else ("accent" if self._ring and self.hasFocus() else "")
        if edge:
            width = FRAME_PX if self.rolling else 1
            painter.setPen(QPen(theme.colour(edge), width))
            inset = width / 2
            painter.drawRect(rect.adjusted(inset, inset, -inset, -inset))
        painter.end()

    def _paint_behind(self, painter: QPainter, rect: QRectF) -> None:
        if self.background.is_room:
            sketch.draw_ground(painter, rect)
        elif not self.background.is_clear:
            size = (self.width(), self.height())
            painter.drawImage(rect, background_image(self.background, size, theme.colours()))

    def _paint_sketch(self, painter: QPainter, rect: QRectF) -> None:
        for stance, token in ((self._ghost, "ghost"), (self._stance, self._token)):
            if stance is not None:
                worn = stance.retargeted_to(self._avatar) if self._avatar is not None else stance
                sketch.draw_figure(painter, rect, self.orbit, worn.skeleton, worn.joints, token)

    def _symbol_side(self) -> int:
        return int(min(max(min(self.width(), self.height()) * 0.3, 56), 120))

    def _place_empty_button(self) -> None:
        size = self.empty_button.sizeHint()
        top = self.height() / 2 + self._symbol_side() * 0.15 + 16 + 64
        self.empty_button.resize(size)
        self.empty_button.move((self.width() - size.width()) // 2, int(top))

    # Pictures

    def _palette(self) -> Palette:
        colours = theme.colours()
        return colours if self._token == "figure" else replace(colours, figure=colours.ghost)

    def _request_if(self, pose: WorldPose | None, shown: WorldPose | None) -> None:
        """Ask for a new picture where a pose looks otherwise than the one that is seen."""
        if pose is None or shown is None:
            alike = pose is shown
        else:
            alike = pose.looks_like(shown, self._avatar is not None)
        if not alike or self._picture is None:
            self._request()

    def _request(self) -> None:
        """Ask for a new picture, soon enough for the display and late enough for everyone else."""
        if self._disposed or self._next.isActive():
            return
        share = QUICK_SHARE if self._last_cost < QUICK else SLOWEST_SHARE
        wait = self._last_cost * (1 / share - 1) - (time.perf_counter() - self._last_drawn)
        self._next.start(max(0, int(wait * 1000)))

    def _draw_finely(self) -> None:
        """Nothing moves any more: draw the same picture in full, once, however coarse it was."""
        if not self._next.isActive():
            self._draw_picture(resting=True)

    def _draw_picture(self, resting: bool = False) -> None:
        self._update_buttons()
        if self._stance is None or self._scene is None or not self.isVisible():
            self.update()
            return
        started = time.perf_counter()
        self._scene.set_avatar(self._avatar)
        self._scene.place(BODY, self._stance)
        if self._ghost is not None:
            self._scene.place(GHOST, self._ghost)
        else:
            self._scene.hide(GHOST)
        ratio, share = self.devicePixelRatioF(), self._detail.share
        pixels = self.width() * self.height() * ratio * ratio
        ratio *= min(1.0, (MOST_PIXELS / max(pixels, 1.0)) ** 0.5) * (1.0 if resting else min(share, 1.0))
        size = max(int(self.width() * ratio), 8), max(int(self.height() * ratio), 8)
        if self._picture is None:
            self._picture = FigurePicture(self._scene)
        smooth = self._last_cost * (FINEST / share) ** 2 < REST_COST if resting else share > 1.0
        finer = FINEST if smooth and pixels < MOST_PIXELS else 1
        part = self._picture.draw(self.seen, size, finer, self.background, self._palette(), resting)
        self._shown = (self._stance, self._ghost)
        self.renders += 1
        if not resting:
            self._last_drawn = time.perf_counter()
            self.note_cost(self._last_drawn - started)
            # Each picture puts it off: while a performer moves it never comes.
            if finer < FINEST:
                self._rest.start()
        self.update(self._picture.in_widget(part, (self.width(), self.height())))

    def note_cost(self, seconds: float) -> None:
        """A picture took this long: draw less often or less, where that is too slow."""
        self._last_cost = seconds
        self._detail.saw(seconds)
        if self._avatar is None or not self._avatar.surfaces:
            return
        self._costs.append(seconds)
        # The quickest of them counts: a computer that is held up by something else for a while is not slow.
        quickest = min(self._costs)
        always = len(self._costs) == _COSTS_KEPT and quickest > TOO_SLOW
        if always or (len(self._costs) >= _COSTS_ENOUGH and quickest > FAR_TOO_SLOW):
            if self.keeps_avatar:
                self._costs.clear()
                self._detail.go_coarsest()
                if self._slow_told:
                    return
            else:
                self.set_avatar(replace(self._avatar, surfaces=(), expressions=()))
            self._slow_told = True
            self.avatar_too_slow.emit()

    # Buttons over the picture

    def add_tool(self, tool: QWidget) -> None:
        """Put one more button beside those of the views."""
        self._views.add_tool(tool)
        self._update_buttons()

    def _add_view_buttons(self) -> None:
        self._views = ViewButtons(self)
        self._views.chosen.connect(self._on_view)
        column = QVBoxLayout(self)
        column.setContentsMargins(AROUND_PX, AROUND_PX, AROUND_PX, AROUND_PX)
        column.addWidget(self._views)
        column.addStretch(1)
        self._views.show_orbit(self.seen)
        self._update_buttons()

    def _on_view(self, name: str) -> None:
        self.set_view(name)
        self._views.show_orbit(self.seen)

    def _update_buttons(self) -> None:
        self._views.show_in(self.width(), self._stance is not None and self.view_buttons_shown)
        self.empty_button.setVisible(self._stance is None and bool(self.empty_button.text()))
