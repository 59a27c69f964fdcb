"""One clock for every input: the computer's monotonic seconds, and how the sound device's run beside them."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

_SLOPE_SPREAD = 100e-6
"""Sound devices are off by tens of ppm; a slope beyond a few of these is noise of a short take."""
_CORRELATED = 10.0
_ROUNDS = 8
_READINGS, _AT_ONCE = 8, 10e-6
_SET, _SMOOTH = 1e-3, 0.02


def now() -> float:
    """Seconds of the computer's monotonic clock, comparable with all stamps of this package.

    Its finest one: what Python calls monotonic ticks every 16 ms on Windows. On Linux and macOS both are one.
    """
    return time.perf_counter()


class WallClock:
    """How far the wall clock, whose time the kernel's receive stamps have, is ahead of the monotonic one.

    Read afresh for every lot of stamps, so that a wall clock set in mid-take moves nothing, and steady
    enough otherwise to put stamps of one lot and the next in order.
    """

    def __init__(self) -> None:
        self._ahead: float | None = None

    def ahead(self) -> float:
        """The difference now, seconds."""
        ahead, narrowest = 0.0, float("inf")
        for _ in range(_READINGS):
            # The one that was held up least counts.
            before, wall, after = now(), time.time(), now()
            if after - before < narrowest:
                ahead, narrowest = wall - 0.5 * (before + after), after - before
            if narrowest < _AT_ONCE:
                break
        if self._ahead is None or abs(ahead - self._ahead) > narrowest + _SET:
            self._ahead = ahead
        elif narrowest < _AT_ONCE:
            self._ahead += _SMOOTH * (ahead - self._ahead)
        return self._ahead


@dataclass(frozen=True)
class ClockFit:
    """A straight line from the computer's clock to the take's: audio = scale * t + offset.

    Args:
        scale: seconds of sound per second of computer clock.
        offset: seconds.
        drift_ppm: how much faster the computer's clock ran than the sound device's.
        residual_ms: median distance of the points from the line.
    """

    scale: float = 1.0
    offset: float = 0.0
    drift_ppm: float = 0.0
    residual_ms: float = 0.0

    @overload
    def to_audio(self, t: float) -> float: ...
    @overload
    def to_audio(self, t: NDArray[np.float64]) -> NDArray[np.float64]: ...
    def to_audio(self, t: float | NDArray[np.float64]) -> float | NDArray[np.float64]:
        """Moments of the computer's clock, in seconds from the first recorded sample."""
        return self.scale * t + self.offset


def fit(audio_stream_times: ArrayLike, arrival_times: ArrayLike) -> ClockFit:
    """The line through pairs of one moment on both clocks, unmoved by stragglers.

    Iteratively re-weighted least squares (Tukey's biweight) with a prior that the slope is 1 to within
    100 ppm: a take of seconds says nothing about drift, one of minutes says all.

    Args:
        audio_stream_times: seconds of sound (sample index / sample rate), (N,).
        arrival_times: seconds of `now()` when these samples were captured, (N,).

    Returns:
        The fit; the identity shifted for one pair, the identity for none.
    """
    x, y = _finite_pairs(arrival_times, audio_stream_times)
    if len(x) == 0:
        return ClockFit()
    middle = float(np.median(x))
    # Nearly constant, so no digits are lost to large clock values.
    ahead = y - x
    away = x - middle
    level, tilt = float(np.median(ahead)), 0.0
    weights = np.ones(len(x))
    for _ in range(_ROUNDS):
        left = ahead - level - tilt * away
        spread = max(1.4826 * float(np.median(np.abs(left - np.median(left)))), 1e-6)
        weights = np.clip(1 - (left / (6 * spread)) ** 2, 0, None) ** 2
        level, tilt = _line(away, ahead, weights, spread)
    residual = float(np.median(np.abs(ahead - level - tilt * away))) * 1e3
    scale = 1.0 + tilt
    return ClockFit(scale, level - tilt * middle, (1 / scale - 1) * 1e6, residual)


def _line(
    x: NDArray[np.float64], y: NDArray[np.float64], weights: NDArray[np.float64], spread: float
) -> tuple[float, float]:
    total = weights.sum()
    if total < 1e-9:
        return float(np.median(y)), 0.0
    mean_x, mean_y = (weights * x).sum() / total, (weights * y).sum() / total
    # Neighbouring blocks err together, so they count as fewer; the prior counts as spread^2 / slope^2.
    prior = _CORRELATED * (spread / _SLOPE_SPREAD) ** 2
    tilt = (weights * (x - mean_x) * (y - mean_y)).sum() / ((weights * (x - mean_x) ** 2).sum() + prior)
    return float(mean_y - tilt * mean_x), float(tilt)


def _finite_pairs(x: ArrayLike, y: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    a, b = np.asarray(x, dtype=np.float64).reshape(-1), np.asarray(y, dtype=np.float64).reshape(-1)
    count = min(len(a), len(b))
    good = np.isfinite(a[:count]) & np.isfinite(b[:count])
    return a[:count][good], b[:count][good]
