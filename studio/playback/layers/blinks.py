"""Blinks at human intervals, on top of those a motion has.

Source: Bentivoglio et al. 1997, Analysis of blink rate patterns in normal subjects (17 a minute at rest,
26 in conversation, 4.5 reading; log-normal); VanderWerf et al. 2003, Eyelid movements (lids close about twice
as fast as they open); Trutoiu et al. 2011, Modeling and animating eye blinks (fast down, slow up).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from studio.motion import Motion
from studio.playback.layers.regions import lid_sides
from studio.playback.layers.schedule import Schedule, log_normal, smooth_step

APART = 0.8
"""Seconds from one blink's beginning to the next at the least; the longest blink is shorter."""
SPREAD = 0.8
"""Standard deviation of the intervals, as a share of their mean."""
CLOSING, SHUT, OPENING = (0.100, 0.150), 0.034, (0.170, 0.250)
"""Seconds; a lid that is shut for a thirtieth is seen shut at 30 frames a second."""
LONGEST = CLOSING[1] + SHUT + OPENING[1]
"""Seconds that no blink exceeds."""
CLEAR = 1.0
"""Seconds about an inferred blink in which none is added."""
INFERRED = 0.5
"""A lid closed more than this blinks by itself."""


class Blinks:
    """Lids as a function of time.

    Args:
        per_minute: how many on average, above 0.
        seed: which draw.
    """

    def __init__(self, per_minute: float, seed: int) -> None:
        rest = max(60.0 / per_minute - APART, 0.05)
        free = log_normal(rest, SPREAD * 60.0 / per_minute)
        self._schedule = Schedule(seed, 1, 2, lambda normal: APART + free(normal))
        self._parts = np.zeros((0, 2))

    def events(self, end: float) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Beginning, seconds of closing and seconds of opening of each blink (K,) until a moment."""
        self._schedule.reach(end)
        draws = self._schedule.draws
        if len(draws) > len(self._parts):
            low, high = np.array([CLOSING[0], OPENING[0]]), np.array([CLOSING[1], OPENING[1]])
            self._parts = np.clip((low + high) / 2.0 + draws * (high - low) / 4.0, low, high)
        return self._schedule.starts, self._parts[:, 0], self._parts[:, 1]

    def lids(
        self, times: NDArray[np.float64], inferred: NDArray[np.float64], ahead: float = CLEAR
    ) -> NDArray[np.float64]:
        """How far the lids are closed, 0 to 1.

        Args:
            times: seconds (T,).
            inferred: moments at which the motion blinks by itself, rising (M,).
            ahead: seconds after a blink in which an inferred one keeps it away; 0 for a stream, which cannot
                know what comes.
        """
        if not len(times):
            return np.zeros(0)
        starts, closing, opening = self.events(float(times.max()))
        number = self._schedule.running(times)
        k = np.maximum(number, 0)
        start, c, o = starts[k], closing[k], opening[k]
        x = times - start
        rising = np.clip((x - c - SHUT) / o, 0.0, 1.0)
        level = np.where(x < c, smooth_step(x / c), (1.0 - smooth_step(rising)) ** 1.5)
        end = start + (c + SHUT + o + ahead if ahead > 0 else 0.0)
        near = np.searchsorted(inferred, end, side="right") > np.searchsorted(inferred, start - CLEAR)
        return np.where((number >= 0) & ~near, level, 0.0)


def blinking(motion: Motion, blinks: Blinks, inferred: NDArray[np.float64], ahead: float = CLEAR) -> Motion:
    """A motion with blinks added to what it does by itself.

    Args:
        motion: T frames; without shapes for the lids it comes back as it is.
        blinks: when.
        inferred, ahead: see Blinks.lids.
    """
    both, single = lid_sides(motion.shape_names)
    if not both and not single:
        return motion
    level = blinks.lids(motion.times, inferred, ahead)
    shapes = motion.shapes.copy()
    if both:
        # A shape for both lids adds up with those of one: together they may not close more than fully.
        sides = shapes[:, single].max(axis=1) if single else np.zeros(len(level))
        columns, level = both[:1], np.minimum(level, 1.0 - sides)
    else:
        columns = single
    for column in columns:
        shapes[:, column] = np.maximum(shapes[:, column], level)
    return replace(motion, shapes=shapes)


def blinks_of(motion: Motion) -> NDArray[np.float64]:
    """The moments at which a motion closes a lid by itself, rising (M,)."""
    both, single = lid_sides(motion.shape_names)
    columns = [*both, *single]
    if not columns:
        return np.zeros(0)
    return motion.times[motion.shapes[:, columns].max(axis=1) > INFERRED]
