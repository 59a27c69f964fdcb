"""An avatar: a humanoid of its own proportions with the surfaces and expressions it may have.

Bones are kept as everywhere else, in Unity's axes. Surfaces are kept in a picture's axes: right-handed, Y up,
facing +Z, metres, as in glTF and VRM 1.0; x is turned over between the two.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio.errors import say, together
from studio.motion import rotation
from studio.motion.expression import Expression, FaceMap
from studio.motion.look_at import Gaze, LookAt, asks, gaze_of, is_ahead, turned_by
from studio.motion.material import SurfaceMaterial
from studio.motion.neutral import ARMS_DOWN
from studio.motion.rig import Rig
from studio.motion.skeleton import Skeleton

Floats = NDArray[np.float32]
Array = NDArray[np.floating]

# Unity's axes are left-handed, a picture's right-handed: x is turned over, and turns about y and z with it.
MIRROR = np.array([-1.0, 1.0, 1.0])
MIRROR_TURN = np.array([1.0, -1.0, -1.0, 1.0])
# Rest hips this share away from the length of the legs are somebody who sat: the legs count then.
_STANDING = 0.2
# A face alone, of a webcam or a phone, must not stand there with its arms spread.
_HANGING = {
    f"{side}UpperArm": (
        rotation.from_axis_angle(np.array([0.0, 0.0, 1.0]), np.float64(angle)),
        frozenset(f"{side}{part}" for part in ("Shoulder", "UpperArm", "LowerArm", "Hand")),
    )
    for side, angle in (("Left", ARMS_DOWN), ("Right", -ARMS_DOWN))
}
"""How an upper arm hangs, and the bones of which one at least is tracked where it does not."""


@dataclass(frozen=True, eq=False)
class Morph:
    """How far some vertices of a surface move at full weight.

    Args:
        rows: which (n,).
        offsets: metres (n, 3).
        name: as the file calls it.
    """

    rows: NDArray[np.int32]
    offsets: Floats
    name: str = ""


@dataclass(frozen=True, eq=False)
class Surface:
    """Triangles that move with bones.

    Args:
        name: of its mesh.
        vertices, normals: (V, 3) before binding.
        uv: (V, 2), v from the top, or None.
        triangles: vertex indices (F, 3).
        joints, weights: which of the binds move each vertex, and how much, (V, K); weights sum to 1.
        binds: (B, 3, 4), from the vertices to the avatar at rest in a picture's axes.
        owners: the node each bind follows (B,), index into the avatar's rig, -1 for none.
        morphs: its morph targets.
        material: index among the avatar's materials.
    """

    name: str
    vertices: Floats
    normals: Floats
    uv: Floats | None
    triangles: NDArray[np.int32]
    joints: NDArray[np.int32]
    weights: Floats
    binds: Array
    owners: NDArray[np.int32]
    morphs: tuple[Morph, ...] = ()
    material: int = 0


FREE = "Free for any use (CC0)."


@dataclass(frozen=True)
class Licence:
    """What an avatar's file says about itself: its title, who made it, and what one may do, in sentences."""

    title: str = ""
    authors: tuple[str, ...] = ()
    terms: tuple[str, ...] = ()

    @property
    def free(self) -> bool:
        """Whether nobody has to heed anything."""
        return self.terms == (FREE,)

    @property
    def line(self) -> str:
        """All of it in one line."""
        by = say("By {authors}.", authors=", ".join(self.authors).rstrip(".")) if self.authors else ""
        return together(" ", by, *map(say, self.terms))


@dataclass(frozen=True, eq=False)
class Avatar:
    """A humanoid as its file has it.

    Args:
        name: for people.
        skeleton: J bones at rest in a T-pose, Unity's axes, each below the one it hangs from.
        surfaces: what is seen of it; none where the file has no meshes.
        materials: how they look.
        expressions: its named faces.
        licence: what the file says about itself.
        notes: what was left out while reading.
        rig: what moves of it beside its bones, which are its first nodes; None for nothing.
        look_at: what moves its eyes.
        drivers: what a person has said of what moves its expressions, see `FaceMap`.
    """

    name: str
    skeleton: Skeleton
    surfaces: tuple[Surface, ...] = ()
    materials: tuple[SurfaceMaterial, ...] = ()
    expressions: tuple[Expression, ...] = ()
    licence: Licence = Licence()
    notes: tuple[str, ...] = ()
    rig: Rig | None = None
    look_at: LookAt = field(default_factory=LookAt)
    drivers: Mapping[str, str] = field(default_factory=dict)

    @cached_property
    def rest_joints(self) -> Array:
        """Where the bones rest in the world, Unity's axes (J, 3)."""
        return self.skeleton.forward(self.skeleton.rest_positions, self.skeleton.rest_rotations)[0]

    @property
    def hips_height(self) -> float:
        """Metres from the ground to the hips at rest."""
        hips = _place(self.skeleton, "Hips")
        return float(self.rest_joints[hips, 1]) if hips >= 0 else 0.0

    @cached_property
    def skins(self) -> tuple[Skin, ...]:
        """What moves each surface; worked out once, in a moment: not first on a thread that draws."""
        count = len(self.rig.parents) if self.rig is not None else len(self.skeleton.bone_names)
        return tuple(Skin(surface, count) for surface in self.surfaces)

    def bone_owners(self, surface: Surface) -> NDArray[np.int32]:
        """The bone that each of a surface's binds follows, or hangs from at last (B,), -1 for none."""
        if self.rig is None:
            return surface.owners
        return np.where(surface.owners < 0, -1, self.rig.carriers[surface.owners])

    @property
    def has_face(self) -> bool:
        """Whether its expressions move anything."""
        return any(one.moves for one in self.expressions)

    def retargeted(
        self, source: Skeleton, joints: Array, turns: Array, scale: float | None = None
    ) -> tuple[Array, Array]:
        """How this avatar stands where another skeleton stands so.

        A bone that the source lacks follows its parent, but an arm that is not tracked at all hangs; one that
        the avatar lacks is in its children's turns. The hips are as far from the ground as
        their size asks for.

        Args:
            source: S bones.
            joints: world positions (..., S, 3).
            turns: world rotations, each the change from the T-pose (..., S, 4).
            scale: by how much the hips' moves grow; worked out by `scale_from` where None.

        Returns:
            World positions (..., J, 3) and changes from the T-pose (..., J, 4), Unity's axes.
        """
        own, lead = self.skeleton, joints.shape[:-2]
        scale = self.scale_from(source) if scale is None else scale
        p = np.broadcast_to(self.rest_joints, (*lead, len(own.bone_names), 3)).copy()
        q = np.broadcast_to(rotation.IDENTITY, (*lead, len(own.bone_names), 4)).copy()
        index = {name: j for j, name in enumerate(source.bone_names)}
        # Parents first: a bone that the source lacks follows its parent.
        for bone in own.order:
            parent, there = own.parents[bone], index.get(own.bone_names[bone])
            if there is not None:
                q[..., bone, :] = turns[..., there, :]
            elif parent >= 0:
                q[..., bone, :] = q[..., parent, :]
                if (hanging := _HANGING.get(own.bone_names[bone])) and not index.keys() & hanging[1]:
                    q[..., bone, :] = rotation.multiply(q[..., bone, :], hanging[0])
            if own.bone_names[bone] == "Hips":
                if there is not None:
                    p[..., bone, :] = joints[..., there, :] * scale
            elif parent >= 0:
                offset = np.broadcast_to(own.rest_positions[bone], (*lead, 3))
                p[..., bone, :] = p[..., parent, :] + rotation.rotate(q[..., parent, :], offset)
        return p, q

    def scale_from(self, source: Skeleton) -> float:
        """By how much hips that move in a source's metres move here."""
        height = _hips_height(source)
        return self.hips_height / height if height > 0.05 and self.hips_height > 0.0 else 1.0

    def placements(self, positions: Array, turns: Array) -> Array:
        """What moves the binds of each node from rest to where `retargeted` has it; nothing swings.

        Args:
            positions, turns: of one moment, (J, 3) and (J, 4), Unity's axes.

        Returns:
            (N + 1, 3, 4) in a picture's axes; the last one is for binds that follow no node. Without a rig
            the nodes are the J bones.
        """
        made = np.zeros((len(positions) + 1, 3, 4))
        made[-1, :, :3] = np.eye(3)
        turned = rotation.to_matrix(turns * MIRROR_TURN)
        made[:-1, :, :3] = turned
        made[:-1, :, 3] = positions * MIRROR - np.einsum("jab,jb->ja", turned, self.rest_joints * MIRROR)
        return made if self.rig is None else self.rig.posed(made)

    @cached_property
    def face(self) -> FaceMap:
        """Which blend shapes move its expressions."""
        return FaceMap(self.expressions, self.drivers)

    def driven_by(self, drivers: Mapping[str, str]) -> Avatar:
        """The same avatar with other blend shapes moving its expressions, see `FaceMap`."""
        made = replace(self, drivers=dict(drivers))
        # What takes long to work out is the same.
        made.__dict__["skins"] = self.skins
        return made

    def morph_weights(self, shapes: Mapping[str, float]) -> list[Floats]:
        """How far each surface's morph targets are moved by blend shapes of any set, (M,) each."""
        weights = [np.zeros(len(surface.morphs), dtype=np.float32) for surface in self.surfaces]
        for expression, amount in self.face.played(shapes):
            for surface, morph, weight in expression.binds:
                weights[surface][morph] += weight * amount
        return weights

    def looking(
        self, turns: Array, shapes: Mapping[str, float], eyes: Mapping[str, Gaze]
    ) -> tuple[Array, Mapping[str, float]]:
        """Turns and blend shapes with what a gaze adds to them.

        Args:
            turns: changes from the T-pose (J, 4), Unity's axes, as `retargeted` has them.
            shapes: blend shapes of any set.
            eyes: where the source's eye bones look, "left" and "right", those it has.
        """
        arkit, presets = asks(shapes)
        # What its own expressions show needs no eye bones.
        if any(self._shows(name) for name in arkit):
            arkit = {}
        moved = any(not is_ahead(*gaze) for gaze in eyes.values())
        own = {side: _place(self.skeleton, f"{side.title()}Eye") for side in ("left", "right")}
        if self.look_at.by_bones and max(own.values()) >= 0:
            share = self.face.weights(shapes)[1]["lookAt"]
            presets = {name: weight for name, weight in presets.items() if not self._shows(name)}
            if (moved and share == 1.0) or not (moved or arkit or presets):
                return turns, shapes
            turns = np.array(turns)
            for side, bone in own.items():
                if bone < 0:
                    continue
                if moved:
                    across, down = eyes.get(side) or next(iter(eyes.values()))
                else:
                    gaze = gaze_of(arkit, side) if arkit else self.look_at.of_presets(side, presets)
                    across, down = self.look_at.turn(side, *gaze)
                above = self.skeleton.parents[bone]
                head = turns[above] if above >= 0 else rotation.IDENTITY
                turn = turned_by(across * share, down * share) * MIRROR_TURN
                turns[bone] = rotation.multiply(head, turn)
            return turns, shapes
        if presets or not (moved or arkit):
            return turns, shapes
        gazes = list(eyes.values()) if moved else [gaze_of(arkit, side) for side in own]
        yaw, pitch = (float(angle) for angle in np.mean(gazes, axis=0))
        return turns, {**shapes, **self.look_at.weights(yaw, pitch)}

    def _shows(self, name: str) -> bool:
        """Whether a blend shape moves something of it."""
        return any(one.moves for one in self.face.moved_by(name))

    @cached_property
    def changing_parts(self) -> dict[int, frozenset[str]]:
        """Which parts of which materials expressions may change."""
        found: dict[int, frozenset[str]] = {}
        for one in self.expressions:
            for bind in one.looks:
                found[bind.material] = found.get(bind.material, frozenset()) | {bind.part}
        return found

    def material_values(self, shapes: Mapping[str, float]) -> dict[int, dict[str, tuple[float, ...]]]:
        """What blend shapes make of `changing_parts`, by material and part."""
        made = {
            i: {part: self.materials[i].value(part) or () for part in parts}
            for i, parts in self.changing_parts.items()
        }
        for expression, amount in self.face.played(shapes) if made else ():
            for bind in expression.looks:
                rest = self.materials[bind.material].value(bind.part) or ()
                now = made[bind.material][bind.part]
                made[bind.material][bind.part] = tuple(
                    n + amount * (full - r) for n, r, full in zip(now, rest, bind.value, strict=True)
                )
        return made


def _place(skeleton: Skeleton, bone: str) -> int:
    return skeleton.bone_names.index(bone) if bone in skeleton.bone_names else -1


def _hips_height(skeleton: Skeleton) -> float:
    """How high somebody's hips are when they stand: as they rest, or as long as their legs if they sat."""
    hips = _place(skeleton, "Hips")
    if hips < 0:
        return 0.0
    rest = float(skeleton.rest_positions[hips, 1])
    leg = [_place(skeleton, f"Left{part}") for part in ("UpperLeg", "LowerLeg", "Foot")]
    if min(leg) < 0:
        return rest
    length = float(np.linalg.norm(skeleton.rest_positions[leg[1:]], axis=1).sum())
    # And the ankle above the sole.
    length = (length - float(skeleton.rest_positions[leg[0], 1])) * 1.09
    return rest if abs(rest - length) < _STANDING * length else length


class Skin:
    """A surface made ready to be moved at the display's rate, on one thread.

    Binds that agree, as all do in a file whose rest pose is its bind pose, are put into the vertices once, so
    that hair and skirt bones that follow one bone of the body cost nothing more than it.
    """

    def __init__(self, surface: Surface, nodes: int) -> None:
        """Args: surface: what is moved. nodes: how many the avatar has that move it."""
        from scipy import sparse

        self._owners = np.where(surface.owners < 0, nodes, surface.owners)
        self._binds = np.asarray(surface.binds, dtype=np.float64)
        count = len(surface.vertices)
        columns, turn = surface.joints, np.eye(3)
        self._rest = surface.vertices.astype(np.float32)
        # 1e-5 is below what float32 keeps of a metre.
        self._agree = bool(np.abs(self._binds - self._binds[:1]).max(initial=0.0) < 1e-5)
        if self._agree:
            turn, shift = self._binds[0, :, :3], self._binds[0, :, 3]
            self._rest = (surface.vertices @ turn.T + shift).astype(np.float32)
            columns = self._owners[columns]
        rows = np.repeat(np.arange(count), columns.shape[1])
        shape = (count, nodes + 1 if self._agree else len(self._binds))
        entries = (surface.weights.ravel(), (rows, columns.ravel()))
        self._weights: Any = sparse.csr_matrix(entries, shape=shape, dtype=np.float32)
        self._weights.sum_duplicates()
        self._normals = (surface.normals @ _normal_turn(turn).T).astype(np.float32)
        # One matrix (3 V, M), so that a face of fifty shapes costs no more than one of ten.
        coordinates = [(m.rows[:, None] * 3 + np.arange(3)).ravel() for m in surface.morphs]
        shape = (3 * count, len(surface.morphs))
        self._morphs: Any = sparse.csr_matrix(shape, dtype=np.float32)
        if any(map(len, coordinates)):
            offsets = np.concatenate([(m.offsets @ turn.T).ravel() for m in surface.morphs])
            columns = np.repeat(np.arange(shape[1]), [len(one) for one in coordinates])
            entries = (offsets.astype(np.float32), (np.concatenate(coordinates), columns))
            self._morphs = sparse.csr_matrix(entries, shape=shape)
        self._moved = (np.zeros(shape[1], np.float32), self._rest)

    def pose(self, placements: Array, morphs: Floats) -> tuple[Floats, Floats]:
        """Vertices and normals (V, 3) in a picture's axes; normals are not of unit length.

        Args:
            placements: (N + 1, 3, 4) of `Avatar.placements`.
            morphs: weights (M,) of `Avatar.morph_weights`.
        """
        moves = placements.astype(np.float32)
        if not self._agree:
            own = placements[self._owners]
            moves = np.concatenate(
                [own[:, :, :3] @ self._binds[:, :, :3],
                 own[:, :, :3] @ self._binds[:, :, 3:] + own[:, :, 3:]], axis=2,
            ).astype(np.float32)  # fmt: skip
        blended: NDArray[np.float32] = (self._weights @ moves.reshape(len(moves), 12)).reshape(-1, 3, 4)
        rest = self._morphed(morphs)
        vertices = np.einsum("vab,vb->va", blended[:, :, :3], rest) + blended[:, :, 3]
        return vertices, np.einsum("vab,vb->va", blended[:, :, :3], self._normals)

    def _morphed(self, weights: Floats) -> Floats:
        """The vertices moved as far as the weights say; those of the time before where these are the same."""
        before, moved = self._moved
        if not np.array_equal(weights, before):
            moved = self._rest
            if weights.any():
                moved = self._rest + (self._morphs @ weights).reshape(-1, 3)
            self._moved = (weights.copy(), moved)
        return moved


def _normal_turn(turn: Array) -> Array:
    """What turns normals where `turn` (3, 3) turns vertices."""
    determinant = float(np.linalg.det(turn))
    return np.linalg.inv(turn).T if abs(determinant) > 1e-12 else turn
