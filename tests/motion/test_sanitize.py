"""Motion with values that are no numbers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from studio.motion import rotation
from studio.motion.sanitize import sanitized
from tests.formats.examples import a_motion


def test_a_sound_motion_comes_back_as_it_is() -> None:
    motion = a_motion()
    assert sanitized(motion) == (motion, 0)


def test_what_is_no_number_is_held_from_the_frame_before() -> None:
    motion = a_motion()
    shapes, positions, rotations = motion.shapes.copy(), motion.positions.copy(), motion.rotations.copy()
    shapes[5, 2], shapes[6, 2], positions[8], rotations[10, 3] = np.nan, np.inf, 1e30, np.nan
    got, bad = sanitized(replace(motion, shapes=shapes, positions=positions, rotations=rotations))
    assert bad == 4
    assert got.shapes[5, 2] == got.shapes[6, 2] == motion.shapes[4, 2]
    np.testing.assert_array_equal(got.positions[8], motion.positions[7])
    assert rotation.angle_between(got.rotations[10, 3], motion.rotations[9, 3]) < 1e-3
    np.testing.assert_array_equal(got.shapes[7:], motion.shapes[7:])


def test_rotations_are_brought_to_length_one_and_frames_of_the_first_values_to_rest() -> None:
    motion = a_motion()
    rotations = motion.rotations.copy()
    rotations[4] *= 3.0
    rotations[0] = np.nan
    got, bad = sanitized(replace(motion, rotations=rotations))
    assert bad == 2
    np.testing.assert_allclose(np.linalg.norm(got.rotations, axis=-1), 1.0, atol=1e-6)
    np.testing.assert_allclose(np.abs(got.rotations[0]), np.tile([0, 0, 0, 1], (len(motion.bone_names), 1)))
    assert np.all(rotation.angle_between(got.rotations[4], motion.rotations[4]) < 1e-3)


def test_frames_whose_time_does_not_rise_are_left_out() -> None:
    motion = a_motion()
    times = motion.times.copy()
    times[3], times[7] = np.nan, times[2]
    got, bad = sanitized(replace(motion, times=times))
    assert bad == 2
    np.testing.assert_array_equal(got.times, np.delete(motion.times, [3, 7]))


@pytest.mark.parametrize("wrong", [1e9, 500_000.0, -7.0, np.inf, -2e192])
@pytest.mark.parametrize("at", [0, 1, 15, 28, 29])
def test_one_wrong_time_costs_its_own_frame_and_no_other(at: int, wrong: float) -> None:
    motion = a_motion(30)
    times = motion.times.copy()
    times[at] = wrong
    got, bad = sanitized(replace(motion, times=times))
    rises = at == 0 and wrong == -7.0  # which is as good as any
    assert bad == (0 if rises else 1)
    np.testing.assert_array_equal(got.times, times if rises else np.delete(motion.times, at))


def test_a_recording_with_a_long_pause_keeps_both_its_parts() -> None:
    motion = a_motion(60)
    times = motion.times + np.where(np.arange(60) < 10, 0.0, 1200.0)
    assert sanitized(replace(motion, times=times))[1] == 0


def test_a_motion_without_frames_or_without_one_good_time_is_empty() -> None:
    motion = a_motion()
    empty = motion.between(5.0, 6.0)
    assert sanitized(empty) == (empty, 0)
    got, bad = sanitized(replace(motion, times=np.full(len(motion), np.nan)))
    assert (len(got), bad) == (0, len(motion))
