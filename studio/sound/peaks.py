"""How loud a sound is, at any zoom: a pyramid of smallest and largest samples, kept once made.

Two hours are read once, in bounded memory; from then on a picture of any stretch takes milliseconds.
"""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.errors import StudioError
from studio.files import cache
from studio.sound.sound_file import read_span, sound_blocks, sound_info

BLOCK = 128
"""Samples in a block of the finest level kept."""
FACTOR = 4
"""Blocks of a level that make one of the next."""
CACHE_NAME = "peaks1.npz"
COARSEST = 2_048
"""Blocks at which the pyramid ends."""

Floats = NDArray[np.float32]
Counts = NDArray[np.int16]


class Peaks:
    """The pyramid of one sound file.

    Args:
        path: the sound file; read again only where one looks closer than a block.
        sample_rate: of the file.
        low, high: smallest and largest sample of each block, full scale +-32767, (N,).
    """

    def __init__(self, path: Path, sample_rate: int, low: Counts, high: Counts) -> None:
        self._path, self.sample_rate = path, sample_rate
        self._levels = [(low, high)]
        while len(low) > COARSEST:
            kept = len(low) // FACTOR * FACTOR
            # The rest that fills no block is kept as one, so that the end of the sound stays visible.
            low = np.append(low[:kept].reshape(-1, FACTOR).min(axis=1), low[kept:].min(initial=0))
            high = np.append(high[:kept].reshape(-1, FACTOR).max(axis=1), high[kept:].max(initial=0))
            self._levels.append((low.astype(np.int16), high.astype(np.int16)))
        self._near: tuple[int, Floats] | None = None

    def columns(self, start: float, end: float, count: int) -> tuple[Floats, Floats]:
        """Smallest and largest sample, full scale +-1, in each of `count` equal parts of start..end seconds.

        Returns:
            Two arrays (count,); silence outside the sound.
        """
        edges = np.linspace(start, end, count + 1) * self.sample_rate
        per_column = float(edges[-1] - edges[0]) / max(count, 1)
        if per_column < 2 * BLOCK:
            first, samples = self._samples(start, end)
            return block_extremes(samples, samples, edges - first)
        level, size = 0, BLOCK
        while level + 1 < len(self._levels) and size * FACTOR <= per_column / 2:
            level, size = level + 1, size * FACTOR
        low, high = block_extremes(*self._levels[level], edges / size)
        return low / np.float32(32767), high / np.float32(32767)

    def _samples(self, start: float, end: float) -> tuple[int, Floats]:
        """(first sample's number, mono samples) covering start..end; what was read last is used again."""
        first, last = int(max(start, 0.0) * self.sample_rate), int(max(end, 0.0) * self.sample_rate) + 2
        if self._near is not None:
            begin, samples = self._near
            if begin <= first and last <= begin + len(samples):
                return self._near
        try:
            sound = read_span(self._path, first / self.sample_rate, last / self.sample_rate)
        except StudioError:
            # The file went away after it was opened: the coarse picture stays, the close one is flat.
            return first, np.zeros(1, np.float32)
        self._near = (first, sound.mono())
        return self._near


def peaks(path: Path) -> Peaks:
    """The peaks of a sound file, computed the first time and kept.

    Raises:
        StudioError: the file is missing or holds no sound.
    """
    place = cache.find(path, CACHE_NAME)
    found = _load(place, path) if place is not None else None
    if found is not None:
        return found
    rate = sound_info(path).sample_rate
    low, high = _measure(path)
    made = Peaks(path, rate, low, high)
    # Nowhere to keep it: the same picture, only later the next time.
    with suppress(OSError, StudioError), cache.keeping(path, CACHE_NAME) as beside, beside.open("wb") as file:
        # The size tells the sound among others once it was moved away.
        np.savez(file, size=path.stat().st_size, rate=rate, low=low, high=high)
    return made


def block_extremes(
    low: NDArray[np.generic], high: NDArray[np.generic], edges: NDArray[np.float64]
) -> tuple[Floats, Floats]:
    """Smallest and largest values between consecutive edges.

    Args:
        low, high: (N,) values of equal blocks.
        edges: (count + 1,) positions in blocks, rising; outside 0..N there is silence.

    Returns:
        Two arrays (count,).
    """
    count, size = len(edges) - 1, len(low)
    begin = max(int(np.floor(edges[0])), 0)
    end = min(int(np.ceil(edges[-1])) + 1, size)
    inside = (edges[1:] > 0) & (edges[:-1] < size)
    if end <= begin or not inside.any():
        return np.zeros(count, np.float32), np.zeros(count, np.float32)
    # An edge a rounding error off a block's border is that border.
    first = np.clip(np.floor(edges[:-1] + 1e-6).astype(np.int64), begin, end - 1) - begin
    last = np.clip(np.ceil(edges[1:] - 1e-6).astype(np.int64), first + begin + 1, end) - begin
    # reduceat reads pairs (first, last); a silent cell after the end lets the last pair reach it.
    pairs = np.stack([first, last], axis=1).reshape(-1)
    lows = np.minimum.reduceat(np.append(low[begin:end], low.dtype.type(0)), pairs)[::2]
    highs = np.maximum.reduceat(np.append(high[begin:end], high.dtype.type(0)), pairs)[::2]
    return np.where(inside, lows, 0).astype(np.float32), np.where(inside, highs, 0).astype(np.float32)


def _load(place: Path, path: Path) -> Peaks | None:
    """Peaks kept before, unless they are damaged."""
    content = cache.read_arrays(place)
    try:
        rate, low, high = int(content["rate"]), content["low"], content["high"]
    except (KeyError, TypeError, ValueError):
        return None
    whole = low.dtype == high.dtype == np.int16 and low.ndim == 1 and low.shape == high.shape
    return Peaks(path, rate, low, high) if whole and rate > 0 else None


def _measure(path: Path) -> tuple[Counts, Counts]:
    lows: list[Counts] = []
    highs: list[Counts] = []
    rest = np.zeros(0, np.float32)
    for block in sound_blocks(path):
        samples = np.concatenate([rest, block])
        kept = len(samples) // BLOCK * BLOCK
        rest = samples[kept:]
        lows.append(_counts(samples[:kept].reshape(-1, BLOCK).min(axis=1)))
        highs.append(_counts(samples[:kept].reshape(-1, BLOCK).max(axis=1)))
    if len(rest):
        lows.append(_counts(rest.min(keepdims=True)))
        highs.append(_counts(rest.max(keepdims=True)))
    if not lows:
        return np.zeros(0, np.int16), np.zeros(0, np.int16)
    return np.concatenate(lows), np.concatenate(highs)


def _counts(values: Floats) -> Counts:
    return (np.clip(np.nan_to_num(values), -1, 1) * 32767).astype(np.int16)
