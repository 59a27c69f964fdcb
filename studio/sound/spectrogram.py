"""Which pitches a sound holds, at any zoom: a pyramid of columns, measured once and kept on the disk.

Every column is the loudness of BANDS bands of pitch. Coarse levels keep the loudest of four finer columns, so
that a click is seen from far away. Closer than the finest level kept, columns are measured again from the
samples, a tile at a time. Nothing here is for the GUI thread but `columns`.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.errors import StudioError
from studio.files import cache
from studio.sound.sound_file import read_span, sound_blocks, sound_info

BANDS = 96
LOWEST_HZ, HIGHEST_HZ = 70.0, 16_000.0
WINDOW = 0.024
"""Seconds heard for one column: two periods of a low voice."""
HOP, CLOSE_HOP = 0.016, 0.004
"""Seconds between columns of the finest level kept, and of tiles measured while looking close."""
FACTOR = 4
COARSEST = 2_048
"""Columns at which the pyramid ends."""
TILE = 256
"""Columns of a tile."""
TILES_KEPT = 64
FLOOR_DB, STEP_DB = -120.0, 0.5
"""A value of 0 is FLOOR_DB; each step of it is STEP_DB."""
VERSION = 1
_BLOCK_S = 30.0

Columns = NDArray[np.uint8]


class Stopped(Exception):  # noqa: N818 - not an error: somebody asked for it
    """The measuring was stopped; nothing was kept."""


@dataclass(frozen=True, eq=False)
class Part:
    """What is to be drawn of a stretch of time.

    Args:
        data: loudness, uint8 (K, BANDS), low pitches first.
        start, end: seconds that the K columns cover, each the same length.
        finer: numbers of tiles that would show it finer, once `measure_tile` was called for them.
    """

    data: Columns
    start: float
    end: float
    finer: tuple[int, ...] = ()


class Spectrogram:
    """The pyramid of one sound file.

    Args:
        path: the sound file; read again where one looks close.
        sample_rate: of the file.
        finest: columns every HOP seconds, uint8 (T, BANDS), low pitches first.
    """

    def __init__(self, path: Path, sample_rate: int, finest: Columns) -> None:
        self.path, self.sample_rate = path, sample_rate
        self._levels = [finest]
        while len(self._levels[-1]) > COARSEST:
            self._levels.append(_coarser(self._levels[-1]))
        last = self._levels[-1]
        self.top_db = FLOOR_DB + STEP_DB * float(np.percentile(last, 99.7)) if last.size else FLOOR_DB
        self._tiles: OrderedDict[int, Columns] = OrderedDict()

    @property
    def pitches_hz(self) -> NDArray[np.float64]:
        """The middle of each band, (BANDS,)."""
        return band_pitches(self.sample_rate)[1:-1]

    def part(self, start: float, end: float, count: int) -> Part:
        """What to draw of start..end seconds in `count` columns of a picture; at least that is covered."""
        if (end - start) / max(count, 1) >= HOP:
            return Part(self._far(start, end, count), start, end)
        a, b = _around(start, end, CLOSE_HOP)
        there = {i: self._tile(i) for i in range(a // TILE, (b - 1) // TILE + 1)}
        missing = tuple(i for i, tile in there.items() if tile is None)
        if missing:
            a, b = _around(start, end, HOP)
            return Part(_cut(self._levels[0], a, b), (a - 0.5) * HOP, (b - 0.5) * HOP, missing)
        whole = np.concatenate([tile for tile in there.values() if tile is not None])
        first = a // TILE * TILE
        return Part(_cut(whole, a - first, b - first), (a - 0.5) * CLOSE_HOP, (b - 0.5) * CLOSE_HOP)

    def measure_tile(self, index: int) -> None:
        """Measure a tile; it is shown from then on. Runs on the thread pool."""
        size, _ = _sizes(self.sample_rate, CLOSE_HOP)
        start = index * TILE * CLOSE_HOP - WINDOW / 2
        try:
            sound = read_span(self.path, max(start, 0.0), start + TILE * CLOSE_HOP + 2 * WINDOW)
        except StudioError:
            # The file went away after it was opened: the coarser picture stays.
            return
        places = np.round((index * TILE + np.arange(TILE)) * CLOSE_HOP * self.sample_rate)
        # From the middle of a window to its first sample, and from the file's start to what was read of it.
        places -= round(WINDOW / 2 * self.sample_rate) + int(max(start, 0.0) * self.sample_rate)
        early = max(-int(places[0]), 0)
        need = max(int(places[-1]) + early + size - early - len(sound.mono()), 0)
        samples = np.pad(sound.mono(), (early, need))
        self._tiles[index] = _loudness(samples, self.sample_rate, places + early)
        while len(self._tiles) > TILES_KEPT:
            self._tiles.popitem(last=False)

    def _tile(self, index: int) -> Columns | None:
        tile = self._tiles.get(index)
        if tile is not None:
            self._tiles.move_to_end(index)
        return tile

    def _far(self, start: float, end: float, count: int) -> Columns:
        level = 0
        while level + 1 < len(self._levels) and HOP * FACTOR ** (level + 1) <= (end - start) / count:
            level += 1
        data = self._levels[level]
        # A column of the finest level is heard around its moment, half a hop before it and after it.
        edges = (np.linspace(start, end, count + 1) / HOP + 0.5) / FACTOR**level
        inside = (edges[1:] > 0) & (edges[:-1] < len(data))
        result = np.zeros((count, BANDS), np.uint8)
        if inside.any():
            first = np.clip(np.floor(edges[:-1]).astype(np.int64), 0, len(data) - 1)
            last = np.clip(np.ceil(edges[1:]).astype(np.int64), first + 1, len(data))
            # A picture's column is a few columns wide at most: the loudest of them, one after the other.
            for step in range(int((last - first).max())):
                np.maximum(result, data[np.minimum(first + step, last - 1)], out=result)
        result[~inside] = 0
        return result


def spectrogram(path: Path, on_progress: Callable[[float], bool] = lambda _: True) -> Spectrogram:
    """The spectrogram of a sound file, measured the first time and kept. Runs on the thread pool.

    Args:
        path: the sound.
        on_progress: is told how much of it is done, 0..1, and gives whether to go on.

    Raises:
        StudioError: the file is missing or holds no sound.
        Stopped: it was not to go on.
    """
    name = f"spectrum{VERSION}.npy"
    info = sound_info(path)
    rate, seconds, done = info.sample_rate, max(info.duration, HOP), 0
    place = cache.find(path, name)
    if place is not None:
        found = cache.read_arrays(place).get("")
        if found is not None and found.dtype == np.uint8 and found.ndim == 2 and found.shape[1] == BANDS:
            return Spectrogram(path, rate, found)
    parts = []
    for part in _measured(path, rate):
        done += len(part)
        if not on_progress(min(done * HOP / seconds, 1.0)):
            raise Stopped
        parts.append(part)
    finest = np.concatenate(parts) if parts else np.zeros((0, BANDS), np.uint8)
    try:
        with cache.keeping(path, name) as beside, beside.open("wb") as file:
            np.save(file, finest)
    except (OSError, StudioError):
        # Nowhere to keep it: the same picture, only later the next time.
        pass
    return Spectrogram(path, rate, finest)


def band_pitches(sample_rate: int) -> NDArray[np.float64]:
    """Edges and middles of the bands in Hz, (BANDS + 2,): even steps in mel."""
    top = min(HIGHEST_HZ, sample_rate / 2)
    low, high = (2595 * np.log10(1 + f / 700) for f in (LOWEST_HZ, top))
    result: NDArray[np.float64] = 700 * (10 ** (np.linspace(low, high, BANDS + 2) / 2595) - 1)
    return result


def _measured(path: Path, rate: int) -> Iterator[Columns]:
    """Columns every HOP seconds from the start to the end of a file, a block at a time."""
    size, _ = _sizes(rate, HOP)
    # The first column's middle is the first sample.
    rest = np.zeros(round(WINDOW / 2 * rate), np.float32)
    # Columns measured, and the sample (of the padded sound) that `rest` starts with.
    done, begin = 0, 0
    for block in sound_blocks(path, None, _BLOCK_S):
        rest = np.concatenate([rest, block])
        count = int((begin + len(rest) - size) / (HOP * rate)) + 1 - done
        if count > 0:
            places = np.round(np.arange(done, done + count) * HOP * rate) - begin
            places = places[places + size <= len(rest)]
            yield _loudness(rest, rate, places)
            done += len(places)
            cut = max(int(np.round(done * HOP * rate)) - begin, 0)
            rest, begin = rest[cut:], begin + cut
    tail = int(np.ceil(max(len(rest) - round(WINDOW / 2 * rate), 0) / (HOP * rate)))
    if tail:
        places = np.round(np.arange(done, done + tail) * HOP * rate) - begin
        yield _loudness(np.append(rest, np.zeros(2 * size, np.float32)), rate, places)


def _loudness(samples: NDArray[np.float32], rate: int, places: NDArray[np.floating]) -> Columns:
    """Columns of the windows that begin at some samples, uint8 (K, BANDS)."""
    size, _ = _sizes(rate, HOP)
    window, bands = _window(size), _bands(rate, size)
    result = np.empty((len(places), BANDS), np.uint8)
    for i in range(0, len(places), 512):
        at = places[i : i + 512].astype(np.int64)
        frames = np.lib.stride_tricks.sliding_window_view(samples, size)[at] * window
        power = np.abs(np.fft.rfft(frames, axis=1)).astype(np.float32) ** 2
        level = 10 * np.log10(power @ bands + 1e-12)
        result[i : i + 512] = np.clip((level - FLOOR_DB) / STEP_DB, 0, 255)
    return result


def _sizes(rate: int, hop: float) -> tuple[int, int]:
    """Samples in a window and between windows."""
    return max(round(WINDOW * rate), 16), max(round(hop * rate), 1)


def _window(size: int) -> NDArray[np.float32]:
    # Scaled so that a sine of full scale is 0 dB.
    window = np.hanning(size + 1)[:-1]
    result: NDArray[np.float32] = (window * 2 / window.sum()).astype(np.float32)
    return result


def _bands(rate: int, size: int) -> NDArray[np.float32]:
    """Triangles over the spectrum's bins, (size // 2 + 1, BANDS); narrow ones look between two bins."""
    edges = band_pitches(rate) * size / rate
    bins = np.arange(size // 2 + 1)[:, None]
    middle = edges[1:-1]
    below, above = np.maximum(middle - edges[:-2], 1.0), np.maximum(edges[2:] - middle, 1.0)
    rise, fall = (bins - middle + below) / below, (middle + above - bins) / above
    result: NDArray[np.float32] = np.clip(np.minimum(rise, fall), 0, 1).astype(np.float32)
    return result


def _coarser(data: Columns) -> Columns:
    whole = len(data) // FACTOR * FACTOR
    joined: Columns = np.asarray(data[:whole]).reshape(-1, FACTOR, BANDS).max(axis=1)
    rest = data[whole:]
    return np.concatenate([joined, rest.max(axis=0, keepdims=True)]) if len(rest) else joined


def _around(start: float, end: float, hop: float) -> tuple[int, int]:
    """The first and the one after the last column that start..end seconds touch."""
    first = int(np.floor(start / hop + 0.5))
    return first, max(int(np.ceil(end / hop + 0.5)), first + 1)


def _cut(data: Columns, first: int, last: int) -> Columns:
    """Columns first..last, silence where there are none."""
    inside = np.asarray(data[max(first, 0) : max(last, 0)])
    before = min(max(-first, 0), last - first)
    return np.pad(inside, ((before, last - first - before - len(inside)), (0, 0)))
