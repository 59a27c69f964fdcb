"""Sound files: WAV, FLAC and OGG by libsndfile, anything else (MP3, M4A, video) by FFmpeg.

Samples that are no numbers (float files of a broken program hold them) are silence.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from studio.errors import StudioError

if TYPE_CHECKING:
    import soundfile

Samples = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Sound:
    """Sound in memory.

    Args:
        samples: float32 (N, C), full scale +-1.
        sample_rate: samples per second.
    """

    samples: Samples
    sample_rate: int

    @property
    def duration(self) -> float:
        """Seconds."""
        return len(self.samples) / self.sample_rate

    def mono(self) -> Samples:
        """The mean of all channels, float32 (N,)."""
        if self.samples.shape[1] == 1:
            return self.samples[:, 0]
        return self.samples.mean(axis=1, dtype=np.float32)

    def resampled(self, sample_rate: int) -> Sound:
        """The same sound at another rate."""
        if sample_rate == self.sample_rate or not len(self.samples):
            return Sound(self.samples, sample_rate)
        import soxr

        return Sound(np.asarray(soxr.resample(self.samples, self.sample_rate, sample_rate)), sample_rate)


@dataclass(frozen=True)
class SoundInfo:
    """What a sound file holds: rate, channels, seconds, and libsndfile's names of container and encoding."""

    sample_rate: int
    channels: int
    duration: float
    container: str = ""
    encoding: str = ""


def sound_info(path: Path) -> SoundInfo:
    """Rate, channels and length of a sound file.

    Raises:
        StudioError: it is missing or no sound can be found in it.
    """
    file = open_file(path)
    if file is None:
        return _decoded_info(path)
    with file:
        duration = file.frames / file.samplerate
        return SoundInfo(file.samplerate, file.channels, duration, file.format, file.subtype)


def open_file(path: Path) -> soundfile.SoundFile | None:
    """The file in libsndfile's hands, which can seek in it; None where FFmpeg has to decode it.

    Raises:
        StudioError: it is missing or empty.
    """
    import soundfile

    _must_exist(path)
    with path.open("rb") as start:
        mark = start.read(3)
    # libsndfile's MP3 decoder prints to the terminal, and at a damaged frame drops the rest without a word.
    if mark == b"ID3" or (mark[:1] == b"\xff" and mark[1:2] >= b"\xe0") or path.suffix.lower() == ".mp3":
        return None
    try:
        return soundfile.SoundFile(str(path))
    except soundfile.LibsndfileError:
        return None


def read_sound(path: Path, sample_rate: int | None = None) -> Sound:
    """A whole sound file in memory.

    Args:
        path: any sound or video file with sound.
        sample_rate: wanted rate; the file's own where None.

    Raises:
        StudioError: it is missing or no sound can be found in it.
    """
    import soundfile

    file = open_file(path)
    if file is None:
        sound = _decode(path)
    else:
        try:
            with file:
                sound = Sound(_finite(file.read(dtype="float32", always_2d=True)), file.samplerate)
        except soundfile.LibsndfileError:  # damaged on the way: FFmpeg goes on behind the damage
            sound = _decode(path)
    return sound if sample_rate is None else sound.resampled(sample_rate)


def read_span(path: Path, start: float, end: float) -> Sound:
    """The samples from start to end (seconds) of a WAV, FLAC or OGG, without reading the rest."""
    import soundfile

    file = open_file(path)
    if file is None:
        raise _no_sound(path)
    try:
        with file:
            first = min(max(int(start * file.samplerate), 0), file.frames)
            last = min(max(int(np.ceil(end * file.samplerate)), first), file.frames)
            file.seek(first)
            samples = file.read(last - first, dtype="float32", always_2d=True)
            return Sound(_finite(samples), file.samplerate)
    except soundfile.LibsndfileError as error:
        raise _damaged(path) from error


def sound_blocks(
    path: Path, sample_rate: int | None = None, block_seconds: float = 30.0
) -> Iterator[Samples]:
    """The sound as mono blocks, float32 (N,), in bounded memory; together they equal the whole.

    Args:
        path: any sound or video file with sound.
        sample_rate: wanted rate; the file's own where None.
        block_seconds: length read at a time.

    Raises:
        StudioError: it is missing, holds no sound, or is damaged on the way.
    """
    blocks = _own_blocks(path, block_seconds)
    rate, ahead = next(blocks, (0, None))
    if ahead is None:
        return
    if sample_rate in (None, rate):
        yield ahead
        yield from (block for _, block in blocks)
        return
    import soxr

    stream = soxr.ResampleStream(rate, sample_rate, 1, dtype="float32")
    for _, block in blocks:
        yield stream.resample_chunk(ahead)
        ahead = block
    yield stream.resample_chunk(ahead, last=True)


def _own_blocks(path: Path, block_seconds: float) -> Iterator[tuple[int, Samples]]:
    """The file's own rate with each mono block, (N,)."""
    import soundfile

    file = open_file(path)
    if file is None:
        yield from _decoded_blocks(path, block_seconds)
        return
    with file:
        size = max(int(block_seconds * file.samplerate), 1)
        while True:
            try:
                block = file.read(size, dtype="float32", always_2d=True)
            except soundfile.LibsndfileError as error:
                raise _damaged(path) from error
            if not len(block):
                return
            yield file.samplerate, _mono(block)


def _decoded_blocks(path: Path, block_seconds: float) -> Iterator[tuple[int, Samples]]:
    waiting: list[Samples] = []
    for rate, part in _decoded(path):
        waiting.append(_mono(part))
        if sum(map(len, waiting)) >= block_seconds * rate:
            yield rate, np.concatenate(waiting)
            waiting = []
    if waiting:
        yield rate, np.concatenate(waiting)


def _mono(samples: Samples) -> Samples:
    return np.ascontiguousarray(_finite(samples).mean(axis=1, dtype=np.float32))


def _finite(samples: Samples) -> Samples:
    return np.nan_to_num(samples, copy=False, nan=0.0, posinf=0.0, neginf=0.0)


def write_sound(path: Path, sound: Sound, subtype: str = "PCM_16") -> None:
    """Write a WAV or FLAC file in one piece (by suffix); subtype is libsndfile's name of the encoding."""
    from studio.take import safe_file

    with safe_file.written(path) as beside:
        put_sound(beside, sound, subtype, path.suffix.lstrip(".").upper())


def put_sound(path: Path, sound: Sound, subtype: str, container: str) -> None:
    """Write a sound to a path as it stands; OSError where the disk does not take it."""
    import soundfile

    try:
        soundfile.write(str(path), sound.samples, sound.sample_rate, subtype=subtype, format=container)
    except soundfile.LibsndfileError as error:  # what the disk said is lost in it
        raise OSError(str(error)) from error


def _must_exist(path: Path) -> None:
    if not path.is_file():
        raise StudioError(f"The sound file {path.name} is missing.", f"Put it back at {path.parent}.")
    if path.stat().st_size == 0:
        raise StudioError(f"The sound file {path.name} is empty.", "Choose another file.")


def _no_sound(path: Path) -> StudioError:
    return StudioError(
        f"No sound could be read from {path.name}.", "Choose a WAV, FLAC, OGG, MP3 or M4A file."
    )


def _damaged(path: Path) -> StudioError:
    return StudioError(f"The sound file {path.name} is damaged.", "Import or record it again.")


def _decode(path: Path) -> Sound:
    """The whole first audio stream of any file FFmpeg understands."""
    rate, parts = 0, []
    for rate, part in _decoded(path):  # noqa: B007 - the rate is the same in all
        parts.append(part)
    return Sound(_finite(np.ascontiguousarray(np.concatenate(parts), dtype=np.float32)), rate)


def _decoded(path: Path) -> Iterator[tuple[int, Samples]]:
    """Rate and samples (N, C), some hundredths of a second at a time; a damaged packet is silence."""
    import av

    rate, channels = 0, 0
    try:
        with av.open(str(path.absolute())) as container:  # "a: b.mp3" would name a protocol
            if not container.streams.audio:
                raise _no_sound(path)
            resampler = av.AudioResampler(format="fltp")
            for packet in container.demux(audio=0):
                try:
                    frames = packet.decode()
                except av.InvalidDataError:
                    lost = float((packet.duration or 0) * (packet.time_base or 0))
                    if rate:
                        yield rate, np.zeros((round(lost * rate), channels), np.float32)
                    continue
                for out in (out for frame in frames for out in resampler.resample(frame)):
                    rate, channels = out.sample_rate, len(out.layout.channels)
                    yield rate, np.asarray(out.to_ndarray().T, dtype=np.float32)
    except (av.FFmpegError, ValueError) as error:
        raise _no_sound(path) from error
    if not rate:
        raise _no_sound(path)


def _decoded_info(path: Path) -> SoundInfo:
    """By decoding all of it: what such files say of their own length is a guess."""
    rate, channels, count = 0, 0, 0
    for rate, part in _decoded(path):  # noqa: B007 - the rate is the same in all
        channels, count = part.shape[1], count + len(part)
    return SoundInfo(rate, channels, count / rate, "", "decoded")
