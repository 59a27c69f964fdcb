"""Curves that the whole body is made of, each a pure function of absolute time.

That makes the performer endless: any stretch, computed whenever, continues the one before it exactly.
"""

from __future__ import annotations

import zlib

import numpy as np
from numpy.typing import NDArray

Curve = NDArray[np.float64]

GRID_FPS = 120
"""All curves are computed on this grid of absolute time, whatever the frame rate asked for."""

_MIX_A, _MIX_B = np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)
_GOLDEN = np.uint64(0x9E3779B97F4A7C15)


def grid(start: float, end: float) -> Curve:
    """Times (n,) of the grid from just before start to just after end."""
    return np.arange(int(np.floor(start * GRID_FPS)), int(np.ceil(end * GRID_FPS)) + 1) / GRID_FPS


def chance(seed: int, name: str, index: NDArray[np.int64]) -> Curve:
    """One number in 0..1 for each whole number, the same at every asking (splitmix64)."""
    with np.errstate(over="ignore"):
        z = index.astype(np.uint64) * _GOLDEN + np.uint64(zlib.crc32(f"{seed}/{name}".encode()))
        z = z + _GOLDEN
        z = (z ^ (z >> np.uint64(30))) * _MIX_A
        z = (z ^ (z >> np.uint64(27))) * _MIX_B
        z = z ^ (z >> np.uint64(31))
    return (z >> np.uint64(11)).astype(np.float64) / float(1 << 53)


def wander(times: Curve, seed: int, name: str, period: float) -> Curve:
    """Smooth idle movement (n,) of about -1..1 that never repeats.

    A cubic B-spline through random values, one every `period` seconds: position, speed and acceleration are
    continuous.
    """
    at = times / period
    first = np.floor(at).astype(np.int64)
    f = at - first
    weights = ((1 - f) ** 3, 3 * f**3 - 6 * f**2 + 4, -3 * f**3 + 3 * f**2 + 3 * f + 1, f**3)
    values = sum(w / 6 * (2 * chance(seed, name, first + k - 1) - 1) for k, w in enumerate(weights))
    # The spline averages; this brings the spread back.
    return np.asarray(values) * 1.7


def smoothed(values: Curve, sigma: float) -> Curve:
    """A curve on the grid, blurred by a Gaussian of `sigma` seconds cut at four."""
    reach = int(np.ceil(4 * sigma * GRID_FPS))
    x = np.arange(-reach, reach + 1) / (sigma * GRID_FPS)
    kernel = np.exp(-0.5 * x * x)
    padded = np.pad(values, reach, mode="edge")
    return np.convolve(padded, kernel / kernel.sum(), mode="valid")


def ramp(x: Curve) -> Curve:
    """0 below 0, 1 above 1, and between them a minimum-jerk rise."""
    u = np.clip(x, 0.0, 1.0)
    return u * u * u * (10 + u * (6 * u - 15))


def plateau(times: Curve, start: float, end: float, rise: float, fall: float) -> Curve:
    """1 from start to end, with rises before and falls after of the given seconds."""
    return ramp((times - start + rise) / rise) * ramp((end + fall - times) / fall)


def window(times: Curve, start: float, end: float) -> slice:
    """The part of a grid that lies between two moments."""
    first, last = np.searchsorted(times, [start, end])
    return slice(int(first), int(last))
