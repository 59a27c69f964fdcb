"""The filter calms what trembles, and leaves closures and blinks as quick as they are."""

from __future__ import annotations

import numpy as np

from studio.motion import rotation
from studio.motion.channels import ARKIT_SHAPES
from studio.tracking.smoothing import PIECE, FaceFilter, smooth

FPS = 30.0
BLINK, JAW, BROW = (ARKIT_SHAPES.index(name) for name in ("EyeBlinkLeft", "JawOpen", "BrowInnerUp"))


def filtered(weights: np.ndarray) -> np.ndarray:
    face = FaceFilter()
    return np.array([face(i / FPS, row, rotation.IDENTITY)[0] for i, row in enumerate(weights)])


def whole(t: np.ndarray, raw: np.ndarray) -> np.ndarray:
    """A stretch smoothed to both sides."""
    weights, turns = raw.astype(np.float32), np.tile(rotation.IDENTITY.astype(np.float32), (len(t), 1))
    smooth(t, weights, turns, np.arange(len(t)))
    return weights


def at_rest(frames: int = 90, seed: int = 3) -> np.ndarray:
    noise = np.random.default_rng(seed).normal(0.0, 0.02, (frames, len(ARKIT_SHAPES)))
    return np.clip(0.3 + noise, 0, 1)


def test_a_face_at_rest_trembles_half_as_much() -> None:
    raw = at_rest()
    assert filtered(raw)[30:].std(axis=0).mean() < 0.5 * raw[30:].std(axis=0).mean()


def test_a_blink_of_three_frames_keeps_its_height_and_its_moment() -> None:
    raw = at_rest()
    raw[40:43, BLINK] = 0.95
    for result in (filtered(raw), whole(np.arange(90) / FPS, raw)):
        assert result[:, BLINK].max() > 0.9
        assert abs(int(np.argmax(result[:, BLINK])) - 41) <= 1


def test_lips_that_meet_for_two_frames_meet() -> None:
    raw = at_rest()
    raw[:, JAW] = 0.6
    raw[50:52, JAW] = 0.02
    for result in (filtered(raw), whole(np.arange(90) / FPS, raw)):
        assert result[50:52, JAW].min() < 0.06


def test_a_whole_stretch_is_smoothed_without_coming_late() -> None:
    t = np.arange(300) / FPS
    raw = np.zeros((300, len(ARKIT_SHAPES)))
    raw[:, BROW] = 0.5 + 0.4 * np.sin(2 * np.pi * t)
    live, calm = filtered(raw)[:, BROW], whole(t, raw)[:, BROW]

    def lag(values: np.ndarray) -> int:
        span = slice(60, 240)
        return int(np.argmax([np.dot(raw[span, BROW], np.roll(values, -k)[span]) for k in range(-4, 5)])) - 4

    assert lag(live) >= 0
    assert lag(calm) == 0


def test_a_turn_takes_the_shorter_way_whatever_its_sign() -> None:
    face = FaceFilter()
    turns = rotation.from_euler_yxz(np.linspace(0, 0.5, 40), np.zeros(40), np.zeros(40))
    turns[::2] *= -1
    zero = np.zeros(len(ARKIT_SHAPES))
    result = [face(i / FPS, zero, turn)[1] for i, turn in enumerate(turns)]
    assert rotation.angle_between(np.array(result), turns).max() < 0.1


def test_hours_in_pieces_are_smoothed_as_in_one(monkeypatch) -> None:
    count = 2 * PIECE + 700
    rng = np.random.default_rng(7)
    t = np.cumsum(rng.uniform(0.9, 1.1, count)) / FPS
    raw = np.clip(0.4 + 0.3 * np.sin(t)[:, None] + rng.normal(0, 0.03, (count, 52)), 0, 1).astype(np.float32)
    raw[rng.random(count) < 0.02, BLINK] = 0.95
    turned = rotation.from_euler_yxz(0.4 * np.sin(t / 3), 0.2 * np.cos(t), 0.1 * np.sin(2 * t)) + 0.0
    turned[rng.random(count) < 0.5] *= -1
    # Every third row belongs to another face, and is not touched.
    rows = np.flatnonzero(np.arange(count) % 3 > 0)
    pieces, turns = raw.copy(), turned.astype(np.float32)
    smooth(t, pieces, turns, rows)
    monkeypatch.setattr("studio.tracking.smoothing.PIECE", count)
    one, at_once = raw.copy(), turned.astype(np.float32)
    smooth(t, one, at_once, rows)
    # What is left of how a filter began, some hundred of its memories later, and the numbers' last bits.
    assert np.abs(pieces - one).max() < 1e-5
    assert rotation.angle_between(turns, at_once).max() < 1e-3
    assert np.array_equal(pieces[::3], raw[::3])
    assert np.abs(one - raw)[rows].mean() > 0.005
