from __future__ import annotations

from dataclasses import fields, replace

import numpy as np
import pytest

from studio.motion import Motion, rotation
from studio.motion.channels import ALL_BONES, ARKIT_SHAPES, VRM0_SHAPES
from studio.playback.layers import PieceTuner, Reference, ShapeTuning, Tuner, Tuning, tuned
from studio.playback.layers.regions import BODY_REGIONS, FACE_REGIONS, REGIONS, bone_region, shape_region
from studio.playback.layers.tuning import FACE_ONLY, LIMITS, UPPER_BODY
from tests.tolerance import LAST_BITS

EVERYTHING_ON = Tuning(
    expressiveness=1.3, mouth=1.2, head=1.4, arms=0.6, torso=0.8,
    blinks=17.0, darts=1.0, breath=1.0, sway=1.0,
    top_vowels=True, shapes=(ShapeTuning("Joy", 0.5, 0.2),), lock_root=True, plant_feet=True, seed=3,
)  # fmt: skip


def _lively(
    seconds: float = 6.0,
    fps: float = 60.0,
    shapes: tuple[str, ...] = VRM0_SHAPES,
    bones: tuple[str, ...] = ALL_BONES,
) -> Motion:
    """Everything moves, no eye blinks by itself."""
    random = np.random.default_rng(2)
    t = np.arange(int(seconds * fps)) / fps
    pace, phase = random.uniform(0.3, 2.0, (2, len(shapes)))
    values = 0.2 + 0.15 * np.sin(2 * np.pi * pace * t[:, None] + phase)
    pace, phase = random.uniform(0.3, 1.0, (2, len(bones)))
    axes = random.normal(size=(len(bones), 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    angles = 0.1 + 0.15 * np.sin(2 * np.pi * pace * t[:, None] + phase)
    rotations = rotation.from_axis_angle(axes, angles)
    root = 0.1 * np.sin(t[:, None] * np.array([1.0, 2.0, 3.0]))
    return Motion.build(t, shapes, values, bones, None, rotations, root)


def _swing(motion: Motion, bone: str) -> float:
    q = motion.rotations[:, motion.bone_names.index(bone)]
    mean = rotation.normalised(q.mean(axis=0))
    return float(rotation.angle_between(q, mean).std())


def test_a_neutral_tuning_gives_the_very_same_motion() -> None:
    motion = _lively(1.0)
    assert tuned(motion, Tuning()) is motion
    assert tuned(motion, Tuning(seed=7, shapes=(ShapeTuning("A"),))) is motion
    pose = motion.pose(0.5)
    assert Tuner(Tuning(), motion.shape_names, motion.bone_names).pose(0.5, pose) is pose


@pytest.mark.parametrize("region", FACE_REGIONS)
def test_the_strength_of_a_part_of_the_face_leaves_everything_else_bit_equal(region: str) -> None:
    motion = _lively(1.0, shapes=(*VRM0_SHAPES, *ARKIT_SHAPES))
    half = tuned(motion, replace(Tuning(), **{region: 0.5}))
    for i, name in enumerate(motion.shape_names):
        lid = "blink" in name.lower() or name == "Neutral"
        factor = 0.5 if shape_region(name) == region and not lid else 1.0
        assert half.shapes[:, i] == pytest.approx(factor * motion.shapes[:, i]), name
        assert factor != 1.0 or np.array_equal(half.shapes[:, i], motion.shapes[:, i]), name


@pytest.mark.parametrize("region", BODY_REGIONS)
def test_the_strength_of_a_part_of_the_body_leaves_everything_else_bit_equal(region: str) -> None:
    motion = _lively(2.0)
    half = tuned(motion, replace(Tuning(), **{region: 0.5}))
    assert np.array_equal(half.shapes, motion.shapes)
    for i, name in enumerate(ALL_BONES):
        if bone_region(name) == region:
            assert _swing(half, name) == pytest.approx(0.5 * _swing(motion, name), rel=0.03), name
        else:
            assert np.array_equal(half.rotations[:, i], motion.rotations[:, i]), name
    assert np.array_equal(half.root_position, motion.root_position) == (region != "torso")


def test_strength_keeps_the_posture_and_flips_no_sign() -> None:
    motion = _lively()
    strong = tuned(motion, Tuning(expressiveness=2.0, head=2.0, arms=0.0, torso=1.5))
    assert np.linalg.norm(strong.rotations, axis=-1) == pytest.approx(1.0, abs=1e-5)
    assert ((strong.rotations[1:] * strong.rotations[:-1]).sum(-1) > 0).all()
    assert strong.shapes.min() >= 0.0
    assert strong.shapes.max() <= 1.0
    assert _swing(strong, "LeftLowerArm") < 1e-3


def test_expressiveness_moves_face_and_body_alike_and_leaves_the_gaze() -> None:
    motion = _lively()
    lively = tuned(motion, Tuning(expressiveness=1.5))
    assert _swing(lively, "Head") == pytest.approx(1.5 * _swing(motion, "Head"), rel=0.05)
    assert np.array_equal(
        lively.rotations[:, ALL_BONES.index("LeftEye")], motion.rotations[:, ALL_BONES.index("LeftEye")]
    )
    joy, mouth = VRM0_SHAPES.index("Joy"), VRM0_SHAPES.index("A")
    assert lively.shapes[:, joy] == pytest.approx(1.5 * motion.shapes[:, joy], rel=1e-4)
    assert lively.shapes[:, mouth] == pytest.approx(1.25 * motion.shapes[:, mouth], rel=1e-4)


def test_gain_and_lift_of_one_shape_leave_all_others_bit_equal() -> None:
    motion = _lively(1.0)
    changed = tuned(motion, Tuning(shapes=(ShapeTuning("joy", 2.0, -0.1),)))
    joy = VRM0_SHAPES.index("Joy")
    others = [i for i in range(len(VRM0_SHAPES)) if i != joy]
    assert changed.shapes[:, joy] == pytest.approx(np.clip(2.0 * motion.shapes[:, joy] - 0.1, 0, 1), abs=1e-6)
    assert np.array_equal(changed.shapes[:, others], motion.shapes[:, others])


def test_two_vowels_stay_whole_and_the_others_go_without_a_jump() -> None:
    motion = _lively(20.0)
    two = tuned(motion, Tuning(top_vowels=True))
    vowels = [VRM0_SHAPES.index(name) for name in "AIUEO"]
    before, after = np.sort(motion.shapes[:, vowels], axis=1), np.sort(two.shapes[:, vowels], axis=1)
    assert np.array_equal(after[:, -2:], before[:, -2:])
    clear = before[:, -2] - before[:, -3] > 0.05
    assert clear.any()
    assert after[clear, :3].max() == 0.0
    steps = np.abs(np.diff(two.shapes[:, vowels], axis=0)).max()
    assert steps < 0.3, "a vowel that falls behind fades; it is not cut off"


@pytest.mark.parametrize("moves", [FACE_ONLY, UPPER_BODY, frozenset({"mouth"}), frozenset({"head", "hands"})])
def test_what_a_mask_lets_through_is_bit_equal_and_the_rest_stands_still(moves: frozenset[str]) -> None:
    motion = _lively(2.0)
    result = tuned(motion, Tuning(moves=moves))
    for i, name in enumerate(motion.shape_names):
        if shape_region(name) in moves or name == "Neutral":
            assert np.array_equal(result.shapes[:, i], motion.shapes[:, i]), name
        else:
            assert not result.shapes[:, i].any(), name
    for i, name in enumerate(motion.bone_names):
        if bone_region(name) in moves:
            assert np.array_equal(result.rotations[:, i], motion.rotations[:, i]), name
        else:
            assert np.ptp(result.rotations[:, i], axis=0).max() == 0.0, name
    assert np.array_equal(result.root_position, motion.root_position) == ("torso" in moves)


def test_what_is_left_out_is_gone_and_what_stays_is_bit_equal() -> None:
    motion, tuning = _lively(1.0), Tuning(moves=frozenset({"mouth"}), left_out=True)
    result = tuned(motion, tuning)
    assert result.shape_names == ("A", "E", "I", "O", "U")
    assert result.bone_names == ("Jaw",)
    assert np.array_equal(result.shapes[:, 0], motion.shapes[:, 0])
    tuner = Tuner(tuning, motion.shape_names, motion.bone_names)
    assert (tuner.shape_names, tuner.bone_names) == (result.shape_names, result.bone_names)
    pose = tuner.pose(0.0, motion.pose(0.0))
    assert pose.shapes.shape == (5,)
    assert pose.rotations.shape == (1, 4)


def test_the_offset_moves_the_motion_later() -> None:
    motion = _lively(1.0)
    later = tuned(motion, Tuning(offset_ms=40.0))
    assert later.times == pytest.approx(motion.times + 0.04)
    assert np.array_equal(later.shapes, motion.shapes)


@pytest.mark.parametrize("shapes", [VRM0_SHAPES, ARKIT_SHAPES])
def test_one_pose_after_another_gives_what_the_whole_motion_gives(shapes: tuple[str, ...]) -> None:
    motion = _lively(fps=20.0, shapes=shapes)
    whole = tuned(motion, EVERYTHING_ON)
    tuner = Tuner(EVERYTHING_ON, motion.shape_names, motion.bone_names, Reference.of(motion))
    for i, t in enumerate(motion.times):
        frame = motion.at_rows(slice(i, i + 1))
        pose = tuner.pose(float(t), frame.pose(float(t)))
        np.testing.assert_allclose(pose.shapes, whole.shapes[i], atol=1e-6)
        assert float(rotation.angle_between(pose.rotations, whole.rotations[i]).max()) < 1e-5
        np.testing.assert_allclose(pose.root_position, whole.root_position[i], atol=1e-6)
        np.testing.assert_allclose(pose.positions, whole.positions[i], atol=1e-6)


def test_a_stream_without_a_reference_swings_about_its_own_mean() -> None:
    motion = _lively(20.0, fps=20.0)
    tuner = Tuner(Tuning(head=0.0), motion.shape_names, motion.bone_names)
    poses = [tuner.pose(float(t), motion.pose(float(t))) for t in motion.times]
    head = ALL_BONES.index("Head")
    mean = rotation.normalised(motion.rotations[:, head].mean(axis=0))
    late = np.stack([pose.rotations[head] for pose in poses[240:]])
    assert np.degrees(rotation.angle_between(late, mean).max()) < 5.0
    assert np.degrees(rotation.angle_between(late, late[:1]).max()) < 0.01, "and holds it once it is found"


def test_a_stream_adds_no_blink_right_after_one_of_its_own() -> None:
    times = np.arange(90 * 30) / 30.0
    values = np.zeros((len(times), 1))
    values[(times % 3.0) < 0.1] = 1.0
    rest = Motion.build([0.0], ("Blink",)).pose(0.0)
    tuner = Tuner(Tuning(blinks=40.0), ("Blink",), ())
    poses = [replace(rest, shapes=value.astype(np.float32)) for value in values]
    lids = np.array([tuner.pose(float(t), pose).shapes[0] for t, pose in zip(times, poses, strict=True)])
    begins = np.flatnonzero((lids[1:] > 0) & (lids[:-1] == 0) & (values[1:, 0] == 0)) + 1
    since = times[begins] % 3.0
    assert len(begins) > 5
    assert since.min() > 1.0


def test_a_blink_that_a_mask_hides_keeps_none_away() -> None:
    times = np.arange(60 * 30) / 30.0
    values = ((times % 1.5) < 0.1).astype(float)[:, None]
    motion = Motion.build(times, ("Blink",), values)
    assert np.array_equal(tuned(motion, Tuning(blinks=20.0)).shapes, motion.shapes)
    hidden = tuned(motion, Tuning(blinks=20.0, moves=frozenset({"mouth"})))
    assert 10 < np.sum((hidden.shapes[1:, 0] > 0) & (hidden.shapes[:-1, 0] == 0)) < 32


def test_a_tuning_that_changes_in_mid_stream_takes_effect_with_the_next_pose() -> None:
    motion = _lively(1.0)
    tuner = Tuner(Tuning(), motion.shape_names, motion.bone_names)
    joy = VRM0_SHAPES.index("Joy")
    before = tuner.pose(0.1, motion.pose(0.1)).shapes[joy]
    tuner.retune(Tuning(face=0.5))
    assert tuner.pose(0.1, motion.pose(0.1)).shapes[joy] == pytest.approx(0.5 * before)


def test_long_motions_are_worked_on_in_blocks_without_a_seam() -> None:
    motion = _lively(500.0, fps=34.0, shapes=("A", "Blink"), bones=("Hips", "Chest", "Head"))
    whole = tuned(motion, EVERYTHING_ON)
    assert len(whole) == len(motion) > 2 * 8192
    assert ((whole.rotations[1:] * whole.rotations[:-1]).sum(-1) > 0).all()
    steps = np.abs(np.diff(whole.shapes[:, 0]))
    assert steps[8190:8194].max() <= steps.max()


@pytest.mark.parametrize("count", [0, 1, 2])
def test_a_motion_of_hardly_any_frames_goes_through(count: int) -> None:
    motion = Motion.build(np.arange(count), ("A", "Blink"), np.ones((count, 2)), ("Head",))
    assert len(tuned(motion, replace(EVERYTHING_ON, smoothing=0.2, offset_ms=10.0))) == count


def test_a_motion_of_only_a_face_or_only_a_body_goes_through() -> None:
    whole = _lively(1.0)
    face = Motion.build(whole.times, whole.shape_names, whole.shapes)
    body = Motion.build(whole.times, (), None, ALL_BONES, None, whole.rotations)
    for motion in (face, body):
        assert len(tuned(motion, replace(EVERYTHING_ON, moves=FACE_ONLY, left_out=True))) == len(motion)


def test_every_number_of_a_tuning_has_limits_that_hold_its_default() -> None:
    for field in fields(Tuning):
        if isinstance(field.default, (int, float)) and not isinstance(field.default, bool):
            low, high = LIMITS[field.name]
            assert low <= field.default <= high
    assert set(REGIONS) <= set(LIMITS)


# -- a motion that grows ------------------------------------------------------------------------------


def _pieces_of(motion: Motion, tuner: PieceTuner, seconds: float = 1.7) -> Motion:
    """What a tuner gives while a motion grows, piece by piece."""
    found = None
    for end in np.arange(seconds, motion.times[-1] + seconds, seconds):
        before, found = found, tuner.tuned(motion.between(0.0, end))
        if before is not None and found is not None:
            assert len(found) >= len(before)
    assert found is not None
    return found


def _blinking(motion: Motion) -> Motion:
    """The same with blinks of its own, which keep added ones away."""
    shapes = motion.shapes.copy()
    shapes[(motion.times % 4.3) < 0.2, motion.shape_names.index("Blink")] = 0.9
    return replace(motion, shapes=shapes)


@pytest.mark.parametrize(
    "tuning",
    [
        Tuning(smoothing=0.1), Tuning(blinks=30.0), Tuning(blinks=30.0, smoothing=0.2, offset_ms=120.0),
        EVERYTHING_ON, replace(EVERYTHING_ON, smoothing=0.15),
        Tuning(moves=UPPER_BODY, left_out=True, smoothing=0.05),
    ],
)  # fmt: skip
def test_a_motion_tuned_piece_by_piece_is_that_tuned_as_a_whole(tuning: Tuning) -> None:
    motion = _blinking(_lively(20.0))
    posture = Reference.of(motion)
    grown, whole = _pieces_of(motion, PieceTuner(tuning, posture)), tuned(motion, tuning, posture)
    held_back = len(whole) - len(grown)
    assert 0 <= held_back < 4.0 * 60
    whole = whole.at_rows(slice(0, len(grown)))
    assert grown.shape_names == whole.shape_names
    # A running sum that began at another frame differs in its last bits; a frame that a filter or a blink
    # saw too little of differs by a hundredth.
    np.testing.assert_allclose(grown.times, whole.times, atol=1e-9)
    np.testing.assert_allclose(grown.shapes, whole.shapes, atol=LAST_BITS)
    np.testing.assert_allclose(grown.positions, whole.positions, atol=LAST_BITS)
    np.testing.assert_allclose(grown.root_position, whole.root_position, atol=LAST_BITS)
    # q and -q are one rotation.
    same = np.abs((grown.rotations.astype(np.float64) * whole.rotations).sum(axis=-1))
    np.testing.assert_allclose(same, 1.0, atol=LAST_BITS)


def test_a_growing_motion_that_is_not_tuned_is_the_very_same() -> None:
    motion = _lively(1.0)
    assert PieceTuner(Tuning()).tuned(motion) is motion


def test_strengths_of_a_growing_motion_refer_to_the_mean_of_what_was_there() -> None:
    motion = _lively(16.0)
    tuner, tuning = PieceTuner(Tuning(head=0.0)), Tuning(head=0.0)
    for seconds in (4.0, 8.0, 15.0):
        found = tuner.tuned(motion.between(0.0, seconds))
        seen = motion.between(0.0, min(seconds, 8.0))  # 15 is not yet the double of 8
        assert found is not None
        expected = tuned(motion.between(0.0, seconds), tuning, Reference.of(seen))
        np.testing.assert_allclose(found.rotations, expected.rotations, atol=LAST_BITS)


def test_what_was_shown_stays_as_it_was_while_the_motion_grows() -> None:
    motion, tuner = _lively(12.0), PieceTuner(Tuning(smoothing=0.1, mouth=0.5))
    first = tuner.tuned(motion.between(0.0, 5.0))
    assert first is not None
    before = first.shapes.copy()
    for end in (6.0, 8.0, 12.0):
        tuner.tuned(motion.between(0.0, end))
    np.testing.assert_array_equal(first.shapes, before)
