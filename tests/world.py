"""Where the bones of a motion are in the world."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from studio.motion import Motion, rotation


def world_of(motion: Motion) -> tuple[NDArray[np.floating], NDArray[np.floating]]:
    """World positions (T, J, 3) and rotations (T, J, 4) of all bones, the root applied."""
    p, q = motion.skeleton.forward(motion.positions, motion.rotations)
    root = np.broadcast_to(motion.root_rotation[:, None, :], q.shape)
    return rotation.rotate(root, p) + motion.root_position[:, None, :], rotation.multiply(root, q)
