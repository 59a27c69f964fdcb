"""What moves of an avatar beside its bones: node constraints, and springs of VRM 0 and 1.

Nothing of it keeps an avatar from being read: what makes no sense stays still, and a note says so.

Source: VRMC_node_constraint 1.0, VRMC_springBone 1.0, VRMC_springBone_extended_collider 1.0 and VRM 0's
secondaryAnimation, as UniVRM and three-vrm read them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from studio.formats._glb import Glb
from studio.formats._vrm.mesh import Nodes
from studio.motion import rotation
from studio.motion.avatar import MIRROR
from studio.motion.rig import Collider, Constraint, Rig, SpringJoint

MOST_NODES, MOST_DEEP, MOST_PAIRS = 4096, 96, 100_000
"""Nodes that move, how many of them hang from each other, and pairs of what swings with what it may touch."""
_TOO_MANY = "Its hair and clothes stay still: they have more springs than the studio can move."
_DAMAGED = "Some of what should swing or turn by itself is damaged and stays still."
_LEAF = 0.07
"""Metres that a VRM 0's last spring is long."""
_AXES = {"X": (1.0, 0.0, 0.0), "Y": (0.0, 1.0, 0.0), "Z": (0.0, 0.0, 1.0)}
_UNREADABLE = (KeyError, IndexError, TypeError, ValueError, AttributeError, OverflowError)

T = TypeVar("T")
Vector = NDArray[np.float64]
Spring = tuple[int, dict[str, Any]]
"""A node and what its spring is made of, nodes being the file's."""


def read_rig(glb: Glb, old: bool, nodes: Nodes, bones: Sequence[int]) -> tuple[Rig, list[int], list[str]]:
    """What moves, which of the file's nodes that is, and what was left out.

    Args:
        glb: the file.
        old: whether it is VRM 0.
        nodes: where its nodes rest.
        bones: the nodes of its bones; they are the rig's first.
    """
    reader = _Reader(glb, nodes)
    try:
        springs = list(reader.springs_of_vrm0() if old else reader.springs())
    except _TooManyError:
        notes = [_DAMAGED] if reader.damaged else []
        return *_still(nodes, bones), [*notes, _TOO_MANY]
    constraints = list(reader.constraints())
    moved = list(dict.fromkeys([*bones, *(node for node, _ in constraints), *(node for node, _ in springs)]))
    notes = [_DAMAGED] if reader.damaged else []
    owners, above = nodes.owners(moved), nodes.owners(moved, strictly=True)
    parents = tuple(int(above[node]) for node in moved)
    pairs = len(springs) * max((len(one["colliders"]) for _, one in springs), default=0)
    if len(moved) > MOST_NODES or _deepest(parents) > MOST_DEEP or pairs > MOST_PAIRS:
        return *_still(nodes, bones), [*notes, _TOO_MANY]
    rig = Rig(
        parents,
        nodes.world[moved, :3, 3],
        len(bones),
        tuple(reader.constraint(node, one, owners, above) for node, one in constraints),
        tuple(
            SpringJoint(
                int(owners[node]),
                **{**one, "center": int(owners[one["center"]]) if one["center"] >= 0 else -1},
            )
            for node, one in springs
        ),
        tuple(Collider(int(owners[node]), *shape) for node, *shape in reader.colliders),
    )
    return rig, moved, notes


def _still(nodes: Nodes, bones: Sequence[int]) -> tuple[Rig, list[int]]:
    """Nothing but bones, and their nodes."""
    above = nodes.owners(list(bones), strictly=True)
    rig = Rig(tuple(int(above[node]) for node in bones), nodes.world[list(bones), :3, 3], len(bones))
    return rig, list(bones)


def _deepest(parents: Sequence[int]) -> int:
    """How many nodes hang from each other at most."""
    deepest, known = 0, dict[int, int]()
    for node in range(len(parents)):
        path = []
        while node >= 0 and node not in known:
            path.append(node)
            node = parents[node]
        depth = known.get(node, 0)
        for one in reversed(path):
            depth += 1
            known[one] = depth
        deepest = max(deepest, depth)
    return deepest


class _TooManyError(Exception):
    """Springs name more than MOST_PAIRS of what they may touch."""


class _Reader:
    def __init__(self, glb: Glb, nodes: Nodes) -> None:
        self._document, self._nodes = glb.document, nodes
        self._entries: list[dict[str, Any]] = glb.document["nodes"]
        self.damaged = 0
        self.colliders: list[tuple[Any, ...]] = []
        self._sprung: set[int] = set()
        self._pairs = 0
        world = nodes.world[:, :3, :3]
        # Columns at length 1; nodes may be scaled.
        size = np.linalg.norm(world, axis=1, keepdims=True)
        self._turns = rotation.from_matrix(world / np.where(size > 1e-12, size, 1.0))

    def constraints(self) -> Iterable[tuple[int, dict[str, Any]]]:
        """Nodes with what constrains them."""
        for i, node in enumerate(self._entries):
            one = self._tried(_constraint, node, len(self._entries))
            if one:
                yield i, one

    def constraint(
        self, node: int, one: dict[str, Any], owners: NDArray[np.int32], above: NDArray[np.int32]
    ) -> Constraint:
        """A constraint of the rig, from one of the file."""
        source = one["source"]
        return Constraint(
            one["kind"], int(owners[node]), int(above[node]), self._turns[node], self._turn_above(node),
            np.array(one["axis"]), int(owners[source]), int(above[source]), self._nodes.world[source, :3, 3],
            self._turns[source], self._turn_above(source), one["weight"],
        )  # fmt: skip

    def springs(self) -> Iterable[Spring]:
        """The joints of a VRM 1, each from one node to the next."""
        extension = (self._document.get("extensions") or {}).get("VRMC_springBone")
        if not isinstance(extension, dict):
            return
        known = [self._tried(self._collider, one) for one in _list(extension, "colliders")]
        groups = [
            [c for i in _once(_list(group, "colliders"), len(known)) if (c := known[i]) is not None]
            for group in _list(extension, "colliderGroups")
        ]
        for spring in _list(extension, "springs"):
            joints = _list(spring, "joints")
            touched = self._touched(spring, groups, max(len(joints) - 1, 1))
            for one, after in pairwise(joints):
                made = self._tried(self._joint, one, after, touched, spring.get("center", -1))
                if made:
                    yield made

    def springs_of_vrm0(self) -> Iterable[Spring]:
        """The joints of a VRM 0: all nodes below those it names."""
        table = self._document["extensions"]["VRM"].get("secondaryAnimation")
        groups = [
            self._tried(self._colliders_of_vrm0, group) or () for group in _list(table, "colliderGroups")
        ]
        for spring in _list(table, "boneGroups"):
            touched = self._touched(spring, groups)
            values = self._tried(self._of_vrm0, spring)
            for root in _list(spring, "bones") if values else ():
                walked = [root] if self._is_node(root) else []
                self.damaged += not walked and root != -1
                # Grows while it is walked; a tree, so it ends.
                for node in walked:
                    # Below one that swings all do: a file may name a root a hundred thousand times.
                    if node in self._sprung or not values:
                        continue
                    walked += self._entries[node].get("children", ())
                    self._sprung.add(node)
                    self._count(len(touched))
                    yield node, values | {"tail": self._tail_of_vrm0(node), "colliders": touched}

    def _touched(self, spring: Any, groups: Sequence[Sequence[int]], joints: int = 1) -> tuple[int, ...]:
        """What the joints of a spring may touch, each once."""
        named = [groups[i] for i in _once(_list(spring, "colliderGroups"), len(groups))]
        self._count(sum(len(group) for group in named) * joints)
        return tuple(dict.fromkeys(c for group in named for c in group))

    def _count(self, pairs: int) -> None:
        """Stop before a small file fills the memory: it grows with the square of what a file lists."""
        self._pairs += pairs
        if self._pairs > MOST_PAIRS:
            raise _TooManyError

    def _tried(self, read: Callable[..., T], *args: Any) -> T | None:
        """What could be read; what could not is counted."""
        try:
            return read(*args)
        except _UNREADABLE:
            self.damaged += 1
            return None

    def _is_node(self, node: Any) -> bool:
        return isinstance(node, int) and not isinstance(node, bool) and 0 <= node < len(self._entries)

    def _node(self, node: Any, none: int | None = None) -> int:
        if node == none:
            return -1
        if not self._is_node(node):
            raise IndexError(node)
        return int(node)

    def _turn_above(self, node: int) -> Vector:
        parent = self._nodes.parents[node]
        turn: Vector = self._turns[parent] if parent >= 0 else rotation.IDENTITY
        return turn

    def _placed(self, node: int, point: Vector) -> Vector:
        placed: Vector = self._nodes.world[node, :3, :3] @ point + self._nodes.world[node, :3, 3]
        return placed

    def _joint(
        self, one: dict[str, Any], after: dict[str, Any], touched: tuple[int, ...], center: Any
    ) -> Spring | None:
        node, end = self._node(one["node"]), self._node(after["node"])
        if node in self._sprung:
            return None
        pull = _number(one.get("gravityPower", 0.0)) * _vector(one.get("gravityDir"), (0.0, -1.0, 0.0))
        made = {
            "tail": self._nodes.world[end, :3, 3],
            "stiffness": _number(one.get("stiffness", 1.0), 0.0),
            "drag": _number(one.get("dragForce", 0.5), 0.0, 1.0),
            "gravity": tuple(pull.tolist()),
            "radius": _number(one.get("hitRadius", 0.0), 0.0),
            "center": self._node(center, -1),
            "colliders": touched,
        }
        self._sprung.add(node)
        return node, made

    def _collider(self, one: dict[str, Any]) -> int | None:
        """Which of the colliders it became, None where its file left its node open."""
        node = self._node(one.get("node", -1), -1)
        if node < 0:
            return None
        extended = (one.get("extensions") or {}).get("VRMC_springBone_extended_collider") or {}
        shape: dict[str, Any] = extended.get("shape") or one["shape"]
        kind = _kind(shape, "sphere", "capsule", "plane")
        values = shape[kind]
        start = _vector(values.get("offset"), (0.0, 0.0, 0.0))
        end = _vector(values.get("tail"), (0.0, 0.0, 0.0)) if kind == "capsule" else start
        normal = None
        if kind == "plane":
            normal = self._nodes.world[node, :3, :3] @ _vector(values.get("normal"), (0.0, 0.0, 1.0))
            normal = normal / max(float(np.linalg.norm(normal)), 1e-9)
        radius, inside = _number(values.get("radius", 0.0), 0.0), bool(values.get("inside", False))
        self.colliders.append(
            (node, self._placed(node, start), self._placed(node, end), radius, inside, normal)
        )
        return len(self.colliders) - 1

    def _colliders_of_vrm0(self, group: dict[str, Any]) -> tuple[int, ...]:
        node = self._node(group.get("node", -1), -1)
        first = len(self.colliders)
        for one in group.get("colliders") or () if node >= 0 else ():
            # Unity's z points the other way.
            at = self._placed(node, _xyz(one.get("offset"), (0.0, 0.0, 0.0)) * (1.0, 1.0, -1.0))
            self.colliders.append((node, at, at, _number(one.get("radius", 0.0), 0.0)))
        return tuple(range(first, len(self.colliders)))

    def _of_vrm0(self, spring: dict[str, Any]) -> dict[str, Any]:
        pull = _number(spring.get("gravityPower", 0.0)) * _xyz(spring.get("gravityDir"), (0.0, -1.0, 0.0))
        return {
            # Misspelt in every file there is.
            "stiffness": _number(spring.get("stiffiness", 1.0), 0.0),
            "drag": _number(spring.get("dragForce", 0.4), 0.0, 1.0),
            "gravity": tuple((pull * MIRROR).tolist()),
            "radius": _number(spring.get("hitRadius", 0.0), 0.0),
            "center": self._node(spring.get("center", -1), -1),
        }

    def _tail_of_vrm0(self, node: int) -> Vector:
        children = self._entries[node].get("children", ())
        if children:
            tail: Vector = self._nodes.world[children[0], :3, 3]
            return tail
        local = np.linalg.inv(self._world_above(node)) @ self._nodes.world[node, :, 3]
        length = float(np.linalg.norm(local[:3]))
        return self._placed(node, local[:3] * (_LEAF / length if length > 1e-9 else 0.0))

    def _world_above(self, node: int) -> Vector:
        parent = self._nodes.parents[node]
        world: Vector = self._nodes.world[parent] if parent >= 0 else np.eye(4)
        # One that is flat has no way back.
        return world if abs(float(np.linalg.det(world))) > 1e-12 else np.eye(4)


def _constraint(node: Any, count: int) -> dict[str, Any] | None:
    if not isinstance(node, dict) or "VRMC_node_constraint" not in (node.get("extensions") or {}):
        return None
    listed = node["extensions"]["VRMC_node_constraint"]["constraint"]
    kind = _kind(listed, "roll", "aim", "rotation")
    one, axis = listed[kind], np.array(_AXES["X"])
    if kind == "roll":
        axis = np.array(_AXES[one["rollAxis"]])
    elif kind == "aim":
        side, name = str(one["aimAxis"])[:8], str(one["aimAxis"])[8:]
        axis = np.array(_AXES[name]) * {"Positive": 1.0, "Negative": -1.0}[side]
    source = one["source"]
    if not isinstance(source, int) or not 0 <= source < count:
        raise IndexError(source)
    return {"kind": kind, "source": source, "axis": axis, "weight": _number(one.get("weight", 1.0), 0.0, 1.0)}


def _kind(table: dict[str, Any], *kinds: str) -> str:
    """The first of some names that a table has."""
    found = [kind for kind in kinds if kind in table]
    if not found:
        raise KeyError(kinds)
    return found[0]


def _number(value: Any, least: float = -100.0, most: float = 100.0) -> float:
    number = float(value)
    if not math.isfinite(number):
        raise ValueError(value)
    return min(max(number, least), most)


def _vector(value: Any, usual: tuple[float, float, float]) -> Vector:
    x, y, z = usual if value is None else value
    return np.array([_number(x), _number(y), _number(z)])


def _xyz(value: Any, usual: tuple[float, float, float]) -> Vector:
    return _vector(
        None if value is None else (value.get("x", 0), value.get("y", 0), value.get("z", 0)), usual
    )


def _list(table: Any, name: str) -> Sequence[Any]:
    found = table.get(name) if isinstance(table, dict) else None
    return found if isinstance(found, list) else ()


def _once(indices: Sequence[Any], count: int) -> Iterable[int]:
    """The indices that exist, each once."""
    return dict.fromkeys(i for i in indices if isinstance(i, int) and 0 <= i < count)
