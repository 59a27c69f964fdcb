"""The gain of each region: the captured motion, no more deviation than captured, nothing wild."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from studio.features.audio_spec import Floats
from studio.features.examples import Example
from studio.features.motion import Layout, fit
from studio.motion import Motion, rotation
from studio.motion.grid import Grid
from studio.training.gains import CALM, CALMEST, LIVELIEST, region_gains, regions

T = np.arange(300) / 30.0


def captured() -> tuple[Layout, Example]:
    """A take in which a shape, the head and the spine sway at a third of a cycle a second."""
    sway = np.sin(2 * np.pi * T / 3)
    bones = ("Head", "Spine", "LeftHand", "LeftFoot")
    turns = np.tile(rotation.IDENTITY, (len(T), len(bones), 1))
    for j in range(len(bones)):
        turns[:, j] = rotation.from_axis_angle(np.array([[1.0, 0.0, 0.0]]), 0.2 * sway)
    motion = Motion.build(T, ("A",), 0.5 + 0.4 * sway[:, None], bones, None, turns)
    layout = fit([motion])
    natural, mask = layout.columns(motion)
    grid = Grid(motion, np.ones(len(T), dtype=np.float32))
    return layout, Example("take", np.zeros((1, 1), np.float32), 0, layout.scaled(natural), mask, grid)


def scaled_in(region: str, factor: float, layout: Layout, example: Example) -> Floats:
    poses = example.values.copy()
    poses[:, regions(layout) == region] *= factor
    return poses


def test_each_column_has_its_region() -> None:
    layout, _ = captured()
    assert list(dict.fromkeys(regions(layout))) == ["face", "head", "torso", "arms", "rest"]
    assert (regions(layout) == "head").sum() == 6


@pytest.mark.parametrize("region", ["head", "torso", "arms", "rest"])
def test_what_is_too_still_or_too_lively_gets_the_captured_motion_and_nothing_else_changes(
    region: str,
) -> None:
    layout, example = captured()
    for factor in (0.8, 2.0):
        gain = region_gains([scaled_in(region, factor, layout, example)], [example], layout)
        of = regions(layout)
        assert gain[of == region] == pytest.approx(CALM / factor, rel=0.05)  # 6D is not quite an angle
        assert gain[(of != region) & (of != "face")] == pytest.approx(CALM)
        assert gain[of == "face"] == pytest.approx(1.0)


def test_gains_stay_within_limits_and_a_still_region_is_left() -> None:
    layout, example = captured()
    for factor, wanted in ((0.1, LIVELIEST), (10.0, CALMEST), (0.0, 1.0)):
        gain = region_gains([scaled_in("head", factor, layout, example)], [example], layout)
        assert gain[regions(layout) == "head"] == pytest.approx(wanted)


def test_a_trembling_capture_does_not_widen_the_poses_beyond_it() -> None:
    layout, example = captured()
    poses = scaled_in("head", 0.9, layout, example)
    trembling = example.values + 0.05 * (-1.0) ** np.arange(len(T))[:, None]
    noisy = replace(example, values=trembling.astype(np.float32))
    gain = region_gains([poses], [noisy], layout)[regions(layout) == "head"]
    assert gain == pytest.approx(1 / 0.9, rel=0.01)  # by its motion alone it would be above 1.5


def test_frames_and_channels_that_do_not_count_are_passed_over() -> None:
    layout, example = captured()
    valid = example.grid.valid.copy()
    valid[100:200] = 0
    wild = example.values.copy()
    wild[100:200] *= 5
    gone = replace(example, grid=replace(example.grid, valid=valid), values=wild)
    of = regions(layout)
    assert region_gains([example.values], [gone], layout)[of != "face"] == pytest.approx(CALM)
    headless = replace(example, mask=np.where(of == "head", 0, 1).astype(np.float32))
    gain = region_gains([scaled_in("head", 2.0, layout, example)], [headless], layout)
    assert gain[of == "head"] == pytest.approx(1.0)
    assert gain[of == "arms"] == pytest.approx(CALM)


def test_what_chance_adds_is_scaled_until_it_makes_up_for_what_expected_poses_lack() -> None:
    layout, example = captured()
    head = regions(layout) == "head"
    expected, drawn = example.values.copy(), example.values.copy()
    expected[:, head] *= 0.5
    other = example.values[(np.arange(len(T)) + 22) % 90]  # as lively, a quarter of a cycle before
    drawn[:, head] = expected[:, head] + 0.4 * other[:, head]
    gain = region_gains([drawn], [example], layout, [expected])
    assert gain[head] == pytest.approx(np.sqrt(CALM**2 - 0.5**2) / 0.4, rel=0.05)
    too_lively = example.values.copy()
    too_lively[:, head] *= 1.5
    drawn[:, head] = too_lively[:, head] + 0.4 * other[:, head]
    assert region_gains([drawn], [example], layout, [too_lively])[head] == pytest.approx(CALMEST)
