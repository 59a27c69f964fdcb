"""The figure's shape: a capsule for every bone, a ball for every joint, a head with eyes.

Plain arrays, computed at the display's rate; `actors` draws them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from studio.motion.skeleton import Skeleton

Points = NDArray[np.float64]

HEAD_RADIUS = 0.1
SIDES = 12
TORSO_LENGTH = 0.54
"""Metres from Hips to Head of the built-in body: the measure of its scale."""

_LIMB_RADII = {
    "Spine": (0.090, 0.082), "Chest": (0.082, 0.098), "UpperChest": (0.098, 0.085), "Neck": (0.045, 0.034),
    "Head": (0.034, 0.034), "Shoulder": (0.045, 0.040), "UpperArm": (0.040, 0.036),
    "LowerArm": (0.036, 0.027), "Hand": (0.027, 0.021), "UpperLeg": (0.062, 0.060),
    "LowerLeg": (0.060, 0.042), "Foot": (0.042, 0.028), "Toes": (0.030, 0.022),
}  # fmt: skip
_FINGER_RADII = (0.0085, 0.0075)
_BALLS = {"UpperArm": 0.042, "LowerArm": 0.037, "Hand": 0.028, "LowerLeg": 0.048, "Foot": 0.036}


@dataclass(frozen=True, eq=False)
class Plan:
    """What is drawn of a skeleton, worked out once.

    Args:
        starts, ends: joint indices of the L capsules.
        radii: of each capsule at its start and end, metres (L, 2).
        balls: joint indices of the drawn joints.
        ball_radii: metres (B,).
        head, neck, hips: joint indices, -1 where missing.
        eyes: joint indices of the eyes there are.
    """

    starts: NDArray[np.intp]
    ends: NDArray[np.intp]
    radii: Points
    balls: NDArray[np.intp]
    ball_radii: Points
    head: int
    neck: int
    hips: int
    eyes: tuple[int, ...]

    @classmethod
    def of(cls, skeleton: Skeleton) -> Plan:
        """The plan of a skeleton; unknown bones become thin limbs."""
        names = skeleton.bone_names
        index = {name: i for i, name in enumerate(names)}
        limbs = [
            (up, child, _radii(names[child]))
            for up, child in skeleton.edges()
            if not names[child].endswith(("Eye", "Jaw"))
        ]
        balls = [(i, r) for i, name in enumerate(names) if (r := _BALLS.get(_unsided(name)))]
        return cls(
            np.array([limb[0] for limb in limbs], dtype=np.intp),
            np.array([limb[1] for limb in limbs], dtype=np.intp),
            np.array([limb[2] for limb in limbs], dtype=np.float64).reshape(-1, 2),
            np.array([ball[0] for ball in balls], dtype=np.intp),
            np.array([ball[1] for ball in balls], dtype=np.float64),
            index.get("Head", -1),
            index.get("Neck", index.get("UpperChest", -1)),
            index.get("Hips", -1),
            tuple(index[name] for name in ("LeftEye", "RightEye") if name in index),
        )

    def scale(self, joints: Points) -> float:
        """How large this body is against the built-in one, from its joints (J, 3)."""
        if self.head >= 0 and self.hips >= 0:
            size = float(np.linalg.norm(joints[self.head] - joints[self.hips])) / TORSO_LENGTH
        elif len(joints) > 1:
            size = float(np.linalg.norm(np.ptp(joints, axis=0))) / 2.2
        else:
            size = 1.0
        # Damaged motion may have bones of no length or of kilometres; the camera must still find it.
        return size if 1e-3 < size < 1e3 else 1.0


def limbs(plan: Plan, joints: Points, scale: float) -> tuple[Points, Points]:
    """The capsules' surface.

    Args:
        plan: what is drawn.
        joints: picture-space joints (J, 3).
        scale: the body's size.

    Returns:
        Vertices and unit normals, both (L * V, 3), V vertices a capsule.
    """
    template_normals, template_along = _capsule()
    start, end = joints[plan.starts], joints[plan.ends]
    axis = end - start
    length = np.linalg.norm(axis, axis=1, keepdims=True)
    z = np.where(length > 1e-9, axis / np.maximum(length, 1e-9), [0.0, 1.0, 0.0])
    # Any direction that is not the bone's own, to build a frame on; up, unless the bone stands upright.
    helper = np.where(np.abs(z[:, 1:2]) < 0.9, [0.0, 1.0, 0.0], [1.0, 0.0, 0.0])
    x = np.cross(helper, z)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    frame = np.stack([x, np.cross(z, x), z], axis=1)  # (L, 3 local axes, 3)
    normals = np.einsum("vk,lkc->lvc", template_normals, frame)
    radius = plan.radii[:, :1] + (plan.radii[:, 1:] - plan.radii[:, :1]) * template_along  # (L, V)
    centre = start[:, None, :] + axis[:, None, :] * template_along[None, :, None]
    vertices = centre + normals * (radius * scale)[:, :, None]
    return vertices.reshape(-1, 3), normals.reshape(-1, 3)


def balls(plan: Plan, joints: Points, scale: float) -> tuple[Points, Points]:
    """The drawn joints' surface: vertices and normals, both (B * V, 3)."""
    normals = _sphere()[0]
    radii = (plan.ball_radii * scale)[:, None, None]
    vertices = joints[plan.balls][:, None, :] + normals[None] * radii
    return vertices.reshape(-1, 3), np.tile(normals, (len(plan.balls), 1))


def head(plan: Plan, joints: Points, scale: float) -> tuple[Points, Points]:
    """The head's and the eyes' surface: vertices and normals, ((1 + E) * V, 3); empty without a head."""
    if plan.head < 0:
        return np.empty((0, 3)), np.empty((0, 3))
    normals = _sphere()[0]
    centre, radius = head_ball(plan, joints, scale)
    parts = [centre + normals * radius]
    for eye in plan.eyes:
        out = joints[eye] - centre
        size = float(np.linalg.norm(out))
        out = out / size if size > 1e-6 else np.array([0.0, 0.0, 1.0])
        parts.append(centre + out * radius * 0.97 + normals * (0.016 * scale))
    return np.concatenate(parts), np.tile(normals, (len(parts), 1))


def head_ball(plan: Plan, joints: Points, scale: float) -> tuple[Points, float]:
    """Centre (3,) and radius of the head."""
    up = joints[plan.head] - joints[plan.neck] if plan.neck >= 0 else np.array([0.0, 1.0, 0.0])
    size = float(np.linalg.norm(up))
    up = up / size if size > 1e-6 else np.array([0.0, 1.0, 0.0])
    centre = joints[plan.head] + up * (0.075 * scale)
    # The head joint sits over the spine; the skull reaches forward to the eyes.
    if plan.eyes:
        forward = joints[list(plan.eyes)].mean(axis=0) - joints[plan.head]
        forward -= up * float(forward @ up)
        centre = centre + forward * 0.25
    return centre, HEAD_RADIUS * scale


def faces(kind: str, count: int) -> NDArray[np.int64]:
    """Triangles of `count` capsules ("limb") or spheres ("ball") in VTK's layout (3, a, b, c, 3, ...)."""
    triangles, vertices = (
        (_capsule_faces(), len(_capsule()[1])) if kind == "limb" else (_sphere()[1], len(_sphere()[0]))
    )
    offsets = (np.arange(count) * vertices)[:, None, None]
    stacked = (triangles[None] + offsets).reshape(-1, 3)
    return np.concatenate([np.full((len(stacked), 1), 3), stacked], axis=1).astype(np.int64).ravel()


def sphere() -> tuple[Points, NDArray[np.int64]]:
    """A ball of radius 1: vertices, which are their own normals (V, 3), and triangles (F, 3)."""
    return _sphere()


def vertex_count(kind: str) -> int:
    """Vertices of one capsule ("limb") or sphere ("ball")."""
    return len(_capsule()[1]) if kind == "limb" else len(_sphere()[0])


def _unsided(name: str) -> str:
    return name.removeprefix("Left").removeprefix("Right")


def _radii(name: str) -> tuple[float, float]:
    return _LIMB_RADII.get(_unsided(name), _FINGER_RADII)


@lru_cache(1)
def _capsule() -> tuple[Points, Points]:
    """Normals (V, 3) in a frame whose z is the axis, and where along it each vertex sits (V,)."""
    polar = np.radians([-90, -60, -30, 0, 0, 30, 60, 90])
    along = np.array([0, 0, 0, 0, 1, 1, 1, 1], dtype=np.float64)
    around = np.arange(SIDES) * 2 * np.pi / SIDES
    p, a = np.meshgrid(polar, around, indexing="ij")
    normals = np.stack([np.cos(p) * np.cos(a), np.cos(p) * np.sin(a), np.sin(p)], axis=-1)
    return normals.reshape(-1, 3), np.repeat(along, SIDES)


@lru_cache(1)
def _capsule_faces() -> NDArray[np.int64]:
    return _ring_faces(8, SIDES)


@lru_cache(1)
def _sphere() -> tuple[Points, NDArray[np.int64]]:
    rings, sides = 11, 18
    polar = np.linspace(-np.pi / 2, np.pi / 2, rings)
    around = np.arange(sides) * 2 * np.pi / sides
    p, a = np.meshgrid(polar, around, indexing="ij")
    normals = np.stack([np.cos(p) * np.cos(a), np.sin(p), -np.cos(p) * np.sin(a)], axis=-1)
    return normals.reshape(-1, 3), _ring_faces(rings, sides)


def _ring_faces(rings: int, sides: int) -> NDArray[np.int64]:
    """Triangles (F, 3) between neighbouring rings of vertices."""
    made = []
    for ring in range(rings - 1):
        for side in range(sides):
            a, b = ring * sides + side, ring * sides + (side + 1) % sides
            made += [(a, b, b + sides), (a, b + sides, a + sides)]
    return np.array(made, dtype=np.int64)
