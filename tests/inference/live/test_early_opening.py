"""The mouth opens as soon as a voice begins, stays shut for other sounds, and gives way to the network."""

from __future__ import annotations

import numpy as np
import pytest

from studio.inference.live.early_opening import (
    AMOUNT,
    FALL_S,
    HOLD_S,
    RISE_S,
    SUSTAINED,
    EarlyOpening,
    OnsetDetector,
)
from studio.motion import Motion

RATE, BLOCK = 16_000, 80
SHAPES = ("jawOpen", "mouthClose", "browInnerUp")
REST, MEAN = (Motion.build([0.0], SHAPES, [row]) for row in ([0.02, 0.1, 0.0], [0.12, 0.05, 0.4]))
DELAY = 0.075


def room(seconds: float, dbfs: float, seed: int = 5) -> np.ndarray:
    """The noise of a room, pink (N,)."""
    size = int(seconds * RATE)
    spectrum = np.fft.rfft(np.random.default_rng(seed).normal(size=size))
    pink = np.fft.irfft(spectrum / np.sqrt(np.maximum(np.fft.rfftfreq(size, 1 / RATE), 40)), size)
    return (pink / np.sqrt(np.mean(pink**2)) * 10 ** (dbfs / 20)).astype(np.float32)


def clicks(seconds: float, keys: bool) -> np.ndarray:
    """A room in which somebody clicks a mouse, or types: down, a thump, and up again."""
    rng, sound, at = np.random.default_rng(3), room(seconds, -55).copy(), 1.0
    t = np.arange(int(0.08 * RATE)) / RATE
    while at < seconds - 1:
        burst = rng.normal(size=len(t)) * np.exp(-t / (0.004 if keys else 0.0015))
        if keys:
            burst += 0.5 * np.sin(2 * np.pi * rng.uniform(150, 400) * t) * np.exp(-t / 0.012)
        for after, loud in ((0.0, 0.2), (rng.uniform(0.06, 0.12), 0.08))[: 1 + keys]:
            first = int((at + after) * RATE)
            sound[first : first + len(t)] += (loud * burst).astype(np.float32)
        at += rng.uniform(0.15, 0.6)
    return sound


def words(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Vowels that swell within 40 ms in a room, each for .4 s, and when they begin."""
    sound, starts = room(count + 1.0, -58).copy(), 1.0 + np.arange(count)
    t = np.arange(int(0.4 * RATE)) / RATE
    for start in starts:
        vowel = sum(np.sin(2 * np.pi * 140 * k * t) / k for k in range(1, 12)) * np.clip(t / 0.04, 0, 1)
        first = int(start * RATE)
        sound[first : first + len(t)] += (0.05 * vowel).astype(np.float32)
    return sound, starts


def beginnings(sound: np.ndarray) -> np.ndarray:
    """When it is known that something begins, seconds."""
    detector = OnsetDetector(RATE)
    heard = [detector.feed(sound[i : i + BLOCK])[0] for i in range(0, len(sound) - BLOCK, BLOCK)]
    return (np.flatnonzero(heard) + 1) * BLOCK / RATE


def performed(sound: np.ndarray, on: bool = True) -> np.ndarray:
    """How far the jaw is open every 5 ms while the network's own poses rest, (T,)."""
    opening, pose = EarlyOpening(REST, MEAN, RATE, on), REST.pose(0.0)
    shown = []
    for i in range(0, len(sound) - BLOCK, BLOCK):
        now = (i + BLOCK) / RATE
        opening.feed(sound[i : i + BLOCK], now, DELAY)
        shown.append(opening.opened(pose, now).shapes[0])
    return np.array(shown)


def test_every_word_is_known_once_within_40_ms_whatever_the_blocks() -> None:
    sound, starts = words(10)
    found = beginnings(sound)
    assert len(found) == len(starts)
    assert (found - starts).min() > 0
    assert (found - starts).max() < SUSTAINED * 0.005 + 0.015
    detector, rng, at, odd = OnsetDetector(RATE), np.random.default_rng(1), 0, 0
    while at < len(sound):
        size = int(rng.integers(1, 400))
        odd += detector.feed(sound[at : at + size])[0]
        at += size
    assert odd == len(starts)


@pytest.mark.parametrize("dbfs", [-70, -60, -50, -40])
def test_a_room_opens_nothing(dbfs: float) -> None:
    assert not len(beginnings(room(60.0, dbfs)))


def test_clicks_open_nothing_and_typing_hardly_anything_and_not_for_long() -> None:
    assert not len(beginnings(clicks(60.0, keys=False)))
    typing = clicks(60.0, keys=True)
    assert len(beginnings(typing)) <= 3
    assert np.mean(performed(typing) > 0.03) < 0.01


def test_the_mouth_opens_before_its_sound_is_known_and_goes_back() -> None:
    sound, starts = words(1)
    jaw, i = performed(sound), int(starts[0] / 0.005)
    wide = 0.02 + AMOUNT * 0.1
    assert jaw[i - 1] == pytest.approx(0.02)
    assert jaw[i + round((0.04 + RISE_S) / 0.005)] == pytest.approx(wide, abs=0.002)
    assert jaw[i + round((DELAY + HOLD_S) / 0.005)] == pytest.approx(wide, abs=0.002)
    assert jaw[i + round((0.05 + DELAY + HOLD_S + FALL_S) / 0.005)] == pytest.approx(0.02)
    assert np.abs(np.diff(jaw)).max() < 0.03
    np.testing.assert_allclose(performed(sound, on=False), 0.02)


def test_what_ends_at_once_was_no_voice_and_is_taken_back() -> None:
    thump = room(3.0, -58).copy()
    t = np.arange(int(0.035 * RATE)) / RATE
    thump[RATE : RATE + len(t)] += (0.2 * np.sin(2 * np.pi * 120 * t)).astype(np.float32)
    jaw = performed(thump)
    known = int(np.argmax(jaw > 0.021))
    assert known > 0
    assert (jaw[known + round((0.05 + FALL_S) / 0.005) :] == np.float32(0.02)).all()


def test_only_what_opens_the_mouth_moves_and_a_wider_mouth_stays_as_it_is() -> None:
    sound, starts = words(1)
    opening = EarlyOpening(REST, MEAN, RATE)
    for i in range(0, int((starts[0] + 0.1) * RATE), BLOCK):
        opening.feed(sound[i : i + BLOCK], (i + BLOCK) / RATE, DELAY)
    now = float(starts[0]) + 0.1
    assert opening.share(now) == 1.0
    np.testing.assert_allclose(opening.opened(REST.pose(0.0), now).shapes, [0.17, 0.1, 0.0], atol=1e-6)
    wide = Motion.build([0.0], SHAPES, [[0.6, 0.0, 0.2]]).pose(0.0)
    np.testing.assert_allclose(opening.opened(wide, now).shapes, [0.6, 0.0, 0.2], atol=1e-6)
