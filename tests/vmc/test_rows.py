"""Rows of numbers and the motion they make."""

import numpy as np
import pytest

from studio.vmc.assemble import Frame
from studio.vmc.rows import ChannelLayout, Packer, motion_of

UNIT = (0.0, 0.0, 0.0, 1.0)


def frame(t: float, shapes: dict[str, float], bones: dict[str, float]) -> Frame:
    return Frame(t, None, shapes, {name: ((x, 0.0, 0.0), UNIT) for name, x in bones.items()}, None)


def test_a_packed_frame_gives_its_pose_back() -> None:
    row = Packer().pack(frame(1.0, {"A": 0.5}, {"Hips": 0.1, "Head": 0.2}))
    pose = row.pose()
    assert pose.shapes.tolist() == [0.5]
    assert pose.positions[:, 0] == pytest.approx([0.1, 0.2])
    assert pose.rotations.tolist() == [list(UNIT)] * 2
    assert pose.root_rotation.tolist() == list(UNIT)


def test_names_are_shared_until_they_change() -> None:
    packer = Packer()
    one, two = packer.pack(frame(0, {"A": 0}, {})), packer.pack(frame(1, {"A": 0}, {}))
    three = packer.pack(frame(2, {"A": 0, "I": 0}, {}))
    assert one.names is two.names
    assert three.names == ChannelLayout(("A", "I"), ())
    assert packer.pack(frame(3, {"A": 0, "Joy": 0}, {})).names == ChannelLayout(
        ("A", "Joy"), ()
    )  # as many, others


def test_a_channel_that_came_late_is_held_back_to_the_start() -> None:
    packer = Packer()
    rows = [
        packer.pack(frame(0, {"A": 0.1}, {"Hips": 1.0})),
        packer.pack(frame(1, {"A": 0.2, "I": 0.7}, {"Hips": 1.0, "Head": 0.3})),
        packer.pack(frame(2, {"A": 0.3, "I": 0.8}, {"Hips": 1.0, "Head": 0.4})),
    ]
    runs = [(r.names, np.array([r.arrival]), r.values[None]) for r in rows]
    motion = motion_of(runs, np.array([0.0, 1.0, 2.0]))
    assert motion is not None
    assert motion.shape_names == ("A", "I")
    assert motion.shapes[:, 1] == pytest.approx([0.7, 0.7, 0.8])
    assert motion.positions[:, 1, 0] == pytest.approx([0.3, 0.3, 0.4])


def test_times_rise_and_begin_with_the_sound() -> None:
    row = Packer().pack(frame(0, {"A": 0.1}, {}))
    runs = [(row.names, np.zeros(5), np.tile(row.values, (5, 1)))]
    motion = motion_of(runs, np.array([-0.5, 0.2, 0.1, 0.2, 0.3]))
    assert motion is not None
    assert motion.times == pytest.approx([0.1, 0.2, 0.3])


def test_nothing_makes_no_motion() -> None:
    assert motion_of([], np.zeros(0)) is None
    row = Packer().pack(frame(0, {"A": 0.1}, {}))
    assert motion_of([(row.names, np.zeros(1), row.values[None])], np.array([-1.0])) is None
