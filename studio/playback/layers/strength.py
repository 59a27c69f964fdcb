"""Strength and smoothing of motion: shapes scaled, bones swung further or less far, jitter taken out.

Strength works out every frame from itself and the reference alone. Smoothing leaves lips meeting and blinks
blinks, of a whole motion and of a stream.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from studio.motion import Motion, Pose, rotation
from studio.motion.channels import is_mouth_shape
from studio.playback.layers.regions import Reference, bone_region, is_lid, shape_region, vowel
from studio.playback.layers.tuning import Tuning

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
    # Fewer frames have no neighbours to be smoothed with.
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
            rotation.towards(before.rotations, pose.rotations, share).astype(np.float32),
            before.root_position + (pose.root_position - before.root_position) * share,
            rotation.towards(before.root_rotation, pose.root_rotation, share).astype(np.float32),
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


RIVAL = 0.05
"""How far below the second strongest vowel another one has to be to vanish; between them it fades."""


def strengthened(motion: Motion, tuning: Tuning, reference: Reference) -> Motion:
    """Shapes scaled (and kept in 0..1), bones and root swung about the reference.

    Args:
        motion: T frames.
        tuning: its strengths; a region at 1 comes back bit for bit.
        reference: the posture of the same J bones.
    """
    factors = _shape_factors(tuning, motion.shape_names)
    if (factors != 1.0).any():
        motion = replace(motion, shapes=_scaled(motion.shapes, factors, np.zeros(len(factors))))
    return _swung(motion, tuning, reference)


# A stream asks sixty times a second for the same channels and the same tuning.
@lru_cache(maxsize=64)
def _shape_factors(tuning: Tuning, names: tuple[str, ...]) -> NDArray[np.float64]:
    return np.array([shape_factor(tuning, name) for name in names])


@lru_cache(maxsize=64)
def _bone_factors(tuning: Tuning, names: tuple[str, ...]) -> NDArray[np.float64]:
    return np.array([tuning.strength(bone_region(name)) for name in names])


def shape_factor(tuning: Tuning, name: str) -> float:
    """The strength of a blend shape; blinks stay whole, and "Neutral" is no movement."""
    if is_lid(name) or name.lower() == "neutral":
        return 1.0
    return tuning.strength(shape_region(name))


def single_shapes(motion: Motion, tuning: Tuning) -> Motion:
    """Gain and lift of single blend shapes, kept in 0..1."""
    if not tuning.shapes:
        return motion
    wanted = [tuning.shape(name) for name in motion.shape_names]
    if all(one.neutral for one in wanted):
        return motion
    gains, lifts = np.array([one.gain for one in wanted]), np.array([one.lift for one in wanted])
    return replace(motion, shapes=_scaled(motion.shapes, gains, lifts))


def two_vowels(motion: Motion) -> Motion:
    """No more than the two strongest of A, I, U, E, O at a time, without a jump where they change places.

    Mixed mouths of many vowels look like mumbling; two are what viewers read.
    """
    columns = [i for i, name in enumerate(motion.shape_names) if vowel(name)]
    if len(columns) < 3:
        return motion
    shapes = motion.shapes.copy()
    values = shapes[:, columns].astype(np.float64)
    second = np.sort(values, axis=1)[:, -2:-1]
    shapes[:, columns] = values * np.clip(1.0 - (second - values) / RIVAL, 0.0, 1.0)
    return replace(motion, shapes=shapes)


def _scaled(
    shapes: NDArray[np.float32], gains: NDArray[np.float64], lifts: NDArray[np.float64]
) -> NDArray[np.float32]:
    """Shapes (T, S) x gains + lifts (S,) in 0..1; columns that change nothing stay bit for bit."""
    out = shapes.copy()
    changed = np.flatnonzero((gains != 1.0) | (lifts != 0.0))
    out[:, changed] = np.clip(shapes[:, changed] * gains[changed] + lifts[changed], 0.0, 1.0)
    return out


def _swung(motion: Motion, tuning: Tuning, reference: Reference) -> Motion:
    factors = _bone_factors(tuning, motion.bone_names)
    changed = np.flatnonzero(factors != 1.0)
    if len(changed):
        rotations = motion.rotations.copy()
        rotations[:, changed] = _turned(rotations[:, changed], reference.rotations[changed], factors[changed])
        motion = replace(motion, rotations=rotations)
    torso = tuning.strength("torso")
    if torso == 1.0 or not motion.bone_names:
        return motion
    root = reference.root_position + (motion.root_position - reference.root_position) * torso
    motion = replace(motion, root_position=root.astype(np.float32))
    if "Hips" in motion.bone_names:
        hips = motion.bone_names.index("Hips")
        positions, mean = motion.positions.copy(), reference.positions[hips]
        positions[:, hips] = mean + (positions[:, hips] - mean) * torso
        motion = replace(motion, positions=positions)
    return motion


def _turned(
    q: NDArray[np.float32], mean: NDArray[np.float64], factors: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Rotations (T, J, 4) with their distance from a mean (J, 4) scaled by a factor a bone (J,)."""
    away = rotation.multiply(rotation.inverse(mean), q)
    # Of the two signs the shorter way, so that a factor scales the turn and not its complement.
    away = np.where(away[..., 3:] < 0, -away, away)
    sine = np.linalg.norm(away[..., :3], axis=-1)
    angle = 2.0 * np.arctan2(sine, away[..., 3])
    axis = away[..., :3] / np.maximum(sine, 1e-12)[..., None]
    scaled = rotation.from_axis_angle(axis, np.minimum(angle * factors, np.pi))
    turned = rotation.normalised(rotation.multiply(mean, scaled))
    # Never more than half a turn from where it was: with the sign that is nearer it stays continuous.
    return np.where((turned * q).sum(axis=-1, keepdims=True) < 0, -turned, turned).astype(np.float64)
