"""Encodes poses as VMC datagrams; `assemble` does the reverse. Pure.

Source: VMC protocol V3.1, performer specification; OSC 1.0.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from studio.motion import rotation
from studio.motion.channels import VRM0_TO_VRM1, VRM1_TO_VRM0, canonical_shape
from studio.motion.motion import Pose
from studio.motion.skeleton import Skeleton

NAME_SETS = ("vrm0", "vrm1", "arkit", "as_is")
# Below what any network carries in one piece (1500 with its headers), as VirtualMotionCapture does.
MAX_DATAGRAM = 1200
MAX_BONES = 13
"""Bones a bundle, as VirtualMotionCapture sends them: some receivers count on small datagrams."""
# Time tag 1 means "at once"; python-osc would sleep on one in the future.
_BUNDLE = b"#bundle\x00" + struct.pack(">Q", 1)
_SEVEN, _ONE = struct.Struct(">7f"), struct.Struct(">f")

_ARKIT_FROM_VRM0: dict[str, tuple[str, ...]] = {
    "A": ("JawOpen",), "O": ("MouthFunnel",), "U": ("MouthPucker",),
    "E": ("MouthStretchLeft", "MouthStretchRight"), "I": ("MouthSmileLeft", "MouthSmileRight"),
    "Blink": ("EyeBlinkLeft", "EyeBlinkRight"), "Blink_L": ("EyeBlinkLeft",), "Blink_R": ("EyeBlinkRight",),
    "Joy": ("MouthSmileLeft", "MouthSmileRight"), "Fun": ("CheekSquintLeft", "CheekSquintRight"),
    "Angry": ("BrowDownLeft", "BrowDownRight"), "Sorrow": ("MouthFrownLeft", "MouthFrownRight"),
    "Surprised": ("BrowInnerUp",), "LookUp": ("EyeLookUpLeft", "EyeLookUpRight"),
    "LookDown": ("EyeLookDownLeft", "EyeLookDownRight"), "LookLeft": ("EyeLookOutLeft", "EyeLookInRight"),
    "LookRight": ("EyeLookInLeft", "EyeLookOutRight"),
}  # fmt: skip


@dataclass(frozen=True)
class SendOptions:
    """How a frame is put on the wire.

    Args:
        names: one of NAME_SETS; shapes without a counterpart in it keep their own names.
        bundle: False sends one message a datagram, for receivers that fail on bundles.
        rotations_only: bones and the root stay where they rest; only rotations are the pose's.
        ok: send /VMC/Ext/OK (loaded, calibrated).
        root: send /VMC/Ext/Root/Pos.
        sender_time: send /VMC/Ext/T.
    """

    names: str = "vrm0"
    bundle: bool = True
    rotations_only: bool = False
    ok: bool = True
    root: bool = True
    sender_time: bool = True


def encode_frame(
    pose: Pose,
    shape_names: Sequence[str],
    bone_names: Sequence[str],
    t: float,
    options: SendOptions = SendOptions(),
) -> list[bytes]:
    """One frame as datagrams: OK, Root, bones, blends with Apply, then T.

    Args:
        pose: shapes (S,), positions (J, 3), rotations (J, 4).
        shape_names, bone_names: S and J names.
        t: the sender's clock in seconds; the caller keeps it rising over loops and seeks.
        options: how to send.

    Returns:
        Datagrams of at most MAX_DATAGRAM bytes, to be sent in this order.
    """
    state: list[bytes] = []
    if options.ok:
        state.append(_OK)
    if options.root:
        state.append(_root(pose, options.rotations_only))
    bones = _bones(pose, tuple(bone_names), options.rotations_only)
    shapes = [
        _shape_head(name) + _ONE.pack(value) for name, value in _named_shapes(pose, shape_names, options)
    ]
    # Apply even without shapes: receivers end their frame at it.
    ending = [*shapes, _APPLY] if shapes else [_APPLY]
    if options.sender_time:
        ending.append(_T_HEAD + _ONE.pack(t))
    if not options.bundle:
        return [*state, *bones, *ending]
    return list(_bundles(state, bones, ending))


def encode_age(seconds: float) -> bytes:
    """A datagram that says how long before it is sent the next frame happened; the studio's own message."""
    return message("/Saia/Age", float(seconds))


def encode_picture(age: float, flags: int, main: Sequence[float]) -> bytes:
    """A datagram that says what is known of a camera's picture; the studio's own message.

    Args:
        age: seconds since it was taken.
        flags: of motion.filmed.PictureFlag.
        main: jaw, mouth and blinks in it.
    """
    return message("/Saia/Picture", flags, float(age), *map(float, main))


def message(address: str, *arguments: str | int | float) -> bytes:
    """Any OSC message of strings, ints and floats.

    Returns:
        The message as bytes, a valid datagram by itself.
    """
    tags, body = ",", b""
    for argument in arguments:
        if isinstance(argument, str):
            tags, body = tags + "s", body + _text(argument)
        elif isinstance(argument, int):
            tags, body = tags + "i", body + struct.pack(">i", argument)
        else:
            tags, body = tags + "f", body + _ONE.pack(argument)
    return _text(address) + _text(tags) + body


def _text(value: str) -> bytes:
    """An OSC string: zero-ended, padded to four bytes."""
    raw = value.encode("utf-8")
    return raw + b"\x00" * (4 - len(raw) % 4)


# Loaded (1), calibrated (3), mode 0, tracking (1): EVMC4U can hide an avatar that is not calibrated.
_OK = message("/VMC/Ext/OK", 1, 3, 0, 1)
_APPLY = message("/VMC/Ext/Blend/Apply")
_T_HEAD = _text("/VMC/Ext/T") + _text(",f")
_ROOT_HEAD = _text("/VMC/Ext/Root/Pos") + _text(",sfffffff") + _text("root")


@lru_cache(maxsize=4096)
def _bone_head(name: str) -> bytes:
    return _text("/VMC/Ext/Bone/Pos") + _text(",sfffffff") + _text(name)


@lru_cache(maxsize=4096)
def _shape_head(name: str) -> bytes:
    return _text("/VMC/Ext/Blend/Val") + _text(",sf") + _text(name)


def _root(pose: Pose, rotations_only: bool) -> bytes:
    position = np.zeros(3) if rotations_only else np.nan_to_num(pose.root_position, posinf=0, neginf=0)
    return _ROOT_HEAD + _SEVEN.pack(*position.tolist(), *rotation.normalised(pose.root_rotation).tolist())


@lru_cache(maxsize=64)
def _rest(bone_names: tuple[str, ...]) -> NDArray[np.float64]:
    return Skeleton.humanoid(bone_names).rest_positions


def _bones(pose: Pose, bone_names: tuple[str, ...], rotations_only: bool) -> list[bytes]:
    if not bone_names:
        return []
    rest = _rest(bone_names)
    if rotations_only:
        positions = rest
    else:
        # EVMC4U applies positions as they come: a bone at zero collapses into its parent.
        usable = np.asarray(np.isfinite(pose.positions).all(axis=1) & pose.positions.any(axis=1))
        positions = np.where(usable[:, None], pose.positions, rest)
    rows = np.concatenate([positions, rotation.normalised(pose.rotations)], axis=1).tolist()
    return [_bone_head(name) + _SEVEN.pack(*row) for name, row in zip(bone_names, rows, strict=True)]


def _named_shapes(
    pose: Pose, shape_names: Sequence[str], options: SendOptions
) -> Iterable[tuple[str, float]]:
    """Shapes under the names the target knows, 0..1; where two become one the larger wins."""
    values = np.clip(np.nan_to_num(pose.shapes), 0.0, 1.0).tolist()
    out: dict[str, float] = {}
    for name, value in zip(shape_names, values, strict=True):
        for target in _targets(name, options.names):
            out[target] = max(value, out.get(target, 0.0))
    return out.items()


@lru_cache(maxsize=4096)
def _targets(name: str, names: str) -> tuple[str, ...]:
    if names == "as_is":
        return (name,)
    known = canonical_shape(name)
    old = VRM1_TO_VRM0.get(known, known)
    if names == "vrm1":
        return (VRM0_TO_VRM1.get(old, known),)
    if names == "arkit":
        return _ARKIT_FROM_VRM0.get(old, (known,))
    # VRM0 names are the default, since the protocol asks VRM1 senders to offer them.
    return (old,)


def _bundles(state: list[bytes], bones: list[bytes], ending: list[bytes]) -> Iterable[bytes]:
    """Messages packed in order; a new bundle begins where one would grow past its limits."""
    body, size, bones_in = [_BUNDLE], len(_BUNDLE), 0
    marks = [False] * len(state) + [True] * len(bones) + [False] * len(ending)
    for part, is_bone in zip([*state, *bones, *ending], marks, strict=True):
        full = size + 4 + len(part) > MAX_DATAGRAM or (is_bone and bones_in == MAX_BONES)
        if full and len(body) > 1:
            yield b"".join(body)
            body, size, bones_in = [_BUNDLE], len(_BUNDLE), 0
        body += [struct.pack(">i", len(part)), part]
        size += 4 + len(part)
        bones_in += is_bone
    yield b"".join(body)
