"""Random events that are a function of time and a seed: any moment has one answer."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

CHUNK = 128

Intervals = Callable[[NDArray[np.float64]], NDArray[np.float64]]


class Schedule:
    """Events one after another from time 0 on, drawn as far as they are asked for.

    Args:
        seed: whole number >= 0; the same seed gives the same events.
        kind: tells apart the schedules of one seed.
        columns: normal deviates that each event brings besides its interval's.
        intervals: normal deviates (N,) -> seconds until the next event (N,), all above 0.
    """

    def __init__(self, seed: int, kind: int, columns: int, intervals: Intervals) -> None:
        self._random = np.random.default_rng((abs(seed), kind))
        self._columns, self._intervals = columns, intervals
        self.starts = np.zeros(0)
        """When each event begins, seconds, rising."""
        self.draws = np.zeros((0, columns))
        """What each event brought, (K, columns)."""

    def reach(self, t: float) -> None:
        """Draw events until one lies behind a moment."""
        parts_starts, parts_draws = [self.starts], [self.draws]
        last = float(self.starts[-1]) if len(self.starts) else 0.0
        while math.isfinite(t) and last <= max(t, 0.0):
            normal = self._random.standard_normal((CHUNK, self._columns + 1))
            starts = last + np.cumsum(self._intervals(normal[:, 0]))
            parts_starts.append(starts)
            parts_draws.append(normal[:, 1:])
            last = float(starts[-1])
        if len(parts_starts) > 1:
            self.starts, self.draws = np.concatenate(parts_starts), np.concatenate(parts_draws)

    def running(self, times: NDArray[np.float64]) -> NDArray[np.intp]:
        """Number of the event that began last before each of some moments (T,); -1 before the first."""
        if len(times):
            self.reach(float(times.max()))
        return np.searchsorted(self.starts, times, side="right") - 1


def log_normal(mean: float, deviation: float) -> Intervals:
    """Intervals of a log-normal distribution with a mean and a standard deviation in seconds."""
    sigma = math.sqrt(math.log1p((deviation / mean) ** 2))
    mu = math.log(mean) - sigma**2 / 2.0

    def intervals(normal: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(np.exp(mu + sigma * normal), dtype=np.float64)

    return intervals


def smooth_step(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """0 to 1 without a corner at either end."""
    x = np.clip(x, 0.0, 1.0)
    return x * x * (3.0 - 2.0 * x)
