"""Frames as flat rows of numbers in blocks, and blocks as a Motion."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import chain, groupby

import numpy as np
from numpy.typing import NDArray

from studio.motion import Motion, Pose, rotation
from studio.vmc.assemble import Frame

_NO_ROOT = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
_ROOT = 7


@dataclass(frozen=True)
class ChannelLayout:
    """Which number of a row is what: S shapes, J bones of seven numbers, the root's seven."""

    shapes: tuple[str, ...]
    bones: tuple[str, ...]

    @property
    def width(self) -> int:
        """Numbers in a row."""
        return len(self.shapes) + 7 * len(self.bones) + _ROOT


@dataclass(frozen=True, eq=False)
class RowBlock:
    """Consecutive frames that share their names: the one form of captured motion, from packer to take.

    Args:
        names: what the values are; the same object for blocks that have the same.
        stamps: arrival in seconds of `clock.now()`, and the sender's T (NaN where it sends none), (T, 2).
        values: float32 (T, names.width).
    """

    names: ChannelLayout
    stamps: NDArray[np.float64]
    values: NDArray[np.float32]

    def __len__(self) -> int:
        return len(self.stamps)

    @property
    def arrivals(self) -> NDArray[np.float64]:
        """When each frame's first datagram came, (T,)."""
        return self.stamps[:, 0]

    def between(self, first: float = -math.inf, last: float = math.inf) -> RowBlock:
        """The rows that arrived from one moment to another, both included; itself where all did."""
        # A mask and no search: when the leading sender changes, two frames may stand in each other's order.
        inside = (self.arrivals >= first) & (self.arrivals <= last)
        return self if inside.all() else RowBlock(self.names, self.stamps[inside], self.values[inside])

    def pose(self, row: int = -1) -> Pose:
        """One row, the latest where not said otherwise, as a pose in the order of its names."""
        values = self.values[row]
        s, j = len(self.names.shapes), len(self.names.bones)
        bones = values[s : s + 7 * j].reshape(j, 7)
        root = values[-_ROOT:]
        return Pose(values[:s], bones[:, :3], bones[:, 3:], root[:3], root[3:])


class Packer:
    """Packs frames of one assembler; the same names are the same object."""

    def __init__(self) -> None:
        self._names = ChannelLayout((), ())

    def pack(self, frames: Sequence[Frame]) -> list[RowBlock]:
        """Frames as blocks, a new one wherever their channels change."""
        blocks = []
        for names, same in groupby(frames, self._layout):
            run = list(same)
            numbers = chain.from_iterable(map(_numbers, run))
            values = np.fromiter(numbers, dtype=np.float32, count=len(run) * names.width)
            stamps = [(f.arrival, math.nan if f.sender_time is None else f.sender_time) for f in run]
            blocks.append(RowBlock(names, np.array(stamps), values.reshape(len(run), names.width)))
        return blocks

    def _layout(self, frame: Frame) -> ChannelLayout:
        shapes, bones = tuple(frame.shapes), tuple(frame.bones)
        # One object for as long as nothing changes: the journal and the pipe to the recorder write the names,
        # which take as much room as a row, only where it is another one.
        if self._names.shapes != shapes or self._names.bones != bones:
            self._names = ChannelLayout(shapes, bones)
        return self._names


def _numbers(frame: Frame) -> Iterable[float]:
    """A frame's values in the order of a row."""
    placed = chain(frame.bones.values(), (frame.root or _NO_ROOT,))
    return chain(frame.shapes.values(), chain.from_iterable(chain.from_iterable(placed)))


def motion_of(blocks: Sequence[RowBlock], times: NDArray[np.float64]) -> Motion | None:
    """Rows as a Motion; a channel that came later is held back to the start at its first value.

    Args:
        blocks: in order.
        times: seconds on the take's clock for every row of all blocks, (T,).

    Returns:
        The motion from time 0 on with rising times; None without rows there.
    """
    shapes = tuple(dict.fromkeys(chain.from_iterable(block.names.shapes for block in blocks)))
    bones = tuple(dict.fromkeys(chain.from_iterable(block.names.bones for block in blocks)))
    total = len(times)
    weights = np.full((total, len(shapes)), np.nan, dtype=np.float32)
    placed = np.full((total, len(bones), 7), np.nan, dtype=np.float32)
    root = np.empty((total, 7), dtype=np.float32)
    at = 0
    for block in blocks:
        names, values, count = block.names, block.values, len(block)
        span = slice(at, at + count)
        s, j = len(names.shapes), len(names.bones)
        weights[span, _places(names.shapes, shapes)] = values[:, :s]
        placed[span, _places(names.bones, bones)] = values[:, s : s + 7 * j].reshape(count, j, 7)
        root[span] = values[:, -_ROOT:]
        at += count
    keep = _rising(times)
    if not len(keep):
        return None
    _hold_back(weights)
    _hold_back(placed.reshape(total, -1))
    # Not Motion.build: what the decoder let through is unit and finite, and checking ten minutes of it
    # again would take longer than all else about saving.
    return Motion(
        times[keep],
        shapes,
        weights[keep],
        bones,
        np.ascontiguousarray(placed[keep, :, :3]),
        rotation.sign_continuous(placed[keep, :, 3:]).astype(np.float32),
        np.ascontiguousarray(root[keep, :3]),
        rotation.sign_continuous(root[keep, 3:]).astype(np.float32),
    )


def _places(names: Iterable[str], among: tuple[str, ...]) -> list[int]:
    index = {name: i for i, name in enumerate(among)}
    return [index[name] for name in names]


def _rising(times: NDArray[np.float64]) -> NDArray[np.intp]:
    """Indices of the rows from time 0 on, each later than all before it."""
    # By time, since the clock fit may put two arrivals the other way round; the first of two equal ones
    # stays.
    order = np.argsort(times, kind="stable")
    rising = times[order]
    later = np.concatenate([[True], np.diff(rising) > 1e-6]) if len(rising) else np.zeros(0, dtype=bool)
    return order[later & (rising >= 0)]


def _hold_back(columns: NDArray[np.float32]) -> None:
    """Fill, in place, what was not there yet with the column's first value, and gaps with the last one."""
    for at in np.flatnonzero(np.isnan(columns).any(axis=0)):
        # A view, so filling it fills the table.
        column = columns[:, at]
        index = np.flatnonzero(~np.isnan(column))
        if not len(index):
            # A channel that never had a value in any row: at rest.
            column[:] = 0.0
            continue
        spread = np.maximum.accumulate(np.where(np.isnan(column), index[0], np.arange(len(column))))
        column[:] = column[spread]
