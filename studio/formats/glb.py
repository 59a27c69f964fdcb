"""glTF in one file (.glb): a body or an avatar with its skeleton, its face as morph targets, and the motion.

Right-handed, Y up, facing +Z, metres, as glTF has it: Unity's X is turned over. Bones rest without any turn,
so a rotation is the change from the T-pose.
Source: Khronos glTF 2.0, sections 3.7 (meshes, skins) and 3.11 (animations).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio.errors import RequestError
from studio.formats import _glb, _glb_body
from studio.formats._glb import Glb, Numbers, entry
from studio.formats._table import check_suffix
from studio.formats._writing import DEFAULT_FPS, checked, grounded_body, on_grid
from studio.formats.vrma import rest_skeleton
from studio.motion import Motion, Skeleton, rotation
from studio.motion.avatar import MIRROR, MIRROR_TURN, Avatar
from studio.render.face import fitted
from studio.render.mannequin import mannequin

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
        raise RequestError(f"There is no motion to write to {path.name}.", "Choose a take with motion.")
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
    body = _glb_body.Body(numbers, avatar)
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
