"""Where the nodes of an avatar's file stand at rest."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio.formats._glb import Glb, entry
from studio.motion import rotation

MOST_NODES = 50_000
_AROUND = np.diag([-1.0, 1.0, -1.0, 1.0])
"""Half a turn about Y: a VRM 0 faces -Z."""


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
        for i in order:  # grows while it is walked
            order += entries[i].get("children", ())
        if len(order) != count:
            raise ValueError("nodes hang in a circle")
        world, root = np.zeros((count, 4, 4)), _AROUND if turned else np.eye(4)
        with np.errstate(over="ignore", invalid="ignore"):  # of damaged files; looked at below
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
