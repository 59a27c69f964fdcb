"""Claps with arms that swing together and a sound that bangs."""

from __future__ import annotations

import numpy as np
import pytest

from studio.motion import Motion
from studio.motion.lag import power
from studio.take.clap import clap_offset, claps, hand_distance

RATE, FPS = 16_000, 60.0
BONES = ("Hips", "LeftHand", "RightHand")
CLAPS = (3.0, 3.9, 6.25)


def _hands(
    moments: tuple[float, ...], seconds: float = 10.0, late: float = 0.0, fast: float = 0.12
) -> Motion:
    """Hands 0.7 m apart that meet at 0.08 m at some moments, `late` seconds after them."""
    t = np.arange(int(seconds * FPS)) / FPS
    apart = np.full(len(t), 0.7) + 0.01 * np.sin(9 * t)
    for moment in moments:
        after = t - (moment + late)
        close = np.where(after < 0, np.clip(1 + after / fast, 0, 1) ** 2, np.clip(1 - after / 0.3, 0, 1))
        apart = np.minimum(apart, 0.7 - 0.62 * close)
    positions = np.zeros((len(t), 3, 3))
    positions[:, 1, 0], positions[:, 2, 0] = apart / 2, -apart / 2
    return Motion.build(t, (), None, BONES, positions)


def _bangs(moments: tuple[float, ...], seconds: float = 10.0, speech: float = 0.03) -> np.ndarray:
    rng = np.random.default_rng(1)
    t = np.arange(int(seconds * RATE)) / RATE
    sound = speech * np.clip(np.sin(2 * np.pi * 1.3 * t), 0, 1) * rng.normal(size=len(t))
    for moment in moments:
        at = int(moment * RATE)
        burst = rng.normal(size=1600) * np.exp(-np.arange(1600) / 160) * 0.5
        sound[at : at + 1600] += burst
    return power(sound.astype(np.float32), RATE)


@pytest.mark.parametrize("late", [0.0, 0.12, -0.3])
def test_the_offset_brings_the_hands_to_the_bang(late: float) -> None:
    found = clap_offset(_bangs(CLAPS), _hands(CLAPS, late=late))
    assert found.offset == pytest.approx(-late, abs=0.02)
    assert found.confidence > 0.75
    assert len(found.curve) == len(found.offsets)


def test_one_clap_among_speech_is_enough() -> None:
    found = clap_offset(_bangs((5.0,)), _hands((5.0,), late=0.2))
    assert found.offset == pytest.approx(-0.2, abs=0.02)
    assert found.confidence > 0.75


def test_hands_folded_slowly_are_no_clap() -> None:
    slow = _hands(CLAPS, fast=1.5)
    assert not len(claps(slow))
    found = clap_offset(_bangs(CLAPS), slow)
    assert (found.offset, found.confidence) == (0.0, 0.0)


def test_claps_are_found_where_the_hands_meet() -> None:
    assert claps(_hands(CLAPS)) == pytest.approx(CLAPS, abs=0.02)


def test_claps_without_a_bang_give_no_confidence() -> None:
    assert clap_offset(_bangs(()), _hands(CLAPS)).confidence < 0.5
    assert clap_offset(np.zeros(1000), _hands(CLAPS)).confidence == 0.0


def test_motion_without_arms_gives_nothing() -> None:
    face = Motion.build(np.arange(600) / 60, ("A",), np.zeros((600, 1)))
    assert hand_distance(face) is None
    assert clap_offset(_bangs(CLAPS), face).confidence == 0.0
    assert clap_offset(np.zeros(0), Motion.build([])).confidence == 0.0
