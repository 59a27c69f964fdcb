"""The body stands, breathes and gestures like a person's, and goes on for ever."""

from __future__ import annotations

import functools

import numpy as np
import pytest

from studio.motion import concatenate, rotation
from studio.motion.channels import BONES
from studio.performer import perform
from studio.performer.performance import ScriptedPerformance, perform_script, scenes
from studio.performer.script import Script
from tests.tolerance import LAST_BITS
from tests.world import world_of

SEEDS = (0, 1, 2)


@functools.cache
def performed(seed: int, fps: float = 60.0, seconds: float = 30.0) -> ScriptedPerformance:
    return perform_script(Script(seed, voice_source="bundled"), seconds, fps)


def turn_deg(found: ScriptedPerformance, bone: str) -> np.ndarray:
    q = found.motion.rotations[:, BONES.index(bone)]
    return np.degrees(rotation.angle_between(q, rotation.IDENTITY))


def place(found: ScriptedPerformance, bone: str) -> np.ndarray:
    return world_of(found.motion)[0][:, BONES.index(bone)]


@pytest.mark.parametrize("seed", SEEDS)
def test_rotations_are_unit_and_continuous(seed: int) -> None:
    q = performed(seed, 120.0).motion.rotations
    assert np.linalg.norm(q, axis=-1) == pytest.approx(1.0, abs=1e-5)
    assert (q[1:] * q[:-1]).sum(axis=-1).min() > 0.99
    eyes = [BONES.index(side + "Eye") for side in ("Left", "Right")]
    speed = np.degrees(rotation.angle_between(q[1:], q[:-1])) * 120
    assert np.delete(speed, eyes, axis=1).max() < 420, "no limb is flung"
    assert speed[:, eyes].max() < 900, "a saccade of a person is at most this fast"


LIMITS_DEG = {
    "Head": 30, "Neck": 25, "Spine": 12, "Chest": 12, "UpperChest": 12, "Hips": 15, "LeftEye": 32,
    "LeftShoulder": 12, "LeftHand": 40, "LeftUpperLeg": 20, "LeftLowerLeg": 25, "LeftFoot": 25,
    "LeftIndexProximal": 70, "LeftLittleDistal": 70, "LeftThumbProximal": 45,
}  # fmt: skip


@pytest.mark.parametrize("seed", SEEDS)
def test_no_joint_goes_beyond_what_a_person_does_in_talk(seed: int) -> None:
    found = performed(seed)
    for bone, limit in LIMITS_DEG.items():
        for name in {bone, bone.replace("Left", "Right")}:
            assert turn_deg(found, name).max() < limit, name


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("side", ["Left", "Right"])
def test_elbows_bend_forward_only_and_hands_stay_in_front(seed: int, side: str) -> None:
    found = performed(seed)
    shoulder, elbow, hand = (place(found, side + part) for part in ("UpperArm", "LowerArm", "Hand"))
    assert (elbow[:, 1] < shoulder[:, 1] - 0.15).all(), "upper arms hang"
    upper = (elbow - shoulder) / np.linalg.norm(elbow - shoulder, axis=1, keepdims=True)
    fore = (hand - elbow) / np.linalg.norm(hand - elbow, axis=1, keepdims=True)
    bend = np.degrees(np.arccos(np.clip((upper * fore).sum(axis=1), -1, 1)))
    assert bend.min() > 3
    assert bend.max() < 135
    assert (fore[:, 2] > upper[:, 2]).all(), "a forearm bends forward"
    outward = -1 if side == "Left" else 1
    assert (outward * elbow[:, 0] > 0.1).all(), "no elbow inside the body"
    assert (outward * hand[:, 0] > -0.05).all(), "no crossed arms"


@pytest.mark.parametrize("seed", SEEDS)
def test_feet_stay_on_the_floor_and_knees_nearly_straight(seed: int) -> None:
    found = performed(seed)
    for side in ("Left", "Right"):
        for bone in ("Foot", "Toes"):
            at = place(found, side + bone)
            assert np.ptp(at, axis=0).max() < 0.004, "it neither slides nor lifts"
        assert place(found, side + "Toes")[:, 1] == pytest.approx(0.03, abs=0.005)
        assert turn_deg(found, side + "LowerLeg").max() < 20


@pytest.mark.parametrize("seed", SEEDS)
def test_face_looks_ahead(seed: int) -> None:
    found = performed(seed)
    head = world_of(found.motion)[1][:, BONES.index("Head")]
    ahead = rotation.rotate(head, np.array([0.0, 0.0, 1.0]))
    assert ahead[:, 2].min() > 0.8
    assert ahead[:, 2].mean() > 0.96


def test_every_bone_that_can_moves() -> None:
    found = performed(0)
    still = [
        name for i, name in enumerate(BONES) if np.ptp(found.motion.rotations[:, i], axis=0).max() < 1e-3
    ]
    assert still == ["LeftToes", "RightToes"]


def test_arms_rise_to_speak_and_hang_in_silence() -> None:
    found = performed(0)
    raised = 0
    for line in found.lines:
        inside = (found.motion.times > line.voice_start + 0.5) & (found.motion.times < line.voice_end - 0.2)
        for side in ("Left", "Right"):
            bend = turn_deg(found, side + "LowerArm")[inside]
            if len(bend) and line.hands in ("both", side.lower()):
                raised += 1
                assert bend.max() > 45
    assert raised >= 3
    lowest = [turn_deg(found, side + "LowerArm").min() for side in ("Left", "Right")]
    assert max(lowest) < 30


def test_head_nods_on_beats() -> None:
    found = performed(0, 120.0)
    q = found.motion.rotations[:, BONES.index("Head")]
    nod = np.degrees(rotation.to_euler_yxz(q)[1])
    beats = [line.voice_start + b.t for line in found.lines for b in line.prosody.beats if b.strength > 0.6]
    beats = [t for t in beats if 0.5 < t < 29]
    assert len(beats) > 8
    change = [
        np.interp(t + 0.09, found.motion.times, nod) - np.interp(t - 0.1, found.motion.times, nod)
        for t in beats
    ]
    assert np.mean(change) > 1.0
    assert np.mean(np.array(change) > 0) > 0.8


def test_same_seed_is_the_same_performance_and_another_is_not() -> None:
    one, two, other = perform(4, 3.0), perform(4, 3.0), perform(5, 3.0)
    assert two[0] == pytest.approx(one[0], abs=LAST_BITS)
    for name in ("times", "shapes", "positions", "rotations"):
        assert getattr(two[2], name) == pytest.approx(getattr(one[2], name), abs=LAST_BITS)
    assert other[0].shape != one[0].shape or np.abs(other[0] - one[0]).max() > 1e-2
    assert np.abs(one[2].rotations - other[2].rotations).max() > 1e-2


def test_frame_rate_samples_the_same_motion() -> None:
    slow, fast = performed(0, 30.0).motion, performed(0, 60.0).motion
    assert slow.shapes == pytest.approx(fast.shapes[::2], abs=1e-5)
    assert slow.rotations == pytest.approx(fast.rotations[::2], abs=1e-5)


def test_scene_by_scene_equals_all_at_once() -> None:
    """What is broadcast line by line is, frame for frame, what one long computation gives."""
    from studio.performer.performance import frame_times, move

    script = Script(0, voice_source="bundled")
    made = []
    for scene in scenes(script, 60.0):
        made.append(scene)
        if len(made) == 6:
            break
    lines = [scene.line for scene in made]
    streamed = concatenate([scene.motion for scene in made[:4]])
    whole = move(frame_times(0.0, lines[3].end, 60.0), lines, script.style)
    assert np.allclose(np.diff(streamed.times), 1 / 60)
    assert streamed.shapes == pytest.approx(whole.shapes, abs=1e-6)
    assert np.abs((streamed.rotations * whole.rotations).sum(axis=-1)).min() > 1 - 1e-6
    assert streamed.positions == pytest.approx(whole.positions, abs=1e-6)


def test_sound_and_motion_are_as_long_as_asked() -> None:
    for fps in (30.0, 59.94, 120.0):
        samples, rate, motion = perform(1, 2.5, fps)
        assert len(samples) == round(2.5 * rate)
        assert len(motion) == int(np.ceil(2.5 * fps))
        assert motion.fps == pytest.approx(fps, rel=1e-3)
