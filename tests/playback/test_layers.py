from __future__ import annotations

import numpy as np
import pytest

from studio.motion import Motion, rotation
from studio.playback.layers import Tuning, smoothed, strengthened, tuned

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


def test_a_neutral_tuning_gives_the_very_same_motion() -> None:
    motion = _speaking()
    assert tuned(motion, Tuning()) is motion


def test_strength_scales_the_swing_and_keeps_the_posture() -> None:
    motion = _speaking()
    half = strengthened(motion, 1.0, 0.5, 1.0)
    assert np.std(_angles(half)) == pytest.approx(0.5 * np.std(_angles(motion)), rel=0.02)
    assert np.mean(_angles(half)) == pytest.approx(np.mean(_angles(motion)), abs=0.01)


def test_head_and_body_are_tuned_apart() -> None:
    motion = _speaking()
    assert np.array_equal(strengthened(motion, 1.0, 1.0, 0.0).rotations, motion.rotations)
    still = strengthened(motion, 1.0, 0.0, 1.0)
    assert np.std(_angles(still)) < 1e-4


def test_shapes_never_leave_their_range() -> None:
    strong = strengthened(_speaking(), 2.0, 1.0, 1.0)
    assert strong.shapes.min() >= 0.0
    assert strong.shapes.max() <= 1.0


def test_smoothing_calms_tracker_noise() -> None:
    motion = _speaking()
    calm = smoothed(motion, 0.1)

    def tremble(m: Motion) -> float:
        return float(np.abs(np.diff(_angles(m), 2)).mean())

    assert tremble(calm) < 0.2 * tremble(motion)


def test_lips_still_meet_after_smoothing() -> None:
    motion = _speaking()
    calm = smoothed(motion, 0.15)
    shut = motion.shapes[:, 0] == 0.0
    assert calm.shapes[shut, 0].max() == 0.0


def test_blinks_stay_blinks_after_smoothing() -> None:
    motion = _speaking()
    assert np.array_equal(smoothed(motion, 0.3).shapes[:, 1], motion.shapes[:, 1])


def test_smoothing_adds_no_delay() -> None:
    motion = _speaking(20.0)
    a, b = _angles(motion), _angles(smoothed(motion, 0.1))
    a, b = a - a.mean(), b - b.mean()
    lags = range(-12, 13)
    best = max(lags, key=lambda lag: float(a[20:-20] @ np.roll(b, lag)[20:-20]))
    assert best == 0


def test_rotations_stay_unit_and_never_flip() -> None:
    result = tuned(_speaking(), Tuning(head=2.0, smoothing=0.1))
    q = result.rotations[:, 0]
    assert np.allclose(np.linalg.norm(q, axis=-1), 1.0, atol=1e-5)
    assert ((q[1:] * q[:-1]).sum(-1) > 0).all()


def test_the_offset_moves_the_motion_later() -> None:
    motion = _speaking()
    later = tuned(motion, Tuning(offset_ms=40.0))
    assert later.times == pytest.approx(motion.times + 0.04)


def test_a_motion_of_one_frame_or_none_goes_through() -> None:
    for count in (0, 1):
        motion = Motion.build(np.arange(count), ("A",), np.ones((count, 1)), ("Head",))
        assert len(tuned(motion, Tuning(face=0.5, head=2.0, body=0.5, smoothing=0.2))) == count
