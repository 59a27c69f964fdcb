"""Motion with values that are no numbers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from studio.motion import rotation
from studio.motion.mend import mended
from tests.formats.examples import a_motion


def test_a_sound_motion_comes_back_as_it_is() -> None:
    motion = a_motion()
    assert mended(motion) == (motion, 0)


def test_what_is_no_number_is_held_from_the_frame_before() -> None:
    motion = a_motion()
    shapes, positions, rotations = motion.shapes.copy(), motion.positions.copy(), motion.rotations.copy()
    shapes[5, 2], shapes[6, 2], positions[8], rotations[10, 3] = np.nan, np.inf, 1e30, np.nan
    got, bad = mended(replace(motion, shapes=shapes, positions=positions, rotations=rotations))
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
    got, bad = mended(replace(motion, rotations=rotations))
    assert bad == 2
    np.testing.assert_allclose(np.linalg.norm(got.rotations, axis=-1), 1.0, atol=1e-6)
    np.testing.assert_allclose(np.abs(got.rotations[0]), np.tile([0, 0, 0, 1], (len(motion.bone_names), 1)))
    assert np.all(rotation.angle_between(got.rotations[4], motion.rotations[4]) < 1e-3)


def test_frames_whose_time_does_not_rise_are_left_out() -> None:
    motion = a_motion()
    times = motion.times.copy()
    times[3], times[7] = np.nan, times[2]
    got, bad = mended(replace(motion, times=times))
    assert bad == 2
    np.testing.assert_array_equal(got.times, np.delete(motion.times, [3, 7]))


def test_a_motion_without_frames_or_without_one_good_time_is_empty() -> None:
    motion = a_motion()
    empty = motion.between(5.0, 6.0)
    assert mended(empty) == (empty, 0)
    got, bad = mended(replace(motion, times=np.full(len(motion), np.nan)))
    assert (len(got), bad) == (0, len(motion))
