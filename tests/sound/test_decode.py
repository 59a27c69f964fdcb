"""Sound that changes on the way, that was cut off, or whose head does not say the truth."""

from __future__ import annotations

import io
import struct
from collections.abc import Callable
from pathlib import Path

import av
import numpy as np
import pytest
import soundfile

from studio.errors import StudioError
from studio.sound.peaks import peaks
from studio.sound.sound_file import Sound, SoundSource, read_sound, read_span, sound_blocks, sound_info

SECONDS = 1.0
FIRST_HZ, SECOND_HZ = 440, 660


def tone(rate: int, channels: int, pitch: float | np.ndarray, seconds: float = SECONDS) -> np.ndarray:
    if isinstance(pitch, np.ndarray):
        return pitch
    t = np.arange(round(seconds * rate)) / rate
    return np.tile(0.3 * np.sin(2 * np.pi * pitch * t), (channels, 1)).T.astype(np.float32)


def by_libsndfile(kind: str) -> Callable[[int, int, float | np.ndarray], bytes]:
    def encoded(rate: int, channels: int, pitch: float | np.ndarray) -> bytes:
        data = io.BytesIO()
        soundfile.write(data, tone(rate, channels, pitch), rate, format=kind)
        return data.getvalue()

    return encoded


def by_ffmpeg(container: str, codec: str) -> Callable[[int, int, float | np.ndarray], bytes]:
    def encoded(rate: int, channels: int, pitch: float | np.ndarray) -> bytes:
        data, layout = io.BytesIO(), "mono" if channels == 1 else "stereo"
        with av.open(data, "w", format=container) as file:
            stream = file.add_stream(codec, rate=rate, layout=layout)
            samples = np.ascontiguousarray(tone(rate, channels, pitch).T)
            frame = av.AudioFrame.from_ndarray(samples, format="fltp", layout=layout)
            frame.sample_rate = rate
            for packet in [*stream.encode(frame), *stream.encode(None)]:
                file.mux(packet)
        return data.getvalue()

    return encoded


KINDS = {
    "mp3": by_libsndfile("MP3"),
    "aac": by_ffmpeg("adts", "aac"),
    "ogg": by_libsndfile("OGG"),
    "opus": by_ffmpeg("ogg", "libopus"),
}


def pitch_of(samples: np.ndarray, rate: int) -> float:
    middle = samples[len(samples) // 4 : len(samples) * 3 // 4]
    return float(np.argmax(np.abs(np.fft.rfft(middle * np.hanning(len(middle)))))) * rate / len(middle)


@pytest.mark.parametrize("suffix", KINDS)
@pytest.mark.parametrize(
    ("first", "second"),
    [((48000, 1), (48000, 2)), ((48000, 2), (24000, 2)), ((24000, 2), (48000, 1))],
    ids=["channels", "rate", "both"],
)
def test_a_sound_that_changes_on_the_way_keeps_its_length_and_pitch(
    suffix: str, first: tuple[int, int], second: tuple[int, int], tmp_path: Path
) -> None:
    made = KINDS[suffix]
    path = tmp_path / f"two.{suffix}"
    path.write_bytes(made(*first, FIRST_HZ) + made(*second, SECOND_HZ))
    sound = read_sound(path)
    rate = 48000 if suffix == "opus" else first[0]  # Opus is always decoded at its own
    assert (sound.sample_rate, sound.samples.shape[1]) == (rate, first[1])
    # Encoders add frames at both ends of each, of 1152 samples at most.
    assert sound.duration == pytest.approx(2 * SECONDS, abs=6 * 1152 / min(first[0], second[0]))
    half = len(sound.samples) // 2
    assert pitch_of(sound.mono()[:half], rate) == pytest.approx(FIRST_HZ, abs=3)
    assert pitch_of(sound.mono()[half:], rate) == pytest.approx(SECOND_HZ, abs=3)
    assert np.abs(sound.samples[half * 5 // 4 :]).max() == pytest.approx(0.3, abs=0.1)
    info = sound_info(path)
    assert (info.sample_rate, info.channels, info.duration) == (rate, first[1], sound.duration)
    assert sum(map(len, sound_blocks(path, None, 0.5))) == len(sound.samples)
    low, high = peaks(path).columns(0.0, sound.duration, 8)
    assert (high - low > 0.4).all()
    source = SoundSource(path)
    assert source.duration == pytest.approx(sound.duration)
    source.close()


@pytest.mark.parametrize("suffix", ["mp3", "aac", "ogg", "opus", "flac"])
def test_what_is_there_of_a_sound_cut_off_is_read(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"cut.{suffix}"
    noise = np.random.default_rng(1).uniform(-0.3, 0.3, (192000, 1)).astype(np.float32)
    data = KINDS.get(suffix, by_libsndfile("FLAC"))(48000, 1, noise)
    path.write_bytes(data[: len(data) * 6 // 10])
    sound = read_sound(path)
    assert sound.duration == pytest.approx(0.6 * 4, abs=1.0)
    info = sound_info(path)
    assert info.duration == pytest.approx(sound.duration, abs=1e-6)
    if suffix == "flac":  # the only one that says how long it should be
        assert info.note == "cut.flac ends early; what is there was kept."


def a_wav(size: int | None = None, rate: int = 16000, channels: int = 1, bits: int = 16) -> bytes:
    """A second of sound under a head that may lie; None is the true size."""
    data = (tone(16000, 1, FIRST_HZ, 1.0) * 32767).astype("<i2").tobytes()
    align = channels * bits // 8 & 0xFFFF
    form = struct.pack("<IHHIIHH", 16, 1, channels, rate, rate * align & 0xFFFFFFFF, align, bits)
    size = len(data) if size is None else size
    return (
        b"RIFF"
        + struct.pack("<I", 36 + len(data))
        + b"WAVEfmt "
        + form
        + b"data"
        + struct.pack("<I", size)
        + data
    )


@pytest.mark.parametrize(
    ("size", "seconds", "note"),
    [
        (64000, 1.0, "lie.wav ends early; what is there was kept."),
        (0xFFFFFFFF, 1.0, ""),  # what programs write that do not know it yet
        (0, 1.0, ""),
        (16000, 0.5, ""),
        (15999, 0.5, ""),
    ],
)
def test_a_wav_holds_what_is_there_whatever_size_it_claims(
    size: int, seconds: float, note: str, tmp_path: Path
) -> None:
    path = tmp_path / "lie.wav"
    path.write_bytes(a_wav(size))
    sound = read_sound(path)
    assert sound.duration == pytest.approx(seconds, abs=0.001)
    assert pitch_of(sound.mono(), 16000) == pytest.approx(FIRST_HZ, abs=3)
    assert sound_info(path).duration == sound.duration
    assert sound_info(path).note == note


@pytest.mark.parametrize(
    ("lie", "what"),
    [
        ({"rate": 0}, "No sound could be read from lie.wav."),
        ({"rate": 1}, "The sound file lie.wav claims a sample rate of 1 Hz."),
        ({"rate": 2**31 - 1}, "The sound file lie.wav claims a sample rate of 2147483647 Hz."),
        ({"rate": 2**32 - 1}, "No sound could be read from lie.wav."),
        ({"channels": 0}, "No sound could be read from lie.wav."),
        ({"channels": 65535}, "No sound could be read from lie.wav."),
        ({"channels": 255, "bits": 64}, "No sound could be read from lie.wav."),
        ({"bits": 0}, "No sound could be read from lie.wav."),
        ({"bits": 33}, "No sound could be read from lie.wav."),
        ({"bits": 65535}, "No sound could be read from lie.wav."),
    ],
)
def test_a_wav_that_cannot_be_is_one_sentence(lie: dict[str, int], what: str, tmp_path: Path) -> None:
    path = tmp_path / "lie.wav"
    path.write_bytes(a_wav(**lie))
    reads: tuple[Callable[[Path], object], ...] = (
        read_sound, sound_info, lambda p: list(sound_blocks(p, 16000)), lambda p: read_span(p, 0.2, 0.4)
    )  # fmt: skip
    for read in reads:
        with pytest.raises(StudioError) as error:
            read(path)
        assert error.value.what == what


@pytest.mark.parametrize("channels", [1, 2, 8, 9, 12, 24, 64])
def test_any_number_of_channels_is_read_by_ffmpeg(channels: int, tmp_path: Path) -> None:
    path = tmp_path / "many.wav"
    path.write_bytes(a_wav(channels=channels, bits=64))  # a depth that libsndfile does not know
    sound = read_sound(path)
    assert sound.samples.shape == (16000 * 2 // (8 * channels), channels)
    assert sound_info(path).channels == channels


@pytest.mark.parametrize("bits", [1, 7, 12, 20, 24, 31, 64])
def test_an_odd_depth_is_read_as_the_next_whole_one(bits: int, tmp_path: Path) -> None:
    path = tmp_path / "odd.wav"
    path.write_bytes(a_wav(bits=bits))
    wanted = 16000 * 2 // -(-bits // 8)
    assert abs(len(read_sound(path).samples) - wanted) <= 1


def test_a_flac_that_claims_days_is_as_long_as_it_is(tmp_path: Path) -> None:
    path = tmp_path / "days.flac"
    data = bytearray(by_libsndfile("FLAC")(16000, 1, FIRST_HZ))
    # STREAMINFO's number of samples: the last 36 bits before the checksum. Source: RFC 9639, section 8.2.
    data[21] |= 0x0F
    path.write_bytes(data)
    assert sound_info(path).duration == pytest.approx(SECONDS)
    assert sound_info(path).note == "days.flac ends early; what is there was kept."
    sound: Sound = read_sound(path)
    assert sound.duration == pytest.approx(SECONDS)


def test_what_a_file_holds_is_decoded_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[object] = []
    av_open = av.open
    monkeypatch.setattr(av, "open", lambda *args: opened.append(args) or av_open(*args))
    path = tmp_path / "a.mp3"
    path.write_bytes(KINDS["mp3"](44100, 1, FIRST_HZ))
    first = sound_info(path)
    assert sound_info(path) == first
    assert len(opened) == 1
    # Another sound under the same name is another one.
    path.write_bytes(KINDS["mp3"](22050, 1, FIRST_HZ))
    assert sound_info(path).sample_rate == 22050
