"""Calmer motion in which lips still meet and blinks stay blinks: of a whole motion, and of a stream."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from studio.motion import Motion, Pose, rotation
from studio.motion.channels import is_mouth_shape
from studio.playback.layers.regions import is_lid, vowel

CLOSED = 0.15
"""A mouth shape below this is closing: smoothing leaves it where it was, or lips would never meet."""
BOX_PASSES = 3
GAP = 0.5
"""Seconds without a pose after which a stream begins anew."""


def smoothed(motion: Motion, sigma: float, fps: float | None = None) -> Motion:
    """A whole motion calmed without delay.

    Args:
        motion: T frames.
        sigma: standard deviation of the (near Gaussian) filter in seconds.
        fps: frames per second where `motion` is a piece of another one; its own where None.
    """
    frames = sigma * (motion.fps if fps is None else fps)
    if len(motion) < 3 or frames <= 0:
        return motion
    low = _low_passed(motion.shapes, frames)
    return replace(
        motion,
        shapes=_with_closures(motion.shapes, low, motion.shape_names),
        positions=_low_passed(motion.positions, frames).astype(np.float32),
        rotations=_low_passed_rotations(motion.rotations, frames),
        root_position=_low_passed(motion.root_position, frames).astype(np.float32),
        root_rotation=_low_passed_rotations(motion.root_rotation, frames),
    )


def reach(sigma: float, fps: float) -> int:
    """How many frames before and after a frame decide what `smoothed` makes of it."""
    return BOX_PASSES * _half_width(sigma * fps) if sigma > 0 and fps > 0 else 0


class StreamSmoothing:
    """Smoothing of a stream of poses, which knows no future: it lags by about its time constant.

    Args:
        shape_names: S names of the poses' shapes.
        sigma: time constant in seconds.
    """

    def __init__(self, shape_names: tuple[str, ...], sigma: float) -> None:
        self._names, self._sigma = shape_names, sigma
        self._last: tuple[float, Pose] | None = None

    def pose(self, t: float, pose: Pose) -> Pose:
        """The calmed pose at a moment."""
        last, self._last = self._last, (t, pose)
        if last is None or not 0.0 <= t - last[0] < GAP or self._sigma <= 0:
            return pose
        share = 1.0 - math.exp(-(t - last[0]) / self._sigma)
        before = last[1]
        low = Pose(
            before.shapes + (pose.shapes - before.shapes) * share,
            before.positions + (pose.positions - before.positions) * share,
            _towards(before.rotations, pose.rotations, share),
            before.root_position + (pose.root_position - before.root_position) * share,
            _towards(before.root_rotation, pose.root_rotation, share),
        )
        # The smoothed pose is remembered before lids are put back, or a blink would leak into later frames.
        self._last = (t, low)
        shapes = _with_closures(pose.shapes[None], low.shapes[None].astype(np.float64), self._names)[0]
        return replace(low, shapes=shapes)


def _with_closures(
    original: NDArray[np.float32], low: NDArray[np.float64], names: tuple[str, ...]
) -> NDArray[np.float32]:
    """Calmed shapes (T, S) with blinks as they were, and a mouth that closes when it closed."""
    for i, name in enumerate(names):
        if is_lid(name):
            low[:, i] = original[:, i]
        elif is_mouth_shape(name) or vowel(name):
            keep = np.clip(1.0 - original[:, i] / CLOSED, 0.0, 1.0)
            low[:, i] += keep * (original[:, i] - low[:, i])
    return np.clip(low, 0.0, 1.0).astype(np.float32)


def _towards(a: NDArray[np.float32], b: NDArray[np.float32], share: float) -> NDArray[np.float32]:
    # q and -q are one rotation: the nearer of the two, or the mean would turn the long way round.
    nearer = np.where((a * b).sum(axis=-1, keepdims=True) < 0, -b, b)
    return rotation.normalised(a + (nearer - a) * share).astype(np.float32)


def _low_passed_rotations(q: NDArray[np.float32], frames: float) -> NDArray[np.float32]:
    # Neighbours are sign-continuous and close, so their chord mean is their geodesic mean.
    return rotation.normalised(_low_passed(q, frames)).astype(np.float32)


def _low_passed(values: NDArray[np.floating], sigma: float) -> NDArray[np.float64]:
    """Values (T, ...) through three box filters, near a Gaussian of sigma frames; ends are held.

    Source: Kovesi 2010, Fast almost-Gaussian filtering.
    """
    out = np.asarray(values, dtype=np.float64)
    half = _half_width(sigma)
    for _ in range(BOX_PASSES):
        # One more in front than behind: the difference of two sums needs a first one to subtract.
        padded = np.concatenate([out[:1].repeat(half + 1, 0), out, out[-1:].repeat(half, 0)])
        total = np.cumsum(padded, axis=0)
        out = (total[2 * half + 1 :] - total[: -2 * half - 1]) / (2 * half + 1)
    return out


def _half_width(sigma: float) -> int:
    """Frames on either side of the middle of one box, for a filter of sigma frames."""
    width = np.sqrt(12.0 * sigma**2 / BOX_PASSES + 1.0)
    return max(round((width - 1.0) / 2.0), 1)
