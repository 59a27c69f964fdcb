"""The One-Euro filter, which leaves closures and blinks as quick as they are.

Source: Casiez, Roussel and Vogel 2012, 1€ Filter, doi 10.1145/2207676.2208639.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.motion import rotation
from studio.motion.channels import ARKIT_SHAPES

Floats = NDArray[np.floating]

JUMP = 0.1
"""A closure by more than this between two frames is no noise, and passes at once."""
PIECE = 4096
"""Rows of a long stretch that are smoothed at once."""
# Rows from which on a filter has forgotten how it began: ten seconds, a hundred times its slowest memory.
_SETTLING = 300
_SLOPE_HZ = 5.0
_CLOSING = np.array([
    1.0 if name.startswith(("EyeBlink", "MouthClose", "MouthPress", "MouthRoll")) else
    -1.0 if name.startswith(("JawOpen", "MouthLowerDown", "MouthUpperUp", "MouthFunnel")) else 0.0
    for name in ARKIT_SHAPES
])  # fmt: skip
"""Which way a shape moves when lids or lips close: up, down, or neither."""


@dataclass(frozen=True)
class Smoothing:
    """How much is smoothed.

    Args:
        rest_hz: what passes of a value at rest; lower is calmer.
        speed: Hz more for each unit a second that a value moves.
    """

    rest_hz: float
    speed: float


SHAPES, HEAD = Smoothing(1.7, 3.0), Smoothing(2.5, 20.0)


class OneEuro:
    """Filters values that come one row after another; `closing` as in _CLOSING, (N,)."""

    def __init__(self, smoothing: Smoothing, closing: Floats | None = None) -> None:
        self._smoothing, self._closing = smoothing, closing
        self._t = -math.inf
        self._raw: Floats | None = None
        self._value: Floats = np.zeros(0)
        self._slope: Floats = np.zeros(0)

    def reset(self) -> None:
        """What comes next has nothing to do with what came before."""
        self._raw = None

    def __call__(self, t: float, raw: Floats) -> Floats:
        """The smoothed values (N,) at a moment, seconds; a moment that is not later gives those before."""
        if self._raw is None:
            self._t, self._raw, self._value, self._slope = t, raw, raw, np.zeros(len(raw))
            return raw
        step = t - self._t
        if step <= 0:
            return self._value
        slope = (raw - self._raw) / step
        self._slope = self._slope + _share(_SLOPE_HZ, step) * (slope - self._slope)
        cutoff = self._smoothing.rest_hz + self._smoothing.speed * np.abs(self._slope)
        value = self._value + _share(cutoff, step) * (raw - self._value)
        if self._closing is not None:
            value = np.where(self._closing * (raw - self._value) > JUMP, raw, value)
        self._t, self._raw, self._value = t, raw, value
        return value


class FaceFilter:
    """Smooths weights (52,) and a rotation (4,) of one face as they come."""

    def __init__(self) -> None:
        self._weights, self._turn = OneEuro(SHAPES, _CLOSING), OneEuro(HEAD)
        self._before = rotation.IDENTITY

    def reset(self) -> None:
        """Another face, or the same after a break."""
        self._weights.reset()
        self._turn.reset()

    def __call__(self, t: float, weights: Floats, turn: Floats) -> tuple[Floats, Floats]:
        """Both, smoothed."""
        # q and -q are one rotation: the nearer of the two.
        turn = -turn if float(turn @ self._before) < 0 else turn
        self._before = turn
        return self._weights(t, weights), rotation.normalised(self._turn(t, turn))


def smooth(
    times: Floats, weights: NDArray[np.float32], turns: NDArray[np.float32], rows: NDArray[np.intp]
) -> None:
    """Smooth a whole stretch forwards and backwards, in place, so that nothing of it comes late.

    Piece by piece: forwards the filter goes on from one to the next, backwards it begins some seconds behind
    each, from where on it has long forgotten how it began. Hours then need no more memory than a minute.

    Args:
        times: rising seconds, (T,).
        weights: (T, 52).
        turns: (T, 4).
        rows: those of the stretch, rising.
    """
    onward, start = FaceFilter(), float(times[rows[0]]) if len(rows) else 0.0
    for first in range(0, len(rows), PIECE):
        ahead = rows[first : first + PIECE + _SETTLING]
        piece = ahead[:PIECE]
        raw, raw_turns = weights[ahead].astype(np.float64), rotation.sign_continuous(turns[ahead])
        since = times[ahead] - start
        count = len(piece)
        there = _one_way(onward, since, raw, raw_turns, range(count))
        back = _one_way(FaceFilter(), since[-1] - since, raw, raw_turns, range(len(ahead) - 1, -1, -1))
        closed = _CLOSING * (there[0][:count] - back[0][:count])
        # Of two closures the firmer one: the mean of a blink and of none would be half a blink.
        firm = np.where(closed > 0, there[0][:count], back[0][:count])
        mean = (there[0][:count] + back[0][:count]) / 2
        weights[piece] = np.where(np.abs(closed) > JUMP, firm, mean)
        turns[piece] = rotation.slerp(there[1][:count], back[1][:count], np.full(count, 0.5))


def _one_way(
    face: FaceFilter, times: Floats, weights: Floats, turns: Floats, order: range
) -> tuple[Floats, Floats]:
    """Filtered in one order of the rows; seconds that rise in it."""
    calm, turned = np.empty(weights.shape), np.empty(turns.shape)
    for i in order:
        calm[i], turned[i] = face(float(times[i]), weights[i], turns[i])
    return calm, turned


def _share(cutoff_hz: float | Floats, step: float) -> Floats:
    """How much of a new value is taken, by the cutoff and the seconds since the one before."""
    return np.asarray(1.0 / (1.0 + 1.0 / (2 * math.pi * np.asarray(cutoff_hz) * step)))
