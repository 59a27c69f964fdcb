"""Where nobody speaks: pauses by the level of the sound, for cutting one take into many."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

HOP = 0.02
"""Seconds of one level."""
RANGE_DB = 35.0
"""Speech lies within this range below the loudest of it."""
ABOVE_NOISE_DB = 8.0


def levels_dbfs(blocks: Iterable[NDArray[np.float32]], sample_rate: int) -> NDArray[np.float64]:
    """RMS level of every HOP of a sound, dBFS (T,); blocks are mono float32 (N,) and follow each other."""
    size = max(int(HOP * sample_rate), 1)
    found: list[NDArray[np.float64]] = []
    rest = np.zeros(0, np.float32)
    for block in blocks:
        samples = np.concatenate([rest, block])
        kept = len(samples) // size * size
        rest = samples[kept:]
        power = np.mean(samples[:kept].reshape(-1, size).astype(np.float64) ** 2, axis=1)
        found.append(10 * np.log10(power + 1e-12))
    return np.concatenate(found) if found else np.zeros(0)


def pauses(levels: NDArray[np.float64], shortest: float = 0.4) -> tuple[tuple[float, float], ...]:
    """Spans (start, end) in seconds at least `shortest` long in which nobody speaks.

    Speech is what rises ABOVE_NOISE_DB over the quiet tenth of the sound and stays within RANGE_DB of
    its loudest; so a steady hiss is a pause and so is a breath.
    """
    if not len(levels):
        return ()
    floor, loud = np.percentile(levels, 10), np.percentile(levels, 98)
    if loud - floor < ABOVE_NOISE_DB:
        return ()  # no contrast: all speech or all silence
    quiet = levels < max(floor + ABOVE_NOISE_DB, loud - RANGE_DB)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], quiet, [False]]).astype(np.int8)))
    spans = edges.reshape(-1, 2) * HOP
    return tuple((float(a), float(b)) for a, b in spans if b - a >= shortest)


def cuts(levels: NDArray[np.float64], shortest: float = 0.4, part: float = 2.0) -> tuple[float, ...]:
    """Moments in the middle of pauses, at least `part` seconds from each other and from both ends."""
    end = len(levels) * HOP
    moments: list[float] = []
    for a, b in pauses(levels, shortest):
        t, before = (a + b) / 2, moments[-1] if moments else 0.0
        if t - before >= part and end - t >= part:
            moments.append(t)
    return tuple(moments)
