from __future__ import annotations

import numpy as np
import pytest

from studio.motion import Motion
from studio.motion.channels import ARKIT_SHAPES, VRM0_SHAPES, VRM1_SHAPES
from studio.playback.layers.blinks import APART, CLEAR, Blinks, blinking, blinks_of

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


def test_seeds_repeat_and_differ() -> None:
    once = Blinks(17.0, 5).lids(TEN_MINUTES, NONE)
    assert np.array_equal(once, Blinks(17.0, 5).lids(TEN_MINUTES, NONE))
    assert not np.array_equal(once, Blinks(17.0, 6).lids(TEN_MINUTES, NONE))


def test_any_moment_alone_gives_what_the_whole_gives() -> None:
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
