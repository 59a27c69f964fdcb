"""A pose as joints in the world, its skeleton kept as long as the bones stay the same."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from studio.motion import Pose, Skeleton, rotation


class LivePose:
    """Works out where a pose's joints are."""

    def __init__(self) -> None:
        self._names: tuple[str, ...] = ()
        self._skeleton: Skeleton | None = None

    def joints(self, bone_names: tuple[str, ...], pose: Pose) -> tuple[Skeleton, NDArray[np.floating]] | None:
        """Skeleton and Unity-space joints (J, 3), or None where there are too few bones for a figure."""
        if len(bone_names) < 2 or len(pose.rotations) != len(bone_names):
            return None
        if self._skeleton is None or bone_names != self._names:
            self._names = bone_names
            self._skeleton = Skeleton.humanoid(bone_names, pose.positions)
        p, _ = self._skeleton.forward(pose.positions, pose.rotations)
        root = np.broadcast_to(np.asarray(pose.root_rotation, dtype=np.float64), (len(p), 4))
        return self._skeleton, rotation.rotate(root, p) + pose.root_position
