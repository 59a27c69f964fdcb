"""A leg whose foot is to stand somewhere: how it bends, and by how much its hip is too high for it.

Source: two-bone inverse kinematics by the law of cosines, the knee kept in the plane it was in.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from studio.motion import rotation

Array = NDArray[np.float64]

PARTS = ("UpperLeg", "LowerLeg", "Foot")
"""Bones of a leg, each after its side."""
STRETCH = 0.9995
"""A leg is never straighter than this share of its length: near straight a knee snaps."""
FORWARD = np.array([0.0, 0.0, 1.0])


def too_high(joints: Array, ground: Array) -> Array:
    """Metres by which hips are too high for a foot to reach where it belongs (T,).

    Args:
        joints: hip, knee and ankle (T, 3, 3).
        ground: where the ankle belongs (T, 3).
    """
    hip, knee, ankle = (joints[:, i] for i in range(3))
    reach = STRETCH * (length(knee - hip) + length(ankle - knee))[:, 0]
    way = hip - ground
    highest = np.sqrt(np.maximum(reach**2 - way[:, 0] ** 2 - way[:, 2] ** 2, 0.0))
    return np.asarray(way[:, 1] - highest)


def bent(joints: Array, turns: Array, ground: Array) -> tuple[Array, Array]:
    """How thigh and shin are turned (T, 4) where the ankle reaches for the ground.

    Args:
        joints, ground: as for `too_high`.
        turns: of thigh and shin as they are (T, 2, 4).
    """
    hip, knee, ankle = (joints[:, i] for i in range(3))
    thigh, shin = length(knee - hip), length(ankle - knee)
    way = ground - hip
    reach = np.clip(length(way), np.abs(thigh - shin) + 1e-6, STRETCH * (thigh + shin))
    way = way / np.maximum(length(way), 1e-9)
    cosine = np.clip((thigh**2 + reach**2 - shin**2) / np.maximum(2.0 * thigh * reach, 1e-9), -1.0, 1.0)
    # A leg that is straight has its knee in no plane: it bends forwards.
    side = (knee - hip) + 0.05 * rotation.rotate(turns[:, 0], FORWARD)
    side = side - (side * way).sum(axis=-1, keepdims=True) * way
    side = side / np.maximum(length(side), 1e-9)
    bend = way * thigh * cosine + side * thigh * np.sqrt(1.0 - cosine**2)
    first = _arc(knee - hip, bend)
    second = _arc(np.asarray(rotation.rotate(first, ankle - knee)), way * reach - bend)
    upper = rotation.multiply(first, turns[:, 0])
    lower = rotation.multiply(second, rotation.multiply(first, turns[:, 1]))
    return np.asarray(upper), np.asarray(lower)


def length(v: Array) -> Array:
    """Of vectors (..., 3), (..., 1)."""
    return np.asarray(np.linalg.norm(v, axis=-1, keepdims=True))


def _arc(a: Array, b: Array) -> Array:
    """The shortest turn from one direction to another (T, 4)."""
    a, b = a / np.maximum(length(a), 1e-9), b / np.maximum(length(b), 1e-9)
    w = 1.0 + (a * b).sum(axis=-1, keepdims=True)
    return np.asarray(rotation.normalised(np.concatenate([rotation.cross(a, b), w], axis=-1)))
