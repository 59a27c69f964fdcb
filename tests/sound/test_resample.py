"""Sound brought to another rate in a stream: the same whatever the blocks are, at once, and true."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest
import soundfile

from studio.playback.player import Player, TransportState
from studio.sound.resample import Resampler, Stretch
from tests.patience import until


def sine(rate: int, hz: float, seconds: float = 0.5) -> np.ndarray:
    return np.sin(2 * np.pi * hz * np.arange(int(rate * seconds)) / rate).astype(np.float32)


@pytest.mark.parametrize("rate", [48_000, 44_100, 22_050, 8_000, 192_000, 11_025])
def test_blocks_do_not_matter(rate: int) -> None:
    sound, rng = sine(rate, 700.0), np.random.default_rng(1)
    whole = Resampler(rate, 16_000).feed(sound)
    stream, parts, first = Resampler(rate, 16_000), [], 0
    while first < len(sound):
        size = int(rng.integers(1, 900))
        parts.append(stream.feed(sound[first : first + size]))
        first += size
    np.testing.assert_allclose(np.concatenate(parts), whole, atol=1e-6)


@pytest.mark.parametrize("rate", [48_000, 44_100, 96_000, 8_000])
def test_every_sample_lies_at_its_own_moment(rate: int) -> None:
    given = Resampler(rate, 16_000).feed(sine(rate, 1000.0))
    expected = np.sin(2 * np.pi * 1000.0 * np.arange(len(given)) / 16_000)
    np.testing.assert_allclose(given[200:], expected[200:], atol=1e-3)


@pytest.mark.parametrize("rate", [48_000, 44_100])
def test_what_the_lower_rate_cannot_hold_is_left_out(rate: int) -> None:
    given = Resampler(rate, 16_000).feed(sine(rate, 9_000.0))
    assert np.abs(given[200:]).max() < 10 ** (-60 / 20)


def test_it_answers_within_two_milliseconds() -> None:
    given = Resampler(48_000, 16_000).feed(np.zeros(4_800, np.float32))
    assert 0.1 - len(given) / 16_000 < 0.002


def test_the_same_rate_passes_as_it_is() -> None:
    block = sine(16_000, 300.0)
    assert Resampler(16_000, 16_000).feed(block) is block


RATE = 48_000


def _slow(samples: np.ndarray, speed: float) -> np.ndarray:
    stretch = Stretch(RATE, speed)
    parts = [stretch.feed(samples[i : i + 2400]) for i in range(0, len(samples), 2400)]
    return np.concatenate([*parts, stretch.finish()])


@pytest.mark.parametrize("speed", [0.25, 0.5, 0.75])
def test_slower_sound_keeps_its_pitch_and_its_moments(speed: float) -> None:
    t = np.arange(4 * RATE) / RATE
    tone = 0.3 * np.sin(2 * np.pi * 440 * t) * np.where(t < 2.0, 0.05, 1.0)
    slow = _slow(np.stack([tone, tone], axis=1).astype(np.float32), speed)
    assert len(slow) / RATE * speed == pytest.approx(4.0, abs=0.03)
    loud = int(np.flatnonzero(np.abs(slow[:, 0]) > 0.15)[0])
    assert loud / RATE * speed == pytest.approx(2.0, abs=0.02), "seconds of the file"
    last = slow[-RATE:, 0] * np.hanning(RATE)
    assert int(np.abs(np.fft.rfft(last)).argmax()) == pytest.approx(440, abs=2)


def test_silence_between_stays_silence() -> None:
    click = np.zeros((2 * RATE, 2), np.float32)
    click[RATE : RATE + 100] = 0.9
    slow = np.abs(_slow(click, 0.5)[:, 0])
    loud = np.flatnonzero(slow > 0.05) / RATE * 0.5
    assert loud.min() > 0.9
    assert loud.max() < 1.1


def test_time_itself_runs_slower() -> None:
    player = Player(None, duration=3600.0)
    player.set_speed(0.5)
    before = time.monotonic()
    player.play()
    after = time.monotonic()
    until(lambda: player.position > 0.2)
    least = time.monotonic() - after
    position = player.position
    most = time.monotonic() - before
    assert 0.5 * least - 1e-6 <= position <= 0.5 * most + 1e-6
    player.set_speed(1.0)
    assert player.position >= position, "a change of speed goes on from where it is"
    player.close()


def test_a_slow_sound_leads_to_its_end(virtual_audio: str, tmp_path: Path) -> None:
    path = tmp_path / "tone.wav"
    t = np.arange(RATE) / RATE
    soundfile.write(path, 0.1 * np.sin(2 * np.pi * 300 * t), RATE)
    player = Player(path, device=virtual_audio)
    player.set_speed(0.5)
    began = time.monotonic()
    player.play()
    until(lambda: player.state is TransportState.ENDED)
    assert time.monotonic() - began > 1.9, "a second lasts two"
    assert player.position == pytest.approx(1.0)
    player.set_loop((0.2, 0.4))
    player.seek(0.2)
    player.play()
    until(lambda: player.position > 0.3)
    until(lambda: player.position < 0.28)
    player.set_speed(0.1)
    assert player.speed == 0.25, "no slower than that"
    player.close()
