"""What is laid over live poses: idling in silence, freezing, the panic key, a tuning."""

from __future__ import annotations

import numpy as np
import pytest

from studio.inference.live.pose_layers import FADE_S, PANIC_S, WAKE_S, PoseLayers
from studio.motion import Motion, Pose, rotation
from studio.playback.layers import Tuning

SHAPES, BONES = ("A", "Blink"), ("Hips", "Spine", "Chest", "Head", "LeftUpperArm")


def motion(opened: float, turn: float = 0.0) -> Motion:
    turns = np.tile(rotation.IDENTITY, (1, len(BONES), 1))
    turns[:, 3] = rotation.from_axis_angle(np.array([[1.0, 0, 0]]), np.array([turn]))
    return Motion.build([0.0], SHAPES, [[opened, 0.0]], BONES, None, turns)


REST, SAID = motion(0.1), motion(0.9, 0.3).pose(0.0)


def asked(layers: PoseLayers, start: float, seconds: float, made: Pose | None, speaking: bool) -> list[Pose]:
    return [layers.pose(start + i / 60, made, speaking) for i in range(int(seconds * 60))]


def test_a_voice_brings_the_models_own_pose() -> None:
    layers = PoseLayers(REST)
    poses = asked(layers, 100.0, 2.0, SAID, True)
    assert poses[0].shapes[0] < 0.5
    np.testing.assert_allclose(poses[-1].shapes, SAID.shapes, atol=1e-6)
    np.testing.assert_allclose(poses[-1].rotations, SAID.rotations, atol=1e-6)


def test_silence_lets_it_idle_with_blinks_and_breath() -> None:
    layers = PoseLayers(REST)
    asked(layers, 100.0, 2.0, SAID, True)
    idle = asked(layers, 102.0, 30.0, SAID, False)[60:]
    assert max(pose.shapes[0] for pose in idle) == pytest.approx(0.1, abs=0.01)
    assert max(pose.shapes[1] for pose in idle) > 0.8
    chest = np.array([pose.rotations[2] for pose in idle])
    assert np.ptp(chest, axis=0).max() > 1e-3


def test_the_mouth_wakes_before_the_body_and_without_a_jump() -> None:
    layers = PoseLayers(REST)
    asked(layers, 100.0, 2.0, SAID, False)
    waking = asked(layers, 102.0, FADE_S, SAID, True)
    mouth = np.array([pose.shapes[0] for pose in waking])
    head = np.array([pose.rotations[3][0] for pose in waking]) / SAID.rotations[3][0]
    awake = round(WAKE_S * 60) + 1
    assert mouth[awake] == pytest.approx(0.9, abs=0.01)
    assert head[awake] < 0.5
    assert np.diff(mouth).max() < 0.8 * 1.6 / (60 * WAKE_S)


def test_it_goes_over_without_a_jump() -> None:
    layers = PoseLayers(REST)
    poses = asked(layers, 0.0, 2.0, SAID, True) + asked(layers, 2.0, 2.0, SAID, False)
    steps = np.abs(np.diff([pose.shapes[0] for pose in poses[60:]]))
    assert steps.max() < 0.8 * 1.6 / (60 * FADE_S)


def test_before_the_first_pose_it_idles() -> None:
    assert asked(PoseLayers(REST), 5.0, 0.5, None, False)[-1].shapes[0] == pytest.approx(0.1, abs=0.01)


def test_without_idling_silence_leaves_the_model_alone() -> None:
    layers = PoseLayers(REST, idles=False)
    assert asked(layers, 0.0, 1.0, SAID, False)[-1].shapes[0] == pytest.approx(0.9)


def test_frozen_it_holds_still_and_goes_on_afterwards() -> None:
    layers = PoseLayers(REST)
    held = asked(layers, 0.0, 2.0, SAID, True)[-1]
    layers.frozen = True
    assert all(pose is held for pose in asked(layers, 2.0, 1.0, REST.pose(0.0), True))
    layers.frozen = False
    assert asked(layers, 3.0, 1.0, REST.pose(0.0), True)[-1].shapes[0] == pytest.approx(0.1)


def test_the_panic_key_wins_over_everything() -> None:
    layers = PoseLayers(REST)
    layers.retune(Tuning(mouth=2.0, blinks=30.0, breath=1.0))
    asked(layers, 0.0, 2.0, SAID, True)
    layers.frozen = layers.neutral = True
    pose = asked(layers, 2.0, PANIC_S + 0.2, SAID, True)[-1]
    np.testing.assert_allclose(pose.shapes, 0.0, atol=1e-6)
    np.testing.assert_allclose(pose.rotations[3], rotation.IDENTITY, atol=1e-6)


def test_a_tuning_is_laid_over_live_poses_at_once() -> None:
    layers = PoseLayers(REST)
    asked(layers, 0.0, 2.0, SAID, True)
    layers.retune(Tuning(mouth=0.5))
    assert asked(layers, 2.0, 0.2, SAID, True)[-1].shapes[0] == pytest.approx(0.45, abs=0.01)


def test_what_is_left_out_is_left_out_of_the_names_and_of_panic_too() -> None:
    layers = PoseLayers(REST)
    layers.retune(Tuning(moves=frozenset({"mouth", "eyes"}), left_out=True))
    shapes, bones = layers.names
    pose = asked(layers, 0.0, 1.0, SAID, True)[-1]
    assert (len(pose.shapes), len(pose.rotations)) == (len(shapes), len(bones))
    layers.neutral = True
    pose = asked(layers, 1.0, 1.0, SAID, True)[-1]
    assert (len(pose.shapes), len(pose.rotations)) == (len(shapes), len(bones))


def test_several_senders_at_one_moment_get_one_pose() -> None:
    layers = PoseLayers(REST)
    first = layers.pose(10.0, SAID, True)
    assert layers.pose(10.001, SAID, True) is first
    assert layers.pose(10.02, SAID, True) is not first
