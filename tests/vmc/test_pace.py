"""Frames as poses are made: one for each as soon as it is there, even ones between, in order."""

from __future__ import annotations

import threading
import time

import numpy as np
import pytest

from studio.vmc.pace import Pace, PoseArrivals
from studio.vmc.sender import Destination, PoseSource, VmcTarget
from tests.patience import PATIENCE
from tests.vmc.test_sender import _Listener, _motion, listener, target

__all__ = ["listener", "target"]  # fixtures


@pytest.mark.parametrize(
    ("fps", "poses", "each"), [(60, 30, 2), (30, 30, 1), (90, 30, 3), (120, 30, 4), (60, 25, 2), (60, 60, 1)]
)
def test_every_pose_gets_the_same_number_of_frames(fps: float, poses: float, each: int) -> None:
    assert Pace(fps, PoseArrivals(1 / poses)).step == pytest.approx(1 / poses / each)


def test_a_rate_below_that_of_the_poses_keeps_its_own_beat() -> None:
    assert Pace(10, PoseArrivals(1 / 30)).step == pytest.approx(1 / 10)


def test_whoever_waits_is_woken_by_the_pose_or_by_the_time() -> None:
    arrivals = PoseArrivals(1 / 30)
    seen: list[int] = []
    waiting = threading.Thread(target=lambda: seen.append(arrivals.wait(0, time.monotonic() + PATIENCE)))
    waiting.start()
    arrivals.add()
    waiting.join()
    assert seen == [1]
    assert arrivals.wait(1, arrivals.expected) == 1


def test_each_pose_leaves_when_it_has_been_made_in_order_and_stamped(
    listener: _Listener, target: VmcTarget
) -> None:
    """One pose a second, by the beat; made three times as quickly, they leave three times as quickly."""
    arrivals, made, motion = PoseArrivals(1.0), [0.0], _motion()
    source = PoseSource(lambda _: motion.named_pose(made[0]), lambda: 0.0, arrivals)
    target.start(Destination(port=listener.port, fps=1.0), source)
    values: list[float] = []

    def arrived() -> bool:
        values[:] = [float(params[1]) for _, params in listener.values("/VMC/Ext/Blend/Val", "A")]
        return bool(values) and values[-1] == pytest.approx(made[0] / 2, abs=1e-3)

    for number in range(1, 7):
        made[0] = number / 4
        arrivals.add()
        listener.listen(arrived)
    assert np.all(np.diff(values) >= 0)
    stamps = np.diff([float(params[0]) for _, params in listener.values("/VMC/Ext/T")])
    assert stamps.min() < 0.9
    assert stamps.min() >= 0.25 - 1e-3  # and yet no flood


def test_without_poses_frames_go_on_evenly(listener: _Listener, target: VmcTarget) -> None:
    arrivals = PoseArrivals(1 / 30)
    arrivals.add()
    source = PoseSource(_motion().named_pose, lambda: 0.0, arrivals)
    target.start(Destination(port=listener.port), source)
    listener.listen(lambda: len(listener.values("/VMC/Ext/T")) >= 20)
    steps = np.diff([float(params[0]) for _, params in listener.values("/VMC/Ext/T")])[3:] * 60.0
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-2)
