"""A plain body for any skeleton, with a face that every blend shape moves: for files that need a mesh."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from studio.motion.avatar import MIRROR, Avatar, Floats, Morph, Surface
from studio.motion.expression import Expression
from studio.motion.material import SurfaceMaterial
from studio.motion.skeleton import Skeleton
from studio.render import body
from studio.render.face import FaceShape, face_shape
from studio.render.palette import LIGHT, Palette, rgb

_AROUND = 20
_SKIN, _INK, _WHITE, _LIMB = range(4)
# The features lie this much before the ball of the head.
_OUT = 1.012


def mannequin(skeleton: Skeleton, shapes: tuple[str, ...] = (), palette: Palette = LIGHT) -> Avatar:
    """A body of a skeleton's proportions, each shape an expression of its own name.

    Args:
        skeleton: at rest in a T-pose, Unity's axes.
        shapes: blend-shape names of any set; none where it has no head.
        palette: its colours.
    """
    rest = skeleton.forward(skeleton.rest_positions, skeleton.rest_rotations)[0] * MIRROR
    plan = body.Plan.of(skeleton)
    scale = plan.scale(rest)
    surfaces = [_limbs(plan, rest, scale)] if len(plan.starts) else []
    expressions: tuple[Expression, ...] = ()
    if plan.head >= 0:
        centre, radius = body.head_ball(plan, rest, scale)
        surfaces.append(_ball(plan.head, rest, centre, radius))
        first = len(surfaces)
        surfaces += [_feature(which, plan.head, rest, centre, radius, shapes) for which in ("eyes", "ink")]
        expressions = tuple(
            Expression(name, ((first, i, 1.0), (first + 1, i, 1.0))) for i, name in enumerate(shapes)
        )
    return Avatar("Figure", skeleton, tuple(surfaces), _materials(palette), expressions)


def _materials(palette: Palette) -> tuple[SurfaceMaterial, ...]:
    colours = (palette.joint, "#20242C", "#FFFFFF", palette.figure)
    return tuple(SurfaceMaterial(_linear(colour), two_sided=True) for colour in colours)


def _linear(colour: str) -> tuple[float, float, float, float]:
    value = rgb(colour) / 255.0
    r, g, b = np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4).tolist()
    return r, g, b, 1.0


def _limbs(plan: body.Plan, rest: NDArray[np.float64], scale: float) -> Surface:
    vertices, normals = body.limbs(plan, rest, scale)
    triangles = body.faces("limb", len(plan.starts)).reshape(-1, 4)[:, 1:]
    owners = np.repeat(plan.starts, body.vertex_count("limb"))
    return _surface("Body", vertices, normals, triangles, owners, _LIMB)


def _ball(head: int, rest: NDArray[np.float64], centre: NDArray[np.float64], radius: float) -> Surface:
    normals, triangles = body.sphere()
    owners = np.full(len(normals), head)
    return _surface("Head", centre + normals * radius, normals, triangles, owners, _SKIN)


def _feature(
    which: str, head: int, rest: NDArray[np.float64], centre: NDArray[np.float64], radius: float,
    shapes: tuple[str, ...],
) -> Surface:  # fmt: skip
    """Eyes, or what is drawn with ink: pupils, brows and mouth."""
    draw = _eyes if which == "eyes" else _ink
    flat, triangles = draw(FaceShape())
    at_rest = _on_ball(flat)
    # Each shape alone at full weight: morph targets add up, as shapes do.
    offsets = [_on_ball(draw(face_shape({name: 1.0}))[0]) - at_rest for name in shapes]
    morphs = tuple(
        Morph(np.arange(len(flat), dtype=np.int32), (moved * radius).astype(np.float32)) for moved in offsets
    )
    owners = np.full(len(flat), head)
    vertices = centre + at_rest * radius
    material = _WHITE if which == "eyes" else _INK
    return _surface(which.title(), vertices, at_rest, triangles, owners, material, morphs)


def _surface(
    name: str, vertices: NDArray[np.float64], normals: NDArray[np.float64], triangles: NDArray[np.int64],
    owners: NDArray[np.intp], material: int, morphs: tuple[Morph, ...] = (),
) -> Surface:  # fmt: skip
    """Vertices that each follow one bone."""
    used, joints = np.unique(owners, return_inverse=True)
    binds = np.tile(np.eye(4)[:3], (len(used), 1, 1))
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = normals / np.where(length > 0, length, 1.0)
    return Surface(
        name, vertices.astype(np.float32), normals.astype(np.float32), None, triangles.astype(np.int32),
        joints.reshape(-1, 1).astype(np.int32), np.ones((len(vertices), 1), np.float32), binds,
        used.astype(np.int32), morphs, material,
    )  # fmt: skip


def _on_ball(flat: Floats) -> NDArray[np.float64]:
    """Points of a face (V, 3), x to its left, y up, and whether before the rest, on a ball of radius 1."""
    x, y = flat[:, 0].astype(np.float64), flat[:, 1].astype(np.float64)
    out = _OUT + 0.01 * flat[:, 2]
    return np.stack([x, y, np.sqrt(np.maximum(out**2 - x * x - y * y, 0.04))], axis=1)


def _eyes(face: FaceShape) -> tuple[Floats, NDArray[np.int64]]:
    return _joined([_ellipse(side * 0.36, 0.12, 0.19, 0.15 * _open(face, side), 0.0) for side in (1.0, -1.0)])


def _ink(face: FaceShape) -> tuple[Floats, NDArray[np.int64]]:
    parts = []
    for side in (1.0, -1.0):
        # The face's own left is the viewer's right: looks are told as the viewer sees them.
        x, y = side * 0.36 + 0.07 * face.look[0], 0.12 + 0.05 * face.look[1]
        parts.append(_ellipse(x, y, 0.085, max(0.1 * _open(face, side), 0.012), 1.0))
        brow = face.brow_left if side > 0 else face.brow_right
        parts.append(_ellipse(side * 0.36, 0.36 + 0.09 * brow, 0.17, 0.022, 0.0))
    parts.append(_mouth(face))
    return _joined(parts)


def _open(face: FaceShape, side: float) -> float:
    shut = face.blink_left if side > 0 else face.blink_right
    return max((1.0 - shut) * (1.0 + 0.3 * face.surprise), 0.04)


def _ellipse(x: float, y: float, wide: float, tall: float, before: float) -> tuple[Floats, NDArray[np.int64]]:
    a = np.arange(_AROUND) * 2 * np.pi / _AROUND
    rim = np.stack([x + wide * np.cos(a), y + tall * np.sin(a), np.full(_AROUND, before)], axis=1)
    return _fan(x, y, before, rim)


def _mouth(face: FaceShape) -> tuple[Floats, NDArray[np.int64]]:
    """Lips as one filled line: a closed mouth is thin, a smile lifts its corners."""
    half = 0.3 * (1 + 0.35 * face.wide) * (1 - 0.5 * face.round)
    gap = 0.025 + 0.3 * face.open
    a = np.arange(_AROUND) * 2 * np.pi / _AROUND
    x = half * np.cos(a)
    lift = 0.12 * face.smile * (x / max(half, 1e-6)) ** 2
    y = -0.42 + gap * 0.5 * np.sin(a) - 0.25 * gap + lift
    return _fan(0.0, float(-0.42 - 0.25 * gap), 0.0, np.stack([x, y, np.zeros(_AROUND)], axis=1))


def _fan(x: float, y: float, before: float, rim: NDArray[np.float64]) -> tuple[Floats, NDArray[np.int64]]:
    points = np.concatenate([[[x, y, before]], rim]).astype(np.float32)
    i = np.arange(_AROUND)
    return points, np.stack([np.zeros_like(i), 1 + i, 1 + (i + 1) % _AROUND], axis=1)


def _joined(parts: list[tuple[Floats, NDArray[np.int64]]]) -> tuple[Floats, NDArray[np.int64]]:
    starts = np.cumsum([0, *(len(points) for points, _ in parts[:-1])])
    return (
        np.concatenate([points for points, _ in parts]),
        np.concatenate([faces + start for (_, faces), start in zip(parts, starts, strict=True)]),
    )
