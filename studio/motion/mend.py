"""Values that are no numbers, as damaged files and broken programs write them, made usable."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio.motion import rotation
from studio.motion.clip import Motion

OFF_UNIT = 0.01
"""How far from one a quaternion's length may be before it counts as wrong."""
FARTHEST = 1e6
"""No value of a motion is larger; what is, comes from a fault, and its square would overflow."""


def hold_last(values: NDArray[np.float64]) -> tuple[NDArray[np.float64], int]:
    """Cells (T, F) without a finite number take the value above, 0 at the top; gives also how many."""
    bad = ~np.isfinite(values)
    count = int(bad.sum())
    if not count:
        return values, 0
    rows = np.where(bad, 0, np.arange(len(values))[:, None])
    filled = np.take_along_axis(values, np.maximum.accumulate(rows, axis=0), axis=0)
    return np.where(np.isfinite(filled), filled, 0.0), count


def mended(motion: Motion) -> tuple[Motion, int]:
    """A motion whose times rise and whose values are numbers, and how many frames had to be mended.

    Frames without a time, or with one that does not rise, are left out; a value that is no number is held
    from the frame before; rotations are of length one. A sound motion comes back as it is.
    """
    times = motion.times
    highest = np.maximum.accumulate(np.where(np.isfinite(times), times, -np.inf))
    rising = np.isfinite(times) & (times > np.concatenate([[-np.inf], highest[:-1]]))
    kept = motion if rising.all() else motion.at_rows(np.flatnonzero(rising))
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
            held: NDArray[np.floating] = hold_last(flat)[0].reshape(values.shape)
            held = rotation.sign_continuous(rotation.normalised(held)) if is_turn else held
            parts[name] = held.astype(np.float32)
    return (replace(kept, **parts) if parts else kept), int(bad.sum()) + int((~rising).sum())
