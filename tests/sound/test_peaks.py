from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import soundfile

from studio.errors import StudioError
from studio.sound.peaks import BLOCK, block_extremes, peaks

RATE = 16_000


@pytest.fixture
def sound(tmp_path: Path) -> tuple[Path, np.ndarray]:
    random = np.random.default_rng(4)
    samples = (random.normal(size=RATE * 7 + 37) * 0.1).astype(np.float32)
    samples[RATE * 3] = 0.9
    samples[-1] = -0.8
    path = tmp_path / "音 a.wav"
    soundfile.write(path, samples, RATE, subtype="FLOAT")
    return path, samples


def test_every_zoom_shows_the_loudest_sample_of_each_column(sound: tuple[Path, np.ndarray]) -> None:
    path, samples = sound
    found = peaks(path)
    for start, end, count in ((0.0, 7.0, 50), (2.9, 3.1, 1000), (0.0, 7.1, 900), (2.0, 5.0, 333)):
        low, high = found.columns(start, end, count)
        edges = np.linspace(start, end, count + 1) * RATE
        slack = max((end - start) * RATE / count, BLOCK)
        for i in (0, count // 2, count - 1):
            a, b = int(edges[i]), min(int(np.ceil(edges[i + 1])), len(samples))
            if a >= b:
                continue
            wide = samples[max(int(a - slack), 0) : int(b + slack)]
            assert high[i] >= samples[a:b].max() - 1e-3
            assert high[i] <= wide.max() + 1e-3
            assert low[i] <= samples[a:b].min() + 1e-3


def test_a_click_is_seen_at_every_zoom(sound: tuple[Path, np.ndarray]) -> None:
    found = peaks(sound[0])
    for half in (3.0, 1.0, 0.1, 0.01, 0.001):
        assert found.columns(3.0 - half, 3.0 + half, 400)[1].max() == pytest.approx(0.9, abs=1e-3)
    assert found.columns(0.0, 8.0, 300)[0].min() == pytest.approx(-0.8, abs=1e-3), "the very last sample"


def test_the_closest_zoom_shows_single_samples(sound: tuple[Path, np.ndarray]) -> None:
    path, samples = sound
    low, high = peaks(path).columns(1.0, 1.0 + 10 / RATE, 10)
    np.testing.assert_allclose(high, samples[RATE : RATE + 10], atol=1e-6)
    np.testing.assert_allclose(low, high)


def test_outside_the_sound_there_is_silence(sound: tuple[Path, np.ndarray]) -> None:
    low, high = peaks(sound[0]).columns(20.0, 30.0, 10)
    assert not low.any()
    assert not high.any()


def test_peaks_are_kept_and_made_anew_for_another_sound(sound: tuple[Path, np.ndarray]) -> None:
    path, _ = sound
    first = peaks(path).columns(0.0, 7.0, 100)
    assert [file.suffix for file in (path.parent / ".cache").glob("peaks*")] == [".npz"]
    np.testing.assert_array_equal(peaks(path).columns(0.0, 7.0, 100), first)
    soundfile.write(path, np.full(RATE, 0.25, np.float32), RATE, subtype="FLOAT")
    assert peaks(path).columns(0.1, 0.9, 10)[1] == pytest.approx(np.full(10, 0.25), abs=1e-3)


def test_a_sound_made_anew_in_the_same_length_is_seen_as_it_is(sound: tuple[Path, np.ndarray]) -> None:
    path, samples = sound
    assert peaks(path).columns(0.0, 7.0, 1)[1].max() == pytest.approx(0.9, abs=1e-3)
    soundfile.write(path, 0.5 * samples, RATE, subtype="FLOAT")
    assert peaks(path).columns(0.0, 7.0, 1)[1].max() == pytest.approx(0.45, abs=1e-3)
    assert [file.name for file in path.parent.iterdir() if file.is_file()] == [path.name], "nothing beside it"


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 not a zip", b"nonsense"])
def test_a_damaged_cache_is_made_anew(sound: tuple[Path, np.ndarray], content: bytes) -> None:
    path, _ = sound
    expected = peaks(path).columns(0.0, 7.0, 100)
    next((path.parent / ".cache").glob("peaks*")).write_bytes(content)
    np.testing.assert_array_equal(peaks(path).columns(0.0, 7.0, 100), expected)


def test_a_missing_sound_is_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(StudioError) as caught:
        peaks(tmp_path / "gone.wav")
    assert caught.value.what == "The sound file gone.wav is missing."


def test_no_blocks_are_silence() -> None:
    low, high = block_extremes(np.zeros(0), np.zeros(0), np.linspace(0, 5, 6))
    assert low.tolist() == high.tolist() == [0.0] * 5
