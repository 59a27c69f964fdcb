"""Motion on even frames: the rate that was meant, the frames compared and learnt, and which of them count."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from studio.motion.motion import Motion
from studio.motion.standing import planted, standing

Floats = NDArray[np.float32]

LONGEST_GAP = 0.25
"""Seconds without a motion frame that may be filled by going straight from one to the next."""

STANDARD_RATES = (23.976, 24.0, 25.0, 29.97, 30.0, 48.0, 50.0, 60.0, 72.0, 75.0, 90.0, 100.0, 120.0)


@dataclass(frozen=True, eq=False)
class Grid:
    """Motion on even frames.

    Args:
        motion: T frames at i / fps.
        valid: 1 where the frame was captured and is not excluded, float32 (T,).
    """

    motion: Motion
    valid: Floats


def nominal_rate(fps: float) -> float:
    """The frame rate that was meant by a measured one: a standard rate within 1.5 %, else as measured."""
    nearest = min(STANDARD_RATES, key=lambda rate: abs(rate - fps))
    return nearest if abs(nearest - fps) <= 0.015 * fps else round(fps, 2)


def learnt_rate(fps: float, most_fps: float) -> Fraction:
    """The rate learnt for takes of a rate: a whole fraction of it, not above most_fps (where possible)."""
    rate = Fraction(nominal_rate(fps)).limit_denominator(1001)
    divisor = 1
    while rate / divisor > most_fps * 1.001:
        divisor += 1
    return rate / divisor


def on_grid(
    motion: Motion,
    duration: float,
    fps: Fraction,
    excluded: Sequence[tuple[float, float]] = (),
    *,
    feet_stay: bool = True,
) -> Grid:
    """A motion on the frames i / fps from 0 to its end or the sound's, whichever is first.

    Where in the room it stands is in its root, so that the body itself stays in place.

    Args:
        motion: times from the in point, seconds.
        duration: of the sound, seconds.
        fps: frames a second.
        excluded: spans left out, seconds from the in point.
        feet_stay: as it is learnt, without steps, which would slide; as it was captured where False.
    """
    end = min(float(motion.times[-1]), duration + LONGEST_GAP) if len(motion) else 0.0
    count = max(0, int(np.floor(end * float(fps) + 1e-6)) + 1) if len(motion) else 0
    times = np.arange(count) * fps.denominator / fps.numerator
    half = 0.5 / float(fps)
    valid = np.ones(count, dtype=np.float32)
    if count:
        valid[(times < motion.times[0] - half) | (times > motion.times[-1] + half)] = 0
        for gap in np.flatnonzero(np.diff(motion.times) > LONGEST_GAP):
            valid[(times > motion.times[gap] + half) & (times < motion.times[gap + 1] - half)] = 0
    for start, stop in excluded:
        valid[(times >= start) & (times < stop)] = 0
    body = standing(motion.at(times))
    return Grid(planted(body) if feet_stay else body, valid)
