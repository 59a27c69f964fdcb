"""What a body does by itself: blinks, eye darts, breath and sway, each a function of time and a seed.

Sources:
    Blinks: Bentivoglio et al. 1997, Analysis of blink rate patterns in normal subjects (17 a minute at
    rest, 26 in conversation, 4.5 reading; log-normal); VanderWerf et al. 2003, Eyelid movements (lids
    close about twice as fast as they open); Trutoiu et al. 2011, Modeling and animating eye blinks (fast
    down, slow up).
    Darts: Lee, Badler and Badler 2002, Eyes Alive: size A = -6.9 ln(P / 15.7) degrees for P uniform in
    0..15 per cent; eight directions with measured shares; 25 ms + 2.4 ms a degree; while talking the gaze
    rests on the other for 93.9 (deviation 94.9) and away for 27.8 (24.0) frames of 1/30 s.
    Breath and sway: Guyton and Hall, Textbook of Medical Physiology (12 to 15 breaths a minute at rest,
    breathing out takes longer than in); Winter 1995, Human balance and posture control during standing
    and walking (quiet sway lies below 0.5 Hz, and there is less of it the faster it is).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from studio.motion import Motion, rotation
from studio.playback.layers.regions import lid_sides

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
        # In chunks of a fixed size: the draws of a seed are the same however far they are asked for at a
        # time.
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


def smooth_step(x: ArrayLike) -> NDArray[np.float64]:
    """0 to 1 without a corner at either end."""
    x = np.clip(np.asarray(x, dtype=np.float64), 0.0, 1.0)
    return x * x * (3.0 - 2.0 * x)


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


DIRECTIONS = np.array([15.54, 6.46, 17.69, 7.44, 16.80, 7.89, 20.38, 7.79])
"""Share of each direction in per cent, from the right in steps of 45 degrees, up being the third."""
LARGEST = 15.0
"""Degrees; with more the head would turn as well."""
DRIFT = 0.7
"""Degrees between one look at the viewer and the next."""
SHAPE_RANGE = 30.0
"""Degrees of gaze at which a look shape stands at 1."""
_EYE_BONES = ("LeftEye", "RightEye")


class Saccades:
    """Where the eyes look, as a function of time.

    Args:
        amount: size, 1 as in life.
        seed: which draw.
    """

    def __init__(self, amount: float, seed: int) -> None:
        self._amount = amount
        on, away = log_normal(93.9 / 30.0, 94.9 / 30.0), log_normal(27.8 / 30.0, 24.0 / 30.0)

        def intervals(normal: NDArray[np.float64]) -> NDArray[np.float64]:
            # Chunks are of even length: the first, third, ... fixation is on the viewer, and a dart ends it.
            seconds = np.where(np.arange(len(normal)) % 2 == 0, on(normal), away(normal))
            return np.clip(seconds, 0.15, 12.0)

        self._schedule = Schedule(seed, 2, 3, intervals)
        self._landings = np.zeros((0, 2))

    def angles(self, times: NDArray[np.float64]) -> NDArray[np.float64]:
        """Degrees to the avatar's right and up (T, 2)."""
        if not len(times):
            return np.zeros((0, 2))
        number = self._schedule.running(times)
        targets, k = self.targets(), np.maximum(number, 0)
        target, before = targets[k], np.where((k > 0)[:, None], targets[np.maximum(k - 1, 0)], 0.0)
        way = target - before
        seconds = 0.025 + 0.0024 * np.sqrt((way * way).sum(axis=1))
        gone = smooth_step((times - self._schedule.starts[k]) / seconds)[:, None]
        return np.where((number >= 0)[:, None], before + way * gone, 0.0)

    def targets(self) -> NDArray[np.float64]:
        """Where each dart drawn so far lands (K, 2), every second one near the viewer."""
        draws = self._schedule.draws
        if len(draws) == len(self._landings):
            return self._landings
        chance = np.array([[0.5 * math.erfc(-x / math.sqrt(2.0)) for x in draw[:2]] for draw in draws])
        size = np.minimum(-6.9 * np.log(np.maximum(15.0 * chance[:, 0], 1e-6) / 15.7), LARGEST)
        shares = np.cumsum(DIRECTIONS / DIRECTIONS.sum())
        turn = np.radians(45.0) * np.searchsorted(shares[:-1], chance[:, 1])
        away = size[:, None] * np.stack([np.cos(turn), np.sin(turn)], axis=1)
        home = DRIFT * np.clip(draws[:, 1:3], -1.5, 1.5)
        self._landings = self._amount * np.where((np.arange(len(draws)) % 2 == 0)[:, None], away, home)
        return self._landings


def with_saccades(motion: Motion, darts: Saccades) -> Motion:
    """A motion whose eyes dart: by its eye bones, else by its look shapes, else as it is."""
    bones = [motion.bone_names.index(name) for name in _EYE_BONES if name in motion.bone_names]
    if bones:
        # Both eyes alike: eyes that dart apart squint.
        right, up = np.radians(darts.angles(motion.times)).T
        turn = rotation.from_euler_yxz(right, -up, np.zeros_like(up))
        rotations = motion.rotations.copy()
        rotations[:, bones] = rotation.multiply(rotations[:, bones], turn[:, None])
        return replace(motion, rotations=rotations)
    columns = [(i, way) for i, name in enumerate(motion.shape_names) if (way := gaze_shift(name)) is not None]
    if not columns:
        return motion
    angles, shapes = darts.angles(motion.times), motion.shapes.copy()
    for column, way in columns:
        share = np.maximum(angles @ np.array(way), 0.0) / SHAPE_RANGE
        shapes[:, column] = np.clip(shapes[:, column] + share, 0.0, 1.0)
    return replace(motion, shapes=shapes)


def gaze_shift(name: str) -> tuple[float, float] | None:
    """Where a look shape of VRM 0, VRM 1 or ARKit turns the eye (right, up); None for other shapes."""
    low = name.lower()
    for start in ("look", "eyelook"):
        if low.startswith(start):
            return _WAYS.get(low.removeprefix(start))
    return None


_WAYS = {
    "up": (0.0, 1.0), "down": (0.0, -1.0), "left": (-1.0, 0.0), "right": (1.0, 0.0),
    "upleft": (0.0, 1.0), "upright": (0.0, 1.0), "downleft": (0.0, -1.0), "downright": (0.0, -1.0),
    "inleft": (1.0, 0.0), "outleft": (-1.0, 0.0), "inright": (-1.0, 0.0), "outright": (1.0, 0.0),
}  # fmt: skip


def has_eyes(shape_names: tuple[str, ...], bone_names: tuple[str, ...]) -> bool:
    """Whether anything there turns the eyes."""
    return any(name in bone_names for name in _EYE_BONES) or any(gaze_shift(name) for name in shape_names)


BREATH_SECONDS = 4.3
SWAY_HZ = np.array([0.043, 0.071, 0.113, 0.179, 0.283])

Angles = NDArray[np.float64]

# Degrees about x, y and z at the top of a breath: the chest opens, shoulders rise, the head stays level.
_BREATH: dict[str, tuple[float, float, float]] = {
    "Chest": (-0.9, 0.0, 0.0), "UpperChest": (-0.9, 0.0, 0.0),
    "Neck": (0.8, 0.0, 0.0), "Head": (0.8, 0.0, 0.0),
    "LeftShoulder": (0.0, 0.0, -1.8), "RightShoulder": (0.0, 0.0, 1.8),
    "LeftUpperArm": (0.0, 0.0, 1.4), "RightUpperArm": (0.0, 0.0, -1.4),
}  # fmt: skip
# Degrees about x, y and z; one standard deviation of each wave.
_SWAY: dict[str, tuple[float, float, float]] = {
    "Spine": (0.7, 0.5, 0.9), "Chest": (-0.3, 0.4, -0.4), "Neck": (0.3, 0.6, 0.3), "Head": (0.5, 0.9, 0.5),
}  # fmt: skip


def breathing(motion: Motion, amount: float) -> Motion:
    """A motion that breathes, by its chest and shoulders; amount 1 as in life."""
    level = breath_at(motion.times)[:, None] * amount
    return _leant(motion, {bone: level * np.array(degrees) for bone, degrees in _BREATH.items()})


def swaying(motion: Motion, amount: float, seed: int) -> Motion:
    """A motion that sways a little, hips and feet apart; amount 1 as in life."""
    return _leant(
        motion,
        {
            bone: amount * np.array(degrees) * sway_at(motion.times, seed, number)
            for number, (bone, degrees) in enumerate(_SWAY.items())
        },
    )


def breath_at(times: Angles) -> Angles:
    """How full the lungs are, 0 to 1, at some moments (T,)."""
    phase = 2.0 * np.pi * (times / BREATH_SECONDS + 0.05 * np.sin(2.0 * np.pi * times / 31.0))
    # In takes two fifths of a breath, out the rest.
    return 0.5 - 0.5 * np.cos(phase + 0.695 * np.sin(phase / 2.0) ** 2)


def sway_at(times: Angles, seed: int, number: int) -> Angles:
    """Three slow waves (T, 3) of about one standard deviation, different for each seed and number."""
    phases, pace, size = _waves(seed, number)
    return np.asarray((size * np.sin(2.0 * np.pi * times[:, None, None] * pace + phases)).sum(axis=-1))


@lru_cache(maxsize=64)
def _waves(seed: int, number: int) -> tuple[Angles, Angles, Angles]:
    """Phases (3, W), frequencies (3, W) and sizes (W,) of the waves of one bone."""
    # Seeded by bone: another bone that is added changes nothing of the others.
    random = np.random.default_rng((abs(seed), 3, number))
    phases = random.uniform(0.0, 2.0 * np.pi, (3, len(SWAY_HZ)))
    pace = SWAY_HZ * random.uniform(0.9, 1.1, (3, len(SWAY_HZ)))
    size = SWAY_HZ[0] / SWAY_HZ
    return phases, pace, size / np.sqrt((size**2).sum() / 2.0)


def _leant(motion: Motion, degrees: dict[str, Angles]) -> Motion:
    """Bones turned further by angles about x, y, z (T, 3); those that are missing are left out."""
    there = {
        motion.bone_names.index(bone): turn for bone, turn in degrees.items() if bone in motion.bone_names
    }
    if not there:
        return motion
    bones, angles = list(there), np.radians(np.stack(list(there.values()), axis=1))
    turn = rotation.from_euler_yxz(angles[..., 1], angles[..., 0], angles[..., 2])
    rotations = motion.rotations.copy()
    rotations[:, bones] = rotation.multiply(rotations[:, bones], turn)
    return replace(motion, rotations=rotations)
