"""Sound from any rate to another while it comes in: a short symmetric filter, so that it costs no time.

The resampler used for whole files (soxr) answers up to 40 ms late in a stream; this one 2 ms.
"""

from __future__ import annotations

from math import gcd

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]

_REACH_S = 0.0016
_BETA = 7.0
"""Of the Kaiser window: what lies beyond half the lower rate comes out 70 dB lower."""
_PASS = 0.91
"""Share of half the lower rate that passes untouched, about as in soxr's high quality."""


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
        self._kept = np.zeros(self._reach, dtype=np.float32)  # before the sound lies silence
        self._first = -self._reach  # which input sample self._kept[0] is
        self._next = 0  # the next output sample

    @property
    def delay(self) -> float:
        """Seconds it hears ahead of what it gives."""
        return 0.0 if self.rate == self.to else self._reach / self.rate

    def feed(self, block: Floats) -> Floats:
        """What can be given after one more block (N,); together the same whatever the blocks are."""
        if self.rate == self.to:
            return block
        self._kept = np.concatenate([self._kept, block])
        heard = self._first + len(self._kept)
        # Output n lies at n * down / up input samples and needs `reach` samples on both sides of it.
        last = ((heard - 1 - self._reach) * self._up) // self._down
        if last < self._next:
            return np.zeros(0, dtype=np.float32)
        out = self._given(self._next, int(last) + 1)
        self._next = int(last) + 1
        self._forget()
        return out

    def _given(self, first: int, end: int) -> Floats:
        windows = np.lib.stride_tricks.sliding_window_view(self._kept, self._bank.shape[1])
        if self._up == 1:  # every output sample lies on an input sample
            start = first * self._down - self._reach - self._first
            taken = windows[start : start + (end - first - 1) * self._down + 1 : self._down]
            return np.ascontiguousarray(taken) @ self._bank[0]
        n = np.arange(first, end, dtype=np.int64)
        whole, phase = n * self._down // self._up, n * self._down % self._up
        taken = windows[whole - self._reach - self._first]
        out: Floats = np.einsum("nw,nw->n", taken, self._bank[phase])
        return out

    def _forget(self) -> None:
        oldest = self._next * self._down // self._up - self._reach
        drop = min(max(oldest - self._first, 0), len(self._kept))
        self._kept, self._first = self._kept[drop:], self._first + drop


def _bank(up: int, reach: int, rate: int, to: int) -> Floats:
    """Filters (up, 2 reach + 1), one for each place an output sample may have between two input samples."""
    at = np.arange(-reach, reach + 1)[None] - np.arange(up)[:, None] / up
    cut = 0.5 * (1 + _PASS) * 0.5 * min(rate, to) / rate  # cycles a sample, the middle of the transition
    window = np.i0(_BETA * np.sqrt(np.clip(1 - (at / (reach + 1)) ** 2, 0, 1))) / np.i0(_BETA)
    taps = 2 * cut * np.sinc(2 * cut * at) * window
    return np.asarray(taps / taps.sum(axis=1, keepdims=True), dtype=np.float32)
