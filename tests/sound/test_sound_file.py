"""Sound of every kind and rate."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import soundfile

from studio.errors import StudioError
from studio.sound.sound_file import (
    Sound,
    SoundSource,
    read_sound,
    read_span,
    sound_blocks,
    sound_info,
    write_sound,
)
from tests.formats.examples import a_sound


@pytest.mark.parametrize("suffix", [".wav", ".flac", ".ogg", ".mp3"])
@pytest.mark.parametrize(("rate", "channels"), [(8000, 1), (44100, 2)])
def test_common_files_are_read(tmp_path: Path, suffix: str, rate: int, channels: int) -> None:
    path = a_sound(tmp_path / f"x{suffix}", 1.0, rate, channels)
    sound = read_sound(path)
    assert (sound.sample_rate, sound.samples.shape[1]) == (rate, channels)
    assert sound.duration == pytest.approx(1.0, abs=0.1)
    assert np.abs(sound.samples).max() == pytest.approx(0.3, abs=0.05)
    assert sound.samples.dtype == np.float32


def test_192_khz_is_read_and_resampled(tmp_path: Path) -> None:
    path = a_sound(tmp_path / "x.wav", 0.5, 192000, 2)
    sound = read_sound(path, 16000)
    assert sound.sample_rate == 16000
    assert sound.duration == pytest.approx(0.5, abs=1e-3)
    spectrum = np.abs(np.fft.rfft(sound.mono()))
    assert np.argmax(spectrum) / sound.duration == pytest.approx(220, abs=3)


def test_video_and_m4a_are_decoded(tmp_path: Path) -> None:
    av = pytest.importorskip("av")
    path = tmp_path / "x.m4a"
    with av.open(str(path), "w") as container:
        stream = container.add_stream("aac", rate=44100, layout="mono")
        tone = (0.3 * np.sin(np.arange(44100) * 0.1)).astype(np.float32)[None]
        frame = av.AudioFrame.from_ndarray(tone, format="fltp", layout="mono")
        frame.sample_rate = 44100
        for packet in [*stream.encode(frame), *stream.encode(None)]:
            container.mux(packet)
    sound = read_sound(path)
    assert sound.sample_rate == 44100
    assert sound.duration == pytest.approx(1.0, abs=0.1)
    assert sound_info(path).duration == pytest.approx(sound.duration)
    assert sum(len(block) for block in sound_blocks(path, 16000, 0.3)) == pytest.approx(16000, abs=1600)


@pytest.mark.parametrize("rate", [None, 16000, 48000])
def test_blocks_together_are_the_whole(tmp_path: Path, rate: int | None) -> None:
    path = a_sound(tmp_path / "x.wav", 1.7, 44100, 2)
    blocks = list(sound_blocks(path, rate, block_seconds=0.25))
    assert len(blocks) == 7
    np.testing.assert_allclose(np.concatenate(blocks), read_sound(path, rate).mono(), atol=1e-4)


def test_a_span_is_what_the_whole_has_there(tmp_path: Path) -> None:
    path = a_sound(tmp_path / "x.wav", 1.0, 16000)
    whole = read_sound(path).samples
    np.testing.assert_array_equal(read_span(path, 0.25, 0.5).samples, whole[4000:8000])
    assert len(read_span(path, 0.9, 5.0).samples) == 1600
    assert len(read_span(path, 3.0, 5.0).samples) == 0


def test_a_sound_without_samples_is_no_error(tmp_path: Path) -> None:
    write_sound(tmp_path / "x.wav", Sound(np.zeros((0, 1), np.float32), 16000))
    assert read_sound(tmp_path / "x.wav", 8000).duration == 0
    assert list(sound_blocks(tmp_path / "x.wav", 8000)) == []


@pytest.mark.parametrize(
    ("content", "what"),
    [
        (None, "The sound file x.wav is missing."),
        (b"", "The sound file x.wav is empty."),
        (b"hello, I am no sound" * 20, "No sound could be read from x.wav."),
    ],
)
def test_what_is_no_sound_is_one_sentence(tmp_path: Path, content: bytes | None, what: str) -> None:
    path = tmp_path / "x.wav"
    if content is not None:
        path.write_bytes(content)
    for read in (read_sound, sound_info, lambda p: list(sound_blocks(p)), lambda p: read_span(p, 0, 1)):
        with pytest.raises(StudioError) as error:
            read(path)
        assert error.value.what == what


def test_samples_that_are_no_numbers_are_silence(tmp_path: Path) -> None:
    samples = np.full((1600, 1), 0.1, np.float32)
    samples[100:200], samples[300] = np.nan, np.inf
    path = tmp_path / "x.wav"
    write_sound(path, Sound(samples, 16000), "FLOAT")
    wanted = np.where(np.isfinite(samples), samples, 0)
    np.testing.assert_array_equal(read_sound(path).samples, wanted)
    np.testing.assert_array_equal(read_span(path, 0, 1).samples, wanted)
    np.testing.assert_array_equal(np.concatenate(list(sound_blocks(path))), wanted[:, 0])


def test_a_damaged_mp3_is_read_on_behind_the_damage_without_a_word(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = a_sound(tmp_path / "x.mp3", 6.0, 44100)
    content = bytearray(path.read_bytes())
    middle = len(content) // 2
    content[middle : middle + 2000] = np.random.default_rng(1).bytes(2000)
    path.write_bytes(content)
    sound = read_sound(path)
    assert sound.duration == pytest.approx(6.0, abs=1.0)
    assert sound_info(path).duration == pytest.approx(sound.duration)
    assert np.abs(sound.samples[-44100:-4410]).max() == pytest.approx(0.3, abs=0.1)
    assert capfd.readouterr() == ("", "")


def test_a_flac_damaged_on_the_way_is_one_sentence(tmp_path: Path) -> None:
    path = tmp_path / "x.flac"
    noise = np.random.default_rng(2).standard_normal((64000, 1), dtype=np.float32) * np.float32(0.1)
    write_sound(path, Sound(noise, 16000))
    content = bytearray(path.read_bytes())
    middle = len(content) // 2
    content[middle : middle + 4000] = np.random.default_rng(3).bytes(4000)
    path.write_bytes(content)
    for read in (lambda: list(sound_blocks(path)), lambda: read_span(path, 0.0, 4.0)):
        with pytest.raises(StudioError) as error:
            read()
        assert str(error.value) == "The sound file x.flac is damaged. Import or record it again."
    assert read_sound(path).duration == pytest.approx(4.0, abs=0.6)  # FFmpeg goes on behind the damage


def test_a_flac_damaged_at_its_very_start_stays_in_time(tmp_path: Path) -> None:
    t = np.arange(48_000) / 16_000
    wave = (0.3 * np.sin(2 * np.pi * 220 * t) * (t > 1.5)).astype(np.float32)  # silent, then a tone
    path = tmp_path / "a.flac"
    write_sound(path, Sound(np.stack([wave, wave], axis=1), 16_000))
    data = bytearray(path.read_bytes())
    first = data.index(b"\xff\xf8")
    data[first + 5] ^= 0xFF  # in the head of its first frame, which has a checksum of its own
    path.write_bytes(data)
    read = read_sound(path).mono()
    assert len(read) == len(wave)
    np.testing.assert_allclose(read, wave, atol=1e-3)


def test_a_full_disk_is_one_sentence_and_leaves_nothing(tmp_path: Path) -> None:
    resource = pytest.importorskip("resource")
    limit = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (4096, limit[1]))
    try:
        with pytest.raises(StudioError) as error:
            write_sound(tmp_path / "x.wav", Sound(np.zeros((48000, 1), np.float32), 48000))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limit)
    assert error.value.what.startswith("x.wav could not be written: ")
    assert list(tmp_path.iterdir()) == []


def test_a_name_with_a_colon_is_a_file_and_no_protocol(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    a_sound(tmp_path / "plain.mp3", 1.0).replace(tmp_path / "http: 今日.mp3")
    monkeypatch.chdir(tmp_path)
    assert sound_info(Path("http: 今日.mp3")).duration == pytest.approx(1.0, abs=0.2)


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
