"""When frames are due: an even beat, or the moments at which new poses are there and even ones between."""

from __future__ import annotations

import threading
import time

EARLY = 0.003
"""Seconds before it is due that a frame is made, so that it leaves on time."""
_CLOSE = 0.25
"""Share of a step that two frames lie apart at least."""


class PoseArrivals:
    """Wakes senders as soon as a pose has been made; for any thread.

    Args:
        step: seconds between two poses.
    """

    def __init__(self, step: float) -> None:
        self.step = step
        self._count, self._at = 0, float("-inf")
        self._made = threading.Condition()

    @property
    def expected(self) -> float:
        """When the next pose is due, on the monotonic clock; the past where none comes any more."""
        return self._at + self.step

    def add(self) -> None:
        """A pose is there now."""
        with self._made:
            self._count, self._at = self._count + 1, time.monotonic()
            self._made.notify_all()

    def wait(self, count: int, until: float) -> int:
        """How many poses there were, as soon as they are not so many any more, or at a moment."""
        with self._made:
            self._made.wait_for(lambda: self._count != count, max(until - time.monotonic(), 0.0))
            return self._count


class Pace:
    """When the next frame is due, on the monotonic clock; skips what it missed.

    Args:
        fps: frames a second.
        arrivals: of the poses; where there are none to wait for, or they come more often than frames are
            to leave, the beat is even.
    """

    def __init__(self, fps: float, arrivals: PoseArrivals | None = None) -> None:
        # 240 a second is more than any display shows.
        self.step = 1.0 / min(max(fps, 1.0), 240.0)
        # As many frames for each pose as come nearest to the rate: all phases of a pose are then alike.
        each = round(arrivals.step / self.step) if arrivals is not None else 0
        self._arrivals, self._arrived = arrivals if each else None, 0
        if arrivals is not None and each:
            self.step = arrivals.step / each
        self.due = time.monotonic()

    def wait(self, stop: threading.Event) -> int:
        """Sleep until just before the next frame is due; returns how many were missed."""
        if self._arrivals is not None:
            return self._wait_for_pose(self._arrivals)
        self.due += self.step
        # The beat stays on its grid: after a hold-up it goes on where it would have been, not from now.
        late = time.monotonic() - self.due
        missed = int(late / self.step) if late > 0 else 0
        self.due += missed * self.step
        # Not to the beat itself: an event's wait may come back late, and the rest is slept in `hold`.
        rest = self.due - EARLY - time.monotonic()
        if rest > 0:
            stop.wait(rest)
        return missed

    def hold(self) -> None:
        """Sleep the last moment before the frame is due."""
        rest = self.due - time.monotonic()
        if rest > 0:
            time.sleep(rest)

    def _wait_for_pose(self, arrivals: PoseArrivals) -> int:
        """Until a pose is there, or it is time for a frame between two poses."""
        last, beat, expected = self.due, self.due + self.step, arrivals.expected
        # A pose that is nearly there is waited for: a frame of guesses right before it would be for nothing.
        if beat > expected - self.step / 2:
            beat = max(beat, expected + self.step / 2)
        count = arrivals.wait(self._arrived, beat)
        now = time.monotonic()
        if count != self._arrived:
            self._arrived, beat = count, max(now, last + _CLOSE * self.step)
        missed = max(int((now - beat) / self.step), 0)
        self.due = beat + missed * self.step
        return missed
