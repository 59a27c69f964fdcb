"""Rows of numbers and the motion they make."""

import numpy as np
import pytest

from studio.vmc.assemble import Frame
from studio.vmc.rows import ChannelLayout, Packer, motion_of

UNIT = (0.0, 0.0, 0.0, 1.0)


def frame(t: float, shapes: dict[str, float], bones: dict[str, float]) -> Frame:
    return Frame(t, None, shapes, {name: ((x, 0.0, 0.0), UNIT) for name, x in bones.items()}, None)


def test_a_packed_frame_gives_its_pose_back() -> None:
    (block,) = Packer().pack([frame(1.0, {"A": 0.5}, {"Hips": 0.1, "Head": 0.2})])
    pose = block.pose()
    assert pose.shapes.tolist() == [0.5]
    assert pose.positions[:, 0] == pytest.approx([0.1, 0.2])
    assert pose.rotations.tolist() == [list(UNIT)] * 2
    assert pose.root_rotation.tolist() == list(UNIT)


def test_names_are_shared_until_they_change() -> None:
    packer = Packer()
    one, two = frame(0, {"A": 0}, {}), frame(1, {"A": 0}, {})
    three = frame(2, {"A": 0, "I": 0}, {})
    (first,), (second, other) = packer.pack([one]), packer.pack([two, three])
    assert first.names is second.names
    assert other.names == ChannelLayout(("A", "I"), ())
    (last,) = packer.pack([frame(3, {"A": 0, "Joy": 0}, {})])
    assert last.names == ChannelLayout(("A", "Joy"), ())  # as many, others


def test_frames_of_the_same_channels_are_one_block() -> None:
    frames = [frame(k, {"A": k / 10}, {"Hips": k}) for k in range(5)]
    (block,) = Packer().pack(frames)
    assert len(block) == 5
    assert block.arrivals.tolist() == [0, 1, 2, 3, 4]
    assert block.values[:, 0] == pytest.approx([0, 0.1, 0.2, 0.3, 0.4])
    assert np.isnan(block.stamps[:, 1]).all()  # their sender told no time


def test_rows_between_two_moments() -> None:
    (block,) = Packer().pack([frame(k, {"A": k / 10}, {}) for k in range(5)])
    assert block.between(0, 4) is block
    assert block.between(1, 3).arrivals.tolist() == [1, 2, 3]
    assert block.between(last=1).values[:, 0] == pytest.approx([0, 0.1])
    assert len(block.between(9)) == 0


def test_a_channel_that_came_late_is_held_back_to_the_start() -> None:
    blocks = Packer().pack(
        [
            frame(0, {"A": 0.1}, {"Hips": 1.0}),
            frame(1, {"A": 0.2, "I": 0.7}, {"Hips": 1.0, "Head": 0.3}),
            frame(2, {"A": 0.3, "I": 0.8}, {"Hips": 1.0, "Head": 0.4}),
        ]
    )
    motion = motion_of(blocks, np.array([0.0, 1.0, 2.0]))
    assert motion is not None
    assert motion.shape_names == ("A", "I")
    assert motion.shapes[:, 1] == pytest.approx([0.7, 0.7, 0.8])
    assert motion.positions[:, 1, 0] == pytest.approx([0.3, 0.3, 0.4])


def test_times_rise_and_begin_with_the_sound() -> None:
    blocks = Packer().pack([frame(0, {"A": 0.1}, {})] * 5)
    motion = motion_of(blocks, np.array([-0.5, 0.2, 0.1, 0.2, 0.3]))
    assert motion is not None
    assert motion.times == pytest.approx([0.1, 0.2, 0.3])


def test_nothing_makes_no_motion() -> None:
    assert motion_of([], np.zeros(0)) is None
    assert motion_of(Packer().pack([frame(0, {"A": 0.1}, {})]), np.array([-1.0])) is None
