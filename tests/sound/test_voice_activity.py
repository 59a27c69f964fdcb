"""Speech told from silence and noise, with sentences that the practice performer speaks."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from studio.errors import StudioError
from studio.files import cache
from studio.sound.sound_file import Sound, write_sound
from studio.sound.voice_activity import HOP, NAME, kept_voice, voice
from tests.take.speech import RATE, talk
from tests.tolerance import LAST_BITS


def _told(path: Path, start: float, end: float) -> float:
    return float(voice(path)[int(start / HOP) : int(end / HOP)].mean())


def test_speech_is_heard_and_silence_and_hiss_are_not(tmp_path: Path) -> None:
    sound, spans = talk(gap=1.5, noise=0.003)
    write_sound(tmp_path / "a.wav", Sound(sound[:, None], RATE))
    for start, end in spans:
        assert _told(tmp_path / "a.wav", start + 0.2, end - 0.2) > 0.7
        assert _told(tmp_path / "a.wav", end + 0.4, end + 1.1) < 0.2


@pytest.mark.parametrize("rate", [8_000, 44_100, 96_000])
def test_any_rate_tells_the_same_moments(tmp_path: Path, rate: int) -> None:
    sound, spans = talk(gap=1.0)
    stereo = np.repeat(sound[:, None], 2, axis=1)
    write_sound(tmp_path / "a.wav", Sound(stereo, RATE).resampled(rate))
    found = voice(tmp_path / "a.wav")
    assert len(found) * HOP == pytest.approx(len(sound) / RATE, abs=2 * HOP)
    for start, end in spans:
        assert found[int((start + 0.2) / HOP) : int((end - 0.2) / HOP)].mean() > 0.7
        assert found[int((end + 0.4) / HOP) : int((end + 0.7) / HOP)].mean() < 0.2


def test_it_is_listened_to_once(tmp_path: Path) -> None:
    sound, _ = talk(gap=0.5)
    path = tmp_path / "a.wav"
    write_sound(path, Sound(sound[:, None], RATE))
    assert kept_voice(path) is None
    told: list[float] = []
    first = voice(path, told.append)
    assert told == sorted(told)
    assert told[-1] == 1.0
    again = kept_voice(path)
    assert again is not None
    np.testing.assert_array_equal(again, first)


def test_a_damaged_answer_is_asked_for_again(tmp_path: Path) -> None:
    sound, _ = talk(gap=0.5)
    path = tmp_path / "a.wav"
    write_sound(path, Sound(sound[:, None], RATE))
    first = voice(path)
    place = cache.find(path, NAME)
    assert place is not None
    place.write_bytes(b"nothing")
    assert kept_voice(path) is None
    np.testing.assert_allclose(voice(path), first, atol=LAST_BITS)


@pytest.mark.parametrize("samples", [0, 1, 100])
def test_the_shortest_sounds_are_silence(tmp_path: Path, samples: int) -> None:
    write_sound(tmp_path / "a.wav", Sound(np.zeros((samples, 1), np.float32), 16_000))
    assert voice(tmp_path / "a.wav").max(initial=0.0) == 0.0


def test_a_missing_file_is_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(StudioError) as error:
        voice(tmp_path / "gone.wav")
    assert error.value.what == "The sound file gone.wav is missing."
