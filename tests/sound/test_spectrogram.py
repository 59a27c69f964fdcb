from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import soundfile

from studio.errors import StudioError
from studio.files import cache
from studio.sound import spectrogram as spectra
from studio.sound.spectrogram import BANDS, FLOOR_DB, STEP_DB, Spectrogram, Stopped, spectrogram

RATE = 16_000


def _write(path: Path, samples: np.ndarray, rate: int = RATE) -> Path:
    soundfile.write(path, samples.astype(np.float32), rate)
    return path


def _sine(hz: float, seconds: float, rate: int = RATE) -> np.ndarray:
    return np.sin(2 * np.pi * hz * np.arange(int(seconds * rate)) / rate)


def _loudest_hz(found: Spectrogram, column: np.ndarray) -> float:
    return float(found.pitches_hz[int(column.argmax())])


@pytest.mark.parametrize("hz", [150.0, 440.0, 3000.0, 7000.0])
def test_a_tone_is_seen_at_its_pitch_and_its_level(tmp_path: Path, hz: float) -> None:
    found = spectrogram(_write(tmp_path / "a.wav", 0.5 * _sine(hz, 2.0)))
    column = found.part(0.0, 2.0, 100).data[50]
    assert _loudest_hz(found, column) == pytest.approx(hz, rel=0.12)
    level = FLOOR_DB + STEP_DB * float(column.max())
    assert level == pytest.approx(-6.0, abs=5.0)


@pytest.mark.parametrize("rate", [8_000, 44_100, 96_000])
def test_sounds_begin_and_end_where_they_do(tmp_path: Path, rate: int) -> None:
    samples = np.concatenate([np.zeros(rate), _sine(1000, 1.0, rate), np.zeros(rate)])
    found = spectrogram(_write(tmp_path / "a.wav", samples, rate))
    loud = found.part(0.0, 3.0, 180).data.max(axis=1) > 200
    seconds = np.flatnonzero(loud) / 60
    assert seconds[0] == pytest.approx(1.0, abs=0.04)
    assert seconds[-1] == pytest.approx(2.0, abs=0.04)


def test_looking_close_first_shows_what_is_there_then_what_was_measured(tmp_path: Path) -> None:
    samples = np.concatenate([np.zeros(RATE), _sine(1000, 1.0), np.zeros(RATE)])
    found = spectrogram(_write(tmp_path / "a.wav", samples))
    coarse = found.part(0.95, 1.05, 1000)
    assert coarse.finer
    for index in coarse.finer:
        found.measure_tile(index)
    fine = found.part(0.95, 1.05, 1000)
    assert not fine.finer
    assert len(fine.data) > 3 * len(coarse.data)
    for part in (coarse, fine):
        assert part.start <= 0.95
        assert part.end >= 1.05
        moments = part.start + (np.arange(len(part.data)) + 0.5) * (part.end - part.start) / len(part.data)
        first = moments[part.data.max(axis=1) > 200][0]
        assert first == pytest.approx(1.0, abs=0.02)


def test_close_and_far_agree_at_the_start_and_in_the_middle(tmp_path: Path) -> None:
    found = spectrogram(_write(tmp_path / "a.wav", np.random.default_rng(1).normal(size=RATE * 8) * 0.1))
    for start in (0.0, 5.12):
        coarse = found.part(start, start + 0.5, 1000)
        for index in coarse.finer:
            found.measure_tile(index)
        fine = found.part(start, start + 0.5, 1000)
        assert fine.data[4:-4].mean() == pytest.approx(coarse.data[1:-1].mean(), abs=3)


def test_a_click_is_seen_from_far_away(tmp_path: Path) -> None:
    samples = np.zeros(RATE * 120)
    samples[RATE * 60 : RATE * 60 + 200] = 0.9
    found = spectrogram(_write(tmp_path / "a.wav", samples))
    loud = np.flatnonzero(found.part(0.0, 120.0, 300).data.max(axis=1) > 50)
    assert len(loud) in (1, 2)
    assert loud[0] == pytest.approx(150, abs=1)


def test_it_is_measured_once_and_again_when_the_sound_is_another(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = _write(tmp_path / "a.wav", _sine(440, 1.0))
    first = spectrogram(path).part(0, 1, 50).data
    name = f"spectrum{spectra.VERSION}.npy"
    place = cache.find(path, name)
    assert place is not None
    assert place.parent == tmp_path / ".cache"
    stamp = place.stat().st_mtime_ns
    assert (spectrogram(path).part(0, 1, 50).data == first).all()
    assert place.stat().st_mtime_ns == stamp
    _write(path, _sine(2000, 1.0))
    assert cache.find(path, name) is None
    assert (spectrogram(path).part(0, 1, 50).data != first).any()


def test_a_damaged_cache_is_measured_again(tmp_path: Path) -> None:
    path = _write(tmp_path / "a.wav", _sine(440, 1.0))
    first = spectrogram(path).part(0, 1, 50).data
    place = cache.find(path, f"spectrum{spectra.VERSION}.npy")
    assert place is not None
    place.write_bytes(place.read_bytes()[:200])
    assert (spectrogram(path).part(0, 1, 50).data == first).all()


def test_outside_the_sound_there_is_silence(tmp_path: Path) -> None:
    found = spectrogram(_write(tmp_path / "a.wav", _sine(440, 1.0)))
    assert found.part(5.0, 6.0, 10).data.max() == 0
    assert found.part(5.0, 5.01, 100).data.max() == 0
    assert found.part(-3.0, -2.0, 10).data.shape == (10, BANDS)


@pytest.mark.parametrize("seconds", [0.0, 0.001, 0.03])
def test_the_shortest_sounds_do_no_harm(tmp_path: Path, seconds: float) -> None:
    found = spectrogram(_write(tmp_path / "a.wav", _sine(440, seconds)))
    assert found.part(0.0, 1.0, 10).data.shape == (10, BANDS)
    for index in found.part(0.0, 0.01, 100).finer:
        found.measure_tile(index)
    assert not found.part(0.0, 0.01, 100).finer


def test_measuring_stops_when_asked_and_keeps_nothing(tmp_path: Path) -> None:
    path = _write(tmp_path / "a.wav", _sine(440, 1.0))
    with pytest.raises(Stopped):
        spectrogram(path, lambda _: False)
    assert cache.find(path, f"spectrum{spectra.VERSION}.npy") is None


def test_progress_rises_to_the_end(tmp_path: Path) -> None:
    told: list[float] = []
    spectrogram(_write(tmp_path / "a.wav", _sine(440, 70.0)), lambda done: not told.append(done))
    assert len(told) >= 3
    assert told == sorted(told)
    assert told[-1] == pytest.approx(1.0, abs=0.01)


def test_a_missing_file_is_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(StudioError) as error:
        spectrogram(tmp_path / "gone.wav")
    assert error.value.what == "The sound file gone.wav is missing."
