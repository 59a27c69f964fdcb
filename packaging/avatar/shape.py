"""What the avatar is built of: parts of vertices and triangles, lofted tubes, and weights along bones.

Metres, right-handed, Y up, facing +Z, its left at +X, as VRM 1.0 has it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Whole = NDArray[np.int64]


@dataclass
class Part:
    """Triangles of one material.

    Args:
        material: its name.
        points: (V, 3).
        triangles: (F, 3), counter-clockwise from outside.
        bones: name of the bone -> weight (V,).
        uv: (V, 2), v from the top; none where no picture lies on it.
        moved: name of a blend shape -> points at its full weight (V, 3).
        smooth: vertices in one place share their normal.
    """

    material: str
    points: Array
    triangles: Whole
    bones: Mapping[str, Array]
    uv: Array | None = None
    moved: dict[str, Array] = field(default_factory=dict)

    def normals(self, points: Array | None = None) -> Array:
        """Mean direction of the faces around each vertex, those in the same place together (V, 3)."""
        at = self.points if points is None else points
        a, b, c = (at[self.triangles[:, k]] for k in range(3))
        faces = np.cross(b - a, c - a)
        _, same = np.unique(np.round(self.points, 6), axis=0, return_inverse=True)
        total = np.zeros((same.max() + 1, 3))
        for k in range(3):
            np.add.at(total, same.ravel()[self.triangles[:, k]], faces)
        found = total[same.ravel()]
        length = np.linalg.norm(found, axis=1, keepdims=True)
        return np.where(length > 1e-12, found / np.maximum(length, 1e-12), [0.0, 0.0, 1.0])


def rigid(bone: str, count: int) -> dict[str, Array]:
    """Weights of points that follow one bone."""
    return {bone: np.ones(count)}


def smooth(value: Array | float) -> Array:
    """0 below 0, 1 above 1, and an even way between."""
    t = np.clip(np.asarray(value, dtype=np.float64), 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)


def along(position: Array, joints: Sequence[tuple[str, float]], width: float) -> dict[str, Array]:
    """Weights of points between bones in a row: a bone begins where its joint is, and fades over `width`.

    Args:
        position: where the points are along the row (V,), rising.
        joints: (bone, where it begins), rising.
    """
    weights: dict[str, Array] = {}
    left = np.ones(len(position))
    for name, begin in reversed(joints[1:]):
        share = smooth((position - begin) / width + 0.5) * left
        weights[name] = share
        left = left - share
    weights[joints[0][0]] = left
    return weights


def strip(rows: int, columns: int, closed: bool) -> Whole:
    """Triangles of a grid of rows x columns points, whose columns may close to a ring."""
    last = columns if closed else columns - 1
    row, column = np.divmod(np.arange((rows - 1) * last), last)
    beside = (column + 1) % columns
    a, b = row * columns + column, row * columns + beside
    c, d = a + columns, b + columns
    return np.concatenate([np.stack([a, b, d], 1), np.stack([a, d, c], 1)])


def tube(
    centres: Array,
    widths: Array,
    depths: Array,
    sides: int,
    across: Array,
    ends: tuple[bool, bool] = (True, True),
) -> tuple[Array, Whole]:
    """A tube around a line of centres (N, 3), elliptic, closed at its ends by a point where asked for.

    Args:
        widths, depths: half axes (N,): along `across`, and along what is square to it and the line.
        across: a direction (3,) or one for each centre (N, 3).
    """
    way = np.gradient(centres, axis=0)
    way /= np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-9)
    side = np.broadcast_to(np.asarray(across, dtype=np.float64), centres.shape)
    side = side - way * (side * way).sum(axis=1, keepdims=True)
    side = side / np.maximum(np.linalg.norm(side, axis=1, keepdims=True), 1e-9)
    front = np.cross(way, side)
    t = np.arange(sides) * 2.0 * np.pi / sides
    ring = (
        side[:, None] * (np.cos(t)[None, :, None] * widths[:, None, None])
        + front[:, None] * (np.sin(t)[None, :, None] * depths[:, None, None])
        + centres[:, None]
    )
    points, triangles = ring.reshape(-1, 3), strip(len(centres), sides, closed=True)
    caps = []
    for wanted, row, turn in ((ends[0], 0, True), (ends[1], len(centres) - 1, False)):
        if not wanted:
            continue
        points = np.concatenate([points, centres[row : row + 1]])
        edge = row * sides + np.arange(sides)
        nextto = row * sides + (np.arange(sides) + 1) % sides
        tip = np.full(sides, len(points) - 1)
        caps.append(np.stack([nextto, edge, tip] if turn else [edge, nextto, tip], 1))
    return points, np.concatenate([triangles, *caps])


def curve(knots: Sequence[tuple[float, ...]], at: Array) -> Array:
    """A smooth line through knots (t, value...) at some t: (N,) or (N, k)."""
    from scipy.interpolate import PchipInterpolator

    table = np.array(knots, dtype=np.float64)
    values = table[:, 1] if table.shape[1] == 2 else table[:, 1:]
    found: Array = PchipInterpolator(table[:, 0], values, axis=0)(np.clip(at, table[0, 0], table[-1, 0]))
    return found


def mirrored(part: Part, other: Callable[[str], str]) -> Part:
    """The same on the other side; `other` says what a bone or blend shape is called there."""
    turn = np.array([-1.0, 1.0, 1.0])
    return Part(
        part.material,
        part.points * turn,
        part.triangles[:, ::-1].copy(),
        {other(bone): weights for bone, weights in part.bones.items()},
        part.uv,
        {other(name): points * turn for name, points in part.moved.items()},
    )
