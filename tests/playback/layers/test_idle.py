from __future__ import annotations

import numpy as np
import pytest

from studio.motion import Motion, rotation
from studio.motion.channels import BONES
from studio.playback.layers.idle import breath_at, breathing, sway_at, swaying

TEN_MINUTES = np.arange(600 * 60) / 60.0


def test_breath_comes_as_often_as_at_rest_and_goes_out_slower_than_in() -> None:
    full = breath_at(TEN_MINUTES)
    tops = np.sum((full[1:-1] > full[:-2]) & (full[1:-1] >= full[2:]))
    assert 12.0 <= tops / 10.0 <= 16.0
    assert full.min() >= 0.0
    assert full.max() <= 1.0
    assert float((np.diff(full) > 0).mean()) == pytest.approx(0.4, abs=0.03)


def test_sway_is_slow_and_small() -> None:
    sway = sway_at(TEN_MINUTES, 0, 0)
    assert sway.std(axis=0) == pytest.approx([1.0, 1.0, 1.0], abs=0.15)
    assert np.abs(sway).max() < 4.0
    power = np.abs(np.fft.rfft(sway[:, 0])) ** 2
    hertz = np.fft.rfftfreq(len(sway), 1 / 60.0)
    assert power[hertz < 0.5].sum() > 0.99 * power.sum()


def test_the_feet_and_the_hips_take_no_part() -> None:
    motion = Motion.build(TEN_MINUTES[:600], (), None, BONES)
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
    motion = Motion.build(TEN_MINUTES[:1200], (), None, BONES)
    world, _ = breathing(motion, 1.0).world()
    for side in ("Left", "Right"):
        height = world[:, BONES.index(side + "UpperArm"), 1]
        assert np.corrcoef(height, breath_at(motion.times))[0, 1] > 0.95


def test_seeds_repeat_and_differ() -> None:
    assert np.array_equal(sway_at(TEN_MINUTES, 3, 1), sway_at(TEN_MINUTES, 3, 1))
    assert not np.array_equal(sway_at(TEN_MINUTES, 3, 1), sway_at(TEN_MINUTES, 4, 1))


def test_a_motion_without_a_body_comes_back_as_it_is() -> None:
    face = Motion.build([0.0, 1.0], ("A",))
    assert breathing(face, 1.0) is face
    assert swaying(face, 1.0, 0) is face
