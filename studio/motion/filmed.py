"""What pictures say of the motion tracked in them: shares, spans of no use, and a second face beside it.

A picture of a webcam is a row of numbers, COLUMNS of them: when it was taken, its flags, jaw, mouth and
blinks as they were tracked in it; then when another tracker's face was heard last, and its jaw, mouth and
blinks, NaN where there was none.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntFlag

import numpy as np
from numpy.typing import NDArray

from studio.motion import lag
from studio.motion.channels import ARKIT_SHAPES

Floats = NDArray[np.float64]
Span = tuple[float, float, str]
"""Start and end in seconds, and why it is left out."""

COLUMNS = 9
BESIDE = "beside"
"""Fact of a take: an Agreement as JSON."""
NO_FACE, CUT, STILL, HIDDEN = "No face", "Cut", "Still picture", "Mouth hidden"
"""Why a span is left out."""
LOST_S, HIDDEN_S = 0.1, 0.3
"""Seconds without a face, and without its mouth, from which a span is left out."""
MOUTH_SHAPES = tuple(name for name in ARKIT_SHAPES if name.startswith("Mouth"))
BLINK_SHAPES = ("EyeBlinkLeft", "EyeBlinkRight")
MAIN_SHAPES = frozenset({"JawOpen", *MOUTH_SHAPES, *BLINK_SHAPES})
"""Shapes that two trackers of one face are compared by."""
# Seconds; a camera whose pictures are farther apart saw nothing between them.
_PAUSE_S = 0.25
_LEAST_MOVING = 0.01
_NAMES = ("jaw", "mouth", "blinks")


class PictureFlag(IntFlag):
    """What is known of one picture."""

    FACE = 1
    BLURRED = 2
    TURNED = 4
    DARK = 8
    SMALL = 16
    HIDDEN = 32
    """The mouth is, behind a hand, a microphone or a scarf."""
    MERGED = 64
    """The face of the motion comes from these pictures, and from nobody else."""
    PHONE = 128
    """The other tracker is a phone."""


_SHARES = {
    "face_blurred": PictureFlag.BLURRED,
    "face_turned": PictureFlag.TURNED,
    "face_dark": PictureFlag.DARK,
    "face_small": PictureFlag.SMALL,
    "mouth_hidden": PictureFlag.HIDDEN,
}


def main_values(weights: Mapping[str, float]) -> tuple[float, float, float] | None:
    """Jaw, mouth and blinks of a face by its shapes' names; None where it is none of ARKit's."""
    if "JawOpen" not in weights:
        return None

    def mean(names: tuple[str, ...]) -> float:
        values = [weights[name] for name in names if name in weights]
        return sum(values) / len(values) if values else 0.0

    return weights["JawOpen"], mean(MOUTH_SHAPES), mean(BLINK_SHAPES)


def shares(flags: NDArray[np.integer]) -> dict[str, str]:
    """For take.json: parts of the pictures with a face, and of those blurred and the like, as text; (P,)."""
    seen = (flags & PictureFlag.FACE) > 0
    parts = {"face_seen": seen} | {name: (flags[seen] & one) > 0 for name, one in _SHARES.items()}
    return {name: f"{float(part.mean()) if len(part) else 0.0:.4f}" for name, part in parts.items()}


def spans(times: Floats, holds: NDArray[np.bool_], least: float, why: str) -> list[Span]:
    """Where something holds for `least` seconds and more; a span ends with the picture behind it.

    Args:
        times: of the pictures, rising seconds, (P,).
        holds: (P,).
    """
    step = float(np.median(np.diff(times))) if len(times) > 1 else 0.0
    edges = np.flatnonzero(np.diff(np.concatenate([[0], holds.astype(np.int8), [0]])))
    found = []
    for first, end in edges.reshape(-1, 2).tolist():
        stop = times[end] if end < len(times) else times[-1] + step
        if stop - times[first] >= least - 1e-6:
            found.append((float(times[first]), float(stop), why))
    return found


def in_order(found: list[Span]) -> tuple[Span, ...]:
    """Spans as a take keeps them: none before its beginning."""
    return tuple(sorted((round(max(a, 0.0), 4), round(b, 4), why) for a, b, why in found if b > 0))


@dataclass(frozen=True)
class Agreement:
    """How well two trackers of one face agree.

    Args:
        phone: whether the other one is a phone.
        lag_ms: how much later the webcam is; None where that cannot be told.
        jaw, mouth, blinks: correlations once that is taken out, None of what does not move.
    """

    phone: bool
    lag_ms: float | None = None
    jaw: float | None = None
    mouth: float | None = None
    blinks: float | None = None


def agreement(pictures: Floats) -> Agreement | None:
    """How a webcam's face agrees with another's; None where they were not seen together for some seconds.

    Args:
        pictures: (P, COLUMNS), in order.
    """
    both = pictures[((pictures[:, 1].astype(int) & PictureFlag.FACE) > 0) & np.isfinite(pictures[:, 5])]
    if len(both) < 2:
        return None
    mine, others = (both[np.unique(both[:, at], return_index=True)[1]][:, at:] for at in (0, 5))
    mine = mine[:, [0, 2, 3, 4]]
    start, end = max(mine[0, 0], others[0, 0]), min(mine[-1, 0], others[-1, 0])
    # Less is not enough for a delay of up to a second either way.
    if end - start < 4 * lag.REACH + 0.1:
        return None
    grid = np.arange(start, end, 1 / lag.RATE)
    theirs = _on(grid, others)
    found = lag.curve_offset(theirs[:, 0], _on(grid, mine)[:, 0])
    sure = found.confidence >= lag.SURE
    late = -found.offset if sure else 0.0
    counts = _known(grid + late, mine[:, 0]) & _known(grid, others[:, 0])
    ours = _on(grid + late, mine)[counts]
    r = {name: _correlation(ours[:, i], theirs[counts, i]) for i, name in enumerate(_NAMES)}
    phone = bool((both[:, 1].astype(int) & PictureFlag.PHONE).any())
    return Agreement(phone, round(late * 1e3, 1) if sure else None, **r)


def _on(grid: Floats, rows: Floats) -> Floats:
    """Three curves of rows (N, 4) with their times in front, at other moments, (K, 3)."""
    return np.stack([np.interp(grid, rows[:, 0], rows[:, i]) for i in (1, 2, 3)], axis=1)


def _known(grid: Floats, times: Floats) -> NDArray[np.bool_]:
    """Whether there are samples on both sides of each moment, not far apart, (K,)."""
    behind = np.searchsorted(times, grid)
    inside = (behind > 0) & (behind < len(times))
    behind = np.clip(behind, 1, len(times) - 1)
    return np.asarray(inside & (times[behind] - times[behind - 1] < _PAUSE_S))


def _correlation(a: Floats, b: Floats) -> float | None:
    if len(a) < lag.RATE or min(a.std(), b.std()) < _LEAST_MOVING:
        return None
    r = float(np.corrcoef(a, b)[0, 1])
    return round(r, 3) if math.isfinite(r) else None


def webcam_left_out(times: Floats, flags: NDArray[np.integer]) -> tuple[Span, ...]:
    """Spans of a recording in which its webcam saw no face, or no mouth, and nobody else gave one.

    Args:
        times: of the pictures, rising seconds, (P,).
        flags: of each, (P,).
    """
    alone = (flags & PictureFlag.MERGED) > 0
    seen, hidden = (flags & PictureFlag.FACE) > 0, (flags & PictureFlag.HIDDEN) > 0
    lost = spans(times, alone & ~seen, LOST_S, NO_FACE)
    return in_order(lost + spans(times, alone & seen & hidden, HIDDEN_S, HIDDEN))
