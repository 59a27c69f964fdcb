"""What swinging hair and skirts cost: a frame, a seek, and how alike frame rates show it."""

from __future__ import annotations

import statistics
import time
from typing import Any

import numpy as np

STRANDS, JOINTS, COLLIDERS = 60, 4, 10
"""As an avatar of VRoid Studio with long hair and a skirt has them."""
FRAMES = 600


def run() -> dict[str, Any]:
    """Milliseconds of one core a frame at several rates, and millimetres apart after two seconds."""
    from studio.motion.springs import Springs

    rig, result = _rig(), dict[str, Any]()
    result["joints"] = len(rig.joints)
    ends = {}
    for fps in (30, 47, 60, 120):
        springs, costs = Springs(rig), []
        for frame in range(FRAMES):
            placements = rig.posed(_body(frame / fps))
            start = time.thread_time()
            made = springs.moved(placements, frame / fps)
            costs.append(time.thread_time() - start)
            if frame == 2 * fps:
                ends[fps] = made[[one.node for one in rig.joints]][:, :, 3]
        result[f"at_{fps}_fps_ms"] = 1e3 * statistics.median(costs)
    result |= {
        f"{fps}_against_60_fps_mm": 1e3 * float(np.abs(ends[fps] - ends[60]).max()) for fps in (30, 47, 120)
    }
    springs, costs = Springs(rig), []
    for frame in range(50):
        placements = rig.posed(_body(frame / 7))
        start = time.thread_time()
        springs.moved(placements, -float(frame))
        costs.append(time.thread_time() - start)
    return result | {"seek_ms": 1e3 * statistics.median(costs)}


def _rig() -> Any:
    from studio.motion.rig import Collider, Rig, SpringJoint

    parents, at, joints = [-1], [np.array([0.0, 1.5, 0.0])], []
    places = np.random.default_rng(2).normal((0.0, 1.4, 0.0), 0.05, (COLLIDERS, 3))
    colliders = tuple(Collider(0, place, place, 0.07) for place in places)
    for strand in range(STRANDS):
        turn = 2 * np.pi * strand / STRANDS
        way, above = np.array([0.5 * np.cos(turn), -0.8, 0.5 * np.sin(turn)]), 0
        for joint in range(JOINTS):
            parents.append(above)
            above = len(parents) - 1
            at.append(at[0] + [0.1 * np.cos(turn), 0.1, 0.1 * np.sin(turn)] + way * 0.08 * joint)
            which = tuple(range(COLLIDERS))
            joints.append(
                SpringJoint(above, at[-1] + way * 0.08, 0.8, 0.4, (0.0, -0.2, 0.0), 0.02, -1, which)
            )
    return Rig(tuple(parents), np.array(at), 1, (), tuple(joints), colliders)


def _body(t: float) -> Any:
    turn, made = 0.5 * np.sin(8.0 * t), np.tile(np.eye(4)[:3], (2, 1, 1))
    made[0, :, :3] = [[np.cos(turn), 0, np.sin(turn)], [0, 1, 0], [-np.sin(turn), 0, np.cos(turn)]]
    made[0, :, 3] = [0.2 * np.sin(3.0 * t), 0.0, 0.0]
    return made
