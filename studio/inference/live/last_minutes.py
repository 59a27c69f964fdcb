"""The last minutes of a live performance, sound and sent motion, to keep as a take after the fact."""

from __future__ import annotations

import threading
from collections import deque
from dataclasses import dataclass
from datetime import datetime
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from studio.errors import StudioError
from studio.inference.live.audio_source import AudioBlock
from studio.motion import Motion, MotionBuffer, Pose
from studio.sound.sound_file import Sound
from studio.take.take import PREDICTED, TakeInfo

LAST_S = 600.0
"""Ten minutes: 58 MB of sound at 48 kHz in 16 bits, and some 50 MB of poses."""
DENSER = 0.6
"""Of a frame, that poses are noted apart at least: they come unevenly and are put on an even grid."""
PIECE_S = 5.0
GAP_S = 0.12
"""Blocks tremble by less; a longer step between two is sound that was lost, and becomes silence."""
LEAST_S = 1.0
_SCALE = 32767.0
SLATE = "Live"

Names = tuple[tuple[str, ...], tuple[str, ...]]


class _Chunk(NamedTuple):
    """A block of sound as it is kept: samples int16 (N,), and when its first one was captured."""

    captured: float
    samples: NDArray[np.int16]


class _Row(NamedTuple):
    """A pose as it was sent, of the bones' positions the first alone: the others rest."""

    moment: float
    names: Names
    pose: Pose


@dataclass(frozen=True)
class KeptMinutes:
    """What was kept: mono sound at its own rate, and the motion on its clock."""

    sound: Sound
    motion: Motion

    def info(self, run: str, device: str) -> TakeInfo:
        """What its take says of it: predicted by a run, never captured."""
        created = datetime.now().isoformat(timespec="seconds")
        notes = ("This motion was predicted live, so it is not used for training.",)
        return TakeInfo(SLATE, created=created, source=f"{PREDICTED}{run}", device=device, notes=notes)


class LastMinutes:
    """Rings of sound and poses; for any thread.

    Args:
        fps: of the motion that is kept.
        rest: where bones rest (J, 3), by their names.
        seconds: how long both go back.
    """

    def __init__(self, fps: float, rest: dict[str, NDArray[np.float32]], seconds: float = LAST_S) -> None:
        self._fps, self._rest, self._seconds = fps, rest, seconds
        self._chunks: deque[_Chunk] = deque()
        self._rows: deque[_Row] = deque()
        self._rate = self._held = 0
        self._lock = threading.Lock()

    @property
    def seconds(self) -> float:
        """How much sound there is."""
        return self._held / self._rate if self._rate else 0.0

    def add_sound(self, block: AudioBlock, muted: bool) -> None:
        """A block as the device gave it; what was said while muted is not kept. Runs on the live thread."""
        samples = np.clip(block.samples, -1.0, 1.0) * (0.0 if muted else _SCALE)
        with self._lock:
            if block.rate != self._rate:
                # A device of another rate took its place: a take has one.
                self._chunks.clear()
                self._rows.clear()
                self._rate, self._held = block.rate, 0
            if self._chunks:
                self._fill_gap(block.captured)
            self._append(_Chunk(block.captured, np.round(samples).astype(np.int16)))
            while self._chunks and self._held - len(self._chunks[0].samples) >= self._seconds * self._rate:
                self._held -= len(self._chunks.popleft().samples)

    def wants_pose(self, moment: float) -> bool:
        """Whether it is time for the next pose."""
        return not self._rows or moment - self._rows[-1].moment >= DENSER / self._fps

    def note_pose(self, moment: float, pose: Pose, shapes: tuple[str, ...], bones: tuple[str, ...]) -> None:
        """The pose that is sent at a moment, where it is time for the next one."""
        with self._lock:
            if not self.wants_pose(moment):
                return
            short = Pose(
                pose.shapes, pose.positions[:1].copy(), pose.rotations, pose.root_position, pose.root_rotation
            )
            self._rows.append(_Row(moment, (shapes, bones), short))
            while self._rows[0].moment < moment - self._seconds:
                self._rows.popleft()

    def kept(self) -> KeptMinutes:
        """What there is, from the first moment that has both sound and motion.

        Raises:
            StudioError: there is nearly nothing yet.
        """
        with self._lock:
            chunks, rows, rate = list(self._chunks), list(self._rows), self._rate
        sizes = np.cumsum([0, *(len(one.samples) for one in chunks)])
        if not rows or sizes[-1] < LEAST_S * rate:
            raise StudioError("There is nothing to keep yet.", "Speak for a few seconds, then try again.")
        # The device's own line through its trembling times: what it drifts in ten minutes would be heard.
        captured = np.array([one.captured for one in chunks])
        slope, start = _line(sizes[:-1] / rate, captured)
        times = (np.array([row.moment for row in rows]) - start) / slope
        samples = np.concatenate([one.samples for one in chunks])
        inside = (times >= 0.0) & (times <= len(samples) / rate)
        if inside.sum() < 2:
            raise StudioError("There is nothing to keep yet.", "Speak for a few seconds, then try again.")
        first = float(times[inside][0])
        # From the first pose to the last, so that a take has both everywhere.
        a, b = round(first * rate), round(float(times[inside][-1]) * rate)
        rows = [row for row, one in zip(rows, inside, strict=True) if one]
        loud = samples[a:b, None].astype(np.float32)
        loud /= _SCALE
        return KeptMinutes(Sound(loud, rate), self._motion(rows, times[inside] - first))

    def _append(self, chunk: _Chunk) -> None:
        self._chunks.append(chunk)
        self._held += len(chunk.samples)

    def _fill_gap(self, captured: float) -> None:
        last = self._chunks[-1]
        ended = last.captured + len(last.samples) / self._rate
        gap = captured - ended
        if gap > self._seconds:
            self._chunks.clear()
            self._held = 0
        elif gap > GAP_S:
            self._append(_Chunk(ended, np.zeros(round(gap * self._rate), np.int16)))

    def _motion(self, rows: list[_Row], times: NDArray[np.float64]) -> Motion:
        """Poses on an even grid; channels that a tuning left out for a while rest there."""
        kinds = list(dict.fromkeys(row.names for row in rows))
        shape_names = tuple(dict.fromkeys(name for shapes, _ in kinds for name in shapes))
        bone_names = tuple(dict.fromkeys(name for _, bones in kinds for name in bones))
        places = {
            kind: ([shape_names.index(one) for one in kind[0]], [bone_names.index(one) for one in kind[1]])
            for kind in kinds
        }
        grid = np.arange(int(times[-1] * self._fps) + 1) / self._fps
        whole = MotionBuffer()
        # In pieces: all at once took 11 s and 500 MB for ten minutes, beside a performance.
        for piece in np.array_split(grid, max(round(times[-1] / PIECE_S), 1)):
            first = max(int(np.searchsorted(times, piece[0], side="right")) - 1, 0)
            last = int(np.searchsorted(times, piece[-1])) + 1
            part = self._part(rows[first:last], times[first:last], shape_names, bone_names, places)
            whole.append(part.at(piece))
        return whole.motion

    def _part(
        self,
        rows: list[_Row],
        times: NDArray[np.float64],
        shape_names: tuple[str, ...],
        bone_names: tuple[str, ...],
        places: dict[Names, tuple[list[int], list[int]]],
    ) -> Motion:
        count = len(rows)
        shapes = np.zeros((count, len(shape_names)), np.float32)
        rotations = np.tile(np.array([0, 0, 0, 1], np.float32), (count, len(bone_names), 1))
        rest = np.array([self._rest[name] for name in bone_names], np.float32).reshape(-1, 3)
        positions = np.tile(rest, (count, 1, 1))
        for i, row in enumerate(rows):
            at_shapes, at_bones = places[row.names]
            shapes[i, at_shapes] = row.pose.shapes
            rotations[i, at_bones] = row.pose.rotations
            positions[i, at_bones[: len(row.pose.positions)]] = row.pose.positions
        roots = (
            np.array([row.pose.root_position for row in rows]),
            np.array([row.pose.root_rotation for row in rows]),
        )
        return Motion.build(times, shape_names, shapes, bone_names, positions, rotations, *roots)


def _line(x: NDArray[np.float64], y: NDArray[np.float64]) -> tuple[float, float]:
    """Slope and start of the straight line through some points; through a few of them a slope of 1."""
    if len(x) < 2 or x[-1] - x[0] < 5.0:
        return 1.0, float(np.median(y - x))
    slope, start = np.polyfit(x, y, 1)
    return float(slope), float(start)
