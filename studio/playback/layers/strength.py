"""Strength of motion: blend shapes scaled, bones swung further or less far about their mean.

Every frame is worked out from itself and the reference alone.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from studio.motion import Motion, rotation
from studio.playback.layers.regions import Reference, bone_region, is_lid, shape_region, vowel
from studio.playback.layers.tuning import Tuning

RIVAL = 0.05
"""How far below the second strongest vowel another one has to be to vanish; between them it fades."""


def strengthened(motion: Motion, tuning: Tuning, reference: Reference) -> Motion:
    """Shapes scaled (and kept in 0..1), bones and root swung about the reference.

    Args:
        motion: T frames.
        tuning: its strengths; a region at 1 comes back bit for bit.
        reference: the posture of the same J bones.
    """
    if any(shape_factor(tuning, name) != 1.0 for name in motion.shape_names):
        factors = np.array([shape_factor(tuning, name) for name in motion.shape_names])
        motion = replace(motion, shapes=_scaled(motion.shapes, factors, np.zeros(len(factors))))
    return _swung(motion, tuning, reference)


def shape_factor(tuning: Tuning, name: str) -> float:
    """The strength of a blend shape; blinks stay whole, and "Neutral" is no movement."""
    if is_lid(name) or name.lower() == "neutral":
        return 1.0
    return tuning.strength(shape_region(name))


def single_shapes(motion: Motion, tuning: Tuning) -> Motion:
    """Gain and lift of single blend shapes, kept in 0..1."""
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
    factors = np.array([tuning.strength(bone_region(name)) for name in motion.bone_names])
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
    away = np.where(away[..., 3:] < 0, -away, away)
    sine = np.linalg.norm(away[..., :3], axis=-1)
    angle = 2.0 * np.arctan2(sine, away[..., 3])
    axis = away[..., :3] / np.maximum(sine, 1e-12)[..., None]
    scaled = rotation.from_axis_angle(axis, np.minimum(angle * factors, np.pi))
    turned = rotation.normalised(rotation.multiply(mean, scaled))
    # Never more than half a turn from where it was: with the sign that is nearer it stays continuous.
    return np.where((turned * q).sum(axis=-1, keepdims=True) < 0, -turned, turned).astype(np.float64)
