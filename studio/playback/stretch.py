"""Slower sound of the same pitch, block by block: FFmpeg's atempo, which overlaps and adds (WSOLA)."""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

Samples = NDArray[np.float32]

SLOWEST = 0.25
_ONE_STEP = 0.5
"""As much as one filter slows down; slower than that takes two."""


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
            except (FFmpegError, EOFError):  # nothing more for now, or at all
                break
        return np.concatenate(parts) if parts else np.zeros((0, 2), np.float32)
