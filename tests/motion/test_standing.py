"""A body that strays through the room stands still seen from its feet, and is where it was in the room."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest

from studio.metrics.body import place_errors, place_parts
from studio.metrics.comparison import pair_on_frames
from studio.motion import Motion, Skeleton, rotation
from studio.motion.grid import on_grid
from studio.motion.standing import planted, standing
from studio.performer import perform
from tests.benchmarks.wandering import HEADING_DEG, START, walking

SECONDS = 20.0


@pytest.fixture(scope="module")
def still() -> Motion:
    """A performer on both feet in the middle of the room."""
    return perform(4, SECONDS)[2]


@pytest.fixture(scope="module")
def strays(still: Motion) -> Motion:
    """The same performer on legs that walk."""
    return walking(still, 4)


def places(motion: Motion, *, room: bool = False) -> np.ndarray:
    """Joints in metres (T, J, 3), seen from the root or in the room."""
    skeleton = Skeleton.humanoid(motion.bone_names)
    found = skeleton.forward(motion.positions.astype(float), motion.rotations.astype(float))[0]
    if room:
        found = rotation.rotate(motion.root_rotation[:, None].astype(float), found)
        found = found + motion.root_position[:, None]
    return np.asarray(found)


def of(motion: Motion, *bones: str) -> np.ndarray:
    """Places of some bones (T, B, 3)."""
    return places(motion)[:, [motion.bone_names.index(bone) for bone in bones]]


def test_in_the_room_nothing_changes_and_the_hips_stay_over_the_feet(strays: Motion) -> None:
    own = standing(strays)
    assert places(own, room=True) == pytest.approx(places(strays, room=True), abs=1e-5)
    assert np.ptp(of(strays, "Hips")[:, 0, [0, 2]], axis=0).max() > 0.2
    assert np.abs(of(own, "Hips")[:, 0, [0, 2]]).max() < 0.12
    assert own.root_position.mean(axis=0)[[0, 2]] == pytest.approx(np.array(START), abs=0.4)
    heading = np.degrees(rotation.to_euler_yxz(own.root_rotation)[0])
    assert heading.mean() == pytest.approx(HEADING_DEG, abs=25.0)


def test_a_body_on_both_feet_in_the_middle_is_left_alone(still: Motion) -> None:
    own = planted(standing(still))
    assert own.root_position == pytest.approx(still.root_position, abs=2e-3)
    assert places(own) == pytest.approx(places(still), abs=3e-3)


def test_planted_feet_stay_and_the_rest_moves_as_it_did(strays: Motion) -> None:
    own = standing(strays)
    feet = of(planted(own), "LeftFoot", "RightFoot")
    assert np.ptp(feet, axis=0).max() < 1e-3
    assert np.ptp(of(own, "LeftFoot", "RightFoot"), axis=0).max() > 0.02
    assert of(planted(own), "Head", "LeftHand") == pytest.approx(of(own, "Head", "LeftHand"), abs=0.01)


def test_a_kick_is_no_step(still: Motion) -> None:
    rotations = still.rotations.copy()
    thigh, swing = still.bone_names.index("LeftUpperLeg"), np.zeros(len(still))
    swing[600:660] = -1.4 * np.hanning(60)
    turn = rotation.from_axis_angle(np.array([1.0, 0.0, 0.0]), swing)
    rotations[:, thigh] = rotation.multiply(rotations[:, thigh], turn)
    kicked = replace(still, rotations=rotations)
    foot = of(planted(standing(kicked)), "LeftFoot")[:, 0]
    assert foot[630, 1] == pytest.approx(of(kicked, "LeftFoot")[630, 0, 1], abs=0.05)
    assert foot[630, 1] > foot[0, 1] + 0.3


def test_hips_without_legs_keep_what_is_quick(still: Motion) -> None:
    t = still.times
    positions = np.tile(np.array([0.0, 1.0, 0.0]), (len(t), 1, 1))
    positions[:, 0, 0] = 0.02 * np.sin(2 * np.pi * t) + 0.05 * t
    own = standing(Motion.build(t, bone_names=("Hips",), positions=positions))
    inner = slice(len(t) // 3, -len(t) // 3)
    assert own.positions[inner, 0, 0] == pytest.approx(0.02 * np.sin(2 * np.pi * t[inner]), abs=2e-3)


def test_what_is_learnt_stays_in_place_and_what_is_compared_keeps_its_steps(strays: Motion) -> None:
    learnt = on_grid(strays, SECONDS, Fraction(30)).motion
    compared = on_grid(strays, SECONDS, Fraction(30), feet_stay=False).motion
    assert np.ptp(of(learnt, "LeftFoot"), axis=0).max() < 1e-3
    assert np.ptp(of(compared, "LeftFoot"), axis=0).max() > 0.02


def test_straying_is_told_apart_from_the_pose(still: Motion, strays: Motion) -> None:
    pair = pair_on_frames(still, strays, SECONDS)
    own, parts = place_errors([pair]), place_parts([pair])
    room, stand, hips = parts["head_room_cm"], parts["stand_cm"], parts["head_hips_cm"]
    assert room is not None
    assert stand is not None
    assert hips is not None
    assert own["head_cm"] is not None
    assert room > 100.0
    assert room == pytest.approx(stand, rel=0.1)
    assert own["head_cm"] < 8.0
    assert hips == pytest.approx(0.0, abs=0.01)


def test_a_face_has_no_parts() -> None:
    face = Motion.build(np.arange(60) / 30, ("A",))
    assert set(place_parts([pair_on_frames(face, face, 2.0)]).values()) == {None}
