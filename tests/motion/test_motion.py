"""Motion: true times, resampling, and what bad numbers become."""

from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from studio.motion import Motion, MotionBuffer, concatenate, rotation
from studio.motion.channels import BONES, VRM0_SHAPES


def swinging(frames: int = 121, fps: float = 60.0, start: float = 0.0) -> Motion:
    """A head that nods and a mouth that opens, both as sines."""
    t = start + np.arange(frames) / fps
    q = np.tile(rotation.IDENTITY, (frames, 2, 1))
    q[:, 1] = rotation.from_axis_angle([1.0, 0, 0], 0.5 * np.sin(2 * np.pi * t))
    return Motion.build(t, ("A",), (0.5 + 0.5 * np.sin(t))[:, None], ("Hips", "Head"), None, q)


def test_what_is_left_out_is_at_rest() -> None:
    motion = Motion.build([0.0, 0.1], VRM0_SHAPES, None, BONES)
    assert motion.shapes.shape == (2, 18)
    assert not motion.shapes.any()
    assert np.allclose(motion.rotations, rotation.IDENTITY)
    assert np.allclose(motion.positions[0], motion.skeleton.rest_positions)
    assert np.allclose(motion.root_rotation, rotation.IDENTITY)
    assert motion.positions.dtype == motion.rotations.dtype == motion.shapes.dtype == np.float32
    assert motion.times.dtype == np.float64


def test_rotations_are_made_unit_and_continuous() -> None:
    q = np.array([[[0, 0, 0, 2.0]], [[0, 0, 0, -1.0]], [[0, 0, 0, 0]], [[np.nan, 0, 0, 1]]])
    motion = Motion.build(np.arange(4), (), None, ("Head",), None, q)
    assert np.array_equal(motion.rotations, np.tile(rotation.IDENTITY, (4, 1, 1)))


def test_wrong_sizes_are_refused() -> None:
    with pytest.raises(ValueError, match="reshape"):
        Motion.build([0, 1], ("A",), np.zeros((3, 1)))


def test_a_motion_cannot_be_changed() -> None:
    motion = swinging()
    with pytest.raises(FrozenInstanceError):
        motion.times = np.zeros(3)  # type: ignore[misc]


def test_fps_and_duration_come_from_the_times() -> None:
    motion = swinging(121, 60.0, start=3.0)
    assert motion.fps == pytest.approx(60.0)
    assert motion.duration == pytest.approx(2.0)


@pytest.mark.parametrize("frames", [0, 1])
def test_too_few_frames_have_no_rate(frames: int) -> None:
    motion = swinging(frames)
    assert motion.fps == 0.0
    assert motion.duration == 0.0


def test_sampled_at_its_own_times_it_is_itself() -> None:
    motion = swinging()
    again = motion.at(motion.times)
    assert np.allclose(again.shapes, motion.shapes, atol=1e-6)
    assert np.all(rotation.angle_between(again.rotations, motion.rotations) < 1e-3)


def test_between_frames_rotations_follow_slerp() -> None:
    motion = swinging(7, 5.0)
    t = np.linspace(0.05, 1.1, 23)
    expected = Slerp(motion.times, Rotation.from_quat(motion.rotations[:, 1]))(t).as_quat()
    assert np.all(rotation.angle_between(motion.at(t).rotations[:, 1], expected) < 1e-3)


def test_between_frames_shapes_are_linear() -> None:
    motion = Motion.build([0.0, 1.0, 3.0], ("A",), [[0.0], [1.0], [0.0]])
    assert np.allclose(motion.at([0.25, 1.0, 2.0, 2.5]).shapes[:, 0], [0.25, 1.0, 0.5, 0.25])


def test_before_and_after_the_ends_are_held() -> None:
    motion = swinging(start=1.0)
    early, late = motion.pose(-5.0), motion.pose(99.0)
    assert np.allclose(early.shapes, motion.shapes[0])
    assert np.allclose(late.shapes, motion.shapes[-1])
    assert rotation.angle_between(late.rotations[1], motion.rotations[-1, 1]) < 1e-3


def test_equal_times_do_not_divide_by_zero() -> None:
    motion = Motion.build([0.0, 0.5, 0.5, 1.0], ("A",), [[0.0], [0.2], [0.8], [1.0]])
    assert np.isfinite(motion.at(np.linspace(0, 1, 11)).shapes).all()


def test_one_frame_is_held_for_ever() -> None:
    motion = Motion.build([2.0], ("A",), [[0.7]])
    assert np.allclose(motion.at([0.0, 2.0, 9.0]).shapes, 0.7)


def test_no_frame_is_at_rest() -> None:
    motion = Motion.build([], ("A",), None, ("Hips",))
    assert len(motion.at([0.0, 1.0])) == 2
    assert len(motion) == 0
    assert motion.pose(0.0).rotations.shape == (1, 4)


def test_resampling_no_frames_gives_no_frames() -> None:
    assert len(Motion.build([], ("A",)).resampled(30.0)) == 0


@pytest.mark.parametrize("fps", [30.0, 60.0, 480.0, 600.0])
def test_the_rate_is_the_senders_though_it_is_held_up_and_catches_up(fps: float) -> None:
    """It sleeps until a frame is due, and oversleeps by a millisecond or some: most follow too soon."""
    rng = np.random.default_rng(0)
    times, now = [], 0.0
    for k in range(round(6 * fps)):
        now = max(now + 50e-6, k / fps + rng.exponential(1e-3) if now < k / fps else 0.0)
        times.append(now)
    assert rate(np.array(times)) == pytest.approx(fps, rel=0.01)


def test_missing_frames_and_pauses_leave_the_rate_as_it_is() -> None:
    times = np.arange(600) / 60
    assert rate(np.delete(times, [100, 250, 251, 400])) == pytest.approx(60.0)
    assert rate(np.where(times < 4, times, times + 8)) == pytest.approx(60.0)
    assert rate(times[:2]) == pytest.approx(60.0)
    assert rate(np.delete(times[:10], 4)) == pytest.approx(60.0)


def rate(times: np.ndarray) -> float:
    return Motion.build(times, ("A",), np.zeros((len(times), 1)), ()).fps


@pytest.mark.parametrize("fps", [24.0, 30.0, 59.94, 60.0, 90.0])
def test_resampled_lies_on_an_even_grid_that_ends_within_the_motion(fps: float) -> None:
    motion = swinging(121, 60.0, start=0.5)
    even = motion.resampled(fps)
    assert np.allclose(np.diff(even.times), 1 / fps)
    assert even.times[0] == 0.5
    assert 2.5 - 1 / fps < even.times[-1] <= 2.5 + 1e-6


def test_resampling_at_the_same_rate_changes_nothing() -> None:
    motion = swinging()
    assert len(motion.resampled(60.0)) == len(motion)
    assert np.allclose(motion.resampled(60.0).shapes, motion.shapes, atol=1e-5)


def test_between_takes_its_start_and_not_its_end() -> None:
    part = swinging(11, 10.0).between(0.2, 0.5)
    assert np.allclose(part.times, [0.2, 0.3, 0.4])
    assert len(part.shapes) == len(part.rotations) == len(part.root_position) == 3


def test_a_cut_takes_both_ends_and_nothing_of_a_span_without_length() -> None:
    """A selection whose in point lies behind the end of its take has such a span."""
    motion = swinging(11, 10.0)
    assert np.allclose(motion.cut(0.2, 0.5).times, [0.0, 0.1, 0.2, 0.3])
    assert len(motion.cut(1.0, 1.0)) == 0
    assert len(swinging(1, 10.0).cut(0.0, 0.0)) == 1, "a take of one frame has no length either"


def test_shifted_moves_only_the_times() -> None:
    motion = swinging()
    later = motion.shifted(1.5)
    assert np.allclose(later.times - motion.times, 1.5)
    assert later.shapes is motion.shapes


def test_concatenated_parts_stay_sign_continuous() -> None:
    first = swinging(11)
    second = Motion.build(
        first.times + 1, first.shape_names, first.shapes, first.bone_names, None, -first.rotations
    )
    both = concatenate([first, second])
    assert len(both) == 22
    assert ((both.rotations[1:] * both.rotations[:-1]).sum(axis=-1) > 0).all()
    assert both.rotations.dtype == np.float32


def test_the_rest_skeleton_is_the_median_of_the_motion() -> None:
    positions = np.zeros((5, 2, 3))
    positions[:, 0, 1] = [0.9, 1.0, 1.0, 1.0, 7.0]
    motion = Motion.build(np.arange(5), (), None, ("Hips", "Head"), positions)
    assert motion.skeleton.rest_positions[0, 1] == pytest.approx(1.0)


def test_a_motion_that_grows_is_that_made_at_once() -> None:
    t = np.arange(90) / 30
    turn = rotation.from_axis_angle(np.array([0.0, 1.0, 0.0]), 2.0 * t)[:, None]
    whole = Motion.build(t, ("A",), t[:, None] / 3, ("Head",), None, turn)
    buffer, seen = MotionBuffer(), []
    for start in range(0, 90, 20):
        part = whole.at_rows(slice(start, start + 20))
        # Another sign for each part, as parts made one by one may have.
        buffer.append(replace(part, rotations=part.rotations * (1.0 if start % 40 else -1.0)))
        seen.append(buffer.motion)
    assert len(buffer) == len(seen[-1]) == 90
    assert [len(one) for one in seen] == [20, 40, 60, 80, 90]
    np.testing.assert_array_equal(seen[-1].times, whole.times)
    np.testing.assert_array_equal(seen[-1].shapes, whole.shapes)
    np.testing.assert_array_equal(-seen[-1].rotations, whole.rotations)
    np.testing.assert_array_equal(seen[0].shapes, whole.shapes[:20])
