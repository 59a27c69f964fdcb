"""Watches frames go by: how many, how evenly, which are missing, and whether anything moves. Pure."""

from __future__ import annotations

import math
from collections import Counter, deque

import numpy as np

from studio.capture.rows import Row

LATELY_S = 10.0
"""What was lost longer ago is no news, and still in the counters."""
_WINDOW_S = 1.0
_STEPS = 120
_MIN_STEPS = 20
_EVEN = 0.02
"""A sender counts as clocked when its T steps differ by no more than this part."""


class FrameWatch:
    """Counts what a performer should know of the frames that come in.

    Attributes:
        frames: seen. lost: known missing, by steps of a clocked sender's T and by frames that came in part.
        late: gaps of over two and a half intervals that a missing frame does not explain.
        last_arrival, last_moved: when the last frame came, and the last that differed from its predecessor.
    """

    def __init__(self) -> None:
        self.frames = self.lost = self.late = 0
        self.last_arrival = self.last_moved = -math.inf
        self._arrivals: deque[float] = deque(maxlen=1000)
        self._gaps: deque[float] = deque(maxlen=_STEPS)
        self._steps: deque[float] = deque(maxlen=_STEPS)
        self._sizes: deque[int] = deque(maxlen=_STEPS)
        self._last: Row | None = None
        self._losses: deque[tuple[float, int]] = deque()

    def feed(self, row: Row, fresh_channels: int) -> None:
        """One frame.

        Args:
            row: the frame.
            fresh_channels: how many channels it carried itself.
        """
        last, self._last = self._last, row
        lost_before = self.lost
        self.frames += 1
        self._arrivals.append(row.arrival)
        self.last_arrival = row.arrival
        if last is None or last.names is not row.names or not np.array_equal(last.values, row.values):
            self.last_moved = row.arrival
        if last is not None:
            self._count_gap(row.arrival - last.arrival, row.sender_time - last.sender_time)
        self._count_part(fresh_channels)
        if self.lost > lost_before:
            self._losses.append((row.arrival, self.lost - lost_before))
        self._forget(row.arrival)

    def lost_lately(self, now: float) -> int:
        """Frames known missing from the last seconds."""
        self._forget(now)
        return sum(count for _, count in self._losses)

    def _forget(self, now: float) -> None:
        while self._losses and self._losses[0][0] < now - LATELY_S:
            self._losses.popleft()

    def frames_per_s(self, now: float) -> float:
        """Frames of the last second."""
        return float(sum(t > now - _WINDOW_S for t in self._arrivals)) / _WINDOW_S

    def jitter_ms(self) -> float:
        """Standard deviation of the latest intervals."""
        return float(np.std(self._gaps)) * 1e3 if len(self._gaps) > 1 else 0.0

    def _count_gap(self, gap: float, step: float) -> None:
        missing = 0
        if len(self._steps) >= _MIN_STEPS and step > 0:
            usual = float(np.median(self._steps))
            even = float(np.median(np.abs(np.array(self._steps) - usual))) <= _EVEN * usual
            ratio = step / usual if usual > 0 else 0.0
            if even and 1.5 < ratio < 600 and abs(ratio - round(ratio)) < 0.2:
                missing = round(ratio) - 1
        self.lost += missing
        if len(self._gaps) >= _MIN_STEPS and not missing and gap > 2.5 * float(np.median(self._gaps)):
            self.late += 1
        if math.isfinite(step) and step > 0:
            self._steps.append(step)
        self._gaps.append(gap)

    def _count_part(self, size: int) -> None:
        """A sender whose frames are nearly always the same size lost part of one that is smaller."""
        if len(self._sizes) >= _MIN_STEPS:
            usual, times = Counter(self._sizes).most_common(1)[0]
            self.lost += size < usual and times >= 0.8 * len(self._sizes)
        self._sizes.append(size)


class RateWatch:
    """Events a second over the last second or so, from a counter that only grows."""

    def __init__(self) -> None:
        self._marks: deque[tuple[float, int]] = deque()

    def rate(self, now: float, count: int) -> float:
        """The rate, given the counter's value now."""
        if not self._marks or now - self._marks[-1][0] >= 0.05:
            self._marks.append((now, count))
        while len(self._marks) > 1 and now - self._marks[1][0] >= _WINDOW_S:
            self._marks.popleft()
        then, before = self._marks[0]
        return (count - before) / (now - then) if now - then >= 0.2 else 0.0
