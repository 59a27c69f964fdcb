"""What moves of an avatar beside its bones: nodes that copy or aim at others, and what swings from them.

Everything is in a picture's axes. A node's placement is a 3x4 matrix that takes it, and all that hangs
stiffly from it, from where it rests to where it is.

Source: VRMC_node_constraint 1.0, VRMC_springBone 1.0 and its extended colliders; VRM 0 secondaryAnimation.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from studio.motion import rotation

Array = NDArray[np.floating]
_STRAIGHT = 1e-6


@dataclass(frozen=True, eq=False)
class Constraint:
    """A node that turns as another one does.

    Args:
        kind: "roll" about one axis, "aim" at it, or "rotation" as it is.
        node, parent: what turns and what it hangs from, indices into the rig, the parent's -1 for none.
        turn, above: how the node and the node above it rest in the world (4,).
        axis: of roll and aim, unit, as the node has it.
        source, source_parent: what it follows and what that hangs from, -1 for none.
        source_at: where the source rests (3,).
        source_turn, source_above: how it and the node above it rest (4,).
        weight: how much of it, 0..1.
    """

    kind: str
    node: int
    parent: int
    turn: Array
    above: Array
    axis: Array
    source: int
    source_parent: int
    source_at: Array
    source_turn: Array
    source_above: Array
    weight: float = 1.0


@dataclass(frozen=True, eq=False)
class Collider:
    """What nothing swings into: a ball, a capsule, their inside, or all behind a plane.

    Args:
        node: what carries it, index into the rig, -1 for none.
        start, end: of a capsule's axis where it rests (3,); the same of a ball or a plane.
        radius: metres.
        inside: things stay within it.
        normal: of a plane, unit, where it rests; None for the others.
    """

    node: int
    start: Array
    end: Array
    radius: float
    inside: bool = False
    normal: Array | None = None


@dataclass(frozen=True, eq=False)
class SpringJoint:
    """A node that swings from the one it hangs from.

    Args:
        node: index into the rig.
        tail: where its other end rests (3,).
        stiffness: how strongly it goes back to its rest, metres a second.
        drag: how much of its motion is lost in each step of 1/60 s, 0..1.
        gravity: pull in the world, metres a second.
        radius: of its other end, metres.
        center: the node whose motion does not swing it, -1 for the world.
        colliders: what it does not swing into, indices.
    """

    node: int
    tail: Array
    stiffness: float = 1.0
    drag: float = 0.5
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    radius: float = 0.0
    center: int = -1
    colliders: tuple[int, ...] = ()


@dataclass(frozen=True, eq=False)
class Rig:
    """All that moves of an avatar: its J bones first, then N - J nodes that swing or are constrained.

    Args:
        parents: the node that each hangs from (N,), -1 for none.
        at: where they rest (N, 3).
        bones: J.
        constraints: in any order.
        joints: what swings; a node at most once.
        colliders: of all joints.
    """

    parents: tuple[int, ...]
    at: Array
    bones: int
    constraints: tuple[Constraint, ...] = ()
    joints: tuple[SpringJoint, ...] = ()
    colliders: tuple[Collider, ...] = ()

    @cached_property
    def order(self) -> tuple[int, ...]:
        """Nodes with every parent before its children."""
        children: dict[int, list[int]] = {}
        for i, parent in enumerate(self.parents):
            children.setdefault(parent, []).append(i)
        order = list(children.get(-1, ()))
        # Grows while it is walked.
        for i in order:
            order += children.get(i, ())
        return tuple(order)

    @cached_property
    def carriers(self) -> NDArray[np.int32]:
        """The bone that each node hangs from at last (N,), itself for a bone, -1 for none."""
        found = np.full(len(self.parents), -1, dtype=np.int32)
        for i in self.order:
            found[i] = i if i < self.bones else (found[self.parents[i]] if self.parents[i] >= 0 else -1)
        return found

    @cached_property
    def ordered_constraints(self) -> tuple[Constraint, ...]:
        """Constraints with what they depend on first; those that depend on themselves are left out."""
        by_node = {one.node: one for one in self.constraints}
        done: dict[int, bool] = {}
        made: list[Constraint] = []

        def settle(node: int) -> bool:
            """Whether a node and all it depends on is worked out; False in a circle."""
            if node < 0 or node in done:
                return done.get(node, True)
            done[node] = False  # until it is: who comes by again goes around in a circle
            if not settle(self.parents[node]):
                del done[node]
                return False
            one = by_node.get(node)
            if one is not None and settle(one.source) and settle(one.source_parent):
                made.append(one)
            done[node] = True
            return True

        for node in self.order:
            settle(node)
        return tuple(made)

    @cached_property
    def _stiff(self) -> NDArray[np.intp]:
        """The nearest bone or constrained node at or above each node and none (N + 1,); N where none is."""
        own = {one.node for one in self.ordered_constraints}
        lead = np.full(len(self.parents) + 1, len(self.parents), dtype=np.intp)
        for i in self.order:
            if i < self.bones or i in own:
                lead[i] = i
            elif self.parents[i] >= 0:
                lead[i] = lead[self.parents[i]]
        return lead

    @cached_property
    def _carried(self) -> dict[int, NDArray[np.intp]]:
        """Bones below each constrained node: they go with it."""
        found: dict[int, list[int]] = {one.node: [] for one in self.ordered_constraints}
        for bone in range(self.bones):
            above = self.parents[bone]
            while above >= 0:
                if above in found:
                    found[above].append(bone)
                above = self.parents[above]
        return {node: np.array(bones, dtype=np.intp) for node, bones in found.items()}

    def posed(self, placements: Array) -> Array:
        """Placements of all nodes by bones and constraints, with nothing swinging.

        Args:
            placements: of the bones, (J + 1, 3, 4); the last one is for what hangs from none.

        Returns:
            (N + 1, 3, 4); the last one is for what hangs from none.
        """
        count = len(self.parents)
        made = np.empty((count + 1, 3, 4))
        made[:-1], made[-1] = placements[self.carriers], placements[-1]
        for one in self.ordered_constraints:
            before = made[self._stiff[one.parent]] if one.node >= self.bones else made[one.node].copy()
            made[one.node] = self._constrained(one, made)
            carried = self._carried[one.node]
            if len(carried):
                made[carried] = combined(combined(made[one.node], inverted(before)), made[carried])
        return made[self._stiff]

    def _constrained(self, one: Constraint, made: Array) -> Array:
        above = made[self._stiff[one.parent]]
        source = made[self._stiff[one.source]]
        held = rotation.from_matrix(above[:, :3])
        at = above[:, :3] @ self.at[one.node] + above[:, 3]
        base = rotation.multiply(held, one.turn)
        if one.kind == "aim":
            towards = source[:, :3] @ one.source_at + source[:, 3] - at
            away = float(np.linalg.norm(towards))
            turn = rotation.IDENTITY
            if away > _STRAIGHT:
                arc = shortest_arc(rotation.rotate(base, one.axis), towards / away)
                turn = rotation.multiply(rotation.inverse(base), rotation.multiply(arc, base))
        else:
            source_held = rotation.from_matrix(made[self._stiff[one.source_parent]][:, :3])
            change = rotation.multiply(rotation.inverse(source_held), rotation.from_matrix(source[:, :3]))
            if one.kind == "rotation":
                turn = _seen_from(change, one.source_turn)
            else:
                # From the source's parent's axes to the node's own.
                local = rotation.multiply(rotation.inverse(one.above), one.turn)
                turn = _seen_from(_seen_from(change, one.source_above), local)
                arc = shortest_arc(one.axis, rotation.rotate(turn, one.axis))
                turn = rotation.multiply(rotation.inverse(arc), turn)
        turn = rotation.slerp(rotation.IDENTITY, turn, one.weight)
        turned = rotation.multiply(rotation.multiply(base, turn), rotation.inverse(one.turn))
        matrix = rotation.to_matrix(turned)
        return np.column_stack([matrix, at - matrix @ self.at[one.node]])


def _seen_from(turn: Array, axes: Array) -> Array:
    """A rotation in other axes."""
    return rotation.multiply(rotation.inverse(axes), rotation.multiply(turn, axes))


def shortest_arc(a: Array, b: Array) -> Array:
    """The rotation (4,) the shortest way from a unit vector (3,) to another."""
    w = 1.0 + float(a @ b)
    if w > _STRAIGHT:
        return rotation.normalised(np.array([*rotation.cross(a, b), w]))
    across = rotation.cross(a, np.eye(3)[int(np.argmin(np.abs(a)))])
    return np.array([*(across / np.linalg.norm(across)), 0.0])


def combined(a: Array, b: Array) -> Array:
    """The placement b (..., 3, 4) followed by a (..., 3, 4)."""
    made: Array = a[..., :, :3] @ b
    made[..., :, 3] += a[..., :, 3]
    return made


def inverted(a: Array) -> Array:
    """The way back of a placement (..., 3, 4) that only turns and shifts."""
    back = np.swapaxes(a[..., :3], -1, -2)
    return np.concatenate([back, -(back @ a[..., 3:])], axis=-1)
