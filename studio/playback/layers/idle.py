"""Breath and sway: what a body does that does nothing. Sums of slow waves, so a function of time alone.

Source: Guyton and Hall, Textbook of Medical Physiology (12 to 15 breaths a minute at rest, breathing out
takes longer than in); Winter 1995, Human balance and posture control during standing and walking (quiet sway
lies below 0.5 Hz, and there is less of it the faster it is).
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from studio.motion import Motion, rotation

BREATH_SECONDS = 4.3
SWAY_HZ = np.array([0.043, 0.071, 0.113, 0.179, 0.283])

Angles = NDArray[np.float64]

_BREATH: dict[str, tuple[float, float, float]] = {
    "Chest": (-0.9, 0.0, 0.0), "UpperChest": (-0.9, 0.0, 0.0),
    "Neck": (0.8, 0.0, 0.0), "Head": (0.8, 0.0, 0.0),
    "LeftShoulder": (0.0, 0.0, -1.8), "RightShoulder": (0.0, 0.0, 1.8),
    "LeftUpperArm": (0.0, 0.0, 1.4), "RightUpperArm": (0.0, 0.0, -1.4),
}  # fmt: skip
"""Degrees about x, y and z at the top of a breath: the chest opens, shoulders rise, the head stays level."""
_SWAY: dict[str, tuple[float, float, float]] = {
    "Spine": (0.7, 0.5, 0.9), "Chest": (-0.3, 0.4, -0.4), "Neck": (0.3, 0.6, 0.3), "Head": (0.5, 0.9, 0.5),
}  # fmt: skip
"""Degrees about x, y and z; one standard deviation of each wave."""


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
