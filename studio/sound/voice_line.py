"""Sound from one program of this computer to another without a sound device: blocks with their moments.

A voice line is a UDP port of this computer: one end sends what is spoken, block after block as it is heard,
the other one records it as it records a microphone.
"""

from __future__ import annotations

import socket
import struct
from collections import deque
from contextlib import suppress
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from studio import clock

LINE_RATE = 48_000
"""Samples a second of every line."""
BLOCK_SAMPLES = 480
"""Of one datagram: 10 ms, as sound devices hand them over."""
MOST_BYTES = 9_000
"""No datagram of a line is longer; macOS sends none above 9,216 bytes."""
_MAGIC = b"SaiaLine"
# Magic, number of the first sample, and when it is heard.
_HEADER = struct.Struct("<8sQd")
_FADE_SAMPLES = 240


class LineBlock(NamedTuple):
    """One block of a line.

    Args:
        first: number of its first sample in the voice; samples are lost where it jumps.
        captured: when that sample is heard, seconds of `clock.now()`, which all programs of a computer share.
        samples: float32 (N,).
    """

    first: int
    captured: float
    samples: NDArray[np.float32]


def encode_block(block: LineBlock) -> bytes:
    """A block as one datagram."""
    return _HEADER.pack(_MAGIC, block.first, block.captured) + block.samples.astype("<f4").tobytes()


def decode_block(data: bytes) -> LineBlock | None:
    """The block of a datagram; None where it holds none."""
    if len(data) <= _HEADER.size or len(data) % 4 or not data.startswith(_MAGIC):
        return None
    _, first, captured = _HEADER.unpack_from(data)
    samples = np.frombuffer(data, "<f4", offset=_HEADER.size).astype(np.float32)
    if not np.isfinite(captured) or not np.isfinite(samples).all():
        return None
    return LineBlock(first, captured, samples)


class LineSender:
    """The speaking end of a voice line. It never waits, and nobody need listen.

    Args:
        port: of this computer.
    """

    def __init__(self, port: int) -> None:
        self._address = "127.0.0.1", port
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._queue: deque[NDArray[np.float32]] = deque()
        # Samples sent so far.
        self._sent = 0

    def put(self, samples: NDArray[np.float32]) -> None:
        """Queue mono samples (N,) at LINE_RATE."""
        self._queue.append(samples)

    def send_until(self, position: float) -> None:
        """Send the whole blocks that are over.

        Args:
            position: seconds of the voice heard by now; nothing is sent before 0.
        """
        now = clock.now()
        while (self._sent + BLOCK_SAMPLES) / LINE_RATE <= position and self._queue:
            self._send(self._next(), now - position)

    def fall_silent(self, position: float) -> None:
        """End in mid-word without a click; what is queued is never sent."""
        self.send_until(position)
        if self._queue and position > 0:
            samples = self._next()
            fade = min(_FADE_SAMPLES, len(samples))
            samples[:fade] *= np.linspace(1.0, 0.0, fade, dtype=np.float32)
            samples[fade:] = 0.0
            self._send(samples, clock.now() - position)
        self._queue.clear()

    def close(self) -> None:
        """Give the socket back."""
        self._queue.clear()
        self._socket.close()

    def _next(self) -> NDArray[np.float32]:
        """The next block, shorter at the end of what is queued."""
        found: list[NDArray[np.float32]] = []
        missing = BLOCK_SAMPLES
        while missing and self._queue:
            head = self._queue[0]
            found.append(head[:missing])
            missing -= len(found[-1])
            if len(found[-1]) == len(head):
                self._queue.popleft()
            else:
                self._queue[0] = head[len(found[-1]) :]
        return np.concatenate(found)

    def _send(self, samples: NDArray[np.float32], zero: float) -> None:
        block = LineBlock(self._sent, zero + self._sent / LINE_RATE, samples)
        self._sent += len(samples)
        with suppress(OSError):
            self._socket.sendto(encode_block(block), self._address)
