"""A sound file read anywhere, in bounded memory."""

from __future__ import annotations

import math
import tempfile
from pathlib import Path

import numpy as np
import soundfile
from numpy.typing import NDArray

from studio.errors import StudioError
from studio.files import atomic, leftovers
from studio.sound.sound_file import finite, open_file, sound_blocks, sound_info

Samples = NDArray[np.float32]

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
            raise StudioError(f"The sound {path.name} is not there.", "Choose another, or put the file back.")
        self._file = open_file(path) or self._decoded(path)
        self.sample_rate: int = self._file.samplerate
        self.frames: int = self._file.frames
        if not self.frames:
            self.close()
            raise StudioError(f"The sound {path.name} is empty.", "Choose a sound that holds something.")

    @property
    def duration(self) -> float:
        """Seconds."""
        return self.frames / self.sample_rate

    def read(self, start: int, count: int) -> Samples:
        """Frames (count, 2) from a frame of the file; silence before its start and after its end."""
        out = np.zeros((max(count, 0), 2), dtype=np.float32)
        first, last = max(start, 0), min(start + count, self.frames)
        if first < last:
            try:
                self._file.seek(first)
                block = finite(self._file.read(last - first, dtype="float32", always_2d=True))
            except soundfile.LibsndfileError:  # damaged there: silence, and the player goes on
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
        pad = math.ceil(RESAMPLE_PAD / unit) * unit  # whole units keep the output grid where it was
        wide = soxr.resample(self.read(start - pad, count + 2 * pad), self.sample_rate, rate)
        first, length = pad * rate // self.sample_rate, round(count * rate / self.sample_rate)
        return np.ascontiguousarray(wide[first : first + length], dtype=np.float32)

    def close(self) -> None:
        """Let go of the file."""
        self._file.close()
        if self._scratch is not None:
            self._scratch.cleanup()

    def _decoded(self, path: Path) -> soundfile.SoundFile:
        prefix = leftovers.scratch_prefix("sound")
        self._scratch = tempfile.TemporaryDirectory(prefix=prefix, ignore_cleanup_errors=True)
        copy = Path(self._scratch.name) / "sound.wav"
        try:
            _decode(path, copy)
            return soundfile.SoundFile(copy)
        except BaseException:
            self._scratch.cleanup()
            raise


def _decode(path: Path, copy: Path) -> None:
    """Write a sound as a mono WAV."""
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
