"""A WAV file that can be read at any moment while it grows: samples are appended, sizes set at the end.

Source: RIFF WAVE with IEEE float samples; EBU Tech 3306 (RF64) past 4 GiB, its ds64 chunk reserved as JUNK.
"""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

HEADER_BYTES = 12 + 36 + 26 + 12 + 8
_FLOAT = 3
_LIMIT = 0xFFFF_FFFF


def header(sample_rate: int, channels: int, data_bytes: int) -> bytes:
    """The header for so many bytes of float32 samples."""
    frame = 4 * channels
    big = data_bytes + HEADER_BYTES > _LIMIT
    riff_size, data_size = data_bytes + HEADER_BYTES - 8, data_bytes
    frames = data_bytes // frame
    if big:
        head = b"RF64" + struct.pack("<I", _LIMIT) + b"WAVE"
        room = b"ds64" + struct.pack("<IQQQI", 28, riff_size, data_size, frames, 0)
    else:
        head = b"RIFF" + struct.pack("<I", riff_size) + b"WAVE"
        room = b"JUNK" + struct.pack("<I", 28) + bytes(28)
    form = struct.pack("<IHHIIHHH", 18, _FLOAT, channels, sample_rate, sample_rate * frame, frame, 32, 0)
    fact = b"fact" + struct.pack("<II", 4, min(frames, _LIMIT))
    return head + room + b"fmt " + form + fact + b"data" + struct.pack("<I", min(data_size, _LIMIT))


class WavWriter:
    """Appends float32 samples to a WAV file.

    Args:
        path: a new file.
        sample_rate, channels: of the samples.

    Raises:
        OSError: from any method, where the disk is full or gone.
    """

    def __init__(self, path: Path, sample_rate: int, channels: int) -> None:
        self.sample_rate, self.channels = sample_rate, channels
        self.frames = 0
        self._file = path.open("wb")
        self._file.write(header(sample_rate, channels, 0))

    def append(self, samples: NDArray[np.float32]) -> None:
        """Add samples (N, C)."""
        self._file.write(np.ascontiguousarray(samples, dtype="<f4").tobytes())
        self.frames += len(samples)

    def flush(self) -> None:
        """Hand everything to the system, so that a kill of this process loses nothing of it."""
        self._file.flush()

    def fileno(self) -> int:
        """The file descriptor, for fsync."""
        return self._file.fileno()

    def close(self) -> None:
        """Set the sizes and close."""
        if self._file.closed:
            return
        self._file.flush()
        self._file.seek(0)
        self._file.write(header(self.sample_rate, self.channels, 4 * self.channels * self.frames))
        self._file.close()

    def abandon(self) -> None:
        """Close without another byte, for a disk that takes none; `repair` sets the sizes later."""
        if not self._file.closed:
            try:
                self._file.close()
            except OSError:
                # What was buffered does not fit; the file descriptor is closed all the same.
                self.frames = 0


def repair(path: Path, sample_rate: int = 0, channels: int = 0) -> int:
    """Set the sizes of a file whose writer was killed, by its length; a torn last sample is cut off.

    Args:
        sample_rate, channels: what it was written with, where that is known; else its header is asked, which
            may be damaged.

    Returns:
        Frames it holds; 0 where they cannot be told, and then the file is left as it is.
    """
    length = path.stat().st_size
    if length <= HEADER_BYTES:
        return 0
    with path.open("r+b") as file:
        if not sample_rate or not channels:
            head = file.read(HEADER_BYTES)
            if head[:4] not in (b"RIFF", b"RF64"):
                return 0
            channels, sample_rate = struct.unpack_from("<HI", head, 12 + 36 + 4 + 4 + 2)
        if not channels or not sample_rate:
            return 0
        whole = (length - HEADER_BYTES) // (4 * channels) * 4 * channels
        file.truncate(HEADER_BYTES + whole)
        file.seek(0)
        file.write(header(sample_rate, channels, whole))
    return whole // (4 * channels)
