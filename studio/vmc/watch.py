"""Statistics of frames: rate, jitter, losses, and whether anything moves. Pure."""

from __future__ import annotations

import math
from collections import Counter, deque

import numpy as np

from studio.vmc.rows import RowBlock

LATELY_S = 10.0
"""What was lost longer ago is no news, and still in the counters."""
MOST_FRAMES_PER_S = 500
"""More are no motion that anybody needs: they are counted, and not kept."""
_WINDOW_S = 1.0
# Two seconds at 60 frames a second: long enough to tell what is usual, short enough to follow a change.
_STEPS = 120
# Fewer steps tell nothing of what is usual.
_MIN_STEPS = 20
# A sender counts as clocked when its T steps differ by no more than this part.
_EVEN = 0.02


class FrameWatch:
    """Counts what a performer should know of the frames that come in.

    Attributes:
        frames: seen. lost: known missing, by steps of a clocked sender's T and by frames that came in part.
            A frame that came without its T is not missing.
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
        self._last: RowBlock | None = None
        self._last_time = math.nan
        self._timeless = 0
        self._losses: deque[tuple[float, int]] = deque()

    def compare(self, block: RowBlock) -> None:
        """Find out when anything moved last; blocks in order, each after its frames were counted."""
        last, self._last = self._last, block
        moved = np.flatnonzero((block.values[1:] != block.values[:-1]).any(axis=1)) + 1
        if len(moved):
            self.last_moved = float(block.arrivals[moved[-1]])
        elif (
            last is None
            or last.names is not block.names
            or not np.array_equal(last.values[-1], block.values[0])
        ):
            self.last_moved = float(block.arrivals[0])

    def count(self, arrival: float, sender_time: float | None, fresh_channels: int) -> None:
        """Count one frame.

        Args:
            arrival: seconds of `clock.now()`. sender_time: the sender's T, None or NaN where it sent none.
            fresh_channels: how many channels the frame carried itself.
        """
        lost_before = self.lost
        self.frames += 1
        self._arrivals.append(arrival)
        self._count_gap(arrival - self.last_arrival, math.nan if sender_time is None else sender_time)
        self.last_arrival = arrival
        self._count_part(fresh_channels)
        if self.lost > lost_before:
            self._losses.append((arrival, self.lost - lost_before))
        self._discard_old(arrival)

    def lost_lately(self, now: float) -> int:
        """Frames known missing from the last seconds."""
        self._discard_old(now)
        return sum(count for _, count in self._losses)

    def _discard_old(self, now: float) -> None:
        while self._losses and self._losses[0][0] < now - LATELY_S:
            self._losses.popleft()

    def frames_per_s(self, now: float) -> float:
        """Frames of the last second."""
        return float(sum(t > now - _WINDOW_S for t in self._arrivals)) / _WINDOW_S

    def jitter_ms(self) -> float:
        """Standard deviation of the latest intervals."""
        return float(np.std(self._gaps)) * 1e3 if len(self._gaps) > 1 else 0.0

    def _count_gap(self, gap: float, sender_time: float) -> None:
        """A step of T that is several usual ones tells how many frames are missing in it, less those that
        came without their T."""
        timeless, self._timeless = self._timeless, self._timeless + 1
        missing = 0
        if math.isfinite(sender_time):
            step, self._last_time, self._timeless = sender_time - self._last_time, sender_time, 0
            if len(self._steps) >= _MIN_STEPS and step > 0:
                missing = max(self._steps_in(step) - 1 - timeless, 0)
            # A step over frames without T is several steps in one, and T runs back where a sender loops.
            if math.isfinite(step) and step > 0 and not timeless:
                self._steps.append(step)
        self.lost += missing
        # Before the first frame there is no gap.
        if not math.isfinite(gap):
            return
        # A missing frame explains its gap; counted twice it would look worse than it is.
        if len(self._gaps) >= _MIN_STEPS and not missing and gap > 2.5 * float(np.median(self._gaps)):
            self.late += 1
        self._gaps.append(gap)

    def _steps_in(self, step: float) -> int:
        """How many usual steps of the sender's clock one is; 1 where that cannot be told."""
        usual = float(np.median(self._steps))
        even = float(np.median(np.abs(np.array(self._steps) - usual))) <= _EVEN * usual
        ratio = step / usual if usual > 0 else 0.0
        return round(ratio) if even and 1.5 < ratio < 600 and abs(ratio - round(ratio)) < 0.2 else 1

    def _count_part(self, size: int) -> None:
        """A sender whose frames are nearly always the same size lost part of one that is smaller."""
        if len(self._sizes) >= _MIN_STEPS:
            # Eight in ten of one size: senders that leave out what did not change have no usual size.
            usual, times = Counter(self._sizes).most_common(1)[0]
            self.lost += size < usual and times >= 0.8 * len(self._sizes)
        self._sizes.append(size)


class FrameLimit:
    """Says which frames are kept where more come than are any use; those left out lie evenly among them.

    Attributes:
        left_out: frames that were not kept.
    """

    def __init__(self) -> None:
        self.left_out = 0
        # A sender that was held up for a second and makes up for it loses nothing.
        self._left = float(MOST_FRAMES_PER_S)
        self._at = -math.inf

    def keeps(self, arrival: float) -> bool:
        """Whether a frame that arrived then is kept."""
        since = max(arrival - self._at, 0.0)
        self._left = min(self._left + since * MOST_FRAMES_PER_S, MOST_FRAMES_PER_S)
        self._at = max(self._at, arrival)
        kept = self._left >= 1.0
        self._left -= kept
        self.left_out += not kept
        return kept


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
