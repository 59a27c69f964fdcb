"""Motion as columns of numbers: which channels are learnt, how they are scaled, which are carried through.

Shapes stay as they are, rotations become 6D (Zhou et al. 2019), positions come from the rest skeleton and
only the hips' are learnt. What never moves in training is not learnt but carried.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio.errors import StudioError
from studio.motion import Motion, rotation

Array = NDArray[np.floating]

FACE, BODY, HIPS = 0, 1, 2
"""Groups of columns: blend shapes, rotations, the hips' position."""

STATIC_SHAPE = 1e-3
"""A shape whose range in training stays below this is carried, not learnt."""
STATIC_ANGLE = np.radians(0.2)
STATIC_METRES = 5e-4


@dataclass(frozen=True, eq=False)
class Layout:
    """The columns a model predicts, and all that is needed to make a Motion of them.

    Args:
        shape_names: all S shapes of the training takes.
        bone_names: all J bones.
        learnt_shapes, learnt_bones: indices of those that are predicted.
        learns_hips: whether the last three columns are the hips' local position.
        rest_shapes: (S,) carried values.
        shape_limits: (S, 2) lowest and highest value a prediction may take.
        rest_positions: (J, 3) local positions, metres.
        rest_rotations: (J, 4) carried rotations.
        root_position, root_rotation: (3,) and (4,), carried.
        mean: (C,) mean of each column in training, natural units.
        offset, scale: (C,) scaled = (natural - offset) / scale.
    """

    shape_names: tuple[str, ...]
    bone_names: tuple[str, ...]
    learnt_shapes: tuple[int, ...]
    learnt_bones: tuple[int, ...]
    learns_hips: bool
    rest_shapes: Array
    shape_limits: Array
    rest_positions: Array
    rest_rotations: Array
    root_position: Array
    root_rotation: Array
    mean: Array
    offset: Array
    scale: Array

    @property
    def width(self) -> int:
        """Columns, C."""
        return len(self.learnt_shapes) + 6 * len(self.learnt_bones) + 3 * self.learns_hips

    @property
    def groups(self) -> NDArray[np.int64]:
        """FACE, BODY or HIPS for each column, (C,)."""
        counts = (len(self.learnt_shapes), 6 * len(self.learnt_bones), 3 * self.learns_hips)
        return np.repeat(np.array([FACE, BODY, HIPS]), counts)

    @property
    def scaled_mean(self) -> Array:
        """The training mean in scaled units, (C,)."""
        return (self.mean - self.offset) / self.scale

    def columns(self, motion: Motion) -> tuple[Array, Array]:
        """A Motion as columns.

        Returns:
            Natural values float32 (T, C) and a mask (C,): 1 for columns whose channel the motion has, 0
            for those it lacks, whose values are the training mean.
        """
        # A channel that a take lacks stands at the mean and is masked, so that it neither teaches nor counts.
        values = np.tile(self.mean, (len(motion), 1))
        mask = np.zeros(self.width)
        column = 0
        where = {name: i for i, name in enumerate(motion.shape_names)}
        for shape in self.learnt_shapes:
            i = where.get(self.shape_names[shape])
            if i is not None:
                values[:, column], mask[column] = motion.shapes[:, i], 1
            column += 1
        where = {name: i for i, name in enumerate(motion.bone_names)}
        for bone in self.learnt_bones:
            i = where.get(self.bone_names[bone])
            if i is not None:
                values[:, column : column + 6] = rotation.to_6d(motion.rotations[:, i])
                mask[column : column + 6] = 1
            column += 6
        if self.learns_hips and "Hips" in where:
            values[:, column:], mask[column:] = motion.positions[:, where["Hips"]], 1
        return values.astype(np.float32), mask.astype(np.float32)

    def scaled(self, natural: Array) -> Array:
        """Columns in the units a model learns, float32 (T, C)."""
        return ((natural - self.offset) / self.scale).astype(np.float32)

    def natural(self, scaled: Array) -> Array:
        """Columns in natural units from scaled ones, float64 (T, C)."""
        return np.asarray(scaled, dtype=np.float64) * self.scale + self.offset

    def motion(self, scaled: Array, times: Array) -> Motion:
        """A Motion of all channels from scaled columns (T, C) at times (T,), seconds."""
        values = self.natural(scaled)
        frames, faces = len(values), len(self.learnt_shapes)
        shapes = np.tile(self.rest_shapes, (frames, 1))
        positions = np.tile(self.rest_positions, (frames, 1, 1))
        rotations = np.tile(self.rest_rotations, (frames, 1, 1))
        if faces:
            index = list(self.learnt_shapes)
            limits = self.shape_limits[index]
            # A network may overshoot; beyond what was captured and 0 to 1, faces fold into themselves.
            shapes[:, index] = np.clip(values[:, :faces], limits[:, 0], limits[:, 1])
        if self.learnt_bones:
            six = values[:, faces : faces + 6 * len(self.learnt_bones)]
            rotations[:, list(self.learnt_bones)] = rotation.from_6d(
                six.reshape(frames, len(self.learnt_bones), 6)
            )
        if self.learns_hips:
            positions[:, self.bone_names.index("Hips")] = values[:, -3:]
        root = (np.tile(self.root_position, (frames, 1)), np.tile(self.root_rotation, (frames, 1)))
        return Motion.build(times, self.shape_names, shapes, self.bone_names, positions, rotations, *root)

    def as_dict(self) -> dict[str, Any]:
        """Plain values for a file; `from_dict` reads them."""
        return {
            name: value.tolist() if isinstance(value, np.ndarray) else value
            for name, value in vars(self).items()
        }

    @classmethod
    def from_dict(cls, facts: dict[str, Any]) -> Layout:
        """The layout written by `as_dict`; KeyError, TypeError or ValueError where it is damaged."""
        shapes, bones = tuple(map(str, facts["shape_names"])), tuple(map(str, facts["bone_names"]))
        arrays = {name: np.asarray(facts[name], dtype=np.float64) for name in _ARRAYS}
        arrays["shape_limits"] = arrays["shape_limits"].reshape(len(shapes), 2)
        arrays["rest_positions"] = arrays["rest_positions"].reshape(len(bones), 3)
        arrays["rest_rotations"] = arrays["rest_rotations"].reshape(len(bones), 4)
        layout = cls(
            shapes,
            bones,
            tuple(map(int, facts["learnt_shapes"])),
            tuple(map(int, facts["learnt_bones"])),
            bool(facts["learns_hips"]),
            **arrays,
        )
        if {layout.mean.shape, layout.offset.shape, layout.scale.shape} != {(layout.width,)}:
            raise ValueError("columns do not fit the channels")
        # After the shapes of the arrays: a file from elsewhere must not get as far as making motion.
        layout._check()
        return layout

    def _check(self) -> None:
        """ValueError for what motion cannot be made of; a file can come from anybody."""
        for names, learnt in ((self.shape_names, self.learnt_shapes), (self.bone_names, self.learnt_bones)):
            if len(set(names)) < len(names) or len(set(learnt)) < len(learnt):
                raise ValueError("a channel is there twice")
            if learnt and not 0 <= min(learnt) <= max(learnt) < len(names):
                raise ValueError("a channel is learnt that there is not")
        if self.learns_hips and "Hips" not in self.bone_names:
            raise ValueError("hips are learnt that there are not")
        if (self.rest_shapes.shape, self.root_position.shape, self.root_rotation.shape) != (
            (len(self.shape_names),),
            (3,),
            (4,),
        ):
            raise ValueError("what is carried does not fit the channels")
        if any(not (np.abs(getattr(self, name)) <= _LARGEST).all() for name in _ARRAYS):
            raise ValueError("a value is out of all bounds")
        if not (np.abs(self.scale) > 0).all():
            raise ValueError("a column has no scale")


_LARGEST = 1e6
"""Of any number in a layout: metres, weights of shapes, units of a scale. NaN is no number."""
_ARRAYS = (
    "rest_shapes", "shape_limits", "rest_positions", "rest_rotations", "root_position", "root_rotation",
    "mean", "offset", "scale",
)  # fmt: skip


def fit(motions: Sequence[Motion], scaling: str = "group") -> Layout:
    """The layout of some training motions; static channels are found and scales measured.

    Args:
        motions: what is trained on; channels may differ between them.
        scaling: "group" (centred on the mean, one scale for the face, one for rotations, one for the
            hips), "minmax" (each column 0..1 over training) or "none" (natural units).

    Raises:
        StudioError: nothing moves in any of them.
    """
    shape_names = _union(m.shape_names for m in motions)
    bone_names = _union(m.bone_names for m in motions)
    shape_rows = [_stack(motions, name, face=True) for name in shape_names]
    bone_rows = [_stack(motions, name, face=False) for name in bone_names]
    learnt_shapes = tuple(i for i, rows in enumerate(shape_rows) if np.ptp(rows) >= STATIC_SHAPE)
    rest_turns, learnt_bones, bone_columns = [], [], []
    for i, rows in enumerate(bone_rows):
        six = rotation.to_6d(rows)
        rest_turns.append(_mean_turn(six))
        if len(rows) and rotation.angle_between(rest_turns[i], rows).max() >= STATIC_ANGLE:
            learnt_bones.append(i)
            bone_columns.append(six)
    # Of all bones only the hips move in place; the others' positions are the skeleton's.
    hips = _hips(motions) if "Hips" in bone_names else np.zeros((0, 3))
    learns_hips = bool(len(hips)) and bool(np.ptp(hips, axis=0).max() >= STATIC_METRES)
    if not learnt_shapes and not learnt_bones and not learns_hips:
        raise StudioError(
            "Nothing moves in the training takes.",
            "Check that the tracker was sending while they were recorded.",
        )
    columns = [shape_rows[i][:, None] for i in learnt_shapes]
    columns += [*bone_columns, *([hips] if learns_hips else [])]
    counts = (len(learnt_shapes), 6 * len(learnt_bones), 3 * learns_hips)
    # One scale for each group and not for each column: a still brow would be scaled up to noise.
    offset, scale = _scales(columns, np.repeat(np.array([FACE, BODY, HIPS]), counts), scaling)
    roots = np.concatenate([m.root_position for m in motions])
    root_turns = np.concatenate([m.root_rotation for m in motions])
    return Layout(
        shape_names,
        bone_names,
        learnt_shapes,
        tuple(learnt_bones),
        learns_hips,
        # The median: a shape that is stuck for a while must not set where it rests.
        rest_shapes=np.array([np.median(rows) for rows in shape_rows]),
        shape_limits=np.array([(min(0.0, rows.min()), max(1.0, rows.max())) for rows in shape_rows]).reshape(
            -1, 2
        ),
        rest_positions=_rest_positions(motions, bone_names),
        rest_rotations=np.array(rest_turns).reshape(-1, 4),
        root_position=np.median(roots, axis=0).astype(np.float64),
        root_rotation=_mean_turn(rotation.to_6d(root_turns)),
        mean=np.concatenate([part.mean(axis=0) for part in columns]).astype(np.float64),
        offset=offset,
        scale=scale,
    )


def _scales(columns: list[Array], groups: Array, scaling: str) -> tuple[Array, Array]:
    if scaling == "none":
        return np.zeros(len(groups)), np.ones(len(groups))
    if scaling == "minmax":
        low = np.concatenate([part.min(axis=0) for part in columns]).astype(np.float64)
        high = np.concatenate([part.max(axis=0) for part in columns]).astype(np.float64)
        return low, np.maximum(high - low, STATIC_METRES)
    mean = np.concatenate([part.mean(axis=0) for part in columns]).astype(np.float64)
    variance = np.concatenate([part.var(axis=0) for part in columns]).astype(np.float64)
    scale = np.ones(len(groups))
    for group in set(groups.tolist()):
        scale[groups == group] = max(float(np.sqrt(variance[groups == group].mean())), 1e-5)
    return mean, scale


def _union(lists: Any) -> tuple[str, ...]:
    return tuple(dict.fromkeys(name for names in lists for name in names))


def _stack(motions: Sequence[Motion], name: str, *, face: bool) -> Array:
    """All frames of one shape (T,) or one bone's rotations (T, 4), over the motions that have it."""
    parts = []
    for motion in motions:
        names = motion.shape_names if face else motion.bone_names
        if name in names:
            parts.append((motion.shapes if face else motion.rotations)[:, names.index(name)])
    return np.concatenate(parts)


def _mean_turn(six: Array) -> Array:
    """The mean of rotations in 6D (T, 6); of quaternions q and -q are one rotation and would cancel."""
    return rotation.from_6d(six.mean(axis=0)) if len(six) else rotation.IDENTITY.copy()


def _hips(motions: Sequence[Motion]) -> Array:
    return np.concatenate(
        [m.positions[:, m.bone_names.index("Hips")] for m in motions if "Hips" in m.bone_names]
    )


def _rest_positions(motions: Sequence[Motion], bone_names: tuple[str, ...]) -> Array:
    rest = []
    for name in bone_names:
        having = [m for m in motions if name in m.bone_names]
        places = np.concatenate([m.positions[:, m.bone_names.index(name)] for m in having])
        rest.append(np.median(places, axis=0))
    return np.array(rest, dtype=np.float64).reshape(-1, 3)
