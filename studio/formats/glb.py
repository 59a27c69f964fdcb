"""glTF in one file (.glb): a body or an avatar with its skeleton, its face as morph targets, and the motion.

Right-handed, Y up, facing +Z, metres, as glTF has it: Unity's X is turned over. Bones rest without any turn,
so a rotation is the change from the T-pose.
Source: Khronos glTF 2.0, sections 3.7 (meshes, skins) and 3.11 (animations).
"""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio.errors import RequestError, say
from studio.formats import _glb
from studio.formats._glb import Glb, Numbers, entry
from studio.formats._table import check_suffix
from studio.formats._writing import DEFAULT_FPS, checked, grounded_body, on_grid
from studio.formats.vrma import rest_skeleton
from studio.motion import Motion, Skeleton, rotation
from studio.motion.avatar import MIRROR, MIRROR_TURN, Avatar, Floats, Surface
from studio.motion.material import SurfaceMaterial
from studio.render.face import fitted
from studio.render.mannequin import mannequin

_INFLUENCES = 4


class Body:
    """Collects what a document needs of an avatar's surfaces.

    Args:
        numbers: the block of numbers they are added to.
        avatar: whose they are; its bones are nodes 1 to J, a root is node 0.
    """

    def __init__(self, numbers: Numbers, avatar: Avatar) -> None:
        self._numbers, self._avatar = numbers, avatar
        self._meshes: list[dict[str, Any]] = []
        self._materials: dict[int, int] = {}
        self._written: list[dict[str, Any]] = []
        self._pictures: list[int] = []
        self._skins: list[NDArray[np.float64]] = []

    def add(self, index: int, moving: NDArray[np.intp]) -> dict[str, Any]:
        """Add a surface with those of its morph targets that move; gives its node."""
        surface = self._avatar.surfaces[index]
        joints, weights = _influences(
            surface, self._avatar.bone_owners(surface), len(self._avatar.skeleton.bone_names)
        )
        add = self._numbers
        attributes = {
            "POSITION": add.add(surface.vertices, bounds=True), "NORMAL": add.add(_unit(surface.normals)),
            "JOINTS_0": add.add_whole(joints), "WEIGHTS_0": add.add(weights),
        }  # fmt: skip
        if surface.uv is not None:
            attributes["TEXCOORD_0"] = add.add(surface.uv)
        primitive: dict[str, Any] = {
            "attributes": attributes,
            "indices": add.add_whole(surface.triangles.reshape(-1).astype(np.uint32)),
            "material": self._material(surface.material),
        }
        mesh: dict[str, Any] = {"name": surface.name or f"Surface {index}", "primitives": [primitive]}
        if len(moving):
            primitive["targets"] = [self._target(surface, int(m)) for m in moving]
            mesh["weights"] = [0.0] * len(moving)
            mesh["extras"] = {"targetNames": [self._name(index, int(m)) for m in moving]}
        self._meshes.append(mesh)
        return {"name": mesh["name"], "mesh": len(self._meshes) - 1, "skin": self._skin(surface)}

    def document(self) -> dict[str, Any]:
        """The parts of a document that are about surfaces; nothing where there are none."""
        if not self._meshes:
            return {}
        made: dict[str, Any] = {
            "meshes": self._meshes,
            "materials": self._written,
            "skins": [self._described_skin(binds) for binds in self._skins],
        }
        if self._pictures:
            made["images"] = [{"bufferView": view, "mimeType": "image/png"} for view in self._pictures]
            made["textures"] = [{"source": i} for i in range(len(self._pictures))]
        return made

    def _skin(self, surface: Surface) -> int:
        """The skin of a surface: for the root and each bone, from its vertices to the bone at rest."""
        rest, count = self._avatar.rest_joints * MIRROR, len(self._avatar.rest_joints)
        binds = np.tile(np.eye(4), (count + 1, 1, 1))
        binds[1:, :3, 3] = -rest
        owners = self._avatar.bone_owners(surface)
        use = np.bincount(surface.joints.ravel(), surface.weights.ravel(), len(surface.binds))
        # The bind that is used most is a bone's own.
        for i in np.argsort(use, kind="stable"):
            owner = int(owners[i])
            binds[owner + 1, :3] = surface.binds[i]
            if owner >= 0:
                binds[owner + 1, :3, 3] -= rest[owner]
        for known, other in enumerate(self._skins):
            if np.array_equal(binds, other):
                return known
        self._skins.append(binds)
        return len(self._skins) - 1

    def _described_skin(self, binds: NDArray[np.float64]) -> dict[str, Any]:
        matrices = self._numbers.add(binds.transpose(0, 2, 1).reshape(len(binds), 16))
        self._numbers.accessors[matrices]["type"] = "MAT4"
        return {"joints": [*range(len(binds))], "inverseBindMatrices": matrices, "skeleton": 0}

    def _target(self, surface: Surface, morph: int) -> dict[str, int]:
        moved = np.zeros_like(surface.vertices)
        moved[surface.morphs[morph].rows] = surface.morphs[morph].offsets
        return {"POSITION": self._numbers.add(moved, bounds=True)}

    def _name(self, surface: int, morph: int) -> str:
        """The expression that moves a morph target most, or its number."""
        found = [
            (weight, one.name)
            for one in self._avatar.expressions
            for where, which, weight in one.binds
            if (where, which) == (surface, morph)
        ]
        return max(found)[1] if found else f"Target {morph}"

    def _material(self, index: int) -> int:
        if index not in self._materials:
            self._materials[index] = len(self._written)
            self._written.append(self._described(self._avatar.materials[index]))
        return self._materials[index]

    def _described(self, material: SurfaceMaterial) -> dict[str, Any]:
        base: dict[str, Any] = {
            "baseColorFactor": [float(value) for value in material.colour],
            # Near to how avatars are painted; glTF's defaults would make them metal.
            "metallicFactor": 0.0, "roughnessFactor": 0.9,
        }  # fmt: skip
        if material.picture is not None:
            base["baseColorTexture"] = {"index": len(self._pictures)}
            self._pictures.append(self._numbers.attach(_png(material.picture)))
        made: dict[str, Any] = {"pbrMetallicRoughness": base, "doubleSided": material.two_sided}
        if material.mode != "OPAQUE":
            made["alphaMode"] = material.mode
        if material.mode == "MASK":
            made["alphaCutoff"] = material.cutoff
        return made


def _influences(surface: Surface, owners: NDArray[np.int32], bones: int) -> tuple[NDArray[np.uint16], Floats]:
    """The four bones that move each vertex most, (V, 4) each, as joints of the skin: 0 is the root."""
    owners = np.where(owners < 0, 0, owners + 1)[surface.joints]
    dense = np.zeros((len(owners), bones + 1), dtype=np.float32)
    rows = np.repeat(np.arange(len(owners)), owners.shape[1])
    np.add.at(dense, (rows, owners.ravel()), surface.weights.ravel())
    # glTF readers need not take more than four bones a vertex.
    count = min(_INFLUENCES, bones + 1)
    joints = np.argsort(-dense, axis=1, kind="stable")[:, :count]
    weights = np.take_along_axis(dense, joints, axis=1)
    weights /= weights.sum(axis=1, keepdims=True)
    # An unused joint is written as 0.
    joints = np.where(weights > 0.0, joints, 0)
    space = ((0, 0), (0, _INFLUENCES - count))
    return np.pad(joints, space).astype(np.uint16), np.pad(weights, space).astype(np.float32)


def _unit(normals: Floats) -> Floats:
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    up = np.array([0.0, 1.0, 0.0], dtype=np.float32)
    return np.where(length > 1e-6, normals / np.maximum(length, 1e-6), up).astype(np.float32)


def _png(pixels: NDArray[np.uint8]) -> bytes:
    from PIL import Image

    data = io.BytesIO()
    Image.fromarray(np.ascontiguousarray(pixels)).save(data, "PNG")
    return data.getvalue()


TITLE = "glTF"
SUFFIX = ".glb"
NOTE = (
    "Skeleton, body and face in one file for Blender, Unity, Unreal and the web; no sound. An avatar keeps "
    "its surfaces, colours and pictures, not its VRM settings, its hair that swings or its shaders. Share it "
    "only as the avatar's own terms allow."
)
WEARS = True

_TOLERANCE_M = 0.001
_TOLERANCE_RADIANS = np.radians(0.1)
_FRAMES_COMPARED = 500

Array = NDArray[np.floating]


def write(
    path: Path, motion: Motion, audio: Path | None = None, avatar: Path | None = None
) -> tuple[Path, ...]:
    """Write a body with its motion, on an even grid from the sound's first moment on.

    Args:
        path: ends in .glb.
        motion: its median rate is kept; without bones a body at rest carries the face.
        audio: not written; a GLB has no sound.
        avatar: a .vrm that wears the motion; a plain body where None.

    Returns:
        The file, read back and compared by forward kinematics.
    """
    check_suffix(path, SUFFIX)
    if not len(motion) or not (motion.bone_names or motion.shape_names):
        raise RequestError(
            say("There is no motion to write to {name}.", name=path.name), "Choose a take with motion."
        )
    even = on_grid(motion, motion.fps or DEFAULT_FPS)
    moved_body = _retargeted(avatar, even)
    positions, turns = _moved(moved_body, even, None if avatar is not None else 1.0)
    weights = _weights(moved_body, even)
    document, numbers = _document(moved_body, even.times, positions, turns, weights)
    return checked(
        path,
        lambda beside: _glb.write(beside, document, numbers),
        lambda beside: _fits(beside, moved_body.skeleton, even.times, positions, turns, weights),
    )


def _retargeted(avatar: Path | None, motion: Motion) -> Avatar:
    if avatar is not None:
        from studio.formats._vrm import avatar as _vrm

        return _vrm.read(avatar)
    body = grounded_body(motion)
    skeleton = rest_skeleton(body.skeleton) if body is not None else Skeleton.humanoid()
    return mannequin(skeleton, motion.shape_names)


def _moved(avatar: Avatar, motion: Motion, scale: float | None) -> tuple[Array, Array]:
    """World positions and turns of the avatar's bones (T, J, 3) and (T, J, 4), Unity's axes."""
    body = grounded_body(motion)
    if body is None:
        joints = np.tile(avatar.rest_joints, (len(motion), 1, 1))
        return joints, np.tile(rotation.IDENTITY, (*joints.shape[:2], 1))
    return avatar.retargeted(body.skeleton, *body.skeleton.forward(body.positions, body.rotations), scale)


def _weights(avatar: Avatar, motion: Motion) -> list[Array]:
    """How far each surface's morph targets are moved, (T, M) each."""
    made: list[Array] = [np.zeros((len(motion), len(surface.morphs))) for surface in avatar.surfaces]
    if not avatar.has_face:
        return made
    names = motion.shape_names
    for t, row in enumerate(motion.shapes.tolist()):
        shapes = fitted(avatar, dict(zip(names, row, strict=True)))
        for surface, weights in enumerate(avatar.morph_weights(shapes)):
            made[surface][t] = weights
    return made


def _document(
    avatar: Avatar, times: Array, positions: Array, turns: Array, weights: list[Array]
) -> tuple[dict[str, Any], Numbers]:
    numbers, skeleton = Numbers(), avatar.skeleton
    nodes = _bone_nodes(avatar)
    at = numbers.add(times, bounds=True)
    tracks: list[tuple[int, str, int]] = []
    local_p, local_q = _local(skeleton, positions, turns)
    for j, name in enumerate(skeleton.bone_names):
        if name == "Hips":
            tracks.append((j + 1, "translation", numbers.add(local_p[:, j] * MIRROR)))
        tracks.append((j + 1, "rotation", numbers.add(local_q[:, j] * MIRROR_TURN)))
    body = Body(numbers, avatar)
    for i, own in enumerate(weights):
        moving = np.flatnonzero(np.abs(own).max(axis=0, initial=0.0) > 0.0)
        node = body.add(i, moving)
        if len(moving):
            tracks.append((len(nodes), "weights", numbers.add(own[:, moving].ravel())))
        nodes.append(node)
    document = {
        "asset": {"version": "2.0", "generator": "Saia Studio"},
        "scene": 0,
        "scenes": [{"nodes": [0, *range(len(skeleton.bone_names) + 1, len(nodes))]}],
        "nodes": nodes,
        "animations": [_animation(tracks, at)],
        **body.document(),
    }
    return document, numbers


def _bone_nodes(avatar: Avatar) -> list[dict[str, Any]]:
    """A root, and each bone at its place in the list plus one."""
    skeleton = avatar.skeleton
    nodes: list[dict[str, Any]] = [{"name": "Root", "children": []}]
    for name, offset in zip(skeleton.bone_names, skeleton.rest_positions * MIRROR + 0.0, strict=True):
        nodes.append({"name": name, "translation": offset.tolist()})
    for j, parent in enumerate(skeleton.parents):
        nodes[parent + 1].setdefault("children", []).append(j + 1)
    return nodes


def _local(skeleton: Skeleton, positions: Array, turns: Array) -> tuple[Array, Array]:
    """Each bone against its parent, (T, J, 3) and (T, J, 4); turns without jumps of sign."""
    p, q = positions.copy(), turns.copy()
    for j, parent in enumerate(skeleton.parents):
        if parent >= 0:
            back = rotation.inverse(turns[:, parent])
            p[:, j] = rotation.rotate(back, positions[:, j] - positions[:, parent])
            q[:, j] = rotation.multiply(back, turns[:, j])
    return p, rotation.sign_continuous(rotation.normalised(q))


def _animation(tracks: list[tuple[int, str, int]], times: int) -> dict[str, Any]:
    samplers = [{"input": times, "output": out, "interpolation": "LINEAR"} for _, _, out in tracks]
    channels = [{"sampler": i, "target": {"node": n, "path": p}} for i, (n, p, _) in enumerate(tracks)]
    return {"name": "Motion", "samplers": samplers, "channels": channels}


def _fits(
    path: Path, skeleton: Skeleton, times: Array, positions: Array, turns: Array, weights: list[Array]
) -> bool:
    """Whether a file holds what was to be written: all times and weights, and bones all over it."""
    glb = _glb.read(path)
    tracks = _tracks(glb)
    count = len(skeleton.bone_names)
    wanted = [own[:, np.abs(own).max(axis=0, initial=0.0) > 0.0] for own in weights]
    same = np.allclose(glb.numbers(0), times, rtol=0, atol=1e-3)
    for i, own in enumerate(wanted):
        got = tracks.get((count + 1 + i, "weights"), np.zeros(0))
        same = same and got.size == own.size and bool(np.abs(got - own.ravel()).max(initial=0.0) < 1e-5)
    rows = np.unique(np.linspace(0, len(times) - 1, _FRAMES_COMPARED).astype(int))
    p, q = _read_bones(glb, tracks, skeleton, rows)
    far = np.abs(p - positions[rows]).max(initial=0.0)
    angle = rotation.angle_between(q, turns[rows]).max(initial=0.0)
    return bool(same and far <= _TOLERANCE_M and angle <= _TOLERANCE_RADIANS)


def _tracks(glb: Glb) -> dict[tuple[int, str], Array]:
    """The values of each channel by node and path."""
    animation = entry(glb.document, "animations", 0)
    return {
        (channel["target"]["node"], channel["target"]["path"]): glb.numbers(
            entry(animation, "samplers", channel["sampler"])["output"]
        )
        for channel in animation["channels"]
    }


def _read_bones(
    glb: Glb, tracks: dict[tuple[int, str], Array], skeleton: Skeleton, rows: NDArray[np.intp]
) -> tuple[Array, Array]:
    """World positions and turns of the bones as the file's own nodes and channels put them."""
    nodes, count = glb.document["nodes"], len(skeleton.bone_names)
    parents = {child: up for up, node in enumerate(nodes) for child in node.get("children", ())}
    rest = np.array([nodes[j + 1]["translation"] for j in range(count)])
    read = Skeleton(
        tuple(nodes[j + 1]["name"] for j in range(count)), tuple(parents[j + 1] - 1 for j in range(count)),
        rest * MIRROR, np.tile(rotation.IDENTITY, (count, 1)),
    )  # fmt: skip
    p = np.tile(read.rest_positions, (len(rows), 1, 1))
    q = np.stack([tracks[j + 1, "rotation"][rows] for j in range(count)], axis=1) * MIRROR_TURN
    for j in range(count):
        if (j + 1, "translation") in tracks:
            p[:, j] = tracks[j + 1, "translation"][rows] * MIRROR
    return read.forward(p, q)
