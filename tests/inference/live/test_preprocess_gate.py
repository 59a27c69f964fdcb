"""The voice gate: opens on a voice, holds through pauses, and spares the network in silence."""

from __future__ import annotations

import numpy as np
import soxr

from studio.inference.live.preprocess import HOLD_S, RATE, WINDOW, Gate
from tests.take.speech import RATE as SPOKEN_RATE
from tests.take.speech import talk


def noise(seconds: float, level: float, seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).normal(0, level, int(seconds * RATE)).astype(np.float32)


def test_it_opens_at_once_and_holds_through_a_pause() -> None:
    gate = Gate(lambda samples: 0.9 if max(samples) > 0.05 else 0.0)
    gate.feed(noise(1.0, 1e-4))
    assert not gate.open
    gate.feed(noise(0.1, 0.1))
    assert gate.open
    gate.feed(noise(HOLD_S - 0.1, 1e-4))
    assert gate.open
    gate.feed(noise(0.3, 1e-4))
    assert not gate.open


def test_the_network_is_not_asked_about_the_room_alone() -> None:
    asked: list[int] = []

    def ask(samples: list[float]) -> float:
        asked.append(len(samples))
        return 0.0

    gate = Gate(ask)
    gate.feed(noise(10.0, 0.003))
    assert len(asked) < 20
    gate.feed(noise(0.5, 0.1))
    assert len(asked) >= 15
    assert set(asked) == {WINDOW}


def test_blocks_do_not_matter() -> None:
    sound = np.concatenate([noise(0.5, 1e-4), noise(0.5, 0.1), noise(1.0, 1e-4)])
    at_once = Gate(lambda samples: min(max(samples), 1.0))
    at_once.feed(sound)
    bit_by_bit = Gate(lambda samples: min(max(samples), 1.0))
    for first in range(0, len(sound), 77):
        bit_by_bit.feed(sound[first : first + 77])
    assert (at_once.speech_probability, at_once.open, at_once.seconds_processed) == (
        bit_by_bit.speech_probability,
        bit_by_bit.open,
        bit_by_bit.seconds_processed,
    )


def test_silero_hears_a_sentence_at_once_and_not_a_fan() -> None:
    sound, spans = talk(gap=1.5, noise=0.003)
    sound = soxr.resample(sound, SPOKEN_RATE, RATE).astype(np.float32)
    gate, opened = Gate(), []
    for first in range(0, len(sound), 160):
        gate.feed(sound[first : first + 160])
        opened.append(gate.open)
    for start, end in spans:
        assert all(opened[int((start + 0.25) * 100) : int((end - 0.1) * 100)])
        assert not any(opened[int((end + HOLD_S + 0.4) * 100) : int((end + 1.4) * 100)])
    fan = Gate()
    fan.feed(noise(4.0, 0.01))
    assert not fan.open
