"""Sanitizes motion: values that are no numbers or impossible, as damaged files have them, are replaced."""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio.motion import rotation
from studio.motion.motion import Motion

OFF_UNIT = 0.01
"""How far from one a quaternion's length may be before it counts as wrong."""
FARTHEST = 1e6
"""No value of a motion is larger; what is, comes from a fault, and its square would overflow."""

LATEST = 1e13
"""No time is later: milliseconds since 1970 stay below."""
LONGEST_GAP = 600.0
"""Seconds without a frame, behind which a few frames more are a fault."""
FEW = 3
"""Frames that count as a few."""


def forward_filled(values: NDArray[np.float64]) -> tuple[NDArray[np.float64], int]:
    """Cells (T, F) without a finite number take the value above, 0 at the top; gives also how many."""
    bad = ~np.isfinite(values)
    count = int(bad.sum())
    if not count:
        return values, 0
    rows = np.where(bad, 0, np.arange(len(values))[:, None])
    filled = np.take_along_axis(values, np.maximum.accumulate(rows, axis=0), axis=0)
    return np.where(np.isfinite(filled), filled, 0.0), count


def credible(times: NDArray[np.float64]) -> NDArray[np.intp]:
    """The rows whose times can be: they rise, and neither end lies far from all the others.

    One wrong time costs its own row, not those behind it, and does not make a recording of minutes last for
    days: whatever puts it on an even grid would fill the memory.
    """
    finite = np.abs(times) <= LATEST
    highest = np.maximum.accumulate(np.where(finite, times, -np.inf))
    rows = np.flatnonzero(finite & (times > np.concatenate([[-np.inf], highest[:-1]])))
    if len(rows) < finite.sum():
        # Of two that are as long, the one that ends sooner: the last but one may be the wrong one.
        most = _longest_rise(times, np.flatnonzero(finite))
        rows = max(rows, most, key=lambda kept: (len(kept), -times[kept[-1]]))
    # Never as many as half of them: then nobody could say which half is the fault.
    few = min(FEW, (len(rows) - 1) // 2)
    gaps = (np.flatnonzero(np.diff(times[rows]) > LONGEST_GAP) + 1).tolist()
    first, last = 0, len(rows)
    while gaps and last - gaps[-1] <= few:
        last = gaps.pop()
    while gaps and gaps[0] - first <= few:
        first = gaps.pop(0)
    return rows[first:last]


def _longest_rise(times: NDArray[np.float64], rows: NDArray[np.intp]) -> NDArray[np.intp]:
    """Those of some rows that make the longest rising sequence, by patience sorting."""
    tops: list[float] = []
    places: list[int] = []
    before = np.full(len(rows), -1)
    for i, t in enumerate(times[rows].tolist()):
        pile = bisect_left(tops, t)
        tops[pile : pile + 1] = [t]
        places[pile : pile + 1] = [i]
        before[i] = places[pile - 1] if pile else -1
    found: list[int] = []
    at = places[-1] if places else -1
    while at >= 0:
        found.append(at)
        at = int(before[at])
    return rows[found[::-1]]


def sanitized(motion: Motion) -> tuple[Motion, int]:
    """A motion whose times rise and whose values are numbers, and how many frames had to be mended.

    Frames without a time, or with one that cannot be, are left out; a value that is no number is held
    from the frame before; rotations are of length one. A sound motion comes back as it is.
    """
    # On the take's own clock, which begins with the take.
    rows = credible(np.where(np.abs(motion.times) <= FARTHEST, motion.times, np.nan))
    kept = motion if len(rows) == len(motion) else motion.at_rows(rows)
    if not len(kept):
        return kept, len(motion)
    bad = np.zeros(len(kept), dtype=bool)
    parts: dict[str, Any] = {}
    for name in ("shapes", "positions", "root_position", "rotations", "root_rotation"):
        values: NDArray[np.float32] = getattr(kept, name)
        wrong = ~(np.abs(values) <= FARTHEST)
        is_turn = "rotation" in name
        if is_turn:
            # In float64, where the square of no float32 overflows.
            length = np.linalg.norm(values.astype(np.float64), axis=-1, keepdims=True)
            wrong = wrong | ~(np.abs(length - 1) <= OFF_UNIT)
        frames = wrong.reshape(len(kept), -1).any(axis=1)
        if frames.any():
            bad |= frames
            flat = (
                np.where(np.abs(values) <= FARTHEST, values, np.nan).astype(np.float64).reshape(len(kept), -1)
            )
            held: NDArray[np.floating] = forward_filled(flat)[0].reshape(values.shape)
            held = rotation.sign_continuous(rotation.normalised(held)) if is_turn else held
            parts[name] = held.astype(np.float32)
    return (replace(kept, **parts) if parts else kept), int(bad.sum()) + len(motion) - len(rows)
