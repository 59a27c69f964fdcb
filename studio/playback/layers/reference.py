"""The posture that strengths and masks refer to."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.motion import Motion, Pose, Skeleton, rotation


@dataclass(frozen=True, eq=False)
class Reference:
    """A posture: what stands still stands like this, and what swings swings about it.

    Args:
        skeleton: J bones.
        positions: local positions (J, 3).
        rotations: local unit quaternions (J, 4).
        root_position: (3,).
        root_rotation: (4,).
    """

    skeleton: Skeleton
    positions: NDArray[np.float64]
    rotations: NDArray[np.float64]
    root_position: NDArray[np.float64]
    root_rotation: NDArray[np.float64]

    @classmethod
    def of(cls, motion: Motion) -> Reference:
        """The mean posture of a motion; the rest pose where it has no frames."""
        names = motion.bone_names
        if not len(motion):
            return cls.of_pose(names, Motion.build([0.0], bone_names=names).pose(0.0))
        return cls(
            Skeleton.humanoid(names),
            motion.positions.mean(axis=0, dtype=np.float64),
            np.asarray(
                rotation.normalised(motion.rotations.mean(axis=0, dtype=np.float64)), dtype=np.float64
            ),
            motion.root_position.mean(axis=0, dtype=np.float64),
            np.asarray(
                rotation.normalised(motion.root_rotation.mean(axis=0, dtype=np.float64)), dtype=np.float64
            ),
        )

    @classmethod
    def of_pose(cls, bone_names: tuple[str, ...], pose: Pose) -> Reference:
        """A pose as the posture."""
        parts = (pose.positions, pose.rotations, pose.root_position, pose.root_rotation)
        return cls(Skeleton.humanoid(bone_names), *(np.asarray(part, dtype=np.float64) for part in parts))

    def towards(self, pose: Pose, share: float) -> Reference:
        """This posture moved by a share (0 to 1) of the way to a pose."""

        def line(a: NDArray[np.float64], b: NDArray[np.float32]) -> NDArray[np.float64]:
            return a + (b.astype(np.float64) - a) * share

        def turn(a: NDArray[np.float64], b: NDArray[np.float32]) -> NDArray[np.float64]:
            nearer = np.where((a * b).sum(axis=-1, keepdims=True) < 0, -b, b)
            return rotation.normalised(line(a, nearer)).astype(np.float64)

        return Reference(
            self.skeleton,
            line(self.positions, pose.positions),
            turn(self.rotations, pose.rotations),
            line(self.root_position, pose.root_position),
            turn(self.root_rotation, pose.root_rotation),
        )
