"""How fast motion is resampled and posed, beside scipy's Slerp and Rotation on the same rotations."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from studio.motion import Motion
from studio.motion.channels import BONES, VRM0_SHAPES
from tests.world import world_of

SECONDS, FPS, TIMES = 60, 60, 5


def run() -> dict[str, Any]:
    """Medians in milliseconds for a minute of 54 bones and 18 shapes at 60 Hz, resampled to 50 Hz."""
    motion = wandering()
    t = np.arange(0, SECONDS - 1, 1 / 50)
    ours = median_ms(lambda: motion.at(t))
    peer = median_ms(lambda: slerp_by_scipy(motion, t))
    pose = median_ms(lambda: motion.pose(12.345))
    world = median_ms(lambda: world_of(motion))
    return {
        "resample_a_minute_ms": ours,
        "resample_by_scipy_rotations_only_ms": peer,
        "ours_over_scipy": ours / peer,
        "one_pose_ms": pose,
        "forward_kinematics_of_a_minute_ms": world,
        "forward_kinematics_per_frame_us": 1000 * world / len(motion),
    }


def wandering() -> Motion:
    """A minute in which every bone turns smoothly, the same one every time."""
    t = np.arange(SECONDS * FPS) / FPS
    phases = np.random.default_rng(1).uniform(0, 2 * np.pi, (len(BONES), 3))
    vectors = 0.5 * np.sin(t[:, None, None] + phases)
    rotations = Rotation.from_rotvec(vectors.reshape(-1, 3)).as_quat().reshape(len(t), len(BONES), 4)
    shapes = 0.5 + 0.5 * np.sin(t[:, None] + np.arange(len(VRM0_SHAPES)))
    return Motion.build(t, VRM0_SHAPES, shapes, BONES, None, rotations)


def slerp_by_scipy(motion: Motion, t: np.ndarray) -> list[Rotation]:
    """Every bone's rotations at some times, one Slerp a bone: scipy has none for many at once."""
    return [
        Slerp(motion.times, Rotation.from_quat(motion.rotations[:, bone]))(t)
        for bone in range(len(motion.bone_names))
    ]


def median_ms(work: Callable[[], object]) -> float:
    """Median milliseconds of some work that is done once before it counts."""
    seconds = []
    for _ in range(TIMES + 1):
        start = time.perf_counter()
        work()
        seconds.append(time.perf_counter() - start)
    return 1000 * statistics.median(seconds[1:])
