"""Frames as flat rows of numbers, and rows as a Motion."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import chain

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
class FrameRow:
    """One frame packed.

    Args:
        arrival: seconds of `clock.now()`. sender_time: the sender's T, NaN where it sends none.
        names: what the values are; the same object for rows that have the same.
        values: float32 (names.width,).
    """

    arrival: float
    sender_time: float
    names: ChannelLayout
    values: NDArray[np.float32]

    def pose(self) -> Pose:
        """The row as a pose in the order of its names."""
        s, j = len(self.names.shapes), len(self.names.bones)
        bones = self.values[s : s + 7 * j].reshape(j, 7)
        root = self.values[-_ROOT:]
        return Pose(self.values[:s], bones[:, :3], bones[:, 3:], root[:3], root[3:])


class Packer:
    """Packs frames of one assembler; the same names are the same object."""

    def __init__(self) -> None:
        self.names = ChannelLayout((), ())

    def pack(self, frame: Frame) -> FrameRow:
        """One frame as a row."""
        names = self.names
        shapes, bones = tuple(frame.shapes), tuple(frame.bones)
        if names.shapes != shapes or names.bones != bones:
            names = self.names = ChannelLayout(shapes, bones)
        placed = chain(frame.bones.values(), (frame.root or _NO_ROOT,))
        numbers = chain(frame.shapes.values(), chain.from_iterable(chain.from_iterable(placed)))
        values = np.fromiter(numbers, dtype=np.float32, count=names.width)
        t = math.nan if frame.sender_time is None else frame.sender_time
        return FrameRow(frame.arrival, t, names, values)


RowBlock = tuple[ChannelLayout, NDArray[np.float64], NDArray[np.float32]]
"""Rows that share their names: names, arrivals (T,), values (T, width)."""


def motion_of(runs: Sequence[RowBlock], times: NDArray[np.float64]) -> Motion | None:
    """Rows as a Motion; a channel that came later is held back to the start at its first value.

    Args:
        runs: in order.
        times: seconds on the take's clock for every row of all runs, (T,).

    Returns:
        The motion from time 0 on with rising times; None without rows there.
    """
    shapes = tuple(dict.fromkeys(chain.from_iterable(names.shapes for names, _, _ in runs)))
    bones = tuple(dict.fromkeys(chain.from_iterable(names.bones for names, _, _ in runs)))
    total = len(times)
    weights = np.full((total, len(shapes)), np.nan, dtype=np.float32)
    placed = np.full((total, len(bones), 7), np.nan, dtype=np.float32)
    root = np.empty((total, 7), dtype=np.float32)
    at = 0
    for names, arrivals, values in runs:
        span = slice(at, at + len(arrivals))
        s, j = len(names.shapes), len(names.bones)
        weights[span, _places(names.shapes, shapes)] = values[:, :s]
        placed[span, _places(names.bones, bones)] = values[:, s : s + 7 * j].reshape(len(arrivals), j, 7)
        root[span] = values[:, -_ROOT:]
        at += len(arrivals)
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
    order = np.argsort(times, kind="stable")
    rising = times[order]
    later = np.concatenate([[True], np.diff(rising) > 1e-6]) if len(rising) else np.zeros(0, dtype=bool)
    return order[later & (rising >= 0)]


def _hold_back(columns: NDArray[np.float32]) -> None:
    """Fill, in place, what was not there yet with the column's first value, and gaps with the last one."""
    for at in np.flatnonzero(np.isnan(columns).any(axis=0)):
        column = columns[:, at]  # a view: filling it fills the table
        index = np.flatnonzero(~np.isnan(column))
        if not len(index):
            column[:] = 0.0
            continue
        spread = np.maximum.accumulate(np.where(np.isnan(column), index[0], np.arange(len(column))))
        column[:] = column[spread]
