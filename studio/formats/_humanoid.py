"""What the writers of bodies share: a humanoid on the ground, on an even grid from the sound's start."""

from __future__ import annotations

import numpy as np

from studio.motion import Motion, Skeleton, rotation
from studio.motion.channels import ALL_BONES

DEFAULT_FPS = 30.0


def grounded_body(motion: Motion) -> Motion | None:
    """The humanoid bones of a motion, the root put into the hips, which are there and above the ground.

    Returns:
        A motion of bones alone; None where it has no bones or no frames.
    """
    bones = [j for j, name in enumerate(motion.bone_names) if name in ALL_BONES]
    if not bones or not len(motion):
        return None
    names = tuple(motion.bone_names[j] for j in bones)
    positions = motion.positions[:, bones].astype(np.float64)
    rotations = motion.rotations[:, bones].astype(np.float64)
    if "Hips" not in names:
        names = ("Hips", *names)
        rest = Skeleton.humanoid(names)
        tops = [j for j in range(1, len(names)) if rest.parents[j] == 0]
        positions = np.concatenate([np.tile(rest.rest_positions[:1], (len(motion), 1, 1)), positions], axis=1)
        positions[:, tops] = rest.rest_positions[tops]
        rotations = np.concatenate([np.tile(rotation.IDENTITY, (len(motion), 1, 1)), rotations], axis=1)
    hips, root = names.index("Hips"), motion.root_rotation
    positions[:, hips] = rotation.rotate(root, positions[:, hips]) + motion.root_position
    rotations[:, hips] = rotation.multiply(root, rotations[:, hips])
    if positions[0, hips, 1] <= 0.01:
        # Readers scale a figure by its first hips height.
        positions[:, hips, 1] += Skeleton.humanoid(("Hips",)).rest_positions[0, 1] - positions[0, hips, 1]
    return Motion.build(motion.times, (), None, names, positions, rotations)


def on_grid(motion: Motion, fps: float = 0.0) -> Motion:
    """A motion on an even grid from the sound's first moment to its own end; itself where it is that already.

    Args:
        motion: of one frame or more.
        fps: of the grid; the motion's own median rate where 0.
    """
    fps = fps or motion.fps or DEFAULT_FPS
    grid = np.arange(int(np.floor(max(float(motion.times[-1]), 0.0) * fps + 1e-6)) + 1) / fps
    is_even = len(grid) == len(motion) and np.allclose(grid, motion.times, rtol=0, atol=1e-6)
    return motion if is_even else motion.at(grid)
