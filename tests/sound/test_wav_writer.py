"""A WAV file that may be cut off anywhere."""

import struct
from pathlib import Path

import numpy as np
import pytest
import soundfile

from studio.sound import wav_writer
from studio.sound.wav_writer import HEADER_BYTES, WavWriter, repair


def noise(frames: int, channels: int) -> np.ndarray:
    return np.random.default_rng(2).uniform(-1, 1, (frames, channels)).astype(np.float32)


@pytest.mark.parametrize(("rate", "channels"), [(8_000, 1), (44_100, 2), (192_000, 6)])
def test_what_was_written_is_read_bit_for_bit(tmp_path: Path, rate: int, channels: int) -> None:
    samples = noise(1000, channels)
    wav = WavWriter(tmp_path / "a.wav", rate, channels)
    wav.append(samples[:300])
    wav.append(samples[300:])
    wav.close()
    wav.close()
    heard, heard_rate = soundfile.read(tmp_path / "a.wav", dtype="float32", always_2d=True)
    assert heard_rate == rate
    np.testing.assert_array_equal(heard, samples)


@pytest.mark.parametrize("cut", [0, 1, 7])
def test_a_killed_writers_file_is_mended(tmp_path: Path, cut: int) -> None:
    path, samples = tmp_path / "a.wav", noise(1000, 2)
    wav = WavWriter(path, 48_000, 2)
    wav.append(samples)
    wav.flush()
    data = path.read_bytes()
    wav.close()
    path.write_bytes(data[: len(data) - cut])
    whole = 1000 if cut == 0 else 999
    assert repair(path) == whole
    np.testing.assert_array_equal(soundfile.read(path, dtype="float32")[0], samples[:whole])
    assert repair(path) == whole


@pytest.mark.parametrize("content", [b"", b"RIFF", bytes(HEADER_BYTES + 8), b"x" * 500])
def test_what_is_no_wav_holds_nothing(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "a.wav"
    path.write_bytes(content)
    assert repair(path) == 0
    assert path.read_bytes() == content


def test_past_four_gigabytes_it_is_rf64(tmp_path: Path) -> None:
    """The header alone, since five gigabytes of silence help nobody; a sparse file gives it its length."""
    path = tmp_path / "long.wav"
    WavWriter(path, 48_000, 2).close()
    frames = 5 * 1024**3 // 8
    with path.open("r+b") as file:
        file.truncate(HEADER_BYTES + frames * 8)
    assert repair(path) == frames
    with path.open("rb") as file:
        assert file.read(4) == b"RF64"
    assert soundfile.info(path).frames == frames


def test_the_header_has_the_length_it_says() -> None:
    head = wav_writer.header(48_000, 2, 80)
    assert len(head) == HEADER_BYTES
    assert head[-8:-4] == b"data"
    assert struct.unpack("<I", head[-4:]) == (80,)
