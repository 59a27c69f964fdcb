from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from studio.motion import Motion, rotation
from studio.motion.channels import BONES
from studio.playback.layers.foot_lock import in_place, with_foot_lock
from studio.playback.layers.regions import Reference
from tests.world import world_of

FEET = [BONES.index("LeftFoot"), BONES.index("RightFoot")]


def _dancing(dip: float = 0.1, wander: float = 0.0) -> Motion:
    """Hips that bob and shift, legs that swing, a root that wanders."""
    t = np.arange(300) / 60.0
    motion = Motion.build(t, (), None, BONES)
    positions, rotations = motion.positions.copy(), motion.rotations.copy()
    hips = BONES.index("Hips")
    positions[:, hips, 0] += 0.05 * np.sin(2 * t)
    positions[:, hips, 1] -= dip * (1 + np.sin(3 * t)) / 2
    for k, name in enumerate(("Hips", "LeftUpperLeg", "RightUpperLeg", "LeftLowerLeg", "RightFoot")):
        angle = 0.2 * np.sin((1 + k) * t + k)
        rotations[:, BONES.index(name)] = rotation.from_axis_angle(np.array([1.0, 0.0, 0.0]), angle)
    root = np.stack([wander * t, 0 * t, wander * np.sin(t)], axis=1).astype(np.float32)
    turn = rotation.from_axis_angle(np.array([0.0, 1.0, 0.0]), wander * np.sin(t))
    return replace(
        motion, positions=positions, rotations=rotation.sign_continuous(rotations).astype(np.float32),
        root_position=root, root_rotation=turn.astype(np.float32),
    )  # fmt: skip


@pytest.mark.parametrize("wander", [0.0, 0.02])
def test_feet_stay_where_they_are_while_hips_and_root_move(wander: float) -> None:
    motion = _dancing(wander=wander)
    reference = Reference.of(motion)
    p, q = world_of(with_foot_lock(motion, reference))
    before, _ = world_of(motion)
    assert np.ptp(before[:, FEET], axis=0).max() > 0.1
    assert np.ptp(p[:, FEET], axis=0).max() < 0.002
    assert np.degrees(rotation.angle_between(q[:, FEET], q[:1, FEET]).max()) < 0.1


def test_legs_keep_their_length_and_the_upper_body_is_left_alone() -> None:
    motion = _dancing()
    result = with_foot_lock(motion, Reference.of(motion))
    hips = BONES.index("Hips")
    assert np.array_equal(np.delete(result.positions, hips, 1), np.delete(motion.positions, hips, 1))
    assert (result.positions[:, hips, 1] <= motion.positions[:, hips, 1]).all(), "hips only ever come down"
    legs = [i for i, name in enumerate(BONES) if name.endswith(("UpperLeg", "LowerLeg", "Foot"))]
    others = [i for i in range(len(BONES)) if i not in legs]
    assert np.array_equal(result.rotations[:, others], motion.rotations[:, others])
    assert np.linalg.norm(result.rotations, axis=-1) == pytest.approx(1.0, abs=1e-5)
    assert ((result.rotations[1:] * result.rotations[:-1]).sum(-1) > 0.9).all(), "no flips, no jumps"


def test_knees_bend_forwards() -> None:
    motion = Motion.build([0.0, 1.0], (), None, BONES)
    crouching = replace(motion, positions=motion.positions.copy())
    crouching.positions[1, BONES.index("Hips"), 1] -= 0.3
    world, _ = world_of(with_foot_lock(crouching, Reference.of(motion)))
    knee, hip, foot = (world[1, BONES.index(f"Left{part}"), 2] for part in ("LowerLeg", "UpperLeg", "Foot"))
    assert knee > max(hip, foot) + 0.1


def test_a_leap_higher_than_the_legs_are_long_stays_on_the_floor() -> None:
    motion = Motion.build([0.0, 1.0], (), None, BONES)
    leaping = replace(motion, positions=motion.positions.copy())
    leaping.positions[1, BONES.index("Hips"), 1] += 3.0
    world, _ = world_of(with_foot_lock(leaping, Reference.of_pose(BONES, motion.pose(0.0))))
    assert np.ptp(world[:, FEET], axis=0).max() < 0.002


def test_in_place_stops_the_wandering_and_keeps_the_dipping() -> None:
    motion = _dancing(wander=0.1)
    still = in_place(motion, Reference.of(motion))
    assert np.ptp(still.root_position, axis=0).max() == 0.0
    assert np.ptp(still.root_rotation, axis=0).max() == 0.0
    hips = BONES.index("Hips")
    assert np.ptp(still.positions[:, hips, [0, 2]], axis=0).max() == 0.0
    assert np.array_equal(still.positions[:, hips, 1], motion.positions[:, hips, 1])


def test_a_body_without_legs_comes_back_as_it_is() -> None:
    motion = Motion.build([0.0, 1.0], ("A",), None, ("Hips", "Head"))
    assert with_foot_lock(motion, Reference.of(motion)) is motion
