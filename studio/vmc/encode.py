"""Encodes poses as VMC datagrams; `assemble` does the reverse. Pure.

Source: VMC protocol V3.1, performer specification; OSC 1.0.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple

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
    wire = _wire(tuple(shape_names), tuple(bone_names), options)
    words = wire.words.copy()
    words[wire.places] = np.concatenate([_rows(pose, wire, options), _shapes(pose, wire), [t]])[wire.chosen]
    raw = words.tobytes()
    return [raw[start:end] for start, end in pairwise(wire.cuts)]


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
            tags, body = tags + "f", body + struct.pack(">f", argument)
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
_BONE_HEAD = _text("/VMC/Ext/Bone/Pos") + _text(",sfffffff")
_SHAPE_HEAD = _text("/VMC/Ext/Blend/Val") + _text(",sf")


class _Part(NamedTuple):
    """A message: how it begins, how many floats it ends with, and whether it is a bone's."""

    head: bytes
    floats: int = 0
    is_bone: bool = False

    @property
    def size(self) -> int:
        return len(self.head) + 4 * self.floats


@dataclass(frozen=True, eq=False)
class _Wire:
    """Frames of some channels as bytes in which only the floats are missing.

    Args:
        words: all datagrams one behind the other, in words of four bytes (W,).
        cuts: bytes at which datagrams begin, and the end of the last one.
        places: the words that are floats.
        chosen: which of a frame's numbers they are: seven of the root and of each bone, shapes, the time.
        rest: where the bones rest (J, 3).
        sources, targets: numbers of shapes, and of the messages they go into (P,).
    """

    words: NDArray[np.float32]
    cuts: tuple[int, ...]
    places: NDArray[np.intp]
    chosen: NDArray[np.intp]
    rest: NDArray[np.float64]
    sources: NDArray[np.intp]
    targets: NDArray[np.intp]


# Channels and options stay the same from frame to frame: names are put into bytes once.
@lru_cache(maxsize=64)
def _wire(shape_names: tuple[str, ...], bone_names: tuple[str, ...], options: SendOptions) -> _Wire:
    sent: dict[str, int] = {}
    pairs = [
        (source, sent.setdefault(target, len(sent)))
        for source, name in enumerate(shape_names)
        for target in _targets(name, options.names)
    ]
    bones = [_Part(_BONE_HEAD + _text(name), 7, True) for name in bone_names]
    shapes = [_Part(_SHAPE_HEAD + _text(name), 1) for name in sent]
    # Apply even without shapes: receivers end their frame at it.
    parts = [_Part(_OK), _Part(_ROOT_HEAD, 7), *bones, *shapes, _Part(_APPLY), _Part(_T_HEAD, 1)]
    asked = [options.ok, options.root, *[True] * (len(parts) - 3), options.sender_time]
    numbers = np.split(np.arange(sum(one.floats for one in parts)), np.cumsum([one.floats for one in parts]))
    kept = [(part, mine) for part, mine, wanted in zip(parts, numbers, asked, strict=False) if wanted]
    groups = _bundles([part for part, _ in kept]) if options.bundle else [[part] for part, _ in kept]
    places: list[int] = []
    raw, cuts = b"", [0]
    for group in groups:
        raw += _BUNDLE if options.bundle else b""
        for part in group:
            raw += (struct.pack(">i", part.size) if options.bundle else b"") + part.head
            places += range(len(raw) // 4, len(raw) // 4 + part.floats)
            raw += bytes(4 * part.floats)
        cuts.append(len(raw))
    return _Wire(
        np.frombuffer(raw, dtype=">f4"),
        tuple(cuts),
        np.array(places, dtype=np.intp),
        np.concatenate([mine for _, mine in kept]),
        Skeleton.humanoid(bone_names).rest_positions,
        *np.array(pairs, dtype=np.intp).reshape(-1, 2).T,
    )


def _rows(pose: Pose, wire: _Wire, options: SendOptions) -> NDArray[np.float64]:
    """Position and rotation of the root and of each bone, one after another."""
    rows = np.empty((1 + len(wire.rest), 7))
    if options.rotations_only:
        rows[0, :3], rows[1:, :3] = 0.0, wire.rest
    else:
        rows[0, :3] = np.where(np.isfinite(pose.root_position), pose.root_position, 0.0)
        # EVMC4U applies positions as they come: a bone at zero collapses into its parent.
        usable = np.isfinite(pose.positions).all(axis=1, keepdims=True)
        usable &= pose.positions.any(axis=1, keepdims=True)
        rows[1:, :3] = np.where(usable, pose.positions, wire.rest)
    rows[:, 3:] = rotation.normalised(np.concatenate([pose.root_rotation[None], pose.rotations]))
    return rows.reshape(-1)


def _shapes(pose: Pose, wire: _Wire) -> NDArray[np.float64]:
    """What is sent of shapes, 0..1; where two become one the larger wins."""
    values = np.zeros(wire.targets.max(initial=-1) + 1)
    np.maximum.at(values, wire.targets, np.fmin(np.fmax(pose.shapes, 0.0), 1.0)[wire.sources])
    return values


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


def _bundles(parts: Iterable[_Part]) -> Iterable[list[_Part]]:
    """Messages in order, as they are packed; a new bundle begins where one would grow past its limits."""
    held: list[_Part] = []
    for part in parts:
        size = len(_BUNDLE) + sum(4 + one.size for one in (*held, part))
        if held and (size > MAX_DATAGRAM or (part.is_bone and sum(one.is_bone for one in held) == MAX_BONES)):
            yield held
            held = []
        held.append(part)
    yield held
