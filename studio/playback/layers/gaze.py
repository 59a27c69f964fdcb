"""Eye darts: the gaze leaves the viewer for a moment and comes back, as it does in talk.

Source: Lee, Badler and Badler 2002, Eyes Alive: size A = -6.9 ln(P / 15.7) degrees for P uniform in 0..15
per cent; eight directions with measured shares; 25 ms + 2.4 ms a degree; while talking the gaze rests on the
other for 93.9 (deviation 94.9) and away for 27.8 (24.0) frames of 1/30 s.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from studio.motion import Motion, rotation
from studio.playback.layers.schedule import Schedule, log_normal, smooth_step

DIRECTIONS = np.array([15.54, 6.46, 17.69, 7.44, 16.80, 7.89, 20.38, 7.79])
"""Share of each direction in per cent, from the right in steps of 45 degrees, up being the third."""
LARGEST = 15.0
"""Degrees; with more the head would turn as well."""
DRIFT = 0.7
"""Degrees between one look at the viewer and the next."""
SHAPE_RANGE = 30.0
"""Degrees of gaze at which a look shape stands at 1."""
_EYES = ("LeftEye", "RightEye")


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
    bones = [motion.bone_names.index(name) for name in _EYES if name in motion.bone_names]
    if bones:
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
    return any(name in bone_names for name in _EYES) or any(gaze_shift(name) for name in shape_names)
