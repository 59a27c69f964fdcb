"""MMD's bones and the humanoid's: who is who, and the arms that rest lower than a T-pose's."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from studio.motion import Motion, Skeleton, rotation

Array = NDArray[np.floating]

METRES_A_UNIT = 0.08
ARM_REST = np.radians(35.0)
"""How far below level an MMD model's arms rest; most stand between 30 and 40 degrees."""
CENTRE = "センター"
_BODY = {
    "下半身": "Hips", "上半身": "Spine", "上半身2": "UpperChest", "首": "Neck", "頭": "Head",
    "左目": "LeftEye", "右目": "RightEye",
}  # fmt: skip
_ARMS = {"肩": "Shoulder", "腕": "UpperArm", "ひじ": "LowerArm", "手首": "Hand"}
_FINGERS = {"人指": "Index", "中指": "Middle", "薬指": "Ring", "小指": "Little"}
_PARTS = ("Proximal", "Intermediate", "Distal")


def _names() -> dict[str, str]:
    found = dict(_BODY)
    for kanji, side in (("左", "Left"), ("右", "Right")):
        found |= {kanji + name: side + bone for name, bone in _ARMS.items()}
        for i, part in enumerate(_PARTS):
            found |= {f"{kanji}{name}{'１２３'[i]}": side + f + part for name, f in _FINGERS.items()}
            found[f"{kanji}親指{'０１２'[i]}"] = f"{side}Thumb{part}"
    return found


BONES = _names()
"""HumanBodyBones name by MMD's."""
NAMES = frozenset((*BONES, CENTRE, "グルーブ"))
KEPT = frozenset(BONES.values())
_HALF_TURN = np.array([-1.0, 1.0, -1.0])
_HALF_TURN_Q = np.array([-1.0, 1.0, -1.0, 1.0])


def _rests_lower(bone: str) -> float:
    """The side (+1 left, -1 right) of a bone that hangs from a lowered arm, 0 for others."""
    side = 1.0 if bone.startswith("Left") else -1.0 if bone.startswith("Right") else 0.0
    return 0.0 if bone.endswith(("Eye", "Shoulder")) else side


def _lowered(bone: str) -> Array:
    """The turn that takes a bone from the T-pose to MMD's rest, in MMD's axes (the left arm along +X)."""
    return rotation.from_axis_angle([0.0, 0.0, 1.0], -_rests_lower(bone) * ARM_REST)


def from_humanoid(body: Motion) -> dict[str, tuple[Array, Array]]:
    """Positions (T, 3) in MMD's units and rotations (T, 4) by MMD's bone name.

    Args:
        body: humanoid bones, hips among them.

    Returns:
        The bones the body has. Each turn is D_parent^-1 D, with D the bone's change from MMD's own rest.
    """
    names = body.bone_names
    _, turned = body.skeleton.forward(body.positions, body.rotations)
    world = {name: turned[:, j] * _HALF_TURN_Q for j, name in enumerate(names)}
    still = np.zeros((len(body), 3))
    hips = body.positions[:, names.index("Hips")]
    moved = (hips - Skeleton.humanoid(("Hips",)).rest_positions[0] * _height(body)) * _HALF_TURN
    found: dict[str, tuple[Array, Array]] = {
        CENTRE: (moved / METRES_A_UNIT, np.tile(rotation.IDENTITY, (len(body), 1)))
    }
    present = {bone for bone in BONES.values() if bone in world}
    for name, bone in BONES.items():
        if bone not in present:
            continue
        change = rotation.multiply(world[bone], rotation.inverse(_lowered(bone)))
        above = _above(bone, present)
        if above:
            up = rotation.multiply(world[above], rotation.inverse(_lowered(above)))
            change = rotation.multiply(rotation.inverse(up), change)
        found[name] = (still, rotation.sign_continuous(change))
    return found


def to_humanoid(tracks: dict[str, tuple[Array, Array]], frames: int) -> tuple[tuple[str, ...], Array, Array]:
    """Bone names, local positions (T, J, 3) and local rotations (T, J, 4) in Unity's axes.

    Args:
        tracks: positions (T, 3) and rotations (T, 4) by MMD's bone name, of NAMES only.
        frames: T.
    """
    present = {BONES[name] for name in tracks if name in BONES}
    if not tracks:
        return (), np.zeros((frames, 0, 3)), np.zeros((frames, 0, 4))
    names = tuple(dict.fromkeys(("Hips", *(bone for bone in BONES.values() if bone in present))))
    whole = np.tile(rotation.IDENTITY, (frames, 1))
    changes: dict[str, Array] = {}
    for name, bone in BONES.items():  # parents come before their children in the table
        if bone in present:
            above = _above(bone, present)
            changes[bone] = rotation.multiply(changes[above] if above else whole, tracks[name][1])
    world = {b: rotation.multiply(c, _lowered(b)) * _HALF_TURN_Q for b, c in changes.items()}
    rest = Skeleton.humanoid(names)
    positions = np.tile(rest.rest_positions, (frames, 1, 1))
    for name in (CENTRE, "グルーブ"):
        if name in tracks:
            positions[:, 0] += tracks[name][0] * _HALF_TURN * METRES_A_UNIT
    rotations = np.tile(rotation.IDENTITY, (frames, len(names), 1))
    for j, bone in enumerate(names):
        parent = names[rest.parents[j]] if rest.parents[j] >= 0 else ""
        q = world.get(bone, whole)
        rotations[:, j] = rotation.multiply(rotation.inverse(world.get(parent, whole)), q) if parent else q
    return names, positions, rotations


def _above(bone: str, present: set[str]) -> str:
    """The bone that one hangs from in MMD, "" for the centre."""
    if bone in ("Hips", "Spine"):
        return ""
    rest = Skeleton.humanoid(tuple(sorted(present)))
    parent = rest.parents[rest.bone_names.index(bone)]
    above = rest.bone_names[parent] if parent >= 0 else ""
    return "" if above == "Hips" else above


def _height(body: Motion) -> float:
    """The body's resting hips height against the built-in figure's."""
    hips = body.bone_names.index("Hips")
    return float(np.median(body.positions[:, hips, 1])) / float(
        Skeleton.humanoid(("Hips",)).rest_positions[0, 1]
    )
