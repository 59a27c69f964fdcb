"""What is laid over a motion without changing it: strength, smoothing, offset. Motion -> Motion, pure."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from studio.motion import Motion, rotation
from studio.motion.channels import is_blink_shape, is_mouth_shape

CLOSED = 0.15
"""A mouth shape below this is closing: smoothing leaves it where it was, or lips would never meet."""
BOX_PASSES = 3
HEAD_BONES = frozenset({"Neck", "Head", "LeftEye", "RightEye", "Jaw"})


@dataclass(frozen=True)
class Tuning:
    """How a motion is shown, sent and exported.

    Args:
        face: factor on blend shapes, 0 to 2.
        head: factor on how far neck, head and eyes swing about their mean, 0 to 2.
        body: the same for all other bones.
        smoothing: standard deviation of the smoothing in seconds, 0 to 0.3; closures and blinks stay sharp.
        offset_ms: how much later the motion comes against the sound.
    """

    face: float = 1.0
    head: float = 1.0
    body: float = 1.0
    smoothing: float = 0.0
    offset_ms: float = 0.0

    @property
    def neutral(self) -> bool:
        """Whether it changes nothing."""
        return self == Tuning()


def tuned(motion: Motion, tuning: Tuning) -> Motion:
    """A motion with all layers of a tuning applied."""
    if tuning.smoothing > 0:
        motion = smoothed(motion, tuning.smoothing)
    if (tuning.face, tuning.head, tuning.body) != (1.0, 1.0, 1.0):
        motion = strengthened(motion, tuning.face, tuning.head, tuning.body)
    if tuning.offset_ms:
        motion = motion.shifted(tuning.offset_ms / 1000.0)
    return motion


def strengthened(motion: Motion, face: float, head: float, body: float) -> Motion:
    """Shapes scaled (and kept in 0..1); bones swung further about their mean rotation.

    Args:
        motion: T frames.
        face, head, body: factors; 1 changes nothing, 0 holds still.
    """
    shapes = np.clip(motion.shapes * face, 0.0, 1.0).astype(np.float32)
    factors = np.array([head if name in HEAD_BONES else body for name in motion.bone_names])
    rotations, root = motion.rotations, motion.root_position
    if len(motion) and np.any(factors != 1.0):
        rotations = _swung(rotations, factors).astype(np.float32)
    if len(motion) and body != 1.0:
        middle = root.mean(axis=0)
        root = (middle + (root - middle) * body).astype(np.float32)
    return replace(motion, shapes=shapes, rotations=rotations, root_position=root)


def smoothed(motion: Motion, sigma: float) -> Motion:
    """Calmer motion without delay; lips still meet and blinks stay blinks.

    Args:
        motion: T frames.
        sigma: standard deviation of the (near Gaussian) filter in seconds.
    """
    frames = sigma * motion.fps
    if len(motion) < 3 or frames <= 0:
        return motion
    calm = _low_passed(motion.shapes, frames)
    for i, name in enumerate(motion.shape_names):
        original = motion.shapes[:, i]
        if is_blink_shape(name):
            calm[:, i] = original
        elif is_mouth_shape(name):
            keep = np.clip(1.0 - original / CLOSED, 0.0, 1.0)
            calm[:, i] += keep * (original - calm[:, i])
    return replace(
        motion,
        shapes=np.clip(calm, 0.0, 1.0).astype(np.float32),
        positions=_low_passed(motion.positions, frames).astype(np.float32),
        rotations=_calm_rotations(motion.rotations, frames),
        root_position=_low_passed(motion.root_position, frames).astype(np.float32),
        root_rotation=_calm_rotations(motion.root_rotation, frames),
    )


def _calm_rotations(q: NDArray[np.float32], frames: float) -> NDArray[np.float32]:
    # Neighbours are sign-continuous and close, so their chord mean is their geodesic mean.
    return rotation.normalised(_low_passed(q, frames)).astype(np.float32)


def _swung(q: NDArray[np.float32], factors: NDArray[np.floating]) -> NDArray[np.floating]:
    """Rotations (T, J, 4) with their distance from the mean over T scaled by a factor a bone (J,)."""
    mean = rotation.normalised(q.mean(axis=0, dtype=np.float64))
    away = rotation.multiply(rotation.inverse(mean), q)
    away = np.where(away[..., 3:] < 0, -away, away)
    sine = np.linalg.norm(away[..., :3], axis=-1)
    angle = 2.0 * np.arctan2(sine, away[..., 3])
    axis = away[..., :3] / np.maximum(sine, 1e-12)[..., None]
    scaled = rotation.from_axis_angle(axis, np.minimum(angle * factors, np.pi))
    return rotation.sign_continuous(rotation.normalised(rotation.multiply(mean, scaled)))


def _low_passed(values: NDArray[np.floating], sigma: float) -> NDArray[np.float64]:
    """Values (T, ...) through three box filters, near a Gaussian of sigma frames; ends are held.

    Source: Kovesi 2010, Fast almost-Gaussian filtering.
    """
    out = np.asarray(values, dtype=np.float64)
    width = np.sqrt(12.0 * sigma**2 / BOX_PASSES + 1.0)
    half = max(round((width - 1.0) / 2.0), 1)
    for _ in range(BOX_PASSES):
        padded = np.concatenate([out[:1].repeat(half + 1, 0), out, out[-1:].repeat(half, 0)])
        total = np.cumsum(padded, axis=0)
        out = (total[2 * half + 1 :] - total[: -2 * half - 1]) / (2 * half + 1)
    return out
