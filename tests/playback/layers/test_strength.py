from __future__ import annotations

import numpy as np
import pytest

from studio.motion import Motion, rotation
from studio.playback.layers.strength import StreamSmoothing, smoothed

FPS = 60.0


def _speaking(seconds: float = 4.0) -> Motion:
    """Mouth opening and closing, two blinks, a nodding head, with tracker noise."""
    t = np.arange(int(seconds * FPS)) / FPS
    noise = np.random.default_rng(1).normal(0.0, 0.02, (len(t), 2))
    mouth = np.clip(np.sin(2 * np.pi * 2.0 * t), 0.0, 1.0)
    blink = ((t % 2.0) < 0.1).astype(float)
    joy = np.clip(0.5 + noise[:, 1], 0, 1)
    nod = 0.3 + 0.2 * np.sin(2 * np.pi * 0.5 * t) + noise[:, 0]
    rotations = rotation.from_axis_angle(np.array([1.0, 0.0, 0.0]), nod)[:, None, :]
    return Motion.build(
        t, ("A", "Blink", "Joy"), np.stack([mouth, blink, joy], 1), ("Head",), None, rotations
    )


def _angles(motion: Motion) -> np.ndarray:
    return 2.0 * np.arctan2(motion.rotations[:, 0, 0], motion.rotations[:, 0, 3])


def _streamed(motion: Motion, sigma: float) -> Motion:
    smoothing = StreamSmoothing(motion.shape_names, sigma)
    poses = [smoothing.pose(t, motion.pose(t)) for t in motion.times]
    return Motion.build(
        motion.times, motion.shape_names, np.stack([p.shapes for p in poses]), motion.bone_names, None,
        np.stack([p.rotations for p in poses]),
    )  # fmt: skip


def _tremble(motion: Motion) -> float:
    return float(np.abs(np.diff(_angles(motion), 2)).mean())


@pytest.mark.parametrize("way", [smoothed, _streamed])
def test_smoothing_calms_tracker_noise(way: object) -> None:
    motion = _speaking()
    assert callable(way)
    assert _tremble(way(motion, 0.1)) < 0.25 * _tremble(motion)


@pytest.mark.parametrize("way", [smoothed, _streamed])
def test_lips_still_meet_after_smoothing(way: object) -> None:
    motion = _speaking()
    assert callable(way)
    calm = way(motion, 0.15)
    shut = motion.shapes[:, 0] == 0.0
    assert calm.shapes[shut, 0].max() == 0.0


@pytest.mark.parametrize("way", [smoothed, _streamed])
def test_blinks_stay_blinks_after_smoothing(way: object) -> None:
    motion = _speaking()
    assert callable(way)
    assert np.array_equal(way(motion, 0.3).shapes[:, 1], motion.shapes[:, 1])


def test_smoothing_of_a_whole_motion_adds_no_delay() -> None:
    motion = _speaking(20.0)
    a, b = _angles(motion), _angles(smoothed(motion, 0.1))
    a, b = a - a.mean(), b - b.mean()
    lags = range(-12, 13)
    best = max(lags, key=lambda lag: float(a[20:-20] @ np.roll(b, lag)[20:-20]))
    assert best == 0


def test_a_stream_that_paused_begins_anew() -> None:
    smoothing, motion = StreamSmoothing(("A", "Blink", "Joy"), 0.2), _speaking()
    smoothing.pose(0.0, motion.pose(0.0))
    late = motion.pose(1.7)
    assert np.array_equal(smoothing.pose(1.7, late).rotations, late.rotations)


def test_a_rotation_of_the_other_sign_is_no_turn() -> None:
    smoothing, pose = StreamSmoothing(("A", "Blink", "Joy"), 0.1), _speaking().pose(1.0)
    smoothing.pose(0.0, pose)
    from dataclasses import replace

    calm = smoothing.pose(0.02, replace(pose, rotations=-pose.rotations))
    assert float(rotation.angle_between(calm.rotations[0], pose.rotations[0])) < 1e-4
