"""Sound at another rate or tempo, block by block: a short symmetric filter, and FFmpeg's atempo."""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise
from math import gcd
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]

_REACH_S = 0.0016
# Of the Kaiser window: what lies beyond half the lower rate comes out 70 dB lower.
_BETA = 7.0
# Share of half the lower rate that passes untouched, about as in soxr's high quality.
_PASS = 0.91


class Resampler:
    """Mono sound in blocks of any length, each output sample a fixed weighted sum of input samples.

    Source: Crochiere and Rabiner 1983, Multirate Digital Signal Processing, chapter 2 (polyphase form).

    Args:
        rate: samples a second coming in.
        to: samples a second going out.
    """

    def __init__(self, rate: int, to: int) -> None:
        self.rate, self.to = rate, to
        shared = gcd(rate, to)
        self._up, self._down = to // shared, rate // shared
        self._reach = max(2, round(_REACH_S * rate * max(1.0, to / rate if rate < to else 1.0)))
        self._bank = _bank(self._up, self._reach, rate, to)
        # Before the sound lies silence.
        self._buffer = np.zeros(self._reach, dtype=np.float32)
        # Which input sample self._kept[0] is.
        self._first = -self._reach
        # The next output sample.
        self._next = 0

    def feed(self, block: Floats) -> Floats:
        """What can be given after one more block (N,); together the same whatever the blocks are."""
        if self.rate == self.to:
            return block
        self._buffer = np.concatenate([self._buffer, block])
        received = self._first + len(self._buffer)
        # Output n lies at n * down / up input samples and needs `reach` samples on both sides of it.
        last = ((received - 1 - self._reach) * self._up) // self._down
        if last < self._next:
            return np.zeros(0, dtype=np.float32)
        out = self._given(self._next, int(last) + 1)
        self._next = int(last) + 1
        self._discard_consumed()
        return out

    def _given(self, first: int, end: int) -> Floats:
        width = self._bank.shape[1]
        # Every output sample lies on an input sample.
        if self._up == 1:
            kept = self._buffer[first * self._down - self._reach - self._first :]
            # Numpy's own view of windows takes longer than the rest of a live block of a few milliseconds.
            strides = (self._down * kept.itemsize, kept.itemsize)
            taken = np.ndarray((end - first, width), kept.dtype, kept, strides=strides)
            return np.ascontiguousarray(taken) @ self._bank[0]
        windows = np.lib.stride_tricks.sliding_window_view(self._buffer, width)
        n = np.arange(first, end, dtype=np.int64)
        whole, phase = n * self._down // self._up, n * self._down % self._up
        taken = windows[whole - self._reach - self._first]
        out: Floats = np.einsum("nw,nw->n", taken, self._bank[phase])
        return out

    def _discard_consumed(self) -> None:
        oldest = self._next * self._down // self._up - self._reach
        drop = min(max(oldest - self._first, 0), len(self._buffer))
        self._buffer, self._first = self._buffer[drop:], self._first + drop


def _bank(up: int, reach: int, rate: int, to: int) -> Floats:
    """Filters (up, 2 reach + 1), one for each place an output sample may have between two input samples."""
    at = np.arange(-reach, reach + 1)[None] - np.arange(up)[:, None] / up
    # Cycles a sample, the middle of the transition.
    cut = 0.5 * (1 + _PASS) * 0.5 * min(rate, to) / rate
    window = np.i0(_BETA * np.sqrt(np.clip(1 - (at / (reach + 1)) ** 2, 0, 1))) / np.i0(_BETA)
    taps = 2 * cut * np.sinc(2 * cut * at) * window
    return np.asarray(taps / taps.sum(axis=1, keepdims=True), dtype=np.float32)


Samples = NDArray[np.float32]

SLOWEST = 0.25
# As much as one filter slows down; slower than that takes two.
_ONE_STEP = 0.5


class Stretch:
    """Stretches sound that comes in blocks.

    Args:
        sample_rate: of the sound, in and out.
        speed: 0.25 to 1; 0.5 lasts twice as long.
    """

    def __init__(self, sample_rate: int, speed: float) -> None:
        from av.filter import Graph

        self._rate, self._taken = sample_rate, 0
        self._graph: Any = Graph()
        self._in = self._graph.add_abuffer(
            sample_rate=sample_rate, format="fltp", layout="stereo", time_base=Fraction(1, sample_rate)
        )
        steps = [speed] if speed >= _ONE_STEP else [_ONE_STEP, speed / _ONE_STEP]
        chain = [self._in, *(self._graph.add("atempo", f"{step:.6f}") for step in steps)]
        chain.append(self._graph.add("aformat", "sample_fmts=fltp"))
        chain.append(self._graph.add("abuffersink"))
        for one, next_one in pairwise(chain):
            one.link_to(next_one)
        self._out: Any = chain[-1]
        self._graph.configure()

    def feed(self, block: Samples) -> Samples:
        """What is ready after a block: stereo (N, 2) in, (M, 2) out; the first blocks may give nothing."""
        from av import AudioFrame

        if len(block):
            frame = AudioFrame.from_ndarray(np.ascontiguousarray(block.T), format="fltp", layout="stereo")
            frame.sample_rate, frame.pts = self._rate, self._taken
            frame.time_base = Fraction(1, self._rate)
            self._taken += len(block)
            self._in.push(frame)
        return self._pull()

    def finish(self) -> Samples:
        """What is left; nothing can be fed afterwards."""
        self._in.push(None)
        return self._pull()

    def _pull(self) -> Samples:
        from av import FFmpegError

        parts: list[Samples] = []
        while True:
            try:
                parts.append(self._out.pull().to_ndarray().T)
            except (FFmpegError, EOFError):
                # Nothing more for now, or at all.
                break
        return np.concatenate(parts) if parts else np.zeros((0, 2), np.float32)
