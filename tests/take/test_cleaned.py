"""Cleaned sound: quieter pauses, the same voice, the same moments, and an untouched recording."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from studio.errors import StudioError
from studio.files import cache
from studio.sound.sound_file import Sound, read_sound, sound_info, write_sound
from studio.take.cleaned import WAYS, cached_clean, clean, sound_path
from tests.take.speech import RATE, talk

pytestmark = pytest.mark.slow  # noisereduce takes seconds to import


def _noisy(
    path: Path, rate: int = RATE, channels: int = 1
) -> tuple[Path, np.ndarray, list[tuple[float, float]]]:
    samples, spans = talk(gap=1.2, noise=0.01, sentences=1)
    quiet, _ = talk(gap=1.2, sentences=1)
    sound = Sound(np.repeat(samples[:, None], channels, axis=1), RATE).resampled(rate)
    write_sound(path, sound, "PCM_24")
    return path, quiet, spans


def _level_db(samples: np.ndarray, rate: int, start: float, end: float) -> float:
    part = samples[int(start * rate) : int(end * rate)]
    return float(10 * np.log10(np.mean(part.astype(np.float64) ** 2) + 1e-12))


def _late(reference: np.ndarray, other: np.ndarray, reach: int) -> int:
    """Samples by which one sound comes after another."""
    size = 1 << int(np.ceil(np.log2(2 * len(reference))))
    product = np.fft.rfft(other, size) * np.conj(np.fft.rfft(reference, size))
    every = np.fft.irfft(product, size)
    return int(np.argmax(np.concatenate([every[-reach:], every[: reach + 1]]))) - reach


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize(("rate", "channels"), [(16_000, 1), (44_100, 2)])
def test_pauses_get_quieter_and_the_voice_stays_where_and_as_it_was(
    tmp_path: Path, way: str, rate: int, channels: int
) -> None:
    path, quiet, spans = _noisy(tmp_path / "a.wav", rate, channels)
    before = path.read_bytes()
    made = clean(path, way)
    assert path.read_bytes() == before, "the recording is never touched"
    old, new = sound_info(path), sound_info(made)
    assert (new.sample_rate, new.channels, new.duration) == (old.sample_rate, old.channels, old.duration)
    noisy, cleaned = read_sound(path).mono(), read_sound(made).mono()
    for start, end in spans:
        pause = (end + 0.4, end + 1.0)
        assert _level_db(cleaned, rate, *pause) < _level_db(noisy, rate, *pause) - 8
        assert _level_db(cleaned, rate, start, end) == pytest.approx(
            _level_db(noisy, rate, start, end), abs=3
        )
    reference = Sound(quiet[:, None], RATE).resampled(rate).mono()
    assert abs(_late(reference, cleaned, rate // 20)) <= rate // 1000


def test_it_is_made_once_and_found_again(tmp_path: Path) -> None:
    path, _, _ = _noisy(tmp_path / "a.wav")
    assert cached_clean(path, "noise") is None
    assert sound_path(path, "noise") == path
    told: list[float] = []
    made = clean(path, "noise", told.append)
    assert told == sorted(told)
    assert told[-1] == 1.0
    assert cached_clean(path, "noise") == sound_path(path, "noise") == made
    assert sound_path(path, "") == path
    stamp = made.stat().st_mtime_ns
    assert clean(path, "noise") == made
    assert made.stat().st_mtime_ns == stamp


@pytest.mark.parametrize("way", WAYS)
def test_a_sound_longer_than_a_block_has_no_seams(tmp_path: Path, way: str) -> None:
    samples, _ = talk(gap=1.2, noise=0.01, sentences=1)
    write_sound(tmp_path / "a.wav", Sound(samples[:, None], RATE), "PCM_24")
    parts = read_sound(clean(tmp_path / "a.wav", way, block_s=1.7)).mono()
    for one in (tmp_path / cache.CACHE_FOLDER).glob("clean*"):
        one.unlink()
    whole = read_sound(clean(tmp_path / "a.wav", way)).mono()
    assert len(parts) == len(whole) == len(samples)
    assert float(np.abs(parts - whole).max()) < 0.02


def test_pauses_of_digital_silence_leave_the_sound_as_it_is(tmp_path: Path) -> None:
    samples, _ = talk(gap=1.0, sentences=1)
    write_sound(tmp_path / "a.wav", Sound(samples[:, None], RATE), "PCM_24")
    cleaned = read_sound(clean(tmp_path / "a.wav", "noise")).mono()
    np.testing.assert_allclose(cleaned, read_sound(tmp_path / "a.wav").mono(), atol=1e-6)


@pytest.mark.parametrize("samples", [0, 1, 700])
@pytest.mark.parametrize("way", WAYS)
def test_the_shortest_sounds_do_no_harm(tmp_path: Path, way: str, samples: int) -> None:
    noise = np.random.default_rng(1).normal(size=(samples, 1)) * 0.1
    write_sound(tmp_path / "a.wav", Sound(noise.astype(np.float32), RATE))
    assert len(read_sound(clean(tmp_path / "a.wav", way)).samples) == samples


def test_a_missing_recording_and_an_unknown_way_are_sentences(tmp_path: Path) -> None:
    with pytest.raises(StudioError) as error:
        clean(tmp_path / "gone.wav", "noise")
    assert error.value.what == "The sound file gone.wav is missing."
    path, _, _ = _noisy(tmp_path / "a.wav")
    with pytest.raises(StudioError) as error:
        clean(path, "magic")
    assert error.value.what == "There is no sound cleaning called magic."
    assert not list((tmp_path / cache.CACHE_FOLDER).glob("clean*")), "nothing half-made is left"
