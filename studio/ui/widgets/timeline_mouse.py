"""What lies under the mouse on a timeline, and what a press there begins."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import QPointF, Qt
from PySide6.QtGui import QMouseEvent

from studio.dataset import Label
from studio.ui.widgets import timeline_drag as drags
from studio.ui.widgets import timeline_paint as paint
from studio.ui.widgets.timeline_content import GUTTER, Lane, Mark

if TYPE_CHECKING:
    from studio.ui.widgets.timeline import Timeline

HANDLE_PX = 6


class TimelineMouse:
    """Finds what is under a place (pixels of the widget) and follows a press until it is let go."""

    def __init__(self, timeline: Timeline) -> None:
        self._timeline = timeline
        self.drag: drags.Drag | None = None

    def press(self, event: QMouseEvent) -> None:
        """Begin what the place under the mouse is for."""
        timeline = self._timeline
        x, y = event.position().x(), event.position().y()
        if timeline.view.duration <= 0 or x < GUTTER - HANDLE_PX:
            return
        if event.button() == Qt.MouseButton.MiddleButton:
            self.drag = drags.Pan(timeline, x - GUTTER)
        elif event.button() == Qt.MouseButton.LeftButton:
            shift = bool(event.modifiers() & Qt.KeyboardModifier.ShiftModifier)
            self.drag = self._begin(x, y, shift)
            if isinstance(self.drag, (drags.Scrub, drags.PanOverview)):
                self.drag.move(self.moment(x), x - GUTTER)

    def move(self, place: QPointF) -> None:
        """Go on with what was begun, or show what could be."""
        x, y = place.x(), place.y()
        if self.drag is not None:
            self.drag.move(self.moment(x), x - GUTTER)
            return
        label = self.label_at(x, y)
        if self._handle_at(x, y) is not None or (label and self._part_of(label, x) != "all"):
            self._timeline.setCursor(Qt.CursorShape.SizeHorCursor)
        else:
            self._timeline.unsetCursor()

    def release(self) -> None:
        """End what was begun."""
        drag, self.drag = self.drag, None
        if drag is not None:
            drag.end()

    def double_click(self, place: QPointF) -> None:
        """Type a label's text, or begin a new label on an empty place of a tier."""
        x, y = place.x(), place.y()
        lane = self._lane_at(y)
        if lane is None or lane.kind != "labels" or x < GUTTER:
            return
        self.drag = None
        label = self.label_at(x, y)
        if label is not None:
            self._timeline.edit_label(label)
        else:
            start, end = self._timeline.span or (self.moment(x), self.moment(x))
            self._timeline.edit_label(Label(start, end - start, lane.tier, ""), new=True)

    def tip_at(self, x: float, y: float) -> str:
        """What is said of the place under a resting mouse: a problem's sentence or a long label's text."""
        mark, label = self._mark_at(x, y), self.label_at(x, y)
        return mark.text if mark else label.text if label else ""

    def moment(self, x: float) -> float:
        """The moment under a pixel, inside the recording."""
        view = self._timeline.view
        return view.clamped(view.t(x - GUTTER))

    def label_at(self, x: float, y: float) -> Label | None:
        """The label there, the one painted last where several lie."""
        lane = self._lane_at(y)
        if lane is None or lane.kind != "labels" or x < GUTTER:
            return None
        inside = [
            label
            for label in self._timeline.content.labels
            if label.tier == lane.tier
            and paint.label_rect(label, lane, GUTTER, self._timeline.view)
            .adjusted(-2, -2, 2, 2)
            .contains(x, y)
        ]
        return inside[-1] if inside else None

    def _begin(self, x: float, y: float, shift: bool) -> drags.Drag | None:
        timeline, lane, t = self._timeline, self._lane_at(y), self.moment(x)
        handle = self._handle_at(x, y)
        if handle is not None:
            return drags.MoveHandle(timeline, handle)
        if lane is None:
            return None
        if lane.kind == "overview":
            return drags.PanOverview(timeline)
        if lane.kind == "ruler":
            return drags.Scrub(timeline)
        label = self.label_at(x, y)
        if lane.kind == "labels":
            timeline.choose_label(label)
            if label is not None:
                return drags.MoveLabel(timeline, label, self._part_of(label, x), t, x - GUTTER)
        mark = self._mark_at(x, y)
        if mark is not None:
            timeline.problem_chosen.emit(mark)
            return None
        if shift and lane.kind in ("sound", "motion", "heat"):
            return drags.SelectSpan(timeline, self._far_end(t), -10 * drags.CLICK_PX)
        return drags.SelectSpan(timeline, t, x - GUTTER)

    def _far_end(self, t: float) -> float:
        """The end of the selection that a Shift-click at t leaves where it is."""
        start, end = self._timeline.span or (self._timeline.playhead, self._timeline.playhead)
        return end if abs(t - start) < abs(t - end) else start

    def _lane_at(self, y: float) -> Lane | None:
        return next((lane for lane in self._timeline.lanes if lane.top <= y < lane.bottom), None)

    def _handle_at(self, x: float, y: float) -> int | None:
        lane, content = self._lane_at(y), self._timeline.content
        if not content.handles or lane is None or lane.kind not in ("ruler", "sound", "motion", "heat"):
            return None
        near = [(abs(x - self._timeline.x_of(t)), i) for i, t in enumerate(content.in_out)]
        distance, which = min(near)
        # On the ruler the handles' flags are wide; below only their lines can be taken.
        reach = HANDLE_PX * 2 if lane.kind == "ruler" else HANDLE_PX / 2
        return which if distance <= reach else None

    def _part_of(self, label: Label, x: float) -> str:
        lane = self._timeline.lane("labels", label.tier)
        if lane is None or label.duration <= 0:
            return "all"
        rect = paint.label_rect(label, lane, GUTTER, self._timeline.view)
        if rect.width() > 3 * HANDLE_PX and x < rect.left() + HANDLE_PX:
            return "start"
        return "end" if rect.width() > 3 * HANDLE_PX and x > rect.right() - HANDLE_PX else "all"

    def _mark_at(self, x: float, y: float) -> Mark | None:
        lane = self._timeline.lane("problems")
        if lane is None:
            return None
        marks, view = self._timeline.content.problems, self._timeline.view
        return next((m for m in marks if paint.mark_rect(m, lane, GUTTER, view).contains(x, y)), None)
