"""Sound files: WAV, FLAC and OGG by libsndfile, anything else (MP3, M4A, video) by FFmpeg.

They are read whole, in blocks, or (`SoundSource`) from anywhere.
"""

from __future__ import annotations

import math
import re
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from studio.errors import StudioError, say
from studio.files import atomic, leftovers
from studio.sound.decode import RATES, Decoding, UnreadableError, chained

if TYPE_CHECKING:
    import soundfile


Samples = NDArray[np.float32]

LOUDEST = 1e6
"""No sample of a sound is larger."""
# Samples of each channel read at a time.
_BLOCK = 1 << 18
# Bytes that a WAV without samples has at most.
_LARGEST_HEAD = 4096
# How the names of encodings begin whose samples all take the same room.
_PLAIN = ("PCM", "FLOAT", "DOUBLE")
# From here on the size of a WAV is what programs write that do not know it yet.
_NOT_KNOWN = 0x7FFFF000


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
        """This sound resampled to another rate, Hz."""
        if sample_rate == self.sample_rate or not len(self.samples):
            return Sound(self.samples, sample_rate)
        import soxr

        return Sound(np.asarray(soxr.resample(self.samples, self.sample_rate, sample_rate)), sample_rate)


@dataclass(frozen=True)
class SoundInfo:
    """What a sound file holds: rate, channels, seconds, and libsndfile's names of container and encoding.

    `note` says what of it could not be read, "" for nothing.
    """

    sample_rate: int
    channels: int
    duration: float
    container: str = ""
    encoding: str = ""
    note: str = ""


def sound_info(path: Path) -> SoundInfo:
    """Rate, channels and length of a sound file.

    Raises:
        StudioError: it is missing or no sound can be found in it.
    """
    file = open_file(path)
    if file is None:
        stat = path.stat()
        return _decoded_info(path, stat.st_size, stat.st_mtime_ns)
    with file:
        note = (
            say("{name} ends early; what is there was kept.", name=path.name) if _is_cut_short(file) else ""
        )
        duration = file.frames / file.samplerate
        return SoundInfo(file.samplerate, file.channels, duration, file.format, file.subtype, note)


def _is_cut_short(file: soundfile.SoundFile) -> bool:
    """Whether a WAV claims more than there is; 0 and the largest number stand for "not known yet"."""
    found = re.search(r"^data : (\d+) \(should be (\d+)\)", file.extra_info, re.MULTILINE)
    return found is not None and int(found[2]) < int(found[1]) < _NOT_KNOWN


def open_file(path: Path) -> soundfile.SoundFile | None:
    """The file in libsndfile's hands, which can seek in it; None where FFmpeg has to decode it.

    Raises:
        StudioError: it is missing, empty, or claims a rate that no sound has.
    """
    import soundfile

    _must_exist(path)
    with path.open("rb") as start:
        mark = start.read(4)
    # libsndfile's MP3 decoder prints to the terminal, and at a damaged frame drops the rest without a word.
    is_mp3 = mark[:3] == b"ID3" or (mark[:1] == b"\xff" and mark[1:2] >= b"\xe0")
    # A name that ends in .raw makes soundfile ask for the rate instead of looking into the file.
    if is_mp3 or path.suffix.lower() in (".mp3", ".raw"):
        return None
    # Of which libsndfile reads the first only.
    if mark == b"OggS" and chained(path):
        return None
    try:
        file = soundfile.SoundFile(str(path))
    except soundfile.LibsndfileError:
        return None
    if not RATES[0] <= file.samplerate <= RATES[1]:
        with file:
            what = say(
                "The sound file {name} claims a sample rate of {rate} Hz.",
                name=path.name,
                rate=file.samplerate,
            )
            raise StudioError(what, "It is damaged; export or record it again.")
    if _is_to_be_trusted(file, path):
        return file
    file.close()
    return None


def _is_to_be_trusted(file: soundfile.SoundFile, path: Path) -> bool:
    """Whether a file is as long as it says; if not, FFmpeg reads what is there."""
    import soundfile

    # Its program may never have come to write the length.
    if not file.frames:
        return path.stat().st_size <= _LARGEST_HEAD
    if file.format in ("WAV", "WAVEX") and file.subtype.startswith(_PLAIN):
        # The length of plain samples is held against the file's by libsndfile.
        return True
    try:
        file.seek(file.frames - 1)
        last = file.read(1)
        file.seek(0)
    except (soundfile.LibsndfileError, ValueError):
        # ValueError: more than a seek can be told.
        return False
    return len(last) == 1


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
                empty = np.zeros((0, file.channels), np.float32)
                sound = Sound(finite(np.concatenate([empty, *_blocks(file)])), file.samplerate)
        except soundfile.LibsndfileError:
            # Damaged on the way: FFmpeg goes on behind the damage.
            sound = _decode(path)
    return sound if sample_rate is None else sound.resampled(sample_rate)


def _blocks(file: soundfile.SoundFile) -> Iterator[Samples]:
    """What is left of a file, (N, C) at a time: a damaged one may claim more than fits into any memory."""
    while len(block := file.read(_BLOCK, dtype="float32", always_2d=True)):
        yield block


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
            return Sound(finite(samples), file.samplerate)
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
    decoding = Decoding(path)
    for part in _decoded(decoding, path):
        waiting.append(_mono(part))
        if sum(map(len, waiting)) >= block_seconds * decoding.rate:
            yield decoding.rate, np.concatenate(waiting)
            waiting = []
    if waiting:
        yield decoding.rate, np.concatenate(waiting)


def _mono(samples: Samples) -> Samples:
    return np.ascontiguousarray(finite(samples).mean(axis=1, dtype=np.float32))


def finite(samples: Samples) -> Samples:
    """Make samples silence, in place, that are no numbers or so large that the sum of a few may overflow."""
    samples[~(np.abs(samples) <= LOUDEST)] = 0.0
    return samples


def write_sound(path: Path, sound: Sound, subtype: str = "PCM_16") -> None:
    """Write a WAV or FLAC file in one piece (by suffix); subtype is libsndfile's name of the encoding."""
    from studio.files import atomic

    with atomic.written(path) as beside:
        put_sound(beside, sound, subtype, path.suffix.lstrip(".").upper())


def copy_decoded(source: Path, target: Path, subtype: str) -> None:
    """Write a sound of any file anew, block by block, so that hours of it fit into any memory.

    Args:
        source: any sound or video file with sound.
        target: a WAV or FLAC, by its suffix.
        subtype: libsndfile's name of the encoding.

    Raises:
        StudioError: no sound can be read from it, or the disk is full.
    """
    import soundfile

    from studio.files import atomic

    file = open_file(source)
    decoding = Decoding(source)
    blocks = _decoded(decoding, source) if file is None else _blocks(file)
    container = target.suffix.lstrip(".").upper()
    try:
        first = next(blocks, np.zeros((0, 1), np.float32))
        rate = decoding.rate if file is None else file.samplerate
        with (
            atomic.written(target) as beside,
            soundfile.SoundFile(
                str(beside), "w", rate, first.shape[1], subtype=subtype, format=container
            ) as out,
        ):
            for block in chain([first], blocks):
                out.write(finite(block))
    except soundfile.LibsndfileError:
        # Damaged on the way: FFmpeg goes on behind the damage.
        write_sound(target, _decode(source), subtype)
    finally:
        if file is not None:
            file.close()


def put_sound(path: Path, sound: Sound, subtype: str, container: str) -> None:
    """Write a sound to a path as it stands, for use within `atomic.written`."""
    import soundfile

    soundfile.write(str(path), sound.samples, sound.sample_rate, subtype=subtype, format=container)


def _must_exist(path: Path) -> None:
    if not path.is_file():
        raise StudioError(
            say("The sound file {name} is missing.", name=path.name),
            say("Put it back at {folder}.", folder=path.parent),
        )
    if path.stat().st_size == 0:
        raise StudioError(say("The sound file {name} is empty.", name=path.name), "Choose another file.")


def _no_sound(path: Path) -> StudioError:
    return StudioError(
        say("No sound could be read from {name}.", name=path.name),
        "Choose a WAV, FLAC, OGG, MP3 or M4A file.",
    )


def _damaged(path: Path) -> StudioError:
    return StudioError(say("The sound file {name} is damaged.", name=path.name), "Import or record it again.")


def _decode(path: Path) -> Sound:
    """The whole first sound of any file FFmpeg understands."""
    decoding = Decoding(path)
    parts = list(_decoded(decoding, path))
    return Sound(finite(np.concatenate(parts)), decoding.rate)


def _decoded(decoding: Decoding, path: Path) -> Iterator[Samples]:
    """Blocks (N, C) of what FFmpeg reads; StudioError where there are none."""
    try:
        yield from decoding.blocks()
    except UnreadableError as error:
        raise _no_sound(path) from error


@lru_cache(maxsize=512)
def _decoded_info(path: Path, _size: int, _changed: int) -> SoundInfo:
    """By decoding all of it, once: what such files say of their own length is a guess."""
    decoding = Decoding(path)
    count = sum(map(len, _decoded(decoding, path)))
    return SoundInfo(decoding.rate, decoding.channels, count / decoding.rate, "", "decoded", decoding.note)


RESAMPLE_PAD = 512
"""Frames read on both sides of a block so that the resampler's filter is full at its edges."""


class SoundSource:
    """Stereo blocks from any place of a sound file, at the output's rate.

    Files that soundfile cannot seek in (MP3, M4A, video) are decoded once into a temporary WAV.

    Args:
        path: the sound.

    Raises:
        StudioError: the file is missing, damaged or holds no sound.
    """

    def __init__(self, path: Path) -> None:
        self._scratch: tempfile.TemporaryDirectory[str] | None = None
        if not path.is_file():
            raise StudioError(
                say("The sound {name} is not there.", name=path.name), "Choose another, or put the file back."
            )
        self._file = open_file(path) or self._decoded(path)
        self.sample_rate: int = self._file.samplerate
        self.frames: int = self._file.frames
        if not self.frames:
            self.close()
            raise StudioError(
                say("The sound {name} is empty.", name=path.name), "Choose a sound that holds something."
            )

    @property
    def duration(self) -> float:
        """Seconds."""
        return self.frames / self.sample_rate

    @property
    def decoded(self) -> bool:
        """Whether it is a copy that took decoding all of the file, and that holds the file no longer."""
        return self._scratch is not None

    def read(self, start: int, count: int) -> Samples:
        """Frames (count, 2) from a frame of the file; silence before its start and after its end."""
        import soundfile

        out = np.zeros((max(count, 0), 2), dtype=np.float32)
        first, last = max(start, 0), min(start + count, self.frames)
        if first < last:
            try:
                self._file.seek(first)
                block = finite(self._file.read(last - first, dtype="float32", always_2d=True))
            except soundfile.LibsndfileError:
                # Damaged there: silence, and the player goes on.
                block = np.zeros((0, 2), dtype=np.float32)
            stereo = block[:, [0, -1]] if block.shape[1] <= 2 else block.mean(axis=1, keepdims=True)
            out[first - start : first - start + len(block)] = stereo
        return out

    def read_at(self, start: int, count: int, rate: int) -> Samples:
        """Frames of the sound resampled to another rate, (round(count * rate / sample_rate), 2)."""
        if rate == self.sample_rate:
            return self.read(start, count)
        import soxr

        unit = self.sample_rate // math.gcd(self.sample_rate, rate)
        # Whole units keep the output grid where it was.
        pad = math.ceil(RESAMPLE_PAD / unit) * unit
        wide = soxr.resample(self.read(start - pad, count + 2 * pad), self.sample_rate, rate)
        first, length = pad * rate // self.sample_rate, round(count * rate / self.sample_rate)
        return np.ascontiguousarray(wide[first : first + length], dtype=np.float32)

    def close(self) -> None:
        """Let go of the file."""
        self._file.close()
        if self._scratch is not None:
            self._scratch.cleanup()

    def _decoded(self, path: Path) -> soundfile.SoundFile:
        import soundfile

        prefix = leftovers.scratch_prefix("sound")
        self._scratch = tempfile.TemporaryDirectory(prefix=prefix, ignore_cleanup_errors=True)
        copy = Path(self._scratch.name) / "sound.wav"
        try:
            _decode_to_wav(path, copy)
            return soundfile.SoundFile(copy)
        except BaseException:
            self._scratch.cleanup()
            raise


def _decode_to_wav(path: Path, copy: Path) -> None:
    """Write a sound as a mono WAV."""
    import soundfile

    rate = sound_info(path).sample_rate
    try:
        with (
            atomic.disk_faults(copy),
            soundfile.SoundFile(copy, "w", rate, 1, subtype="PCM_16") as out,
        ):
            for block in sound_blocks(path, rate):
                out.write(block)
    except OSError as error:
        raise atomic.cannot_write(copy, error) from error
