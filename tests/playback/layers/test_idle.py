"""Blinks at human intervals, eye darts as measured, breath and sway: each a function of time."""

from __future__ import annotations

import numpy as np
import pytest

from studio.motion import Motion, rotation
from studio.motion.channels import ARKIT_SHAPES, BONES, VRM0_SHAPES, VRM1_SHAPES
from studio.playback.layers.idle import (
    APART,
    CLEAR,
    LARGEST,
    Blinks,
    Saccades,
    blinking,
    blinks_of,
    breath_at,
    breathing,
    gaze_shift,
    has_eyes,
    sway_at,
    swaying,
    with_saccades,
)
from tests.world import world_of

TEN_MINUTES = np.arange(600 * 120) / 120.0
NONE = np.zeros(0)


def _begins(level: np.ndarray, above: float = 0.0) -> np.ndarray:
    return np.flatnonzero((level[1:] > above) & (level[:-1] <= above)) + 1


@pytest.mark.parametrize("per_minute", [10.0, 17.0, 26.0])
def test_ten_minutes_hold_as_many_blinks_as_asked_for(per_minute: float) -> None:
    counts = [len(_begins(Blinks(per_minute, seed).lids(TEN_MINUTES, NONE))) / 10.0 for seed in range(8)]
    assert np.mean(counts) == pytest.approx(per_minute, rel=0.08)


def test_intervals_are_human_and_blinks_never_overlap() -> None:
    starts, closing, opening = Blinks(17.0, 4).events(36_000.0)
    apart = np.diff(starts)
    assert apart.min() >= APART
    assert (closing + opening + 0.034).max() < APART
    assert 0.100 <= closing.min() < closing.max() <= 0.150
    assert 0.170 <= opening.min() < opening.max() <= 0.250
    skew = ((apart - apart.mean()) ** 3).mean() / apart.std() ** 3
    assert skew > 1.5, "many short intervals and a long tail, as log-normal ones have"


def test_each_blink_shuts_the_eye_for_a_frame_of_thirty_a_second() -> None:
    times = np.arange(600 * 30) / 30.0
    level = Blinks(17.0, 0).lids(times, NONE)
    begins = _begins(level)
    assert len(begins) > 100
    assert all(level[i : i + 8].max() == 1.0 for i in begins[:-1])


def test_lids_close_faster_than_they_open() -> None:
    level = Blinks(17.0, 0).lids(TEN_MINUTES, NONE)
    rising, falling = np.sum(np.diff(level) > 1e-9), np.sum(np.diff(level) < -1e-9)
    assert 1.3 < falling / rising < 2.2


def test_blinks_of_a_seed_repeat_and_differ() -> None:
    once = Blinks(17.0, 5).lids(TEN_MINUTES, NONE)
    assert np.array_equal(once, Blinks(17.0, 5).lids(TEN_MINUTES, NONE))
    assert not np.array_equal(once, Blinks(17.0, 6).lids(TEN_MINUTES, NONE))


def test_any_moment_of_blinks_alone_gives_what_the_whole_gives() -> None:
    blinks, whole = Blinks(17.0, 5), Blinks(17.0, 5).lids(TEN_MINUTES, NONE)
    for i in range(0, len(TEN_MINUTES), 997):
        assert blinks.lids(TEN_MINUTES[i : i + 1], NONE)[0] == pytest.approx(whole[i], abs=1e-12)
    assert Blinks(17.0, 5).lids(np.array([-3.0]), NONE)[0] == 0.0


def test_none_comes_within_a_second_of_an_inferred_blink() -> None:
    inferred = np.arange(5.0, 600.0, 7.0)
    level = Blinks(26.0, 1).lids(TEN_MINUTES, inferred)
    free = Blinks(26.0, 1).lids(TEN_MINUTES, NONE)
    near = (np.abs(TEN_MINUTES[:, None] - inferred[None]).min(axis=1)) < CLEAR
    assert free[near].max() == 1.0
    assert level[near].max() == 0.0
    assert 0.3 * free.sum() < level.sum() < 0.9 * free.sum()


def _face(names: tuple[str, ...]) -> Motion:
    times = np.arange(60 * 60) / 60.0
    return Motion.build(times, names, np.zeros((len(times), len(names))))


@pytest.mark.parametrize(
    ("names", "moved"),
    [
        (VRM0_SHAPES, {"Blink"}),
        (VRM1_SHAPES, {"blink"}),
        (ARKIT_SHAPES, {"EyeBlinkLeft", "EyeBlinkRight"}),
        (("A", "Joy"), set()),
    ],
)
def test_the_lids_of_every_set_of_names_blink_and_nothing_else(
    names: tuple[str, ...], moved: set[str]
) -> None:
    motion = _face(names)
    result = blinking(motion, Blinks(17.0, 0), NONE)
    assert {name for i, name in enumerate(names) if result.shapes[:, i].any()} == moved
    assert not motion.shapes.any(), "the motion itself is left as it was"


def test_both_lids_and_one_lid_together_never_close_more_than_fully() -> None:
    motion = _face(VRM0_SHAPES)
    left = VRM0_SHAPES.index("Blink_L")
    motion.shapes[:, left] = 0.4
    result = blinking(motion, Blinks(26.0, 0), NONE)
    total = result.shapes[:, left] + result.shapes[:, VRM0_SHAPES.index("Blink")]
    assert total.max() == pytest.approx(1.0)


def test_an_inferred_blink_is_kept_whole() -> None:
    motion = _face(("Blink",))
    motion.shapes[100:106, 0] = 1.0
    assert blinks_of(motion) == pytest.approx(motion.times[100:106])
    result = blinking(motion, Blinks(40.0, 0), blinks_of(motion))
    assert np.array_equal(result.shapes[50:150], motion.shapes[50:150])


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


TEN_MINUTES_AT_60 = np.arange(600 * 60) / 60.0


def test_breath_comes_as_often_as_at_rest_and_goes_out_slower_than_in() -> None:
    full = breath_at(TEN_MINUTES_AT_60)
    tops = np.sum((full[1:-1] > full[:-2]) & (full[1:-1] >= full[2:]))
    assert 12.0 <= tops / 10.0 <= 16.0
    assert full.min() >= 0.0
    assert full.max() <= 1.0
    assert float((np.diff(full) > 0).mean()) == pytest.approx(0.4, abs=0.03)


def test_sway_is_slow_and_small() -> None:
    sway = sway_at(TEN_MINUTES_AT_60, 0, 0)
    assert sway.std(axis=0) == pytest.approx([1.0, 1.0, 1.0], abs=0.15)
    assert np.abs(sway).max() < 4.0
    power = np.abs(np.fft.rfft(sway[:, 0])) ** 2
    hertz = np.fft.rfftfreq(len(sway), 1 / 60.0)
    assert power[hertz < 0.5].sum() > 0.99 * power.sum()


def test_the_feet_and_the_hips_take_no_part() -> None:
    motion = Motion.build(TEN_MINUTES_AT_60[:600], (), None, BONES)
    result = swaying(breathing(motion, 1.0), 1.0, 0)
    moved = {name for i, name in enumerate(BONES) if result.rotations[:, i].std(axis=0).any()}
    assert moved == {
        "Spine", "Chest", "UpperChest", "Neck", "Head",
        "LeftShoulder", "RightShoulder", "LeftUpperArm", "RightUpperArm",
    }  # fmt: skip
    turned = rotation.angle_between(result.rotations, motion.rotations)
    assert 0.2 < np.degrees(turned.max()) < 8.0
    assert np.array_equal(result.positions, motion.positions)


def test_shoulders_rise_while_the_chest_fills() -> None:
    motion = Motion.build(TEN_MINUTES_AT_60[:1200], (), None, BONES)
    world, _ = world_of(breathing(motion, 1.0))
    for side in ("Left", "Right"):
        height = world[:, BONES.index(side + "UpperArm"), 1]
        assert np.corrcoef(height, breath_at(motion.times))[0, 1] > 0.95


def test_sways_of_a_seed_repeat_and_differ() -> None:
    assert np.array_equal(sway_at(TEN_MINUTES_AT_60, 3, 1), sway_at(TEN_MINUTES_AT_60, 3, 1))
    assert not np.array_equal(sway_at(TEN_MINUTES_AT_60, 3, 1), sway_at(TEN_MINUTES_AT_60, 4, 1))


def test_a_motion_without_a_body_comes_back_as_it_is() -> None:
    face = Motion.build([0.0, 1.0], ("A",))
    assert breathing(face, 1.0) is face
    assert swaying(face, 1.0, 0) is face
