"""Any program's skeleton made a humanoid: its unit, its axes and its rest pose guessed, and said."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from studio.errors import say
from studio.formats._bvh_text import Bvh
from studio.motion import Motion, Skeleton, rotation
from studio.motion.avatar import MIRROR, MIRROR_TURN

Array = NDArray[np.floating]

# Thigh and shin of the built-in figure.
_LEG_M = 0.81
# Metres of thigh and shin together, from a child's to a giant's.
_PLAUSIBLE = (0.33, 1.6)
_UNITS = {say("centimetres"): 0.01, say("metres"): 1.0}
_RARE_UNITS = {
    say("inches"): 0.0254, say("CMU's units (5.6 cm)"): 0.056444, say("millimetres"): 0.001,
    say("feet"): 0.3048,
}  # fmt: skip
# Limbs nearer to the T-pose than this rest in it.
_T_POSE_DEGREES = 15.0


def to_humanoid(bvh: Bvh, bones: dict[str, int], skeleton: Skeleton) -> tuple[Motion, list[str]]:
    """The motion of the bones in Unity's axes and metres, and what was guessed.

    Args:
        bvh: the file.
        bones: joint index by HumanBodyBones name; joints that are no bones are folded into those below them.
        skeleton: of the file's joints.
    """
    p: Array
    q: Array
    p, q = skeleton.forward(*bvh.local())
    identity = np.tile(rotation.IDENTITY, (len(bvh.joints), 1))
    at_rest = skeleton.forward(skeleton.rest_positions, identity)[0]
    names = tuple(sorted(bones, key=lambda bone: bones[bone]))
    joints = [bones[name] for name in names]
    p, q, rest = p[:, joints], q[:, joints], dict(zip(names, at_rest[joints], strict=True))
    p, q, rest, notes = _upright(p, q, rest)
    # A file with Unity's names is ours or alike: small avatars are small, not in inches.
    named_alike = all(bvh.joints[j].name.lower() == bone.lower() for bone, j in bones.items())
    scale, unit = _by_height(p, rest) if named_alike else _scale(p, rest)
    notes = [say("read in {unit}", unit=say(unit))] * (unit != "centimetres") + notes
    lowered = _corrections(rest)
    if lowered:
        notes.append(say("its rest pose was taken for a T-pose"))
    for j, name in enumerate(names):
        if name in lowered:
            q[:, j] = rotation.multiply(q[:, j], np.broadcast_to(lowered[name], q[:, j].shape))
    p, q = p * scale * MIRROR, q * MIRROR_TURN
    positions, rotations = p.copy(), q.copy()
    for j, parent in enumerate(Skeleton.humanoid(names).parents):
        if parent >= 0:
            back = rotation.inverse(q[:, parent])
            positions[:, j] = rotation.rotate(back, p[:, j] - p[:, parent])
            rotations[:, j] = rotation.multiply(back, q[:, j])
    times = np.arange(len(bvh.frames)) * bvh.frame_time
    return Motion.build(times, (), None, names, positions, rotations), notes


def _upright(p: Array, q: Array, rest: dict[str, Array]) -> tuple[Array, Array, dict[str, Array], list[str]]:
    """Turn a figure whose rest pose lies or looks another way so that it stands and looks along +Z."""
    axes = _axes(rest)
    if axes is None or np.allclose(axes, np.eye(3)):
        return p, q, rest, []
    turn = rotation.from_matrix(axes)
    back = np.broadcast_to(rotation.inverse(turn), q.shape)
    rest = {name: axes @ at for name, at in rest.items()}
    names = list(rest)
    head = names.index(next(name for name in _TOPS if name in rest))
    up = (p[:, head] - p[:, names.index("Hips")]).mean(axis=0)
    if not np.allclose(axes[1], [0, 1, 0]) and int(np.argmax(np.abs(up))) == 1:
        # The rest pose lies down but the motion stands it up: the world is right as it is.
        return p, rotation.multiply(q, back), rest, [say("its rest pose was stood upright")]
    turned = rotation.multiply(np.broadcast_to(turn, q.shape), rotation.multiply(q, back))
    return p @ axes.T, turned, rest, [say("turned to stand upright and look ahead")]


_TOPS = ("Head", "Neck", "UpperChest", "Chest", "Spine")


def _axes(rest: dict[str, Array]) -> NDArray[np.float64] | None:
    """The matrix from the rest pose's own left, up and ahead to X, Y and Z, by whole quarter turns."""
    top = next((name for name in _TOPS if name in rest), None)
    pair = next(
        (b for b in ("UpperLeg", "UpperArm", "Shoulder") if {"Left" + b, "Right" + b} <= set(rest)), None
    )
    if top is None or pair is None:
        return None
    # By whole quarter turns: programs differ by their axes, not by a few degrees.
    up = _nearest_axis(rest[top] - rest["Hips"])
    left = rest["Left" + pair] - rest["Right" + pair]
    left = _nearest_axis(left - up * float(left @ up))
    if not up.any() or not left.any():
        return None
    return np.stack([left, up, np.cross(left, up)])


def _nearest_axis(v: Array) -> NDArray[np.float64]:
    found = np.zeros(3)
    place = int(np.argmax(np.abs(v)))
    found[place] = np.sign(v[place])
    return found


def _scale(p: Array, rest: dict[str, Array]) -> tuple[float, str]:
    """Metres a unit, and the unit's name: the one that gives a figure of human size."""
    for side in ("Left", "Right"):
        chain = [side + bone for bone in ("UpperLeg", "LowerLeg", "Foot")]
        if not set(chain) <= set(rest):
            continue
        hip, knee, ankle = (rest[bone] for bone in chain)
        leg = float(np.linalg.norm(knee - hip) + np.linalg.norm(ankle - knee))
        for name, metres in _UNITS.items():
            if _PLAUSIBLE[0] <= leg * metres <= _PLAUSIBLE[1]:
                return metres, name
        if leg > 0:
            name = min(_RARE_UNITS, key=lambda unit: abs(np.log(leg * _RARE_UNITS[unit] / _LEG_M)))
            if _PLAUSIBLE[0] <= leg * _RARE_UNITS[name] <= _PLAUSIBLE[1]:
                return _RARE_UNITS[name], name
            # No unit fits: a figure of human size is what people expect to see.
            return _LEG_M / leg, say("a unit of its own, made human size")
    return _by_height(p, rest)


def _by_height(p: Array, rest: dict[str, Array]) -> tuple[float, str]:
    """Centimetres where the hips are more than ten units high, else metres."""
    height = abs(float(p[0, list(rest).index("Hips"), 1]))
    return (0.01, say("centimetres")) if height > 10 else (1.0, say("metres"))


def _corrections(rest: dict[str, Array]) -> dict[str, Array]:
    """Turns from the T-pose to a file's rest pose, by bone; none for limbs that rest in the T-pose."""
    found: dict[str, Array] = {}
    for side, x in (("Left", 1.0), ("Right", -1.0)):
        arm = [side + bone for bone in ("UpperArm", "LowerArm", "Hand")]
        leg = [side + bone for bone in ("UpperLeg", "LowerLeg", "Foot")]
        for chain, level in ((arm, np.array([x, 0.0, 0.0])), (leg, np.array([0.0, -1.0, 0.0]))):
            for bone, child in pairwise(chain):
                if bone in rest and child in rest:
                    turn = _arc(level, rest[child] - rest[bone])
                    if np.degrees(rotation.angle_between(turn, rotation.IDENTITY)) > _T_POSE_DEGREES:
                        found[bone] = turn
        if side + "LowerArm" in found:
            hand = (side + part for part in ("Hand", "Thumb", "Index", "Middle", "Ring", "Little"))
            found |= {b: found[side + "LowerArm"] for h in hand for b in rest if b.startswith(h)}
    return found


def _arc(a: Array, b: Array) -> Array:
    """The shortest turn from one direction to another."""
    length = float(np.linalg.norm(b))
    if length < 1e-9:
        return rotation.IDENTITY
    b = b / length
    # Opposite: any axis across will do.
    if float(a @ b) < -0.9999:
        return rotation.from_axis_angle([0.0, 0.0, 1.0], np.pi)
    return rotation.normalised(np.append(np.cross(a, b), 1.0 + float(a @ b)))
