"""Legs that keep both feet flat on the floor while the hips sway: two bones and a hinge, solved exactly."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from studio.motion import rotation
from studio.motion.skeleton import REST_OFFSETS

Array = NDArray[np.floating]

STANCE = 0.115
"""Metres from the middle to each ankle."""
TOES_OUT_DEG = 8.0
_SOFT_KNEES = 0.9992
"""How straight the straighter leg is: knees never lock."""


def hip_height(hips: Array, turn: Array) -> Array:
    """The height (n,) at which the straighter leg is almost straight.

    Args:
        hips: where the hips are over the floor, (n, 3); its height is not used.
        turn: their rotation, (n, 4).
    """
    heights = []
    for side in ("Left", "Right"):
        joint = rotation.rotate(turn, np.array(REST_OFFSETS[side + "UpperLeg"]))
        across = hips[:, [0, 2]] + joint[:, [0, 2]] - _ankle(side)[[0, 2]]
        reach = _SOFT_KNEES * (_length(_thigh(side)) + _length(_shin(side)))
        heights.append(np.sqrt(reach**2 - (across**2).sum(axis=1)) + _ankle(side)[1] - joint[:, 1])
    return np.minimum(*heights)


def leg(hips: Array, turn: Array, side: str) -> dict[str, Array]:
    """Local rotations (n, 4) of one leg for hips at (n, 3) with rotation (n, 4)."""
    joint = hips + rotation.rotate(turn, np.array(REST_OFFSETS[side + "UpperLeg"]))
    wanted = rotation.rotate(rotation.inverse(turn), _ankle(side) - joint)
    knee = _knee(_thigh(side), _shin(side), np.linalg.norm(wanted, axis=1))
    bend = rotation.from_axis_angle(np.array([1.0, 0.0, 0.0]), knee)
    bent = _thigh(side) + rotation.rotate(bend, _shin(side))
    foot = rotation.from_euler_yxz(np.radians(-TOES_OUT_DEG if side == "Left" else TOES_OUT_DEG), 0.0, 0.0)
    # Turning the thigh outward about the leg itself lets the knee point where the toes do.
    outward = rotation.from_euler_yxz(np.radians(-5.0 if side == "Left" else 5.0), 0.0, 0.0)
    along = rotation.rotate(outward, bent)
    upper = rotation.multiply(_between(along, wanted), outward)
    shank = rotation.multiply(turn, rotation.multiply(upper, bend))
    return {
        side + "UpperLeg": upper,
        side + "LowerLeg": bend,
        side + "Foot": rotation.multiply(rotation.inverse(shank), np.broadcast_to(foot, shank.shape)),
        side + "Toes": np.tile(rotation.IDENTITY, (len(hips), 1)),
    }


def _knee(thigh: Array, shin: Array, reach: Array) -> Array:
    """The knee's angle (n,) at which hip and ankle are `reach` apart."""
    a, b = _length(thigh), _length(shin)
    cosine = np.clip((reach**2 - a * a - b * b) / (2 * a * b), -1.0, 1.0)
    # The resting shin slants back a little: that much of the bend is built in.
    built_in = np.arctan2(-shin[2], -shin[1]) - np.arctan2(-thigh[2], -thigh[1])
    return np.maximum(np.arccos(cosine) - built_in, 0.0)


def _between(a: Array, b: Array) -> Array:
    """The shortest rotation from directions a to directions b, (n, 4)."""
    a = a / np.linalg.norm(a, axis=-1, keepdims=True)
    b = b / np.linalg.norm(b, axis=-1, keepdims=True)
    return rotation.normalised(np.concatenate([np.cross(a, b), 1 + (a * b).sum(-1, keepdims=True)], axis=-1))


def _thigh(side: str) -> Array:
    return np.array(REST_OFFSETS[side + "LowerLeg"])


def _shin(side: str) -> Array:
    return np.array(REST_OFFSETS[side + "Foot"])


def _length(v: Array) -> float:
    return float(np.linalg.norm(v))


def _ankle(side: str) -> Array:
    """Where the ankle stands: as high and as far back as at rest."""
    chain = ("Hips", side + "UpperLeg", side + "LowerLeg", side + "Foot")
    height = sum(REST_OFFSETS[name][1] for name in chain)
    depth = sum(REST_OFFSETS[name][2] for name in chain)
    return np.array([-STANCE if side == "Left" else STANCE, height, depth])
