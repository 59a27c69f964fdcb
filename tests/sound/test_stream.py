from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import soundfile

from studio.sound.stream import SoundSource


def _tone(path: Path, rate: int, channels: int = 1, seconds: float = 1.0) -> np.ndarray:
    t = np.arange(int(seconds * rate)) / rate
    tone = (0.5 * np.sin(2 * np.pi * 440 * t)).astype(np.float32)
    soundfile.write(path, np.repeat(tone[:, None], channels, 1), rate, subtype="FLOAT")
    return tone


@pytest.mark.parametrize("channels", [1, 2, 6])
def test_any_number_of_channels_becomes_two(tmp_path: Path, channels: int) -> None:
    tone = _tone(tmp_path / "a.wav", 48_000, channels)
    source = SoundSource(tmp_path / "a.wav")
    block = source.read(1000, 500)
    source.close()
    assert block.shape == (500, 2)
    assert block[:, 0] == pytest.approx(tone[1000:1500], abs=1e-6)
    assert np.array_equal(block[:, 0], block[:, 1])


def test_outside_of_the_sound_there_is_silence(tmp_path: Path) -> None:
    tone = _tone(tmp_path / "a.wav", 48_000)
    source = SoundSource(tmp_path / "a.wav")
    block = source.read(-100, 200)
    late = source.read(len(tone) - 10, 50)
    source.close()
    assert not block[:100].any()
    assert block[100:, 0] == pytest.approx(tone[:100], abs=1e-6)
    assert not late[10:].any()


@pytest.mark.parametrize("rate", [8_000, 11_025, 44_100, 192_000])
def test_blocks_resampled_one_by_one_join_without_a_seam(tmp_path: Path, rate: int) -> None:
    _tone(tmp_path / "a.wav", rate)
    source = SoundSource(tmp_path / "a.wav")
    step = rate // 20 if rate != 11_025 else 735
    parts = [source.read_at(start, step, 48_000) for start in range(0, rate - step + 1, step)]
    source.close()
    joined = np.concatenate(parts)[:, 0]
    wanted = 0.5 * np.sin(2 * np.pi * 440 * np.arange(len(joined)) / 48_000)
    middle = slice(2000, len(joined) - 2000)
    assert np.abs(joined[middle] - wanted[middle]).max() < 0.002


def test_a_video_or_m4a_is_decoded_once(tmp_path: Path) -> None:
    av = pytest.importorskip("av")
    path = tmp_path / "声.m4a"
    with av.open(str(path), "w") as container:
        stream = container.add_stream("aac", rate=44_100, layout="mono")
        tone = (0.5 * np.sin(2 * np.pi * 440 * np.arange(44_100) / 44_100)).astype(np.float32)
        frame = av.AudioFrame.from_ndarray(tone[None], format="fltp", layout="mono")
        frame.sample_rate = 44_100
        for packet in [*stream.encode(frame), *stream.encode(None)]:
            container.mux(packet)
    source = SoundSource(path)
    block = source.read(10_000, 1_000)
    duration = source.duration
    source.close()
    assert duration == pytest.approx(1.0, abs=0.1)
    assert np.abs(block).max() == pytest.approx(0.5, abs=0.05)


def test_nan_in_a_file_is_silence(tmp_path: Path) -> None:
    samples = np.full(1000, np.nan, dtype=np.float32)
    soundfile.write(tmp_path / "nan.wav", samples, 48_000, subtype="FLOAT")
    source = SoundSource(tmp_path / "nan.wav")
    assert not source.read(0, 1000).any()
    source.close()
