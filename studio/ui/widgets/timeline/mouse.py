"""What lies under the mouse on a timeline, and what it does there from press to release."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Protocol

from PySide6.QtCore import QPointF, Qt, SignalInstance
from PySide6.QtGui import QMouseEvent

from studio.dataset import Label
from studio.ui.widgets.timeline import paint
from studio.ui.widgets.timeline.content import GUTTER, Content, LabelEdit, Lane, Mark, Span
from studio.ui.widgets.timeline.time_view import TimeView

CLICK_PX = 3
"""A press that moves less than this is a click."""
SHORTEST = 0.02
"""Seconds a take keeps at least between its in and out points."""


class TimelineSurface(Protocol):
    """What the mouse needs of a timeline: described here, so that only the timeline knows the other."""

    content: Content

    @property
    def seek_requested(self) -> SignalInstance:
        """Carries the moment asked for."""

    @property
    def in_out_changed(self) -> SignalInstance:
        """Carries the in and out points after a drag."""

    @property
    def label_edited(self) -> SignalInstance:
        """Carries a LabelEdit."""

    @property
    def span_selected(self) -> SignalInstance:
        """Carries the span dragged over, or None."""

    @property
    def problem_chosen(self) -> SignalInstance:
        """Carries the Mark clicked."""

    @property
    def in_out(self) -> Span:
        """In and out points in seconds."""

    @property
    def span(self) -> Span | None:
        """The selected span."""

    @property
    def playhead(self) -> float:
        """Seconds."""

    @property
    def view(self) -> TimeView:
        """The stretch of time shown."""

    @property
    def lanes(self) -> tuple[Lane, ...]:
        """Its strips from top to bottom."""

    def lane(self, kind: str, tier: str = "") -> Lane | None:
        """The lane of a kind."""

    def x_of(self, t: float) -> float:
        """The pixel of a moment."""

    def set_in_out(self, in_out: Span | None) -> None:
        """Show in and out points."""

    def set_span(self, span: Span | None) -> None:
        """Show the selected span."""

    def show_span(self, start: float, end: float) -> None:
        """Show this stretch of time."""

    def set_labels(self, labels: Sequence[Label]) -> None:
        """Draw these labels."""

    def show_moved_label(self, before: Label, after: Label) -> None:
        """Draw one label elsewhere."""

    def choose_label(self, label: Label | None) -> None:
        """Mark one label."""

    def edit_label(self, label: Label, new: bool = False) -> None:
        """Let a label's text be typed."""

    def setCursor(self, shape: Qt.CursorShape, /) -> None:
        """Show what a press would do."""

    def unsetCursor(self) -> None:
        """The usual cursor again."""


class Drag(Protocol):
    """A press being followed."""

    def move(self, t: float, x: float) -> None:
        """The mouse is at t seconds, x pixels right of the gutter."""

    def end(self) -> None:
        """The button was let go."""


class Scrub:
    """The playhead follows the mouse."""

    def __init__(self, timeline: TimelineSurface) -> None:
        self._timeline = timeline

    def move(self, t: float, x: float) -> None:
        """Ask for this moment."""
        self._timeline.seek_requested.emit(t)

    def end(self) -> None:
        """Nothing is left to do."""


class MoveHandle:
    """An in or out point follows the mouse; the request is sent once, on release."""

    def __init__(self, timeline: TimelineSurface, which: int) -> None:
        self._timeline = timeline
        self._which = which
        self._before = timeline.in_out

    def move(self, t: float, x: float) -> None:
        """Show the point here, never past the other one."""
        start, end = self._timeline.in_out
        pair = (min(t, end - SHORTEST), end) if self._which == 0 else (start, max(t, start + SHORTEST))
        self._timeline.set_in_out(pair)

    def end(self) -> None:
        """Report the new points, if they are new."""
        after = self._timeline.in_out
        if after != self._before:
            self._timeline.in_out_changed.emit(after)


class SelectSpan:
    """A click seeks; a drag selects a span, the pressed end staying."""

    def __init__(self, timeline: TimelineSurface, t: float, x: float) -> None:
        self._timeline = timeline
        self._from, self._x = t, x
        self._dragged = False

    def move(self, t: float, x: float) -> None:
        """Grow the span to here, once the mouse has left the place of the press."""
        if self._dragged or abs(x - self._x) >= CLICK_PX:
            self._dragged = True
            self._timeline.set_span((min(self._from, t), max(self._from, t)))

    def end(self) -> None:
        """Report the span, or the click."""
        if self._dragged:
            self._timeline.span_selected.emit(self._timeline.span)
        else:
            self._timeline.set_span(None)
            self._timeline.span_selected.emit(None)
            self._timeline.seek_requested.emit(self._from)


class Pan:
    """The picture follows the mouse."""

    def __init__(self, timeline: TimelineSurface, x: float) -> None:
        self._timeline = timeline
        self._start, self._x = timeline.view.start, x

    def move(self, t: float, x: float) -> None:
        """Show what keeps the pressed moment under the mouse."""
        view = self._timeline.view
        start = self._start - (x - self._x) / view.width * view.span
        self._timeline.show_span(start, start + view.span)

    def end(self) -> None:
        """Nothing is left to do."""


class PanOverview:
    """The thumb of the overview follows the mouse, its middle under it."""

    def __init__(self, timeline: TimelineSurface) -> None:
        self._timeline = timeline

    def move(self, t: float, x: float) -> None:
        """Show the stretch around this fraction of the whole."""
        view = self._timeline.view
        middle = x / view.width * view.duration
        self._timeline.show_span(middle - view.span / 2, middle + view.span / 2)

    def end(self) -> None:
        """Nothing is left to do."""


class MoveLabel:
    """A label, or one of its ends, follows the mouse; the request is sent once, on release.

    Args:
        part: "start", "end" or "all".
    """

    def __init__(self, timeline: TimelineSurface, label: Label, part: str, t: float, x: float) -> None:
        self._timeline = timeline
        self._before = self._now = label
        self._part, self._t, self._x = part, t, x
        self._dragged = False

    def move(self, t: float, x: float) -> None:
        """Show the label here, once the mouse has left the place of the press."""
        if not self._dragged and abs(x - self._x) < CLICK_PX:
            return
        self._dragged = True
        old, by = self._before, t - self._t
        end = old.t + old.duration
        if self._part == "start":
            start = min(max(old.t + by, 0.0), end - SHORTEST)
            new = replace(old, t=start, duration=end - start)
        elif self._part == "end":
            new = replace(old, duration=max(end + by - old.t, SHORTEST))
        else:
            last = max(self._timeline.view.duration - old.duration, 0.0)
            new = replace(old, t=min(max(old.t + by, 0.0), last))
        self._timeline.show_moved_label(self._now, new)
        self._now = new

    def end(self) -> None:
        """Report where it is now, if it moved."""
        if self._now != self._before:
            self._timeline.label_edited.emit(LabelEdit(self._before, self._now))


class PaintLabel:
    """A label grows with the mouse; the request is sent once, on release."""

    def __init__(self, timeline: TimelineSurface, lane: Lane, t: float, x: float) -> None:
        self._timeline, self._from, self._x = timeline, t, x
        self._before = timeline.content.labels
        self._now = Label(t, 0.0, lane.tier, timeline.content.painting)

    def move(self, t: float, x: float) -> None:
        """Show it up to here, once the mouse has left the place of the press."""
        if abs(x - self._x) >= CLICK_PX or self._now.duration:
            start, end = min(self._from, t), max(self._from, t)
            self._now = replace(self._now, t=start, duration=end - start)
            self._timeline.set_labels((*self._before, self._now))

    def end(self) -> None:
        """Ask for it, if it is more than a click."""
        self._timeline.set_labels(self._before)
        if self._now.duration >= SHORTEST:
            self._timeline.label_edited.emit(LabelEdit(None, self._now))


class ClearLabel:
    """A click takes a label away; a press that is dragged elsewhere does not."""

    def __init__(self, timeline: TimelineSurface, label: Label, x: float) -> None:
        self._timeline, self._label, self._x, self._dragged = timeline, label, x, False

    def move(self, t: float, x: float) -> None:
        """It is no click any more."""
        self._dragged = self._dragged or abs(x - self._x) >= CLICK_PX

    def end(self) -> None:
        """Ask for it to go."""
        if not self._dragged:
            self._timeline.label_edited.emit(LabelEdit(self._label, None))


HANDLE_PX = 6


class TimelineMouse:
    """Finds what is under a place (pixels of the widget) and follows a press until it is let go."""

    def __init__(self, timeline: TimelineSurface) -> None:
        self._timeline = timeline
        self.drag: Drag | None = None

    def press(self, event: QMouseEvent) -> None:
        """Begin what the place under the mouse is for."""
        timeline = self._timeline
        x, y = event.position().x(), event.position().y()
        if timeline.view.duration <= 0 or x < GUTTER - HANDLE_PX:
            return
        if event.button() == Qt.MouseButton.MiddleButton:
            self.drag = Pan(timeline, x - GUTTER)
        elif event.button() == Qt.MouseButton.LeftButton:
            shift = bool(event.modifiers() & Qt.KeyboardModifier.ShiftModifier)
            self.drag = self._begin(x, y, shift)
            if isinstance(self.drag, (Scrub, PanOverview)):
                self.drag.move(self.moment(x), x - GUTTER)

    def move(self, place: QPointF) -> None:
        """Go on with what was begun, or show what could be."""
        x, y = place.x(), place.y()
        if self.drag is not None:
            self.drag.move(self.moment(x), x - GUTTER)
            return
        label = None if self._timeline.content.painting else self.label_at(x, y)
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
        label, painting = self.label_at(x, y), self._timeline.content.painting
        if painting:
            if label is None:
                whole = Label(0.0, self._timeline.view.duration, lane.tier, painting)
                self._timeline.label_edited.emit(LabelEdit(None, whole))
            return
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

    def _begin(self, x: float, y: float, shift: bool) -> Drag | None:
        timeline, lane, t = self._timeline, self._lane_at(y), self.moment(x)
        handle = self._handle_at(x, y)
        if handle is not None:
            return MoveHandle(timeline, handle)
        if lane is None:
            return None
        if lane.kind == "overview":
            return PanOverview(timeline)
        if lane.kind == "ruler":
            return Scrub(timeline)
        label = self.label_at(x, y)
        if lane.kind == "labels" and timeline.content.painting:
            if label is not None:
                return ClearLabel(timeline, label, x - GUTTER)
            return PaintLabel(timeline, lane, t, x - GUTTER)
        if lane.kind == "labels":
            timeline.choose_label(label)
            if label is not None:
                return MoveLabel(timeline, label, self._part_of(label, x), t, x - GUTTER)
        mark = self._mark_at(x, y)
        if mark is not None:
            timeline.problem_chosen.emit(mark)
            return None
        if shift and lane.kind in ("sound", "motion", "heat"):
            return SelectSpan(timeline, self._far_end(t), -10 * CLICK_PX)
        return SelectSpan(timeline, t, x - GUTTER)

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
