"""Reading a VRM Animation: whatever its rest pose, the change from a T-pose comes out."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio.errors import StudioError, counted, say
from studio.formats import _glb
from studio.formats._glb import Glb, entry
from studio.motion import Motion, Skeleton, rotation
from studio.motion.avatar import MIRROR, MIRROR_TURN
from studio.motion.channels import ALL_BONES, vrm1_bone
from studio.motion.sanitize import credible

EYES = ("LeftEye", "RightEye")
_FROM_VRM1 = {vrm1_bone(name).lower(): name for name in ALL_BONES if name not in EYES}
_LONGEST = 24 * 3600.0
_FASTEST = 240.0
SLOWEST = 4.9
"""Keys further apart than this many a second are poses to move between, not frames."""
# A tiny file may claim to last all day: more frames than these for its keys are not made. Each cell, which is
# one track on one frame, takes some 300 bytes while it is read.
_MOST_CELLS = 3_000_000
_MOST_FRAMES_A_KEY = 10_000

Array = NDArray[np.floating]


@dataclass(frozen=True, eq=False)
class _Track:
    """One channel: times (T,), values (T, n), and whether they jump."""

    times: Array
    values: Array
    steps: bool

    def at(self, t: Array) -> Array:
        """The values at some times; rotations by slerp; ends held."""
        if len(t) == len(self.times) and np.array_equal(t, self.times):
            return self.values
        right = np.clip(np.searchsorted(self.times, t, side="right"), 0, len(self.times) - 1)
        left = np.maximum(np.searchsorted(self.times, t, side="right") - 1, 0)
        span = self.times[right] - self.times[left]
        amount = np.clip(np.where(span > 0, (t - self.times[left]) / np.where(span > 0, span, 1.0), 0), 0, 1)
        if self.steps:
            amount = np.zeros_like(amount)
        a, b = self.values[left], self.values[right]
        if self.values.shape[1] == 4:
            return rotation.slerp(a, b, amount)
        return a + (b - a) * amount[:, None]


@dataclass(eq=False)
class _Nodes:
    """World rest pose of all nodes: positions (N, 3), rotations (N, 4) and scales (N,)."""

    positions: Array
    rotations: Array
    scales: Array
    local: Array
    parents: list[int]
    tracks: dict[tuple[int, str], _Track] = field(default_factory=dict)


def read(path: Path) -> tuple[Motion, list[str]]:
    """The first animation of a file, in Unity's axes, and what was guessed about it.

    Raises:
        StudioError: it is no VRM Animation, cut short or damaged.
    """
    glb = _glb.read(path)
    try:
        return _motion(glb)
    except (KeyError, IndexError, TypeError, ValueError, OverflowError, AttributeError) as error:
        raise _glb.damaged(path) from error


def _motion(glb: Glb) -> tuple[Motion, list[str]]:
    extensions = glb.document.get("extensions")
    extension = extensions.get("VRMC_vrm_animation") if isinstance(extensions, dict) else None
    if not isinstance(extension, dict):
        raise StudioError(
            say("{name} is not a VRM Animation.", name=glb.path.name), "Choose a file saved as VRM Animation."
        )
    if not glb.document.get("animations"):
        raise StudioError(
            say("{name} holds no motion.", name=glb.path.name), "Choose a file with an animation."
        )
    nodes = _nodes(glb)
    expressions = _expressions(extension)
    bones = _bones(extension)
    look = extension.get("lookAt", {}).get("node")
    wanted = {*bones.values(), *expressions.values(), look}
    notes = _tracks(glb, nodes, wanted)
    if not nodes.tracks:
        raise StudioError(
            say("{name} holds no motion.", name=glb.path.name), "Choose a file with an animation."
        )
    times, more = _times(glb.path, list(nodes.tracks.values()))
    shapes = [nodes.tracks[node, "translation"].at(times)[:, 0] if (node, "translation") in nodes.tracks
              else np.zeros(len(times)) for node in expressions.values()]  # fmt: skip
    names, positions, rotations = _body(nodes, bones, times)
    if (look, "rotation") in nodes.tracks:
        eyes = [eye for eye in EYES if eye not in names]
        gaze = nodes.tracks[look, "rotation"].at(times)
        names = (*names, *eyes)
        at = _eye_positions(extension, eyes)
        positions = np.concatenate([positions, np.tile(at, (len(times), 1, 1))], axis=1)
        rotations = np.concatenate([rotations, np.repeat(gaze[:, None], len(eyes), axis=1)], axis=1)
    motion = Motion.build(
        times, tuple(expressions), np.stack(shapes, axis=1).clip(0.0, 1.0) if shapes else None, names,
        positions * MIRROR, rotations * MIRROR_TURN,
    )  # fmt: skip
    return motion, notes + more


def _expressions(extension: dict[str, Any]) -> dict[str, int]:
    """Node by expression, presets first."""
    groups = extension.get("expressions", {})
    return {
        str(name): int(place["node"])
        for group in ("preset", "custom")
        for name, place in groups.get(group, {}).items()
    }


def _bones(extension: dict[str, Any]) -> dict[str, int]:
    """Node by HumanBodyBones name; what is no bone, or an eye (a VRMA must not have them), is left out."""
    found = extension.get("humanoid", {}).get("humanBones", {})
    return {
        _FROM_VRM1[name.lower()]: int(place["node"])
        for name, place in found.items()
        if name.lower() in _FROM_VRM1
    }


def _nodes(glb: Glb) -> _Nodes:
    """The world rest pose of every node; ValueError where nodes hang in a circle."""
    entries = [entry(glb.document, "nodes", i) for i in range(len(glb.document["nodes"]))]
    count = len(entries)
    parents = [-1] * count
    for i, node in enumerate(entries):
        for child in node.get("children", ()):
            if not 0 <= child < count or parents[child] >= 0:
                raise ValueError(child)
            parents[child] = i
    local = [_local(node) for node in entries]
    world = _Nodes(np.zeros((count, 3)), np.tile(rotation.IDENTITY, (count, 1)), np.ones(count),
                   np.array([q for _, q, _ in local]).reshape(-1, 4), parents)  # fmt: skip
    waiting = [i for i in range(count) if parents[i] < 0]
    done = 0
    while waiting:
        i = waiting.pop()
        done += 1
        p, q, s = local[i]
        world.positions[i], world.rotations[i], world.scales[i] = _placed(world, parents[i], p), q, s
        if parents[i] >= 0:
            world.rotations[i] = rotation.multiply(world.rotations[parents[i]], q)
            world.scales[i] = world.scales[parents[i]] * s
        waiting += entries[i].get("children", ())
    if done != count:
        raise ValueError("nodes hang in a circle")
    return world


def _placed(world: _Nodes, parent: int, p: Array) -> Array:
    """Local positions (..., 3) below a node, in the world."""
    if parent < 0:
        return p
    q = np.broadcast_to(world.rotations[parent], (*p.shape[:-1], 4))
    return world.positions[parent] + rotation.rotate(q, p * world.scales[parent])


def _local(node: dict[str, Any]) -> tuple[Array, Array, float]:
    """Position, rotation and even scale of a node against its parent."""
    if "matrix" in node:
        matrix = np.array(node["matrix"], dtype=np.float64).reshape(4, 4).T
        scale = float(np.cbrt(np.linalg.det(matrix[:3, :3])))
        if not np.isfinite(matrix).all() or scale <= 0:
            raise ValueError(scale)
        return matrix[:3, 3], rotation.from_matrix(matrix[:3, :3] / scale), scale
    p = np.array(node.get("translation", (0, 0, 0)), dtype=np.float64).reshape(3)
    q = np.array(node.get("rotation", (0, 0, 0, 1)), dtype=np.float64).reshape(4)
    scale = float(np.mean(np.array(node.get("scale", (1, 1, 1)), dtype=np.float64).reshape(3)))
    if not (np.isfinite(p).all() and np.isfinite(q).all() and np.isfinite(scale)):
        raise ValueError(node)
    return p, rotation.normalised(q), scale


def _tracks(glb: Glb, nodes: _Nodes, wanted: set[Any]) -> list[str]:
    """Put the channels of the wanted nodes into `nodes`."""
    animation = entry(glb.document, "animations", 0)
    for channel in animation["channels"]:
        target = channel["target"]
        node, path = target.get("node"), target["path"]
        if node not in wanted or path not in ("translation", "rotation"):
            continue
        if not 0 <= node < len(nodes.parents):
            raise IndexError(node)
        sampler = entry(animation, "samplers", channel["sampler"])
        times = glb.numbers(sampler["input"])
        values: Array = glb.numbers(sampler["output"])
        kind = sampler.get("interpolation", "LINEAR")
        if kind == "CUBICSPLINE":
            # Each key is a tangent, the value and a tangent.
            values = values[1::3]
        if len(values) != len(times) or values.shape[1:] != ((4,) if path == "rotation" else (3,)):
            raise ValueError(path)
        if times[0] < 0 or times[-1] > _LONGEST or (np.diff(times) <= 0).any():
            raise _glb.damaged(glb.path)
        if path == "rotation":
            values = rotation.sign_continuous(rotation.normalised(values))
        nodes.tracks[node, path] = _Track(times, values, kind == "STEP")
    number = len(glb.document["animations"])
    return (
        [say("{name} holds {number} animations; the first was read.", name=glb.path.name, number=number)]
        if number > 1
        else []
    )


def _times(path: Path, tracks: list[_Track]) -> tuple[Array, list[str]]:
    """The times of all tracks where they agree; else an even grid as fine as the finest of them."""
    longest = max(tracks, key=lambda track: len(track.times))
    keys = np.unique(np.concatenate([track.times for track in tracks]))
    ends = float(keys[credible(keys)[-1]])
    alike = all(len(t.times) == 1 or np.array_equal(t.times, longest.times) for t in tracks)
    steps = np.concatenate([np.diff(track.times) for track in tracks])
    if not len(steps):
        return longest.times, []
    finest = float(np.median(np.diff(longest.times))) if len(longest.times) > 1 else float(steps.min())
    fps = min(1.0 / finest, _FASTEST)
    if alike and fps >= SLOWEST:
        return longest.times, []
    fps = 30.0 if fps < SLOWEST else fps
    count = int(np.floor(ends * fps + 1e-6)) + 1
    if count > min(_MOST_CELLS // len(tracks), _MOST_FRAMES_A_KEY * len(longest.times)):
        what = say(
            "{name} claims to last {seconds} s, with {keys} only.",
            name=path.name,
            seconds=f"{ends:.0f}",
            keys=counted(len(longest.times), "key"),
        )
        raise StudioError(what, "Export it again with a key for each frame.")
    notes: list[str] = [
        say("{name} has keys of its own for each part; read at {fps} fps.", name=path.name, fps=f"{fps:.4g}")
    ]
    if ends < keys[-1]:
        notes.append(
            say(
                "{name}: a key at {at} s, far behind all others, left out.",
                name=path.name,
                at=f"{keys[-1]:.0f}",
            )
        )
    return np.arange(count) / fps, notes


def _body(nodes: _Nodes, bones: dict[str, int], times: Array) -> tuple[tuple[str, ...], Array, Array]:
    """Local positions (T, J, 3) and changes from the T-pose (T, J, 4), in glTF's axes and metres.

    Norm = W L^-1 q W^-1 with W the world and L the local rest rotation of the bone.
    """
    names = tuple(bones)
    rest = Skeleton.humanoid(names)
    positions = np.zeros((len(times), len(names), 3))
    rotations = np.tile(rotation.IDENTITY, (len(times), len(names), 1))
    for j, (name, node) in enumerate(bones.items()):
        parent = rest.parents[j]
        above = nodes.positions[bones[names[parent]]] if parent >= 0 else np.zeros(3)
        positions[:, j] = nodes.positions[node] - above
        if name == "Hips" and (node, "translation") in nodes.tracks:
            moved = nodes.tracks[node, "translation"].at(times)
            positions[:, j] = _placed(nodes, nodes.parents[node], moved)
        if (node, "rotation") in nodes.tracks:
            q = nodes.tracks[node, "rotation"].at(times)
            world = nodes.rotations[node]
            above_turn = rotation.multiply(world, rotation.inverse(nodes.local[node]))
            turned = rotation.multiply(np.broadcast_to(above_turn, q.shape), q)
            back = np.broadcast_to(rotation.inverse(world), q.shape)
            rotations[:, j] = rotation.multiply(turned, back)
    return names, positions, rotations


def _eye_positions(extension: dict[str, Any], eyes: list[str]) -> Array:
    """Where the eyes rest against the head (eyes, 3), in glTF's axes."""
    built_in = Skeleton.humanoid(("Head", *EYES)).rest_positions[1:] * MIRROR
    middle = extension["lookAt"].get("offsetFromHeadBone")
    if middle is not None:
        built_in = built_in - built_in.mean(axis=0) + np.array(middle, dtype=np.float64).reshape(3)
    if not np.isfinite(built_in).all():
        raise ValueError(middle)
    return built_in[[EYES.index(eye) for eye in eyes]]
