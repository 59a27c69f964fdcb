"""World-space joints, rotations and blend shapes of one pose, ready to draw."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from studio.motion import Motion, Pose, Skeleton, rotation
from studio.motion.avatar import MIRROR_TURN, Avatar
from studio.motion.look_at import Gaze, gaze_between

ARMS_DOWN = 72.0
"""Degrees from a T-pose to arms that hang."""


@dataclass(frozen=True, eq=False)
class WorldPose:
    """Where the bones of a performer are in the world, and what the face does.

    Args:
        skeleton: J bones and how they rest.
        joints: Unity-space world positions (J, 3), metres.
        turns: world rotations (J, 4), each the change from the T-pose; a stick figure needs none.
        shapes: weights 0..1 by name, of any set.
        t: the moment, seconds, for what moves by itself.
    """

    skeleton: Skeleton
    joints: NDArray[np.floating]
    turns: NDArray[np.floating] | None = None
    shapes: Mapping[str, float] = field(default_factory=dict)
    t: float = 0.0

    @classmethod
    def of(cls, motion: Motion, t: float) -> WorldPose:
        """A motion at a moment (seconds), between its frames; joints are empty where it has no bones."""
        pose = motion.pose(t)
        shapes = dict(zip(motion.shape_names, pose.shapes.tolist(), strict=True))
        return cls.of_pose(motion.skeleton, pose, shapes, t)

    @classmethod
    def of_pose(
        cls, skeleton: Skeleton, pose: Pose, shapes: Mapping[str, float], t: float = 0.0
    ) -> WorldPose:
        """One pose of a skeleton's bones at a moment (seconds); joints are empty where it has none."""
        if not skeleton.bone_names:
            return cls(skeleton, np.zeros((0, 3)), np.zeros((0, 4)), shapes, t)
        if "Hips" not in skeleton.bone_names:
            return _with_body(skeleton, pose, shapes, t)
        local, turns = skeleton.forward(pose.positions, pose.rotations)
        # The root is applied last: local joints are the skeleton's, the root moves all of it.
        root = np.broadcast_to(np.asarray(pose.root_rotation, dtype=np.float64), turns.shape)
        joints = rotation.rotate(root, local) + pose.root_position
        return cls(skeleton, joints, rotation.multiply(root, turns), shapes, t)

    @classmethod
    def at_rest(cls, skeleton: Skeleton) -> WorldPose:
        """A T-pose."""
        return cls(skeleton, *skeleton.forward(skeleton.rest_positions, skeleton.rest_rotations))

    def retargeted_to(self, avatar: Avatar) -> WorldPose:
        """This pose with an avatar's bones and proportions; unchanged where it has no rotations."""
        if self.turns is None:
            return self
        joints, turns = avatar.retargeted(self.skeleton, self.joints, self.turns)
        turns, shapes = avatar.looking(turns, self.shapes, self._gazes())
        return WorldPose(avatar.skeleton, joints, turns, shapes, self.t)

    def _gazes(self) -> dict[str, Gaze]:
        """Where its eye bones look, "left" and "right", those it has."""
        names, found = self.skeleton.bone_names, dict[str, Gaze]()
        for side in ("left", "right"):
            bone = names.index(name) if (name := f"{side.title()}Eye") in names else -1
            if bone >= 0 and self.turns is not None and self.skeleton.parents[bone] >= 0:
                head = self.turns[self.skeleton.parents[bone]]
                found[side] = gaze_between(head * MIRROR_TURN, self.turns[bone] * MIRROR_TURN)
        return found

    @classmethod
    def rest_pose(cls, skeleton: Skeleton) -> WorldPose:
        """Standing with the arms down, for a face that comes without a body."""
        return cls(skeleton, *skeleton.forward(skeleton.rest_positions, _standing(skeleton)))

    def looks_like(self, other: WorldPose, moves: bool) -> bool:
        """Whether a picture of it is that of another pose; with `moves` some of it moves with the time."""
        if self.skeleton is not other.skeleton and self.skeleton.bone_names != other.skeleton.bone_names:
            return False
        turned = (self.turns is None) == (other.turns is None) and (
            self.turns is None or other.turns is None or np.array_equal(self.turns, other.turns)
        )
        return (
            turned
            and (self.t == other.t or not moves)
            and np.array_equal(self.joints, other.joints)
            and dict(self.shapes) == dict(other.shapes)
        )

    @property
    def usable(self) -> bool:
        """Whether there is something to see, all of it finite."""
        fits = len(self.joints) == len(self.skeleton.bone_names) > 0
        return fits and bool(np.isfinite(self.joints).all())


def _with_body(skeleton: Skeleton, pose: Pose, shapes: Mapping[str, float], t: float) -> WorldPose:
    """A head alone, such as a webcam sees, on somebody who stands with the arms down."""
    whole = Skeleton.humanoid()
    turns = _standing(whole)
    for name, turn in zip(skeleton.bone_names, pose.rotations, strict=True):
        if name in whole.bone_names:
            turns[whole.bone_names.index(name)] = turn
    return WorldPose(whole, *whole.forward(whole.rest_positions, turns), shapes, t)


def _standing(skeleton: Skeleton) -> NDArray[np.floating]:
    """Rotations of a skeleton that stands with the arms down (J, 4)."""
    turns = np.array(skeleton.rest_rotations)
    for name, degrees in (("LeftUpperArm", ARMS_DOWN), ("RightUpperArm", -ARMS_DOWN)):
        if name in skeleton.bone_names:
            turns[skeleton.bone_names.index(name)] = rotation.from_euler_yxz(0.0, 0.0, np.radians(degrees))
    return turns
