"""What a timeline shows, as values: curves, marks, label edits, and where its lanes lie. Pure: no Qt."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from studio.dataset import Label

if TYPE_CHECKING:
    from studio.sound.spectrogram import Part

GUTTER = 92
"""Pixels left of the lanes, for their names."""
Span = tuple[float, float]
Floats = NDArray[np.float32]


class PeakSource(Protocol):
    """Sound that can say how loud each column of a picture is, at any zoom."""

    def columns(self, start: float, end: float, count: int) -> tuple[Floats, Floats]:
        """Smallest and largest sample in each of `count` equal stretches of start..end seconds, (count,)."""
        ...


class SpectrumSource(Protocol):
    """Sound that can say which pitches it holds, at any zoom."""

    @property
    def top_db(self) -> float:
        """The level that gets the brightest colour."""
        ...

    @property
    def pitches_hz(self) -> NDArray[np.float64]:
        """The middle of each band, rising, (BANDS,)."""
        ...

    def part(self, start: float, end: float, count: int) -> Part:
        """What to draw of start..end seconds in `count` columns of a picture."""
        ...


@dataclass(frozen=True)
class Mark:
    """Something wrong at a moment or over a span.

    Args:
        t: seconds on the take's clock.
        duration: seconds; 0 for a moment.
        severity: "muted", "warn" or "bad": a colour of the theme.
        title: one or two words drawn on the lane.
        text: the sentence and its remedy, shown on hover.
    """

    t: float
    duration: float
    severity: str
    title: str
    text: str


@dataclass(frozen=True)
class LabelEdit:
    """A change that is requested: added where before is None, removed where after is None."""

    before: Label | None
    after: Label | None


@dataclass(frozen=True, eq=False)
class Curve:
    """One channel over time.

    Args:
        times: seconds, rising, (T,).
        values: (T,).
        colour: index of a data colour, 0..7.
    """

    times: NDArray[np.float64]
    values: NDArray[np.float64]
    colour: int

    @cached_property
    def limits(self) -> Span:
        """The range drawn: 0..1 for weights, else the values' own range, never empty."""
        if not len(self.values):
            return 0.0, 1.0
        low, high = float(np.min(self.values)), float(np.max(self.values))
        if low >= 0.0 and high <= 1.0:
            return 0.0, 1.0
        room = max(high - low, 1e-3) * 0.05
        return low - room, high + room

    def columns(
        self, start: float, end: float, count: int
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """What the curve covers in each of `count` equal parts of start..end seconds.

        Returns:
            Lowest and highest heights 0..1, (count,), NaN before the first and after the last frame. Frames
            denser than columns all count, so that no blink is lost by zooming out.
        """
        edges = np.linspace(start, end, count + 1)
        if not len(self.times):
            nothing = np.full(count, np.nan)
            return nothing, nothing
        at = np.interp(edges, self.times, self.values, left=np.nan, right=np.nan)
        low, high = np.fmin(at[:-1], at[1:]), np.fmax(at[:-1], at[1:])
        places = np.searchsorted(self.times, edges)
        filled = places[1:] > places[:-1]
        if filled.any():
            inside = self.values[: places[-1]]
            low[filled] = np.fmin(low[filled], np.minimum.reduceat(inside, places[:-1][filled]))
            high[filled] = np.fmax(high[filled], np.maximum.reduceat(inside, places[:-1][filled]))
        least, most = self.limits
        return (low - least) / (most - least), (high - least) / (most - least)


@dataclass
class Content:
    """All that a timeline shows.

    Args:
        sound: None where there is none; `silent` says why.
        spectrum: drawn in place of the waveform where there is one.
        curves: motion by name.
        labels, tiers, tier_titles: labels, the lanes they lie on, and the names shown for those.
        chosen: the label clicked last.
        painting: the word that a drag on a tier's lane writes there, and a click on a label takes away; ""
            where labels are moved and typed.
        problems: what is wrong, by time.
        heat: times in seconds and values 0..1 of a strip of colour.
        excluded: spans left out.
        unmade: the span whose motion is still being made.
        in_out, handles: in and out points, and whether they can be dragged.
        span, loop: what is selected and what is repeated.
        parts: what a cut would keep, a preview.
        playhead: seconds.
    """

    sound: PeakSource | None = None
    silent: str = ""
    spectrum: SpectrumSource | None = None
    curves: dict[str, Curve] = field(default_factory=dict)
    labels: tuple[Label, ...] = ()
    tiers: tuple[str, ...] = ()
    tier_titles: Mapping[str, str] = field(default_factory=dict)
    chosen: Label | None = None
    painting: str = ""
    problems: tuple[Mark, ...] = ()
    heat: tuple[NDArray[np.float64], Floats] | None = None
    excluded: tuple[Span, ...] = ()
    unmade: Span | None = None
    in_out: Span = (0.0, 0.0)
    handles: bool = False
    span: Span | None = None
    loop: Span | None = None
    parts: tuple[Span, ...] = ()
    playhead: float = 0.0


@dataclass(frozen=True)
class Lane:
    """A horizontal strip: kind is "ruler", "sound", "heat", "motion", "labels", "problems" or "overview"."""

    kind: str
    top: int
    height: int
    tier: str = ""

    @property
    def bottom(self) -> int:
        """The first pixel below it."""
        return self.top + self.height


RULER, LABELS, PROBLEMS, HEAT, OVERVIEW, GAP = 26, 24, 22, 8, 12, 4
MIN_SOUND = 48
LEAST_ROW, LEAST_SOUND = 16, 24
"""Pixels of a row of labels or problems, and of sound with motion, where there is little room."""


def lay_out(
    height: int, tiers: tuple[str, ...], *, curves: bool, problems: bool, heat: bool
) -> tuple[Lane, ...]:
    """The lanes from top to bottom: sound and motion share what the fixed ones leave.

    Where that is little, rows get thinner first, then the overview goes, and the sound gets thinner. The last
    lane ends at the height, or below it where even so they need more.
    """
    count = len(tiers) + problems
    fixed = RULER + (GAP if curves else 0) + (HEAT + GAP if heat else 0) + (GAP if count else 0)
    overview = fixed + GAP + OVERVIEW + count * LEAST_ROW + MIN_SOUND <= height
    fixed += GAP + OVERVIEW if overview else 0
    row = max((height - fixed - MIN_SOUND) // count, LEAST_ROW) if count else 0
    label, problem = min(row, LABELS), min(row, PROBLEMS)
    free = max(height - fixed - len(tiers) * label - problems * problem, LEAST_SOUND)
    sound = int(free * 0.52) if curves else free
    rows = [("ruler", RULER, ""), ("sound", sound, "")]
    if heat:
        rows += [("", GAP, ""), ("heat", HEAT, "")]
    if curves:
        rows += [("", GAP, ""), ("motion", free - sound, "")]
    if count:
        rows.append(("", GAP, ""))
    rows += [("labels", label, tier) for tier in tiers]
    if problems:
        rows.append(("problems", problem, ""))
    if overview:
        rows += [("", GAP, ""), ("overview", OVERVIEW, "")]
    lanes: list[Lane] = []
    top = 0
    for kind, size, tier in rows:
        if kind:
            lanes.append(Lane(kind, top, size, tier))
        top += size
    return tuple(lanes)
