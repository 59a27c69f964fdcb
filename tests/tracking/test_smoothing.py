"""The filter calms what trembles, and leaves closures and blinks as quick as they are."""

from __future__ import annotations

import numpy as np

from studio.motion import rotation
from studio.motion.channels import ARKIT_SHAPES
from studio.tracking.smoothing import FaceFilter, smoothed

FPS = 30.0
BLINK, JAW, BROW = (ARKIT_SHAPES.index(name) for name in ("EyeBlinkLeft", "JawOpen", "BrowInnerUp"))


def filtered(weights: np.ndarray) -> np.ndarray:
    face = FaceFilter()
    return np.array([face(i / FPS, row, rotation.IDENTITY)[0] for i, row in enumerate(weights)])


def at_rest(frames: int = 90, seed: int = 3) -> np.ndarray:
    noise = np.random.default_rng(seed).normal(0.0, 0.02, (frames, len(ARKIT_SHAPES)))
    return np.clip(0.3 + noise, 0, 1)


def test_a_face_at_rest_trembles_half_as_much() -> None:
    raw = at_rest()
    assert filtered(raw)[30:].std(axis=0).mean() < 0.5 * raw[30:].std(axis=0).mean()


def test_a_blink_of_three_frames_keeps_its_height_and_its_moment() -> None:
    raw = at_rest()
    raw[40:43, BLINK] = 0.95
    for result in (filtered(raw), smoothed(np.arange(90) / FPS, raw, np.tile(rotation.IDENTITY, (90, 1)))[0]):
        assert result[:, BLINK].max() > 0.9
        assert abs(int(np.argmax(result[:, BLINK])) - 41) <= 1


def test_lips_that_meet_for_two_frames_meet() -> None:
    raw = at_rest()
    raw[:, JAW] = 0.6
    raw[50:52, JAW] = 0.02
    for result in (filtered(raw), smoothed(np.arange(90) / FPS, raw, np.tile(rotation.IDENTITY, (90, 1)))[0]):
        assert result[50:52, JAW].min() < 0.06


def test_a_whole_stretch_is_smoothed_without_coming_late() -> None:
    t = np.arange(300) / FPS
    raw = np.zeros((300, len(ARKIT_SHAPES)))
    raw[:, BROW] = 0.5 + 0.4 * np.sin(2 * np.pi * t)
    live, whole = filtered(raw)[:, BROW], smoothed(t, raw, np.tile(rotation.IDENTITY, (300, 1)))[0][:, BROW]

    def lag(values: np.ndarray) -> int:
        span = slice(60, 240)
        return int(np.argmax([np.dot(raw[span, BROW], np.roll(values, -k)[span]) for k in range(-4, 5)])) - 4

    assert lag(live) >= 0
    assert lag(whole) == 0


def test_a_turn_takes_the_shorter_way_whatever_its_sign() -> None:
    face = FaceFilter()
    turns = rotation.from_euler_yxz(np.linspace(0, 0.5, 40), np.zeros(40), np.zeros(40))
    turns[::2] *= -1
    zero = np.zeros(len(ARKIT_SHAPES))
    result = [face(i / FPS, zero, turn)[1] for i, turn in enumerate(turns)]
    assert rotation.angle_between(np.array(result), turns).max() < 0.1
