"""The timeline: sound, motion, labels and problems under one playhead.

The lanes are painted once into a picture; while only the playhead moves, two narrow strips are repainted
from it. That is why this is no pyqtgraph scene, which paints whole curves again under a moving line.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from PySide6.QtCore import QEvent, QPoint, QRect, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QHelpEvent, QMouseEvent, QPainter, QPaintEvent, QPixmap, QResizeEvent, QWheelEvent
from PySide6.QtWidgets import QToolTip, QWidget

from studio.dataset import Label
from studio.ui import theme
from studio.ui.widgets import timeline_drag as drags
from studio.ui.widgets import timeline_paint as paint
from studio.ui.widgets.label_editor import LabelEditor
from studio.ui.widgets.time_view import TimeView
from studio.ui.widgets.timeline_content import Curve, LabelEdit, Lane, Mark, PeakSource, Span, lay_out

GUTTER = 92
HANDLE_PX = 6
ZOOM_STEP = 1.25


class Timeline(QWidget):
    """One recording over time.

    Signals:
        seek_requested: the moment clicked or scrubbed to, seconds.
        in_out_changed: the in and out points after a handle was dragged, (start, end) seconds.
        label_edited: a LabelEdit: a label was added, moved, renamed or removed by hand.
        label_chosen: the label clicked, or None.
        span_selected: the span dragged over, (start, end) seconds, or None.
        problem_chosen: the Mark that was clicked.
        view_changed: another stretch of time is shown.
    """

    seek_requested = Signal(float)
    in_out_changed = Signal(object)
    label_edited = Signal(object)
    label_chosen = Signal(object)
    span_selected = Signal(object)
    problem_chosen = Signal(object)
    view_changed = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("timeline")
        self.setAccessibleName(self.tr("Timeline"))
        self.setMouseTracking(True)
        self.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        self.setMinimumHeight(140)
        self._view = TimeView()
        self._sound: PeakSource | None = None
        self._silent = ""
        self._curves: dict[str, Curve] = {}
        self._labels: tuple[Label, ...] = ()
        self._tiers: tuple[str, ...] = ()
        self._tier_titles: dict[str, str] = {}
        self._problems: tuple[Mark, ...] = ()
        self._heat: tuple[np.ndarray, np.ndarray] | None = None
        self._excluded: tuple[Span, ...] = ()
        self._in_out: Span = (0.0, 0.0)
        self._handles = False
        self._span: Span | None = None
        self._loop: Span | None = None
        self._cuts: tuple[float, ...] = ()
        self._playhead = 0.0
        self._chosen: Label | None = None
        self._vocabulary: tuple[str, ...] = ()
        self._picture: QPixmap | None = None
        self._drag: drags.Drag | None = None
        self._editor: LabelEditor | None = None

    # -- what it shows -------------------------------------------------------------------------

    def set_duration(self, duration: float) -> None:
        """Start over with a recording of this length in seconds, wholly in view, and nothing on it."""
        self._close_editor(keep=False)
        self._view = TimeView(duration, 0.0, 1.0, self._view.width).fitted()
        self._in_out, self._handles = (0.0, duration), False
        self._span = self._loop = self._chosen = self._drag = None
        self._playhead = 0.0
        self._sound, self._heat, self._silent = None, None, ""
        self._curves, self._labels, self._problems, self._excluded, self._cuts = {}, (), (), (), ()
        self._repaint_all()
        self.view_changed.emit()

    def set_sound(self, source: PeakSource | None, silent: str = "") -> None:
        """The waveform; None where there is none, with a sentence in its place ("No sound" if left out)."""
        self._sound = source
        self._silent = silent or self.tr("No sound")
        self._repaint_all()

    def set_curves(self, curves: Mapping[str, tuple[np.ndarray, np.ndarray, int]]) -> None:
        """Motion curves by name: times in seconds (T,), values (T,), index of the data colour."""
        self._curves = {
            name: Curve(np.asarray(t, dtype=np.float64), np.asarray(v, dtype=np.float64), colour)
            for name, (t, v, colour) in curves.items()
        }
        self._repaint_all()

    def set_tiers(self, tiers: Mapping[str, str]) -> None:
        """The label lanes that are always there: tier and the name shown for it."""
        self._tier_titles = dict(tiers)
        self._update_tiers()

    def set_labels(self, labels: Sequence[Label]) -> None:
        """All labels of the recording; a tier not named before gets a lane of its own."""
        self._labels = tuple(labels)
        if self._chosen not in self._labels:
            self._chosen = None
        self._update_tiers()

    def set_vocabulary(self, words: Sequence[str]) -> None:
        """Words offered while a label is typed."""
        self._vocabulary = tuple(words)

    def set_problems(self, problems: Sequence[Mark]) -> None:
        """What is wrong, and where."""
        new = tuple(sorted(problems, key=lambda mark: mark.t))
        if new != self._problems:
            self._problems = new
            self._repaint_all()

    def set_heat(self, times: np.ndarray | None, values: np.ndarray | None = None) -> None:
        """A strip of colour under the sound: values 0..1 at times in seconds; None takes it away."""
        heat = times is not None and values is not None
        self._heat = (np.asarray(times), np.asarray(values)) if heat else None
        self._repaint_all()

    def set_excluded(self, spans: Sequence[Span]) -> None:
        """Spans that are left out, hatched."""
        self._excluded = tuple(spans)
        self._repaint_all()

    def set_in_out(self, in_out: Span | None) -> None:
        """In and out points in seconds, with their handles; None takes the handles away."""
        self._handles = in_out is not None
        self._in_out = in_out or (0.0, self._view.duration)
        self.update()

    def set_span(self, span: Span | None) -> None:
        """The selected span."""
        self._span = span
        self.update()

    def set_loop(self, loop: Span | None) -> None:
        """The span being repeated."""
        self._loop = loop
        self.update()

    def set_cuts(self, moments: Sequence[float]) -> None:
        """Where the recording would be cut: a preview."""
        self._cuts = tuple(moments)
        self.update()

    def set_playhead(self, t: float, follow: bool = False) -> None:
        """Move the playhead; with `follow` the view turns the page when it leaves."""
        before, self._playhead = self._playhead, t
        if follow and self._drag is None:
            view = self._view.following(t)
            if view is not self._view:
                self._set_view(view)
                return
        self.update(self._playhead_strip(before))
        self.update(self._playhead_strip(t))

    @property
    def playhead(self) -> float:
        """Seconds."""
        return self._playhead

    @property
    def in_out(self) -> Span:
        """In and out points in seconds."""
        return self._in_out

    @property
    def span(self) -> Span | None:
        """The selected span, or None."""
        return self._span

    @property
    def chosen_label(self) -> Label | None:
        """The label that was clicked last, or None."""
        return self._chosen

    @property
    def view(self) -> TimeView:
        """The stretch of time shown; its width is without the gutter."""
        return self._view

    # -- where it looks ------------------------------------------------------------------------

    def zoom(self, factor: float, x: float | None = None) -> None:
        """Closer (factor < 1) or wider around a pixel, or around the playhead where it is seen."""
        if x is None:
            head = self._view.x(self._playhead)
            x = head if 0 <= head <= self._view.width else self._view.width / 2
        self._set_view(self._view.zoomed(factor, x))

    def fit(self) -> None:
        """Show the whole recording."""
        self._set_view(self._view.fitted())

    def show_span(self, start: float, end: float) -> None:
        """Show this stretch of time."""
        self._set_view(self._view.showing(start, end))

    def x_of(self, t: float) -> float:
        """The widget's pixel of a moment."""
        return GUTTER + self._view.x(t)

    def lane(self, kind: str, tier: str = "") -> Lane | None:
        """The lane of a kind ("sound", "motion", "labels", ...), or None."""
        return next((one for one in self._lanes() if one.kind == kind and tier in ("", one.tier)), None)

    # -- labels by hand ------------------------------------------------------------------------

    def show_moved_label(self, before: Label, after: Label) -> None:
        """Draw one label elsewhere while it is dragged."""
        self._labels = tuple(after if label == before else label for label in self._labels)
        if self._chosen == before:
            self._chosen = after
        self._repaint_all()

    def edit_label(self, label: Label, new: bool = False) -> None:
        """Let the label's text be typed in its place; Enter keeps, Escape drops."""
        self._close_editor()
        lane = self.lane("labels", label.tier)
        if lane is None:
            return
        rect = paint.label_rect(label, lane, GUTTER, self._view).toRect()
        editor = LabelEditor(label.text, self._vocabulary, self)
        left = min(max(rect.left(), GUTTER), max(self.width() - 150, GUTTER))
        editor.setGeometry(left, lane.top, max(min(rect.width(), 320), 150), lane.height)
        editor.closed.connect(lambda keep: self._on_editor_closed(editor, label, new, keep))
        editor.selectAll()
        editor.show()
        editor.setFocus()
        self._editor = editor

    def _on_editor_closed(self, editor: LabelEditor, label: Label, new: bool, keep: bool) -> None:
        self._editor = None
        text = editor.text().strip()
        editor.hide()
        editor.deleteLater()
        self.setFocus()
        after = Label(label.t, label.duration, label.tier, text) if text else None
        before = None if new else label
        if keep and after != before:
            self.label_edited.emit(LabelEdit(before, after))

    def _close_editor(self, keep: bool = True) -> None:
        if self._editor is not None:
            self._editor.finish(keep)

    # -- mouse ---------------------------------------------------------------------------------

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Begin what the place under the mouse is for."""
        self._close_editor()
        x, y = event.position().x(), event.position().y()
        if self._view.duration <= 0 or x < GUTTER - HANDLE_PX:
            return
        if event.button() == Qt.MouseButton.MiddleButton:
            self._drag = drags.Pan(self, x - GUTTER)
        elif event.button() == Qt.MouseButton.LeftButton:
            shift = bool(event.modifiers() & Qt.KeyboardModifier.ShiftModifier)
            self._drag = self._begin(x, y, shift)
            if isinstance(self._drag, (drags.Scrub, drags.PanOverview)):
                self._drag.move(self._t(x), x - GUTTER)

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Go on with what was begun, or show what could be."""
        x, y = event.position().x(), event.position().y()
        if self._drag is not None:
            self._drag.move(self._t(x), x - GUTTER)
            return
        over_label = self._label_at(x, y)
        if self._handle_at(x, y) is not None or (over_label and self._part_of(over_label, x) != "all"):
            self.setCursor(Qt.CursorShape.SizeHorCursor)
        else:
            self.unsetCursor()

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """End what was begun."""
        drag, self._drag = self._drag, None
        if drag is not None:
            drag.end()

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """Type a label's text, or begin a new label on an empty place of a tier."""
        x, y = event.position().x(), event.position().y()
        lane = self._lane_at(y)
        if lane is None or lane.kind != "labels" or x < GUTTER:
            return
        self._drag = None
        label = self._label_at(x, y)
        if label is not None:
            self.edit_label(label)
        else:
            start, end = self._span or (self._t(x), self._t(x))
            self.edit_label(Label(start, end - start, lane.tier, ""), new=True)

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Zoom at the mouse; sideways or with Shift, pan."""
        dx, dy = event.angleDelta().x(), event.angleDelta().y()
        if event.modifiers() & Qt.KeyboardModifier.ShiftModifier:
            dx, dy = dx or dy, 0
        if abs(dx) > abs(dy):
            self._set_view(self._view.panned(-dx / 120 * self._view.span * 0.1))
        elif dy:
            self._set_view(self._view.zoomed(ZOOM_STEP ** (-dy / 120), event.position().x() - GUTTER))
        event.accept()

    def event(self, event: QEvent) -> bool:
        """Show a problem's sentence, or a long label's text, under a resting mouse."""
        if event.type() == QEvent.Type.ToolTip and isinstance(event, QHelpEvent):
            self._show_tip(event.pos(), event.globalPos())
            return True
        return super().event(event)

    def _begin(self, x: float, y: float, shift: bool) -> drags.Drag | None:
        lane, t = self._lane_at(y), self._t(x)
        handle = self._handle_at(x, y)
        if handle is not None:
            return drags.MoveHandle(self, handle)
        if lane is None:
            return None
        if lane.kind == "overview":
            return drags.PanOverview(self)
        if lane.kind == "ruler":
            return drags.Scrub(self)
        label = self._label_at(x, y)
        if lane.kind == "labels":
            self._choose(label)
            if label is not None:
                return drags.MoveLabel(self, label, self._part_of(label, x), t, x - GUTTER)
        mark = self._mark_at(x, y)
        if mark is not None:
            self.problem_chosen.emit(mark)
            return None
        if shift and lane.kind in ("sound", "motion", "heat"):
            return drags.SelectSpan(self, self._far_end(t), -10 * drags.CLICK_PX)
        return drags.SelectSpan(self, t, x - GUTTER)

    def _far_end(self, t: float) -> float:
        """The end of the selection that a Shift-click at t leaves where it is."""
        start, end = self._span or (self._playhead, self._playhead)
        return end if abs(t - start) < abs(t - end) else start

    def _choose(self, label: Label | None) -> None:
        if label != self._chosen:
            self._chosen = label
            self._repaint_all()
        self.label_chosen.emit(label)

    def _show_tip(self, place: QPoint, screen: QPoint) -> None:
        mark, label = self._mark_at(place.x(), place.y()), self._label_at(place.x(), place.y())
        text = mark.text if mark else label.text if label else ""
        QToolTip.showText(screen, text, self)

    def _t(self, x: float) -> float:
        return self._view.clamped(self._view.t(x - GUTTER))

    def _lane_at(self, y: float) -> Lane | None:
        return next((lane for lane in self._lanes() if lane.top <= y < lane.bottom), None)

    def _handle_at(self, x: float, y: float) -> int | None:
        lane = self._lane_at(y)
        if not self._handles or lane is None or lane.kind not in ("ruler", "sound", "motion", "heat"):
            return None
        near = [(abs(x - self.x_of(t)), i) for i, t in enumerate(self._in_out)]
        distance, which = min(near)
        # On the ruler the handles' flags are wide; below only their lines can be taken.
        reach = HANDLE_PX * 2 if lane.kind == "ruler" else HANDLE_PX / 2
        return which if distance <= reach else None

    def _label_at(self, x: float, y: float) -> Label | None:
        lane = self._lane_at(y)
        if lane is None or lane.kind != "labels" or x < GUTTER:
            return None
        inside = [
            label
            for label in self._labels
            if label.tier == lane.tier
            and paint.label_rect(label, lane, GUTTER, self._view).adjusted(-2, -2, 2, 2).contains(x, y)
        ]
        return inside[-1] if inside else None

    def _part_of(self, label: Label, x: float) -> str:
        lane = self.lane("labels", label.tier)
        if lane is None or label.duration <= 0:
            return "all"
        rect = paint.label_rect(label, lane, GUTTER, self._view)
        if rect.width() > 3 * HANDLE_PX and x < rect.left() + HANDLE_PX:
            return "start"
        return "end" if rect.width() > 3 * HANDLE_PX and x > rect.right() - HANDLE_PX else "all"

    def _mark_at(self, x: float, y: float) -> Mark | None:
        lane = self.lane("problems")
        if lane is None:
            return None
        under = (m for m in self._problems if paint.mark_rect(m, lane, GUTTER, self._view).contains(x, y))
        return next(under, None)

    # -- painting ------------------------------------------------------------------------------

    def sizeHint(self) -> QSize:
        """Wide and not tall."""
        return QSize(900, 260)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Keep the seconds in view on the new width."""
        self._close_editor()
        self._view = self._view.resized(self.width() - GUTTER - 2)
        self._repaint_all()
        self.view_changed.emit()

    def changeEvent(self, event: QEvent) -> None:
        """Repaint in the colours of another theme."""
        if event.type() == QEvent.Type.PaletteChange:
            self._repaint_all()
        super().changeEvent(event)

    def paintEvent(self, event: QPaintEvent) -> None:
        """Copy the dirty part of the picture and paint what moves above it."""
        if self._picture is None or self._picture.devicePixelRatioF() != self.devicePixelRatioF():
            self._picture = self._paint_picture()
        painter = QPainter(self)
        ratio = self._picture.devicePixelRatioF()
        dirty = QRectF(event.rect())
        source = QRectF(dirty.topLeft() * ratio, dirty.size() * ratio)
        painter.drawPixmap(dirty, self._picture, source)
        if self._view.duration > 0:
            painter.setClipRect(QRect(GUTTER - 7, 0, self.width() - GUTTER + 7, self.height()))
            self._paint_above(painter)
        painter.end()

    def _paint_picture(self) -> QPixmap:
        ratio = self.devicePixelRatioF()
        picture = QPixmap(self.size() * ratio)
        picture.setDevicePixelRatio(ratio)
        picture.fill(theme.colour("surface"))
        painter = QPainter(picture)
        for lane in self._lanes():
            self._paint_gutter(painter, lane)
            painter.save()
            painter.setClipRect(QRectF(GUTTER, lane.top, self._view.width, lane.height))
            self._paint_lane(painter, lane)
            painter.restore()
        spread = self._spread()
        painter.setClipRect(QRectF(GUTTER, 0, self._view.width, self.height()))
        paint.paint_excluded(painter, spread, GUTTER, self._view, self._excluded)
        painter.end()
        return picture

    def _paint_lane(self, painter: QPainter, lane: Lane) -> None:
        if self._view.duration <= 0 and lane.kind != "sound":
            return
        if lane.kind == "ruler":
            paint.paint_ruler(painter, lane, GUTTER, self._view)
        elif lane.kind == "sound":
            silent = self._silent if self._view.duration > 0 else ""
            paint.paint_sound(painter, lane, GUTTER, self._view, self._sound, silent)
        elif lane.kind == "heat" and self._heat is not None:
            paint.paint_heat(painter, lane, GUTTER, self._view, *self._heat)
        elif lane.kind == "motion":
            paint.paint_curves(painter, lane, GUTTER, self._view, self._curves)
        elif lane.kind == "labels":
            paint.paint_labels(painter, lane, GUTTER, self._view, self._labels, self._chosen)
        elif lane.kind == "problems":
            paint.paint_problems(painter, lane, GUTTER, self._view, self._problems)
        elif lane.kind == "overview":
            paint.paint_overview(painter, lane, GUTTER, self._view)

    def _paint_gutter(self, painter: QPainter, lane: Lane) -> None:
        names = {
            "sound": self.tr("Sound"), "motion": self.tr("Motion"), "problems": self.tr("Problems"),
            "labels": self._tier_titles.get(lane.tier, lane.tier), "heat": self.tr("Error"),
        }  # fmt: skip
        if lane.kind in names and self._view.duration > 0:
            legend = self._curves if lane.kind == "motion" else {}
            paint.paint_gutter(painter, lane, GUTTER, names[lane.kind], legend)

    def _paint_above(self, painter: QPainter) -> None:
        lanes, spread, view = self._lanes(), self._spread(), self._view
        if self._handles:
            paint.paint_outside(painter, spread, GUTTER, view, self._in_out)
        if self._span is not None:
            paint.paint_span(painter, spread, GUTTER, view, self._span, 50)
        if self._loop is not None:
            edge = float(lanes[0].bottom)
            paint.paint_span(painter, (edge - 5, edge), GUTTER, view, self._loop, 200)
        paint.paint_cuts(painter, spread, GUTTER, view, self._cuts)
        if self._handles:
            paint.paint_handles(painter, spread[1], GUTTER, view, self._in_out)
        paint.paint_playhead(painter, spread[1], self.x_of(self._playhead))

    def _playhead_strip(self, t: float) -> QRect:
        return QRect(round(self.x_of(t)) - 8, 0, 17, self.height())

    def _spread(self) -> tuple[float, float]:
        """Top of the sound and bottom of the last lane above the overview."""
        lanes = self._lanes()
        return float(lanes[0].bottom), float(lanes[-2].bottom)

    def _lanes(self) -> tuple[Lane, ...]:
        if self._lanes_now is None:
            self._lanes_now = lay_out(
                self.height(),
                self._tiers,
                curves=bool(self._curves),
                problems=bool(self._problems),
                heat=self._heat is not None,
            )
        return self._lanes_now

    _lanes_now: tuple[Lane, ...] | None = None

    def _update_tiers(self) -> None:
        others = sorted({label.tier for label in self._labels} - set(self._tier_titles))
        self._tiers = (*self._tier_titles, *others)
        self._repaint_all()

    def _set_view(self, view: TimeView) -> None:
        if view != self._view:
            self._close_editor()
            self._view = view
            self._repaint_all()
            self.view_changed.emit()

    def _repaint_all(self) -> None:
        self._picture = self._lanes_now = None
        self.update()
