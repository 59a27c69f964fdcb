"""Sound through FFmpeg: MP3, M4A, the sound of videos, and whatever libsndfile cannot read to its end.

One rate and one number of channels come out, those of the first frame. Files put together out of several, and
damaged ones, change both on the way: taken as they come, half of such a sound would run at another speed.
"""

from __future__ import annotations

import io
import re
from collections.abc import Iterator
from contextlib import closing
from functools import lru_cache
from itertools import chain, islice, pairwise
from mmap import ACCESS_READ, mmap
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio.errors import say

Samples = NDArray[np.float32]

RATES = (1_000, 768_000)
"""Samples a second that a sound can have; others are damage, and to resample them would fill the memory."""
# FFmpeg's names of the kinds that say how long they are; of others it guesses.
_TELLING = ("flac", "mov,mp4,m4a,3gp,3g2,mj2")
# Seconds less than a file says that are no fault: encoders add some at its ends, which are cut again.
_SHORT = 0.25
# The head of an OGG page, by whether its flags say that it begins a stream. Source: RFC 3533, section 6.
_BEGINS, _GOES_ON = re.compile(rb"OggS\0[\2\3\6\7]"), re.compile(rb"OggS\0[\0\1\4\5]")


def chained(path: Path) -> tuple[int, ...]:
    """Where each further sound begins in a file that holds several OGGs one after the other."""
    return _chained(path, path.stat().st_mtime_ns)


@lru_cache(maxsize=64)
def _chained(path: Path, _changed: int) -> tuple[int, ...]:
    starts: list[int] = []
    with path.open("rb") as file, closing(mmap(file.fileno(), 0, access=ACCESS_READ)) as data:
        at = 0
        # The streams of one sound all begin before any goes on; what begins after that is another sound.
        while data[:4] == b"OggS" and (on := _GOES_ON.search(data, at)):
            if not (new := _BEGINS.search(data, on.end())):
                break
            at = new.start()
            starts.append(at)
    return tuple(starts)


class UnreadableError(Exception):
    """No sound could be read at all."""


class Decoding:
    """The first sound of a file, read once.

    Args:
        path: the file.

    Attributes:
        rate: samples a second, known from the first block on.
        channels: of every block.
        lost: seconds that were damaged; they are silence, so that what follows stays in time.
        damaged: whether the file stopped making sense before its end.
        ends_early: whether it says that it is longer than it is.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self.rate, self.channels = 0, 0
        self.lost, self.damaged, self.ends_early = 0.0, False, False
        self._claimed = 0.0
        # Damaged frames that came before any whole one.
        self._before = 0
        # Of the last frame, which is as long as one that is damaged would have been.
        self._seconds = 0.0
        self._kind: tuple[str, str, int] | None = None
        self._resampler: Any = None

    @property
    def note(self) -> str:
        """What a person should know of how it was read; "" where all of it could be."""
        if self.damaged:
            return say("{path} is damaged; everything readable was kept.", path=self._path.name)
        if self.ends_early:
            return say("{path} ends early; what is there was kept.", path=self._path.name)
        if self.lost:
            return say(
                "{path} is damaged; {lost} s in it could not be read and are silent.",
                path=self._path.name,
                lost=f"{self.lost:.2f}",
            )
        return ""

    def blocks(self) -> Iterator[Samples]:
        """Samples (N, channels), some hundredths of a second at a time.

        Raises:
            UnreadableError: there is no sound in the file.
        """
        frames = self._frames()
        # FFmpeg names the first frame of an MP3 by what it saw on looking ahead, the others by what they are.
        first = list(islice(frames, 2))
        self.rate = max((frame.sample_rate for frame in first if frame is not None), default=0)
        count = 0
        for frame in chain(first, frames):
            for block in self._even(frame) if frame is not None else self._silence():
                count += len(block)
                yield block
        yield from self._rest()
        if not self.channels:
            raise UnreadableError
        self.ends_early = count < (self._claimed - _SHORT) * self.rate

    def _frames(self) -> Iterator[Any]:
        """Each frame as FFmpeg has it, None for one that is damaged."""
        import av

        for part in self._parts():
            try:
                with av.open(part, "r") as container:
                    for packet in container.demux(audio=0) if container.streams.audio else ():
                        yield from self._decoded(packet)
                    if container.format.name in _TELLING and container.streams.audio:
                        stream = container.streams.audio[0]
                        self._claimed += float((stream.duration or 0) * (stream.time_base or 0))
            except (av.FFmpegError, ValueError, MemoryError):
                # ValueError: what PyAV has no name for; MemoryError: FFmpeg's word for a size it refuses.
                self.damaged = True

    def _parts(self) -> Iterator[str | io.BytesIO]:
        """The file, or each of the OGGs in it: FFmpeg follows no change of channels from one to the next."""
        starts = chained(self._path)
        if not starts:
            # "a: b.mp3" would name a protocol.
            yield str(self._path.absolute())
            return
        with self._path.open("rb") as file:
            for start, end in pairwise((0, *starts, self._path.stat().st_size)):
                file.seek(start)
                yield io.BytesIO(file.read(end - start))

    @staticmethod
    def _decoded(packet: Any) -> Iterator[Any]:
        import av

        try:
            frames = packet.decode()
        except av.InvalidDataError:
            frames = [None]
        for frame in frames:
            yield frame if frame is not None and RATES[0] <= frame.sample_rate <= RATES[1] else None

    def _silence(self) -> Iterator[Samples]:
        """In place of what is damaged; what its packet says of its length may be damaged too."""
        if not self.channels:
            # How long it is, and how many channels it has, the first whole frame will tell.
            self._before += 1
        else:
            self.lost += self._seconds
            yield np.zeros((round(self._seconds * self.rate), self.channels), np.float32)

    def _even(self, frame: Any) -> Iterator[Samples]:
        """A frame in the first one's rate and channels; silence where FFmpeg cannot convert it."""
        import av

        try:
            # All of it or nothing.
            yield from list(self._converted(frame))
        except (av.FFmpegError, ValueError):
            # Such as 255 channels.
            self._resampler = self._kind = None
            yield from self._silence()

    def _converted(self, frame: Any) -> Iterator[Samples]:
        import av

        kind = (frame.format.name, frame.layout.name, frame.sample_rate)
        if kind != self._kind:
            yield from self._rest()
            self.rate = self.rate or frame.sample_rate
            # Channel beside channel: PyAV 18 reads wild memory where more than eight lie one after another.
            self._resampler = av.AudioResampler(format="flt", rate=self.rate)
            self._kind = kind
        self._seconds = frame.samples / frame.sample_rate
        for mixed in map(self._mixed, self._resampler.resample(frame)):
            while self._before:
                self._before -= 1
                yield from self._silence()
            yield mixed

    def _rest(self) -> Iterator[Samples]:
        """What the resampler still holds."""
        if self._resampler is not None:
            # One that has nothing to do gives back the None it is given.
            yield from (self._mixed(out) for out in self._resampler.resample(None) if out is not None)

    def _mixed(self, frame: Any) -> Samples:
        # By hand: FFmpeg mixes between layouts that have names only, and damaged files have others.
        samples = np.asarray(frame.to_ndarray().reshape(frame.samples, -1), dtype=np.float32)
        self.channels = self.channels or samples.shape[1]
        if samples.shape[1] != self.channels:
            samples = np.repeat(samples.mean(axis=1, dtype=np.float32)[:, None], self.channels, axis=1)
        return samples
