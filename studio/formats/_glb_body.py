"""An avatar's surfaces as glTF meshes, skins, materials and pictures."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio.formats._glb import Numbers
from studio.motion.avatar import MIRROR, Avatar, Floats, Surface, SurfaceMaterial

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
        joints, weights = _influences(surface, len(self._avatar.skeleton.bone_names))
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
        use = np.bincount(surface.joints.ravel(), surface.weights.ravel(), len(surface.binds))
        for i in np.argsort(use, kind="stable"):  # the bind that is used most is a bone's own
            owner = int(surface.owners[i])
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


def _influences(surface: Surface, bones: int) -> tuple[NDArray[np.uint16], Floats]:
    """The four bones that move each vertex most, (V, 4) each, as joints of the skin: 0 is the root."""
    owners = np.where(surface.owners < 0, 0, surface.owners + 1)[surface.joints]
    dense = np.zeros((len(owners), bones + 1), dtype=np.float32)
    rows = np.repeat(np.arange(len(owners)), owners.shape[1])
    np.add.at(dense, (rows, owners.ravel()), surface.weights.ravel())
    count = min(_INFLUENCES, bones + 1)
    joints = np.argsort(-dense, axis=1, kind="stable")[:, :count]
    weights = np.take_along_axis(dense, joints, axis=1)
    weights /= weights.sum(axis=1, keepdims=True)
    joints = np.where(weights > 0.0, joints, 0)  # an unused joint is written as 0
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
