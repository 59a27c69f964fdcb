"""The pose an avatar is left in, the way into it, and a wave that shows a connection works."""

from __future__ import annotations

import math

import numpy as np

from studio.motion import Pose, Skeleton, rotation
from studio.motion.channels import BONES, VRM0_SHAPES

ARMS_DOWN = math.radians(70.0)
WAVE_SECONDS = 4.0


def neutral_pose(
    shape_names: tuple[str, ...], bone_names: tuple[str, ...], positions: np.ndarray | None = None
) -> Pose:
    """Standing at rest, arms hanging, no expression.

    Args:
        shape_names, bone_names: S and J channels of the pose.
        positions: local bone positions (J, 3); the built-in proportions where None.
    """
    rotations = np.tile(rotation.IDENTITY, (len(bone_names), 1))
    for name, angle in (("LeftUpperArm", ARMS_DOWN), ("RightUpperArm", -ARMS_DOWN)):
        if name in bone_names:
            rotations[bone_names.index(name)] = _about_z(angle)
    if positions is None:
        positions = Skeleton.humanoid(bone_names).rest_positions
    return _pose(np.zeros(len(shape_names)), np.asarray(positions), rotations)


def wave_pose(t: float) -> tuple[Pose, tuple[str, ...], tuple[str, ...]]:
    """A greeting: the right hand waves, the mouth opens and the eyes blink.

    Args:
        t: seconds since it began, 0 to WAVE_SECONDS.

    Returns:
        The pose with its shape names and bone names.
    """
    start = neutral_pose(VRM0_SHAPES, BONES)
    # The square root lifts the arm soon and keeps it up; the sine brings it down again.
    raised = math.sin(math.pi * min(max(t / WAVE_SECONDS, 0.0), 1.0)) ** 0.5
    swing = math.sin(2 * math.pi * 1.5 * t)
    rotations = start.rotations.astype(np.float64)
    upper, lower, head = (BONES.index(name) for name in ("RightUpperArm", "RightLowerArm", "Head"))
    up = _about_z(math.radians(20.0))
    rotations[upper] = rotation.slerp(rotations[upper], up, np.float64(raised))
    rotations[lower] = _about_z(raised * math.radians(75.0 + 20.0 * swing))
    rotations[head] = _about_z(raised * math.radians(5.0) * swing)
    shapes = np.zeros(len(VRM0_SHAPES))
    shapes[VRM0_SHAPES.index("A")] = raised * (0.35 + 0.35 * math.sin(2 * math.pi * 2.0 * t))
    shapes[VRM0_SHAPES.index("Joy")] = 0.6 * raised
    shapes[VRM0_SHAPES.index("Blink")] = 1.0 if (t % 1.5) < 0.12 else 0.0
    return _pose(shapes, start.positions, rotations), VRM0_SHAPES, BONES


def between(a: Pose, b: Pose, amount: float) -> Pose:
    """The pose a fraction (0 to 1) of the way from one to another with the same channels."""
    # The root's rotation with the others: for so few numbers a call costs more than what it works out.
    here, there = (np.concatenate([one.rotations, one.root_rotation[None]]) for one in (a, b))
    turned = rotation.slerp(here, there, np.float64(amount)).astype(np.float32)
    return Pose(
        (a.shapes * (1 - amount) + b.shapes * amount).astype(np.float32),
        (a.positions * (1 - amount) + b.positions * amount).astype(np.float32),
        turned[:-1],
        (a.root_position * (1 - amount) + b.root_position * amount).astype(np.float32),
        turned[-1],
    )


def _about_z(angle: float) -> np.ndarray:
    return rotation.from_axis_angle(np.array([0.0, 0.0, 1.0]), np.float64(angle))


def _pose(shapes: np.ndarray, positions: np.ndarray, rotations: np.ndarray) -> Pose:
    return Pose(
        shapes.astype(np.float32),
        positions.astype(np.float32),
        rotations.astype(np.float32),
        np.zeros(3, dtype=np.float32),
        rotation.IDENTITY.astype(np.float32),
    )
