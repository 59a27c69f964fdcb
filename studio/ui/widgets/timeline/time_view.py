"""Which stretch of time a timeline shows, and where each second falls on it. Pure: no Qt."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

MIN_SPAN = 0.0005
"""Seconds across the whole width at the deepest zoom: 24 samples at 48 kHz."""
TICK_STEPS = (
    1e-5, 2e-5, 5e-5, 1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 5e-3, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5,
    1.0, 2.0, 5.0, 10.0, 15.0, 30.0, 60.0, 120.0, 300.0, 600.0, 900.0, 1800.0, 3600.0, 7200.0,
)  # fmt: skip


@dataclass(frozen=True)
class TimeView:
    """A window onto a recording.

    Args:
        duration: seconds that can be shown, from 0.
        start: the first second shown.
        span: seconds shown.
        width: pixels they fill.
    """

    duration: float = 0.0
    start: float = 0.0
    span: float = 1.0
    width: float = 1.0

    @property
    def end(self) -> float:
        """The last second shown."""
        return self.start + self.span

    def x(self, t: float) -> float:
        """The pixel of a moment; outside 0..width where it is not shown."""
        return (t - self.start) / self.span * self.width

    def t(self, x: float) -> float:
        """The moment under a pixel, not limited to the recording."""
        return self.start + x / self.width * self.span

    def clamped(self, t: float) -> float:
        """A moment moved into the recording."""
        return min(max(t, 0.0), self.duration)

    def fitted(self) -> TimeView:
        """The whole recording."""
        return replace(self, start=0.0, span=max(self.duration, MIN_SPAN))

    def resized(self, width: float) -> TimeView:
        """The same seconds on another width."""
        return replace(self, width=max(width, 1.0))

    def showing(self, start: float, end: float) -> TimeView:
        """This stretch, kept inside the recording and above the deepest zoom."""
        whole = max(self.duration, MIN_SPAN)
        span = min(max(end - start, MIN_SPAN), whole)
        return replace(self, start=min(max(start, 0.0), whole - span), span=span)

    def zoomed(self, factor: float, x: float) -> TimeView:
        """Closer (factor < 1) or wider, the moment under pixel x staying where it is."""
        t = self.t(x)
        whole = max(self.duration, MIN_SPAN)
        span = min(max(self.span * factor, MIN_SPAN), whole)
        start = t - x / self.width * span
        return replace(self, start=min(max(start, 0.0), whole - span), span=span)

    def panned(self, seconds: float) -> TimeView:
        """Later by some seconds (earlier where negative), kept inside the recording."""
        return self.showing(self.start + seconds, self.end + seconds)

    def following(self, t: float) -> TimeView:
        """The same view while t is shown, else the page that begins a little before t."""
        if self.start <= t <= self.end:
            return self
        begin = t - 0.05 * self.span
        return self.showing(begin, begin + self.span)


@dataclass(frozen=True)
class Ticks:
    """Marks of a time ruler.

    Args:
        major: (seconds, text) of the marks that are written out.
        minor: seconds of those between.
    """

    major: tuple[tuple[float, str], ...]
    minor: tuple[float, ...]


def ticks(view: TimeView, gap: float = 90.0) -> Ticks:
    """Round moments at least `gap` pixels apart, with four or five smaller ones between."""
    need = view.span * gap / max(view.width, 1.0)
    step = next((s for s in TICK_STEPS if s >= need), TICK_STEPS[-1])
    last = min(view.end, view.duration)
    major = tuple((t, clock(t, step)) for t in _multiples(step, view.start - step, last))
    fine = step / (4 if math.isclose(step * 10 ** -math.floor(math.log10(step)), 2.0) else 5)
    return Ticks(major, tuple(_multiples(fine, view.start, last)))


def clock(t: float, step: float = 0.1) -> str:
    """A moment as mm:ss.t, with hours where there are any and as many decimals as the step needs."""
    decimals = 0 if step >= 1 else max(1, math.ceil(-math.log10(step) - 1e-9))
    # Rounded first: 59.96 must become 1:00.0, not 0:60.0.
    whole = round(abs(t), decimals)
    minutes, seconds = divmod(whole, 60.0)
    hours, minutes = divmod(int(minutes), 60)
    width = 2 if decimals == 0 else 3 + decimals
    tail = f"{seconds:0{width}.{decimals}f}"
    sign = "-" if t < 0 and whole > 0 else ""
    return f"{sign}{hours}:{minutes:02d}:{tail}" if hours else f"{sign}{minutes:02d}:{tail}"


def minutes(seconds: float) -> str:
    """A length as m:ss, for lists and cards."""
    whole = round(seconds)
    return f"{whole // 60}:{whole % 60:02d}"


def _multiples(step: float, start: float, end: float) -> list[float]:
    first, last = math.ceil(start / step - 1e-9), math.floor(end / step + 1e-9)
    return [i * step for i in range(max(first, 0), last + 1)]
