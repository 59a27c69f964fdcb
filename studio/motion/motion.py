"""Motion: blend shape weights and bone transforms of one performer over time."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from studio.motion import rotation
from studio.motion.skeleton import Skeleton

Floats = NDArray[np.float32]

SKELETON_FRAMES = 4096
"""Frames that tell the rest skeleton."""
_RATE_SPAN_S = 0.25


@dataclass(frozen=True)
class Pose:
    """One moment of a Motion: shapes (S,), positions (J, 3), rotations (J, 4), root (3,) and (4,)."""

    shapes: Floats
    positions: Floats
    rotations: Floats
    root_position: Floats
    root_rotation: Floats


@dataclass(frozen=True, eq=False)
class Motion:
    """Blend shapes, local bone positions and rotations, and the root, with their true times.

    Args:
        times: seconds on the take's clock, rising, float64 (T,).
        shape_names: S blend-shape names.
        shapes: weights, 0..1, float32 (T, S).
        bone_names: J HumanBodyBones names.
        positions: local positions in metres, Unity axes, float32 (T, J, 3).
        rotations: local unit quaternions xyzw, sign-continuous, float32 (T, J, 4).
        root_position: the avatar in the world, float32 (T, 3).
        root_rotation: unit quaternions, float32 (T, 4).
    """

    times: NDArray[np.float64]
    shape_names: tuple[str, ...]
    shapes: Floats
    bone_names: tuple[str, ...]
    positions: Floats
    rotations: Floats
    root_position: Floats
    root_rotation: Floats

    @classmethod
    def build(
        cls,
        times: ArrayLike,
        shape_names: tuple[str, ...] = (),
        shapes: ArrayLike | None = None,
        bone_names: tuple[str, ...] = (),
        positions: ArrayLike | None = None,
        rotations: ArrayLike | None = None,
        root_position: ArrayLike | None = None,
        root_rotation: ArrayLike | None = None,
    ) -> Motion:
        """A Motion from parts: what is left out is zero, at rest or the identity; rotations are made
        unit and sign-continuous."""
        t = np.asarray(times, dtype=np.float64).reshape(-1)
        frames, bones = len(t), len(bone_names)
        if positions is None:
            positions = np.tile(Skeleton.humanoid(bone_names).rest_positions, (frames, 1, 1))
        if rotations is None:
            rotations = np.tile(rotation.IDENTITY, (frames, bones, 1))
        if root_rotation is None:
            root_rotation = np.tile(rotation.IDENTITY, (frames, 1))
        shapes = np.zeros((frames, len(shape_names))) if shapes is None else shapes
        root_position = np.zeros((frames, 3)) if root_position is None else root_position
        return cls(
            t,
            tuple(shape_names),
            _floats(shapes, (frames, len(shape_names))),
            tuple(bone_names),
            _floats(positions, (frames, bones, 3)),
            _floats(_clean(rotations, (frames, bones, 4)), (frames, bones, 4)),
            _floats(root_position, (frames, 3)),
            _floats(_clean(root_rotation, (frames, 4)), (frames, 4)),
        )

    def __len__(self) -> int:
        return len(self.times)

    @property
    def duration(self) -> float:
        """Seconds from the first frame to the last."""
        return float(self.times[-1] - self.times[0]) if len(self) else 0.0

    @property
    def fps(self) -> float:
        """Frames per second of its usual quarter of a second; 0 for fewer than two frames.

        Pauses and single missing frames change nothing. Nor does a sender that is held up for moments and
        then makes up for it, whose median interval would be that of the catching up.
        """
        if len(self) < 2:
            return 0.0
        intervals = len(self) - 1
        mean = intervals / self.duration if self.duration > 0 else 0.0
        # At most a third of all intervals, so that short motions have spans to take a median of.
        span = max(min(round(_RATE_SPAN_S * mean), intervals // 3), 1)
        usual = float(np.median(self.times[span:] - self.times[:-span]))
        return span / usual if usual > 0 else 0.0

    @cached_property
    def skeleton(self) -> Skeleton:
        """The rest skeleton: median local positions of this motion (Hips moves, the others do not).

        Of an hour some thousand frames, spread over it, tell as much as all of them, and much sooner.
        """
        seen = self.positions[:: max(len(self) // SKELETON_FRAMES, 1)]
        rest = np.median(seen, axis=0) if len(self) else None
        return Skeleton.humanoid(self.bone_names, rest)

    def pose(self, t: float) -> Pose:
        """The pose at a moment, between frames by slerp; held before the first and after the last."""
        return self.at([t]).row(0)

    def named_pose(self, t: float) -> tuple[Pose, tuple[str, ...], tuple[str, ...]]:
        """The pose at a moment with the names of its shapes and of its bones."""
        return self.pose(t), self.shape_names, self.bone_names

    def row(self, i: int) -> Pose:
        """The pose of a frame."""
        return Pose(
            self.shapes[i], self.positions[i], self.rotations[i], self.root_position[i], self.root_rotation[i]
        )

    def at(self, times: ArrayLike) -> Motion:
        """This motion sampled at other times (seconds): linear, rotations by slerp, ends held."""
        t = np.asarray(times, dtype=np.float64).reshape(-1)
        if not len(self):
            return Motion.build(t, self.shape_names, None, self.bone_names)
        # The last frame has no right neighbour; it is its own.
        right = np.clip(np.searchsorted(self.times, t, side="right"), 1, max(len(self) - 1, 1))
        left, right = right - 1, np.minimum(right, len(self) - 1)
        span = self.times[right] - self.times[left]
        amount = np.clip(np.where(span > 0, (t - self.times[left]) / np.where(span > 0, span, 1), 0), 0, 1)

        def line(values: Floats) -> NDArray[np.floating]:
            a = amount.reshape(-1, *[1] * (values.ndim - 1))
            return values[left] * (1 - a) + values[right] * a

        return Motion.build(
            t,
            self.shape_names,
            line(self.shapes),
            self.bone_names,
            line(self.positions),
            rotation.slerp(self.rotations[left], self.rotations[right], amount[:, None]),
            line(self.root_position),
            rotation.slerp(self.root_rotation[left], self.root_rotation[right], amount),
        )

    def resampled(self, fps: float) -> Motion:
        """This motion on an even grid from its first frame to its last."""
        if not len(self):
            return self
        count = int(np.floor(self.duration * fps + 1e-6)) + 1
        return self.at(self.times[0] + np.arange(count) / fps)

    def between(self, start: float, end: float) -> Motion:
        """The frames with start <= t < end, times unchanged."""
        first, last = np.searchsorted(self.times, [start, end])
        return self.at_rows(slice(int(first), int(last)))

    def cut(self, start: float, end: float) -> Motion:
        """The frames from start to end, both included, times from start; none of a span without length."""
        # A take of one frame ends where it begins, at 0, and still has it.
        if start >= end > 0:
            return self.at_rows(slice(0, 0))
        # A take ends with its last frame, so the one at the very end belongs to it.
        return self.between(start, float(np.nextafter(end, np.inf))).shifted(-start)

    def shifted(self, seconds: float) -> Motion:
        """This motion with every time later by some seconds."""
        return replace(self, times=self.times + seconds)

    def at_rows(self, rows: slice | NDArray[np.intp]) -> Motion:
        """Some of the frames, by their numbers."""
        return replace(
            self,
            times=self.times[rows],
            shapes=self.shapes[rows],
            positions=self.positions[rows],
            rotations=self.rotations[rows],
            root_position=self.root_position[rows],
            root_rotation=self.root_rotation[rows],
        )


def only_part(motion: Motion, part: str) -> Motion:
    """The "face" (blend shapes) or the "body" (bones) of a motion; "all" is the motion itself."""
    frames = len(motion)
    if part == "face":
        nothing = np.zeros((frames, 0, 3), np.float32), np.zeros((frames, 0, 4), np.float32)
        return replace(motion, bone_names=(), positions=nothing[0], rotations=nothing[1])
    if part == "body":
        return replace(motion, shape_names=(), shapes=np.zeros((frames, 0), np.float32))
    return motion


def concatenate(parts: list[Motion]) -> Motion:
    """Motions with the same channels, one after another in time."""
    first = parts[0]
    return replace(
        first,
        times=np.concatenate([m.times for m in parts]),
        shapes=np.concatenate([m.shapes for m in parts]),
        positions=np.concatenate([m.positions for m in parts]),
        rotations=rotation.sign_continuous(np.concatenate([m.rotations for m in parts])).astype(np.float32),
        root_position=np.concatenate([m.root_position for m in parts]),
        root_rotation=np.concatenate([m.root_rotation for m in parts]),
    )


_COLUMNS = ("times", "shapes", "positions", "rotations", "root_position", "root_rotation")


class MotionBuffer:
    """A motion that grows at its end; appending costs what is new and not what is there already.

    What `motion` gave before stays as it was while more is appended, so that others may read it meanwhile.
    """

    def __init__(self) -> None:
        self._store: Motion | None = None  # with room for more frames than there are
        self._frames = 0

    def __len__(self) -> int:
        return self._frames

    @property
    def motion(self) -> Motion:
        """All frames so far, as a view: nothing is copied. There must have been something to append."""
        assert self._store is not None, "nothing tells the channels yet"
        return self._store.at_rows(slice(0, self._frames))

    def append(self, part: Motion) -> None:
        """Add frames behind those that are there; the channels must be the same."""
        start, end = self._frames, self._frames + len(part)
        store = self._store = self._with_room(self._store or part.at_rows(slice(0, 0)), end)
        for name in _COLUMNS:
            getattr(store, name)[start:end] = getattr(part, name)
        if 0 < start < end:
            # q and -q are one rotation: the part goes on with the sign that the frame before it has.
            turned = (store.rotations[start - 1] * store.rotations[start]).sum(axis=-1) < 0
            store.rotations[start:end, turned] *= -1.0
        self._frames = end

    def _with_room(self, store: Motion, frames: int) -> Motion:
        if frames <= len(store):
            return store
        # Half as much again each time: all copies together stay in proportion to the length, and an hour
        # needs less to spare than it would with twice as much. Rows that are not written take no memory.
        capacity = max(frames, len(store) * 3 // 2)
        columns: dict[str, Any] = {}
        for name in _COLUMNS:
            before = getattr(store, name)
            columns[name] = np.empty((capacity, *before.shape[1:]), before.dtype)
            columns[name][: self._frames] = before[: self._frames]
        return replace(store, **columns)


def _floats(values: ArrayLike, shape: tuple[int, ...]) -> Floats:
    return np.ascontiguousarray(values, dtype=np.float32).reshape(shape)


def _clean(rotations: ArrayLike, shape: tuple[int, ...]) -> NDArray[np.floating]:
    q = np.asarray(rotations, dtype=np.float64).reshape(shape)
    return rotation.sign_continuous(rotation.normalised(q))
