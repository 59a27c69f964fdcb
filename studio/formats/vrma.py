"""VRM Animation (.vrma): body, expressions and gaze for any VRM avatar.

Unity's axes become glTF's by mirroring X; the rest pose is a T facing +Z without any rotation, so a local
rotation is the change from it.
Source: VRMC_vrm_animation 1.0; UniVRM's VrmAnimationImporter for the order of nodes and channels.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio.errors import RequestError, say
from studio.formats import Imported, _glb
from studio.formats._table import check_suffix
from studio.formats._vrm import animation
from studio.formats._vrm.animation import EYES, SLOWEST
from studio.formats._writing import DEFAULT_FPS, checked, grounded_body, on_grid
from studio.formats.saia_csv import find_audio
from studio.motion import Motion, Skeleton, rotation
from studio.motion.avatar import MIRROR, MIRROR_TURN
from studio.motion.channels import VRM0_TO_VRM1, VRM1_SHAPES, vrm1_bone

TITLE = "VRM Animation"
SUFFIX = ".vrma"
NOTE = (
    "Body, expressions and gaze for any VRM avatar; no sound. Both eyes look the same way, by the eye bones; "
    "gaze expressions such as LookUp are left out. Not every program reads all of it: "
    "UniVRM leaves the eyes at rest, VMagicMirror the face."
)

REQUIRED = (
    "Hips", "Spine", "Head", "LeftUpperLeg", "LeftLowerLeg", "LeftFoot", "RightUpperLeg", "RightLowerLeg",
    "RightFoot", "LeftUpperArm", "LeftLowerArm", "LeftHand", "RightUpperArm", "RightLowerArm", "RightHand",
)  # fmt: skip
# A VRMA must not have look expressions: its lookAt node says where the eyes look.
_PRESETS = frozenset(name for name in VRM1_SHAPES if not name.startswith("look"))
_TO_VRM1 = {name.lower(): name for name in VRM1_SHAPES} | {a.lower(): b for a, b in VRM0_TO_VRM1.items()}
_TOLERANCE_M = 0.001
_TOLERANCE_RADIANS = np.radians(0.1)
# Frames compared by forward kinematics, spread over the file: all of an hour would take as long as writing
# it.
_FRAMES_COMPARED = 1000

Array = NDArray[np.floating]


def read(path: Path, audio: Path | None = None) -> Imported:
    """Read the first animation of a VRMA, its rest pose taken out, and the sound of the same name beside it.

    Raises:
        StudioError: it is no VRM Animation, cut short or damaged.
    """
    motion, notes = animation.read(path)
    audio = audio or find_audio(path)
    notes += [] if audio else [say("No sound was found for {name}.", name=path.stem)]
    return Imported(path.stem, motion, audio, tuple(notes))


def write(path: Path, motion: Motion, audio: Path | None = None) -> tuple[Path, ...]:
    """Write bones, expressions and gaze on an even grid from the sound's first moment on.

    Args:
        path: ends in .vrma.
        motion: its median rate is kept; required bones that it lacks stand at rest.
        audio: not written; a VRMA has no sound.

    Returns:
        The file, read back and compared by forward kinematics.
    """
    check_suffix(path, SUFFIX)
    if not len(motion) or not (motion.bone_names or motion.shape_names):
        raise RequestError(
            say("There is no motion to write to {name}.", name=path.name), "Choose a take with motion."
        )
    # Slower than that the reader would take the keys for poses to move between.
    even = on_grid(motion, 0.0 if motion.fps >= SLOWEST else DEFAULT_FPS)
    body = grounded_body(even) or Motion.build(even.times)
    gaze = _gaze(even)
    # A VRMA must not have eye bones; what they do is the lookAt node's rotation.
    moved = [j for j, name in enumerate(body.bone_names) if name not in EYES]
    body = Motion.build(
        body.times, (), None, tuple(body.bone_names[j] for j in moved),
        body.positions[:, moved], body.rotations[:, moved],
    )  # fmt: skip
    expressions = _expressions(even)
    document, numbers = _document(body, expressions, gaze, even)
    return checked(
        path,
        lambda beside: _glb.write(beside, document, numbers),
        lambda beside: _fits(beside, body, expressions),
    )


def expression_of(shape: str) -> str:
    """The VRM 1.0 preset a blend shape is, "" where it is none or only a gaze."""
    name = _TO_VRM1.get(shape.lower(), "")
    return name if name in _PRESETS else ""


def rest_skeleton(body: Skeleton) -> Skeleton:
    """A skeleton with all bones that VRM requires; those it lacks stand where the built-in figure has them.

    Its own bones stay where they were, so bones in between change offsets but no rotation.
    """
    names = (*REQUIRED, *(name for name in body.bone_names if name not in REQUIRED))
    rest = Skeleton.humanoid(names)
    identity = np.tile(rotation.IDENTITY, (len(body.bone_names), 1))
    own = dict(zip(body.bone_names, body.forward(body.rest_positions, identity)[0], strict=True))
    world = np.zeros((len(names), 3))
    for j in rest.order:
        parent = world[rest.parents[j]] if rest.parents[j] >= 0 else 0.0
        world[j] = own.get(names[j], parent + rest.rest_positions[j])
    offsets = np.array([world[j] - (world[p] if p >= 0 else 0.0) for j, p in enumerate(rest.parents)])
    return Skeleton.humanoid(names, offsets)


def _expressions(motion: Motion) -> dict[str, Array]:
    """Weights (T,) by expression; where two shapes mean one expression the first counts."""
    found: dict[str, Array] = {}
    for s, shape in enumerate(motion.shape_names):
        name = expression_of(shape) or ("" if shape.lower() in _TO_VRM1 else shape)
        if name and name not in found:
            found[name] = np.clip(motion.shapes[:, s].astype(np.float64), 0.0, 1.0)
    return found


def _gaze(motion: Motion) -> Array | None:
    """The gaze (T, 4) against the head in glTF's axes: the mean of both eyes, without roll."""
    # One node for both eyes: the format has no squint.
    eyes = [motion.rotations[:, motion.bone_names.index(eye)] for eye in EYES if eye in motion.bone_names]
    if not eyes:
        return None
    yaw, pitch, roll = rotation.to_euler_yxz(rotation.slerp(eyes[0], eyes[-1], 0.5) * MIRROR_TURN)
    return rotation.sign_continuous(rotation.from_euler_yxz(yaw, pitch, np.zeros_like(roll)))


def _document(
    body: Motion, expressions: dict[str, Array], gaze: Array | None, source: Motion
) -> tuple[dict[str, Any], _glb.Numbers]:
    """The glTF document and its numbers.

    UniVRM takes the first node of the scene as the figure and deletes the nodes of expressions by index, so
    these come last, one channel each in the same order, and everything else hangs below the first node.
    """
    numbers, skeleton = _glb.Numbers(), rest_skeleton(body.skeleton)
    nodes = _bone_nodes(skeleton)
    times = numbers.add(source.times, bounds=True)
    tracks: list[tuple[int, str, int]] = []
    for j, name in enumerate(body.bone_names):
        node = skeleton.bone_names.index(name) + 1
        if name == "Hips":
            tracks.append((node, "translation", numbers.add(body.positions[:, j] * MIRROR)))
        tracks.append((node, "rotation", numbers.add(body.rotations[:, j] * MIRROR_TURN)))
    extension: dict[str, Any] = {"specVersion": "1.0", "humanoid": {"humanBones": _human_bones(skeleton)}}
    if gaze is not None:
        nodes[0]["children"].append(len(nodes))
        extension["lookAt"] = {"node": len(nodes), "offsetFromHeadBone": _eye_offset(source)}
        tracks.append((len(nodes), "rotation", numbers.add(gaze)))
        nodes.append({"name": "lookAt"})
    groups: dict[str, dict[str, Any]] = {"preset": {}, "custom": {}}
    scene = [0]
    for name, weights in expressions.items():
        groups["preset" if name in _PRESETS else "custom"][name] = {"node": len(nodes)}
        # Beside the figure, not below it: UniVRM takes the first node of the scene for the humanoid's root.
        scene.append(len(nodes))
        values = np.stack([weights, np.zeros_like(weights), np.zeros_like(weights)], axis=1)
        tracks.append((len(nodes), "translation", numbers.add(values)))
        nodes.append({"name": name})
    if expressions:
        extension["expressions"] = {group: names for group, names in groups.items() if names}
    document = {
        "asset": {"version": "2.0", "generator": "Saia Studio"},
        "extensionsUsed": ["VRMC_vrm_animation"],
        "extensions": {"VRMC_vrm_animation": extension},
        "scene": 0,
        "scenes": [{"nodes": scene}],
        "nodes": nodes,
        "animations": [_animation(tracks, times)],
    }
    return document, numbers


def _bone_nodes(skeleton: Skeleton) -> list[dict[str, Any]]:
    """A root without any turn, and each bone at its place in the list plus one."""
    # + 0.0 makes of -0.0, which JSON would keep, a plain zero.
    offsets = skeleton.rest_positions * MIRROR + 0.0
    nodes: list[dict[str, Any]] = [{"name": "Root", "children": []}]
    nodes += [
        {"name": name, "translation": offset.tolist()}
        for name, offset in zip(skeleton.bone_names, offsets, strict=True)
    ]
    for j, parent in enumerate(skeleton.parents):
        nodes[parent + 1].setdefault("children", []).append(j + 1)
    return nodes


def _human_bones(skeleton: Skeleton) -> dict[str, dict[str, int]]:
    return {vrm1_bone(name): {"node": j + 1} for j, name in enumerate(skeleton.bone_names)}


def _eye_offset(motion: Motion) -> list[float]:
    rest = Skeleton.humanoid(EYES).rest_positions
    if "Head" in motion.bone_names:
        found = [motion.skeleton.rest_positions[motion.bone_names.index(e)] for e in _eyes_of(motion)]
        rest = np.array(found)
    offset: list[float] = (rest.mean(axis=0) * MIRROR + 0.0).tolist()
    return offset


def _eyes_of(motion: Motion) -> Iterable[str]:
    return (eye for eye in EYES if eye in motion.bone_names)


def _animation(tracks: list[tuple[int, str, int]], times: int) -> dict[str, Any]:
    samplers = [{"input": times, "output": out, "interpolation": "LINEAR"} for _, _, out in tracks]
    channels = [{"sampler": i, "target": {"node": n, "path": p}} for i, (n, p, _) in enumerate(tracks)]
    return {"name": "Motion", "samplers": samplers, "channels": channels}


def _fits(path: Path, body: Motion, expressions: dict[str, Array]) -> bool:
    """Whether a file holds what was to be written: every frame's time, every weight, every bone."""
    back, _ = animation.read(path)
    same = len(back) == len(body) and np.allclose(back.times, body.times, rtol=0, atol=1e-3)
    if same and set(expressions) == set(back.shape_names):
        weights = [np.abs(back.shapes[:, s] - expressions[n]).max() for s, n in enumerate(back.shape_names)]
        # Not `any(far >= ...)`: NaN compares as false, and must not pass.
        same = all(far < 1e-5 for far in weights)
    if not same or not set(body.bone_names) <= set(back.bone_names):
        return False
    rows = np.unique(np.linspace(0, len(body) - 1, _FRAMES_COMPARED).astype(int))
    # Bones that move against their parent (only Hips may in a VRMA) are held at their rest offset.
    expected = np.tile(body.skeleton.rest_positions, (len(rows), 1, 1))
    if "Hips" in body.bone_names:
        expected[:, body.bone_names.index("Hips")] = body.positions[rows, body.bone_names.index("Hips")]
    at, turned = body.skeleton.forward(expected, body.rotations[rows])
    got_at, got_turned = back.skeleton.forward(back.positions[rows], back.rotations[rows])
    bones = [back.bone_names.index(name) for name in body.bone_names]
    far = np.abs(got_at[:, bones] - at).max(initial=0.0)
    angle = rotation.angle_between(got_turned[:, bones], turned).max(initial=0.0)
    return bool(far <= _TOLERANCE_M and angle <= _TOLERANCE_RADIANS)
