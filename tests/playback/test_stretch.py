"""Slow motion: the same pitch, and each moment of the sound where the figure is."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest
import soundfile

from studio.playback.player import Player
from studio.playback.stretch import Stretch
from studio.playback.transport import State
from tests.patience import until

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
    until(lambda: player.state is State.ENDED)
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
