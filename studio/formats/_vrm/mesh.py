"""The meshes of an avatar's file: one surface for each part of each mesh that a node shows."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio.errors import StudioError, say
from studio.formats._glb import Glb, entry
from studio.motion import rotation
from studio.motion.avatar import Floats, Morph, Surface

MOST_NODES = 50_000
# Half a turn about Y: a VRM 0 faces -Z.
_AROUND = np.diag([-1.0, 1.0, -1.0, 1.0])


@dataclass(frozen=True, eq=False)
class Nodes:
    """All nodes: parents (N,) with -1 for a root, world rest matrices (N, 4, 4) of an avatar facing +Z,
    and an order with every parent before its children."""

    parents: list[int]
    world: NDArray[np.float64]
    order: list[int]

    @classmethod
    def of(cls, glb: Glb, turned: bool) -> Nodes:
        """Those of a file; ValueError where they hang in a circle or from two parents.

        Args:
            glb: the file.
            turned: whether everything is turned around once.
        """
        count = len(glb.document["nodes"])
        if count > MOST_NODES:
            raise ValueError(count)
        entries = [entry(glb.document, "nodes", i) for i in range(count)]
        parents = [-1] * count
        for i, node in enumerate(entries):
            for child in node.get("children", ()):
                if not isinstance(child, int) or not 0 <= child < count or parents[child] >= 0:
                    raise ValueError(child)
                parents[child] = i
        order = [i for i in range(count) if parents[i] < 0]
        # Grows while it is walked.
        for i in order:
            order += entries[i].get("children", ())
        if len(order) != count:
            raise ValueError("nodes hang in a circle")
        world, root = np.zeros((count, 4, 4)), _AROUND if turned else np.eye(4)
        # Of damaged files; looked at below.
        with np.errstate(over="ignore", invalid="ignore"):
            for i in order:
                world[i] = (world[parents[i]] if parents[i] >= 0 else root) @ _local(entries[i])
        if not np.isfinite(world).all():
            raise ValueError("nodes stand nowhere")
        return cls(parents, world, order)

    def owners(self, bones: list[int], strictly: bool = False) -> NDArray[np.int32]:
        """For each node the place in `bones` of the nearest of them above it, -1 for none; itself counts
        unless `strictly`."""
        place = {node: j for j, node in enumerate(bones)}
        nearest = np.full(len(self.parents), -1, dtype=np.int32)
        above = nearest.copy()
        for i in self.order:
            if self.parents[i] >= 0:
                above[i] = nearest[self.parents[i]]
            nearest[i] = place.get(i, above[i])
        return above if strictly else nearest


def _local(node: dict[str, Any]) -> NDArray[np.float64]:
    """The matrix (4, 4) of a node against its parent."""
    if "matrix" in node:
        return np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
    made = np.eye(4)
    q = np.array(node.get("rotation", (0, 0, 0, 1)), dtype=np.float64).reshape(4)
    scale = np.array(node.get("scale", (1, 1, 1)), dtype=np.float64).reshape(3)
    made[:3, :3] = rotation.to_matrix(rotation.normalised(q)) * scale
    made[:3, 3] = np.array(node.get("translation", (0, 0, 0)), dtype=np.float64).reshape(3)
    if not (np.isfinite(q).all() and np.isfinite(made).all()):
        raise ValueError(node)
    return made


MOST_VERTICES = 800_000
MOST_TRIANGLES = 1_600_000
"""Twice as many take a quarter of a second a picture where no graphics card helps."""
MOST_SURFACES = 1000
"""Each is drawn by itself, however small: 12,000 took a second a picture. Avatars have some ten."""
MOST_TARGETS = 20_000
"""Morph targets of all parts: a face has up to some hundred, and some ten parts."""
MOST_NUMBERS = 150_000_000
"""Numbers that all arrays together may hold while being read: a small file can name one array often."""
_TRIANGLES = 4


@dataclass(frozen=True, eq=False)
class Meshes:
    """What was read.

    Args:
        surfaces: in the order of the nodes.
        by_node, by_mesh: which surfaces a node or a mesh of the file became.
        notes: what was left out.
    """

    surfaces: tuple[Surface, ...]
    by_node: dict[int, list[int]]
    by_mesh: dict[int, list[int]]
    notes: tuple[str, ...]


def read(glb: Glb, nodes: Nodes, owners: NDArray[np.int32], unseen: frozenset[int] = frozenset()) -> Meshes:
    """All surfaces, each with only the vertices it uses.

    Args:
        glb: the file.
        nodes: where its nodes rest.
        owners: the bone that each node follows (N,), -1 for none.
        unseen: nodes whose meshes are left out.
    """
    return _Reader(glb, nodes, owners).read(unseen)


def too_large(path: Path) -> StudioError:
    """What to say of an avatar beyond what a screen could show."""
    return StudioError(
        say("{name} is too large to show.", name=path.name),
        "Choose an avatar with fewer polygons, or use the stick figure.",
    )


class _Reader:
    def __init__(self, glb: Glb, nodes: Nodes, owners: NDArray[np.int32]) -> None:
        self._glb, self._nodes, self._owners = glb, nodes, owners
        self._vertices = self._triangles = self._targets = self._numbers = self._left_out = 0
        self._made: list[Surface] = []

    def read(self, unseen: frozenset[int]) -> Meshes:
        """Go through the nodes."""
        by_node, by_mesh = dict[int, list[int]](), dict[int, list[int]]()
        for index, node in enumerate(self._glb.document["nodes"]):
            if "mesh" not in node:
                continue
            first, mesh = len(self._made), entry(self._glb.document, "meshes", node["mesh"])
            for primitive in mesh["primitives"] if index not in unseen else ():
                self._add(index, node, str(mesh.get("name", "")), primitive, _target_names(mesh, primitive))
            places = list(range(first, len(self._made)))
            by_node[index] = places
            by_mesh.setdefault(node["mesh"], []).extend(places)
        notes = ["Parts of it are stored in a way the studio cannot show."] if self._left_out else []
        return Meshes(tuple(self._made), by_node, by_mesh, tuple(notes))

    def _add(
        self, index: int, node: dict[str, Any], name: str, primitive: dict[str, Any], targets: list[str]
    ) -> None:
        packed = "KHR_draco_mesh_compression" in primitive.get("extensions", {})
        if primitive.get("mode", _TRIANGLES) != _TRIANGLES or packed:
            self._left_out += 1
            return
        if len(self._made) >= MOST_SURFACES:
            raise too_large(self._glb.path)
        attributes = primitive["attributes"]
        at = self._floats(attributes["POSITION"], 3)
        corners = self._corners(primitive, len(at))
        used, triangles = np.unique(corners, return_inverse=True)
        self._vertices += len(used)
        self._triangles += len(corners) // 3
        self._targets += len(primitive.get("targets", ()))
        counted = (self._vertices, self._triangles, self._targets)
        if any(
            n > most for n, most in zip(counted, (MOST_VERTICES, MOST_TRIANGLES, MOST_TARGETS), strict=True)
        ):
            raise too_large(self._glb.path)
        faces = triangles.reshape(-1, 3).astype(np.int32)
        at = at[used]
        normals = self._floats(attributes["NORMAL"], 3)[used] if "NORMAL" in attributes else None
        uv = self._floats(attributes["TEXCOORD_0"], 2)[used] if "TEXCOORD_0" in attributes else None
        joints, weights, binds, owners = self._skin(index, node, attributes, used)
        material = primitive.get("material", -1)
        if not isinstance(material, int) or not -1 <= material < len(self._glb.document.get("materials", ())):
            raise IndexError(material)
        self._made.append(
            Surface(
                name, at, normals if normals is not None else _normals(at, faces), uv, faces, joints, weights,
                binds, owners, tuple(
                    self._morph(target, used, targets[i] if i < len(targets) else "")
                    for i, target in enumerate(primitive.get("targets", ()))
                ),
                material,
            )
        )  # fmt: skip

    def _corners(self, primitive: dict[str, Any], count: int) -> NDArray[np.int64]:
        """Vertex indices (3 F,) of all triangles."""
        if "indices" in primitive:
            corners = self._table(primitive["indices"]).astype(np.int64)[:, 0]
        else:
            corners = np.arange(count)
        corners = corners[: len(corners) // 3 * 3]
        if not len(corners) or corners.min() < 0 or corners.max() >= count:
            raise IndexError("a triangle uses a vertex that does not exist")
        return corners

    def _skin(
        self, index: int, node: dict[str, Any], attributes: dict[str, Any], used: NDArray[np.int64]
    ) -> tuple[NDArray[np.int32], Floats, NDArray[np.float64], NDArray[np.int32]]:
        """Joints and weights (V, K), binds (B, 3, 4) and their owners (B,)."""
        if "skin" not in node or "JOINTS_0" not in attributes:
            still = np.zeros((len(used), 1), dtype=np.int32)
            return (
                still,
                np.ones((len(used), 1), np.float32),
                self._nodes.world[[index], :3],
                self._owners[[index]],
            )
        skin = entry(self._glb.document, "skins", node["skin"])
        places = [self._node(place) for place in skin["joints"]]
        binds = self._nodes.world[places]
        if "inverseBindMatrices" in skin:
            given = self._floats(skin["inverseBindMatrices"], 16).astype(np.float64)
            binds = binds @ given[: len(places)].reshape(-1, 4, 4).transpose(0, 2, 1)
        sets = [s for s in range(4) if f"JOINTS_{s}" in attributes and f"WEIGHTS_{s}" in attributes]
        joints = np.concatenate([self._table(attributes[f"JOINTS_{s}"])[used] for s in sets], axis=1)
        weights = np.concatenate([self._floats(attributes[f"WEIGHTS_{s}"], 4)[used] for s in sets], axis=1)
        if joints.max(initial=0) >= len(places) or not np.isfinite(binds).all():
            raise IndexError("a vertex uses a joint that does not exist")
        joints = np.where(weights > 0.0, joints, 0)
        return joints.astype(np.int32), _shares(weights), binds[:, :3], self._owners[places]

    def _morph(self, target: dict[str, Any], used: NDArray[np.int64], name: str) -> Morph:
        if "POSITION" not in target:
            return Morph(np.zeros(0, np.int32), np.zeros((0, 3), np.float32), name)
        offsets = self._floats(target["POSITION"], 3)[used]
        rows = np.flatnonzero(np.abs(offsets).max(axis=1) > 1e-7)
        return Morph(rows.astype(np.int32), offsets[rows], name)

    def _node(self, place: Any) -> int:
        if not isinstance(place, int) or not 0 <= place < len(self._owners):
            raise IndexError(place)
        return place

    def _floats(self, index: int, width: int) -> Floats:
        """Values (T, width), whole numbers as shares of their largest."""
        table = self._table(index)
        if table.shape[1] != width:
            raise ValueError(table.shape)
        if table.dtype.kind == "f":
            return table.astype(np.float32)
        return np.maximum(table.astype(np.float32) / np.iinfo(table.dtype).max, -1.0)

    def _table(self, index: int) -> NDArray[Any]:
        table = self._glb.table(index, MOST_VERTICES)
        self._numbers += table.size
        if self._numbers > MOST_NUMBERS:
            raise too_large(self._glb.path)
        return table


def _target_names(mesh: dict[str, Any], primitive: dict[str, Any]) -> list[str]:
    """What morph targets are called, which glTF leaves to its writers: most put it here."""
    for table in (mesh, primitive):
        extras = table.get("extras")
        names = extras.get("targetNames") if isinstance(extras, dict) else None
        if isinstance(names, list):
            return [str(name) for name in names]
    return []


def _shares(weights: Floats) -> Floats:
    """Weights that sum to 1; a vertex without any goes with its first joint."""
    weights = np.maximum(weights, 0.0)
    total = weights.sum(axis=1, keepdims=True)
    weights[total[:, 0] <= 0.0, 0] = 1.0
    return (weights / np.where(total > 0.0, total, 1.0)).astype(np.float32)


def _normals(vertices: Floats, triangles: NDArray[np.int32]) -> Floats:
    """Normals (V, 3) of a surface whose file has none."""
    a, b, c = (vertices[triangles[:, i]] for i in range(3))
    across = np.cross(b - a, c - a)
    made = np.zeros_like(vertices)
    for i in range(3):
        np.add.at(made, triangles[:, i], across)
    length = np.linalg.norm(made, axis=1, keepdims=True)
    return (made / np.where(length > 0, length, 1.0)).astype(np.float32)
