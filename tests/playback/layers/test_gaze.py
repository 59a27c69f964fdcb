from __future__ import annotations

import numpy as np
import pytest

from studio.motion import Motion, rotation
from studio.motion.channels import ARKIT_SHAPES, VRM0_SHAPES, VRM1_SHAPES
from studio.playback.layers.gaze import LARGEST, Saccades, gaze_shift, has_eyes, with_saccades

TEN_MINUTES = np.arange(600 * 120) / 120.0


def test_ten_minutes_of_gaze_are_human() -> None:
    angles = Saccades(1.0, 0).angles(TEN_MINUTES)
    size = np.linalg.norm(angles, axis=1)
    moving = np.abs(np.diff(angles, axis=0)).max(axis=1) > 1e-9
    saccades = int(np.sum(moving[1:] & ~moving[:-1])) / 10.0
    assert 20 < saccades < 45, "a minute, at means of 3.1 and 0.9 s"
    assert 0.65 < float((size < 2.0).mean()) < 0.88, "most of the time the viewer is looked at"
    assert size.max() <= LARGEST + 2.0


def test_sizes_and_directions_follow_the_published_ones() -> None:
    darts = Saccades(1.0, 3)
    darts.angles(np.array([36_000.0]))
    away = darts.targets()[::2]
    size = np.linalg.norm(away, axis=1)
    assert np.mean(size) == pytest.approx(6.9 * (1 - np.exp(-(LARGEST / 6.9 - 0.045))) + 0.3, rel=0.08)
    turn = np.round(np.degrees(np.arctan2(away[:, 1], away[:, 0])) / 45.0).astype(int) % 8
    shares = np.bincount(turn, minlength=8) / len(turn) * 100
    assert shares == pytest.approx([15.54, 6.46, 17.69, 7.44, 16.80, 7.89, 20.38, 7.79], abs=1.6)


def test_a_saccade_takes_as_long_as_it_is_large() -> None:
    times = np.arange(120 * 2000) / 2000.0
    angles = Saccades(1.0, 1).angles(times)
    speed = np.linalg.norm(np.diff(angles, axis=0), axis=1) * 2000.0
    assert 100.0 < speed.max() < 500.0, "degrees a second"


def test_any_moment_alone_gives_what_the_whole_gives_and_seeds_repeat() -> None:
    whole, darts = Saccades(1.0, 9).angles(TEN_MINUTES), Saccades(1.0, 9)
    for i in range(0, len(TEN_MINUTES), 1999):
        # Vector units round a row of moments otherwise than one alone.
        assert darts.angles(TEN_MINUTES[i : i + 1])[0] == pytest.approx(whole[i], abs=1e-9)
    assert not np.array_equal(whole, Saccades(1.0, 10).angles(TEN_MINUTES))


def test_eye_bones_turn_where_the_gaze_goes() -> None:
    times = np.arange(60 * 60) / 60.0
    motion = Motion.build(times, ("LookLeft",), None, ("Head", "LeftEye", "RightEye"))
    result, angles = with_saccades(motion, Saccades(1.0, 0)), Saccades(1.0, 0).angles(times)
    ahead = rotation.rotate(result.rotations[:, 1], np.array([0.0, 0.0, 1.0]))
    assert ahead[:, 0] == pytest.approx(
        np.sin(np.radians(angles[:, 0])) * np.cos(np.radians(angles[:, 1])), abs=1e-5
    )
    assert ahead[:, 1] == pytest.approx(np.sin(np.radians(angles[:, 1])), abs=1e-5)
    assert np.array_equal(result.rotations[:, 0], motion.rotations[:, 0])
    assert not result.shapes.any(), "with eye bones the look shapes would turn the eyes twice"


@pytest.mark.parametrize("names", [VRM0_SHAPES, VRM1_SHAPES, ARKIT_SHAPES])
def test_without_eye_bones_the_look_shapes_of_every_set_move(names: tuple[str, ...]) -> None:
    times = np.arange(300 * 30) / 30.0
    motion = Motion.build(times, names)
    result = with_saccades(motion, Saccades(1.0, 0))
    moved = {name for i, name in enumerate(names) if result.shapes[:, i].any()}
    assert moved == {name for name in names if gaze_shift(name)}
    assert len(moved) in (4, 8)


def test_both_eyes_of_arkit_look_the_same_way() -> None:
    assert gaze_shift("EyeLookInLeft") == gaze_shift("EyeLookOutRight") == (1.0, 0.0)
    assert gaze_shift("EyeLookOutLeft") == gaze_shift("EyeLookInRight") == (-1.0, 0.0)


def test_a_motion_without_eyes_comes_back_as_it_is() -> None:
    motion = Motion.build([0.0, 1.0], ("A",), None, ("Head",))
    assert with_saccades(motion, Saccades(1.0, 0)) is motion
    assert not has_eyes(("A",), ("Head",))
    assert has_eyes(("A", "lookUp"), ())
