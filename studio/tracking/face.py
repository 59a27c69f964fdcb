"""A tracked face as channels: ARKit's shapes, VRM's vowels, and the head's turn shared out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from studio.motion import Motion, Pose, rotation
from studio.motion.channels import ARKIT_SHAPES
from studio.motion.shape_sets import VRM_FACE, vrm_face
from studio.motion.skeleton import Skeleton

Floats = NDArray[np.floating]

SHAPES = (*ARKIT_SHAPES, *VRM_FACE)
BONES = ("Neck", "Head", "LeftEye", "RightEye")
"""The channels that a tracked face has."""
NECK_SHARE = 0.4
"""How much of the head's turn the neck makes; necks and heads of people share it about so."""
# Radians that an eye turns at a weight of one. Source: ARKit's rig, and how far eyes can turn at ease.
_EYE_YAW, _EYE_PITCH = 0.52, 0.35
_AT = {name: i for i, name in enumerate(ARKIT_SHAPES)}
CALIBRATION_SECONDS = 2.0
"""How long a performer looks straight ahead, with a calm face, for `neutral_of`."""
_FEWEST = 10
# A neutral face that uses more of a shape is none: it was laughing, or speaking.
_MOST_NEUTRAL = 0.5
_LOW = 10.0
_PIECE = 4096


@dataclass(frozen=True, eq=False)
class Calibration:
    """What a face is at rest, and where it looks then.

    Args:
        neutral: weights at rest, which become zero, (52,).
        yaw, pitch: where the head looks at rest, radians; a camera beside the screen or below it sees it so.
        gains: factors of shapes by name, for what a camera sees too little or too much of.
    """

    neutral: Floats = field(default_factory=lambda: np.zeros(len(ARKIT_SHAPES)))
    yaw: float = 0.0
    pitch: float = 0.0
    gains: Mapping[str, float] = field(default_factory=dict)


def neutral_of(weights: Floats, turns: Floats, gains: Mapping[str, float] | None = None) -> Calibration:
    """The calibration by a calm face that looks ahead.

    Args:
        weights: (T, 52).
        turns: of the head, (T, 4).
        gains: kept in it.
    """
    return _calibration(np.median(weights, axis=0), turns, gains) if len(weights) else Calibration()


def usual_of(weights: Floats, turns: Floats, rows: NDArray[np.intp]) -> Calibration:
    """The calibration by all of a recording: each shape at its calmest, the head where it mostly looks.

    Args:
        weights: (T, 52).
        turns: of the head, (T, 4).
        rows: those that count.
    """
    if len(rows) < _FEWEST:
        return Calibration()
    # Shape by shape: all of hours at once are as large as the video's motion.
    calmest = np.array([np.percentile(weights[rows, i], _LOW) for i in range(weights.shape[1])])
    return _calibration(calmest, turns[rows].astype(np.float64), None)


def _calibration(neutral: Floats, turns: Floats, gains: Mapping[str, float] | None) -> Calibration:
    yaw, pitch, _ = rotation.to_euler_yxz(turns)
    # The roll stays: people tilt their heads, and cameras stand upright.
    return Calibration(
        np.minimum(neutral, _MOST_NEUTRAL), float(np.median(yaw)), float(np.median(pitch)), gains or {}
    )


def head_turn(matrix: Floats) -> Floats:
    """A quaternion in the studio's axes of how a camera sees a face turned, (..., 3, 3).

    The camera's axes are x to the right of its picture, y up and z towards it; a face that looks into it has
    its own left on the right. Mirroring x makes them the avatar's, and turns about y and z change their sign.
    """
    return np.asarray(rotation.from_matrix(matrix) * np.array([1.0, -1.0, -1.0, 1.0]))


def channels(weights: Floats, turns: Floats, calibration: Calibration) -> tuple[Floats, Floats]:
    """Shapes (T, 60) and rotations (T, 4, 4), as SHAPES and BONES name them, of tracked faces.

    Args:
        weights: (T, 52).
        turns: of the head, as `head_turn` gives them, (T, 4).
        calibration: what is taken off.
    """
    neutral = calibration.neutral
    calm = np.clip((weights - neutral) / (1.0 - neutral), 0.0, 1.0)
    gains = np.array([calibration.gains.get(name, 1.0) for name in ARKIT_SHAPES])
    calm = np.clip(calm * gains, 0.0, 1.0)
    view = rotation.from_euler_yxz(calibration.yaw, calibration.pitch, 0.0)
    head = rotation.multiply(rotation.inverse(view), turns)
    neck = rotation.slerp(
        np.broadcast_to(rotation.IDENTITY, head.shape), head, np.full(len(head), NECK_SHARE)
    )
    rest = rotation.multiply(rotation.inverse(neck), head)
    turned = np.stack([neck, rest, _eye(calm, "Left"), _eye(calm, "Right")], axis=1)
    return np.concatenate([calm, vrm_face(calm)], axis=1), turned


def _eye(weights: Floats, side: str) -> Floats:
    def at(name: str) -> Floats:
        return np.asarray(weights[:, _AT[f"EyeLook{name}{side}"]])

    # Towards the avatar's own left is a negative turn about y in Unity's axes.
    out = at("Out") - at("In")
    yaw = _EYE_YAW * (-out if side == "Left" else out)
    return np.asarray(rotation.from_euler_yxz(yaw, _EYE_PITCH * (at("Down") - at("Up")), np.zeros(len(yaw))))


def motion_of(
    times: NDArray[np.float64],
    weights: Floats,
    turns: Floats,
    rows: NDArray[np.intp],
    calibration: Calibration,
) -> Motion:
    """Tracked faces as a motion.

    Args:
        times: rising seconds, (T,).
        weights: (T, 52).
        turns: of the head, (T, 4).
        rows: those that are kept.
    """
    count = len(rows)
    shapes = np.empty((count, len(SHAPES)), np.float32)
    turned = np.empty((count, len(BONES), 4), np.float32)
    for first in range(0, count, _PIECE):
        # Piece by piece, for memory's sake: in between numbers are twice as wide.
        piece = rows[first : first + _PIECE]
        found = channels(weights[piece].astype(np.float64), turns[piece].astype(np.float64), calibration)
        shapes[first : first + _PIECE], turned[first : first + _PIECE] = found
    for bone in range(len(BONES)):
        turned[:, bone] = rotation.sign_continuous(turned[:, bone])
    rest = Skeleton.humanoid(BONES).rest_positions.astype(np.float32)
    at_rest = np.tile(rotation.IDENTITY.astype(np.float32), (count, 1))
    nowhere = np.zeros((count, 3), np.float32)
    return Motion(times[rows], SHAPES, shapes, BONES, np.tile(rest, (count, 1, 1)), turned, nowhere, at_rest)


def pose_of(weights: Floats, turn: Floats, calibration: Calibration) -> Pose:
    """One tracked face, weights (52,) and turn (4,), as a pose of SHAPES and BONES."""
    shapes, turned = channels(weights[None], turn[None], calibration)
    at_rest = rotation.IDENTITY.astype(np.float32)
    places = Skeleton.humanoid(BONES).rest_positions.astype(np.float32)
    row, quaternions = shapes[0].astype(np.float32), turned[0].astype(np.float32)
    return Pose(row, places, quaternions, np.zeros(3, np.float32), at_rest)
