"""What swings from an avatar: hair, skirts and ears as chains of springs, the same at any frame rate.

Time goes on in steps of 1/60 s that lie on one grid whatever the frames are, and a frame between two steps
shows what lies between them. After a seek things hang where they would come to rest.

Source: VRMC_springBone 1.0, whose step this is; three-vrm takes it once a frame.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.motion.rig import Array, Rig, SpringJoint, combined, inverted

Whole = NDArray[np.intp]

STEP = 1.0 / 60.0
SEEK_S = 0.25
"""A moment further from the last one than this, or before it, is a seek."""
JITTER_S = 0.02
"""A moment so little before the last one is the same: clocks that follow a sound card step back a little."""
_SETTLING = 12
_RESOLVED = 4
"""How often a joint is moved out of the collider it is deepest in."""
_ON_GRID = 1e-3
_NO_LENGTH = 1e-5


@dataclass(frozen=True, eq=False)
class _Level:
    """Nodes as many steps below what the body moves: joints that swing, and others that follow them.

    Args:
        joints: which of the joints, in their order by level.
        nodes, parents: of those joints (n,); a parent of N is the world.
        colliders: of each joint (n, K), the number of colliders for none.
        followers, leaders: other nodes (m,) and what they hang from.
    """

    joints: slice
    nodes: Whole
    parents: Whole
    colliders: Whole
    followers: Whole
    leaders: Whole


class Springs:
    """The springs of one avatar in motion. Use it on one thread.

    Args:
        rig: what moves of the avatar.
    """

    _tails: Array
    """The other ends of the joints (n, 3) after the last step, as seen from what they are centered on."""
    _before: Array
    """The same a step earlier."""
    _directions: Array
    """Where the joints point (n, 3), as seen from what they hang from."""
    _made: Array
    """Placements of all nodes (N + 1, 3, 4) after the last step."""
    _last: Array
    """Placements as they were given last."""

    def __init__(self, rig: Rig) -> None:
        self.rig = rig
        self._t: float | None = None
        count = len(rig.parents)
        joints = [one for one in rig.joints if math.dist(one.tail, rig.at[one.node]) > _NO_LENGTH]
        depth = _depths(rig, {one.node for one in joints})
        joints.sort(key=lambda one: depth[one.node])
        self._levels = _levels(rig, joints, depth)
        nodes = np.array([one.node for one in joints], dtype=np.intp)
        self._heads = rig.at[nodes] if len(joints) else np.zeros((0, 3))
        along = np.array([one.tail for one in joints]).reshape(-1, 3) - self._heads
        self._length = np.linalg.norm(along, axis=1, keepdims=True)
        self._axis: Array = along / self._length
        self._stiffness = np.array([[one.stiffness] for one in joints]).reshape(-1, 1)
        self._kept = 1.0 - np.array([[one.drag] for one in joints]).reshape(-1, 1)
        self._gravity = np.array([one.gravity for one in joints]).reshape(-1, 3)
        self._radius = np.array([[one.radius] for one in joints]).reshape(-1, 1)
        self._center = np.array([one.center if one.center >= 0 else count for one in joints], dtype=np.intp)
        self._centered = bool((self._center < count).any())
        self._body = np.array([i for i in range(count + 1) if depth.get(i, 0) == 0], dtype=np.intp)
        self._nodes = nodes
        self._colliders = _Colliders(rig)
        self._tails = self._before = self._directions = np.zeros((len(joints), 3))
        self._made = self._last = np.tile(np.eye(4)[:3], (count + 1, 1, 1))

    def moved(self, placements: Array, t: float) -> Array:
        """Where all nodes are at a moment, with what swings.

        Args:
            placements: of all nodes as `Rig.posed` has them (N + 1, 3, 4).
            t: seconds; moments are given as they are drawn, and an earlier one is a seek.

        Returns:
            (N + 1, 3, 4).
        """
        if not len(self._nodes):
            return placements
        if not np.isfinite(placements).all():
            placements = self._last
        if self._t is not None and self._t - JITTER_S < t < self._t:
            t = self._t
        if self._t is None or not 0.0 <= t - self._t <= SEEK_S:
            self._settle(placements)
        else:
            self._advance(placements, self._t, t)
        self._last, self._t = placements, t
        share = t / STEP - _steps(t)
        directions = self._directions
        if share > _ON_GRID:
            directions = directions + share * (self._following(placements) - directions)
            directions = _unit(directions, self._axis)
        return self._posed(placements, directions)

    def _advance(self, placements: Array, since: float, t: float) -> None:
        for step in range(_steps(since) + 1, _steps(t) + 1):
            share = (step * STEP - since) / (t - since)
            self._step(_between(self._last, placements, min(share, 1.0), self.rig.at))
        if not (np.isfinite(self._tails).all() and np.isfinite(self._directions).all()):
            self._settle(placements)

    def _settle(self, placements: Array) -> None:
        """Hang where it would come to rest with the body as it is."""
        self._made = placements.copy()
        self._tails = self._before = self._from_center(self._made, self._rest_tails(placements))
        for _ in range(_SETTLING):
            self._step(placements, resting=True)
            self._before = self._tails

    def _following(self, placements: Array) -> Array:
        """The directions one step later, which is taken back."""
        kept = self._tails, self._before, self._directions, self._made
        self._made = self._made.copy()
        self._step(placements)
        following = self._directions
        self._tails, self._before, self._directions, self._made = kept
        return following

    def _step(self, placements: Array, resting: bool = False) -> None:
        """One step of 1/60 s; `resting` goes straight to where forces are even."""
        made = self._made
        made[self._body] = placements[self._body]
        tails, before = self._to_world(made, self._tails), self._to_world(made, self._before)
        moved = tails + self._kept * (tails - before) + self._gravity * STEP
        colliders = self._colliders.placed(made)
        reached, directions = np.empty_like(tails), np.empty_like(tails)
        for level in self._levels:
            at = level.joints
            above = made[level.parents]
            turned = above[:, :, :3]
            heads = _through(above, self._heads[at])
            axis = _turned(turned, self._axis[at])
            length = self._length[at]
            if resting:
                way = axis * self._stiffness[at] + self._gravity[at]
            else:
                way = moved[at] + axis * (self._stiffness[at] * STEP) - heads
            way = _unit(way, axis)
            if level.colliders.shape[1]:
                way = colliders.pushed(heads, way, length, self._radius[at], level.colliders)
            reached[at] = heads + way * length
            directions[at] = _turned(np.swapaxes(turned, 1, 2), way)
            _place(made, level, above, heads, _swing(self._axis[at], directions[at]), self._heads[at])
            self._follow(made, placements, level)
        self._before = self._tails
        self._tails = self._from_center(made, reached)
        self._directions = directions

    def _posed(self, placements: Array, directions: Array) -> Array:
        """Placements with the joints in these directions, as seen from what they hang from."""
        made = placements.copy()
        swings = _swing(self._axis, directions)
        for level in self._levels:
            above, heads = made[level.parents], self._heads[level.joints]
            _place(made, level, above, _through(above, heads), swings[level.joints], heads)
            self._follow(made, placements, level)
        return made

    def _follow(self, made: Array, placements: Array, level: _Level) -> None:
        """Other nodes go with what they hang from, as they are turned against it."""
        if len(level.followers):
            own = combined(inverted(placements[level.leaders]), placements[level.followers])
            made[level.followers] = combined(made[level.leaders], own)

    def _rest_tails(self, placements: Array) -> Array:
        return _through(placements[self._nodes], self._heads + self._axis * self._length)

    def _to_world(self, made: Array, points: Array) -> Array:
        return _through(made[self._center], points) if self._centered else points

    def _from_center(self, made: Array, points: Array) -> Array:
        return _through(inverted(made[self._center]), points) if self._centered else points


class _Colliders:
    """All colliders, placed."""

    _start: Array
    _along: Array
    _facing: Array

    def __init__(self, rig: Rig) -> None:
        found, count = rig.colliders, len(rig.parents)
        self._nodes = np.array([c.node if c.node >= 0 else count for c in found], dtype=np.intp)
        self._ends = np.array([(c.start, c.end) for c in found]).reshape(-1, 2, 3)
        # One more that is never touched, for joints with fewer than others.
        self._radius = np.array([*(c.radius for c in found), -math.inf])
        self._side = np.array([*(-1.0 if c.inside else 1.0 for c in found), 1.0])
        self._plane = np.array([*(c.normal is not None for c in found), False])
        self._flat = bool(self._plane.any())
        self._long = bool((self._ends[:, 0] != self._ends[:, 1]).any())
        normals = [c.normal if c.normal is not None else np.zeros(3) for c in found]
        self._normals = np.array(normals).reshape(-1, 3)
        self._start = self._along = self._facing = np.zeros((len(found) + 1, 3))
        self._square = np.ones(len(found) + 1)

    def placed(self, made: Array) -> _Colliders:
        """Itself, where the nodes are now."""
        if not len(self._nodes):
            return self
        carried = made[self._nodes]
        ends = np.zeros((len(self._nodes) + 1, 2, 3))
        ends[:-1] = self._ends @ np.swapaxes(carried[:, :, :3], 1, 2) + carried[:, None, :, 3]
        self._start, self._along = ends[:, 0], ends[:, 1] - ends[:, 0]
        if self._long:
            self._square = np.maximum((self._along**2).sum(axis=1), 1e-12)
        if self._flat:
            self._facing = np.zeros_like(self._start)
            self._facing[:-1] = _turned(carried[:, :, :3], self._normals)
        return self

    def pushed(self, heads: Array, way: Array, length: Array, radius: Array, which: Whole) -> Array:
        """Directions (n, 3) whose ends stay out of the colliders `which` (n, K), as far as they can."""
        way = way.copy()
        rows = np.arange(len(way))
        for _ in range(_RESOLVED):
            depth, push = self._hits(heads[rows] + way[rows] * length[rows], radius[rows], which[rows])
            deepest = depth.argmin(axis=1)
            picked = np.arange(len(rows)), deepest
            hit = depth[picked] < -1e-7
            if not hit.any():
                break
            out = way[rows] * length[rows] - push[picked] * depth[picked][:, None]
            rows = rows[hit]
            way[rows] = _unit(out[hit], way[rows])
        return way

    def _hits(self, tails: Array, radius: Array, which: Whole) -> tuple[Array, Array]:
        """How far tails (n, 3) are from each collider's skin (n, K), less than 0 within, and the way out."""
        away = tails[:, None] - self._start[which]
        if self._long:
            along = self._along[which]
            share = np.clip((away * along).sum(axis=2) / self._square[which], 0.0, 1.0)
            away -= share[:, :, None] * along
        distance = np.sqrt(np.einsum("nkc,nkc->nk", away, away))
        side = self._side[which]
        depth = side * (distance - self._radius[which]) - radius
        push = away * (side / np.maximum(distance, 1e-9))[:, :, None]
        if self._flat:
            plane, facing = self._plane[which], self._facing[which]
            depth = np.where(plane, (away * facing).sum(axis=2) - radius, depth)
            push = np.where(plane[:, :, None], facing, push)
        return depth, push


def _depths(rig: Rig, swinging: set[int]) -> dict[int, int]:
    """How many nodes above each node, itself counted, swing or follow what swings; 0 is the body's own."""
    depth: dict[int, int] = {}
    for i in rig.order:
        above = depth.get(rig.parents[i], 0)
        depth[i] = above + 1 if above or i in swinging else 0
    return depth


def _levels(rig: Rig, joints: list[SpringJoint], depth: dict[int, int]) -> list[_Level]:
    count, swinging, levels, first = len(rig.parents), {one.node for one in joints}, [], 0

    def up(nodes: list[int]) -> Whole:
        return np.array([rig.parents[i] if rig.parents[i] >= 0 else count for i in nodes], dtype=np.intp)

    for number in range(1, max(depth.values(), default=0) + 1):
        nodes = [one.node for one in joints if depth[one.node] == number]
        followers = [i for i in rig.order if depth[i] == number and i not in swinging]
        own = [one.colliders for one in joints[first : first + len(nodes)]]
        which = np.full((len(nodes), max(map(len, own), default=0)), len(rig.colliders), dtype=np.intp)
        for row, colliders in enumerate(own):
            which[row, : len(colliders)] = colliders
        levels.append(
            _Level(
                slice(first, first + len(nodes)),
                np.array(nodes, dtype=np.intp),
                up(nodes),
                which,
                np.array(followers, dtype=np.intp),
                up(followers),
            )
        )
        first += len(nodes)
    return levels


def _steps(t: float) -> int:
    """How many whole steps lie before a moment; one that is a hair short counts."""
    return math.floor(t / STEP + _ON_GRID)


def _place(made: Array, level: _Level, above: Array, heads: Array, swings: Array, rest: Array) -> None:
    """Write the placements of a level's joints: turned by `swings` against what they hang from."""
    turned = above[:, :, :3] @ swings
    made[level.nodes, :, :3] = turned
    made[level.nodes, :, 3] = heads - _turned(turned, rest)


def _turned(matrices: Array, vectors: Array) -> Array:
    product: Array = (matrices @ vectors[:, :, None])[:, :, 0]
    return product


def _through(placements: Array, points: Array) -> Array:
    return _turned(placements[:, :, :3], points) + placements[:, :, 3]


def _unit(vectors: Array, otherwise: Array) -> Array:
    length = np.sqrt((vectors**2).sum(axis=1, keepdims=True))
    if length.min(initial=1.0) > 1e-12:
        return vectors / length
    return np.where(length > 1e-12, vectors / np.maximum(length, 1e-12), otherwise)


def _swing(axis: Array, towards: Array) -> Array:
    """Rotation matrices (n, 3, 3) the shortest way from unit vectors (n, 3) to others."""
    half: Array = axis + towards
    opposite = (half**2).sum(axis=1) < 1e-12
    if opposite.any():
        half = np.where(opposite[:, None], _across(axis), half)
    half = _unit(half, axis)
    # Two mirrors one after the other are a rotation by twice the angle between them.
    once = 2.0 * axis[:, :, None] * axis[:, None, :] - np.eye(3)
    twice = 2.0 * half[:, :, None] * half[:, None, :] - np.eye(3)
    product: Array = twice @ once
    return product


def _across(axis: Array) -> Array:
    """Unit vectors at right angles to others (n, 3)."""
    other = np.eye(3)[np.abs(axis).argmin(axis=1)]
    made = np.cross(axis, other)
    length: Array = np.linalg.norm(made, axis=1, keepdims=True)
    crossed: Array = made / length
    return crossed


def _between(a: Array, b: Array, share: float, at: Array) -> Array:
    """Placements (N + 1, 3, 4) a share of the way from one to another that is close."""
    if share > 1.0 - _ON_GRID:
        return b
    turned = a[:, :, :3] + share * (b[:, :, :3] - a[:, :, :3])
    # Made orthonormal again, column by column.
    x = _unit(turned[:, :, 0], b[:, :, 0])
    y = turned[:, :, 1] - x * (x * turned[:, :, 1]).sum(axis=1, keepdims=True)
    y = _unit(y, b[:, :, 1])
    z = np.cross(x, y)
    made = np.empty_like(b)
    made[:, :, 0], made[:, :, 1], made[:, :, 2] = x, y, z
    rest = np.vstack([at, np.zeros((1, 3))])
    points = (1.0 - share) * _through(a, rest) + share * _through(b, rest)
    made[:, :, 3] = points - _turned(made[:, :, :3], rest)
    return made
