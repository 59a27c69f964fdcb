"""Which moment of the sound is in the ear right now."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

SLOW_HZ, FAST_HZ, FAST_SECONDS = 0.1, 2.0, 1.0
LOST_LOCK = 0.15
"""Seconds of disagreement after which the estimate starts anew (a device was suspended or moved)."""


class StreamClock:
    """When each frame of an output stream reaches the ear, on the monotonic clock.

    A device reports its latency coarsely and unevenly; this smooths the reports by a delay-locked loop.
    Source: Adriaensen 2005, Using a DLL to filter time.

    Args:
        sample_rate: frames per second, as asked of the device.
    """

    def __init__(self, sample_rate: float) -> None:
        self._period = 1.0 / sample_rate
        self._frame = 0
        self._time = math.nan
        self._began = 0
        # One tuple, replaced whole: readers on other threads never see halves of two updates.
        self._line: tuple[int, float, float] | None = None

    def report(self, frame: int, time: float) -> None:
        """The device said that a frame will be heard at a time. Runs on the audio thread."""
        step = frame - self._frame
        expected = self._time + step * self._period
        error = time - expected
        if not abs(error) < LOST_LOCK:  # also the first report, where expected is NaN
            self._frame, self._time, self._began = frame, time, frame
        else:
            young = (frame - self._began) * self._period < FAST_SECONDS
            omega = min(2 * math.pi * (FAST_HZ if young else SLOW_HZ) * step * self._period, 0.5)
            self._time = expected + math.sqrt(2) * omega * error
            self._frame = frame
        self._line = (self._frame, self._time, self._period)

    def frame_at(self, time: float) -> float:
        """The frame that is heard at a time; -inf before the first report."""
        if self._line is None:
            return -math.inf
        frame, when, period = self._line
        return frame + (time - when) / period


@dataclass(frozen=True)
class Span:
    """A run of output frames and the part of the file they play.

    Args:
        first: output frame where it begins.
        count: output frames.
        position: seconds in the file at its first frame.
        speed: file seconds per output frame; 0 for silence while waiting.
        generation: counts seeks; older spans no longer matter.
    """

    first: int
    count: int
    position: float
    speed: float
    generation: int


class PlayedSpans:
    """What was given to the device lately, to look up the file position of an output frame."""

    def __init__(self) -> None:
        self._spans: deque[Span] = deque(maxlen=1024)

    def add(self, span: Span) -> None:
        """Runs on the audio thread."""
        self._spans.append(span)

    def position(self, frame: float, generation: int) -> float | None:
        """File position heard at an output frame; None before anything of this generation is heard."""
        for span in reversed(tuple(self._spans)):
            if span.generation != generation:
                return None
            if span.first <= frame:
                return span.position + min(frame - span.first, span.count) * span.speed
        return None
