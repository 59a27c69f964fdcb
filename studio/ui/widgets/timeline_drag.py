"""What the mouse is doing on a timeline: one small object from press to release.

Each gets moments in seconds, already inside the recording, and tells the Timeline what to show.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Protocol

from studio.dataset import Label
from studio.ui.widgets.timeline_content import LabelEdit

if TYPE_CHECKING:
    from studio.ui.widgets.timeline import Timeline

CLICK_PX = 3
"""A press that moves less than this is a click."""
SHORTEST = 0.02
"""Seconds a take keeps at least between its in and out points."""


class Drag(Protocol):
    """A press being followed."""

    def move(self, t: float, x: float) -> None:
        """The mouse is at t seconds, x pixels right of the gutter."""

    def end(self) -> None:
        """The button was let go."""


class Scrub:
    """The playhead follows the mouse."""

    def __init__(self, timeline: Timeline) -> None:
        self._timeline = timeline

    def move(self, t: float, x: float) -> None:
        """Ask for this moment."""
        self._timeline.seek_requested.emit(t)

    def end(self) -> None:
        """Nothing is left to do."""


class MoveHandle:
    """An in or out point follows the mouse; the wish is sent once, on release."""

    def __init__(self, timeline: Timeline, which: int) -> None:
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

    def __init__(self, timeline: Timeline, t: float, x: float) -> None:
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

    def __init__(self, timeline: Timeline, x: float) -> None:
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

    def __init__(self, timeline: Timeline) -> None:
        self._timeline = timeline

    def move(self, t: float, x: float) -> None:
        """Show the stretch around this fraction of the whole."""
        view = self._timeline.view
        middle = x / view.width * view.duration
        self._timeline.show_span(middle - view.span / 2, middle + view.span / 2)

    def end(self) -> None:
        """Nothing is left to do."""


class MoveLabel:
    """A label, or one of its ends, follows the mouse; the wish is sent once, on release.

    Args:
        part: "start", "end" or "all".
    """

    def __init__(self, timeline: Timeline, label: Label, part: str, t: float, x: float) -> None:
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
