"""Face tracking apps of phones that do not speak VMC: one datagram is one whole face. Pure.

Source: iFacialMocap's page for developers (UDP 49983, text, weights 0 to 100, degrees); Live Link Face's
packets as Unreal Engine reads them (UDP 11111, version 6, big-endian, 61 floats, radians). Both turn head
and eyes about Unity's axes: pitch about x, yaw about y, roll about z.
"""

from __future__ import annotations

import math
import struct

from studio.motion.channels import ARKIT_SHAPES
from studio.vmc.decode import Placed, Quaternion
from studio.vmc.osc import AbsurdError, MalformedError

IFACIALMOCAP, LIVE_LINK_FACE = "iFacialMocap", "Live Link Face"
IFACIALMOCAP_PORT, LIVE_LINK_PORT = 49983, 11111
HELLO = b"iFacialMocap_sahuasouryya9218sauhuiayeta91555dy3719"
"""What asks a phone on its port 49983 to begin sending here."""

_MOST_BYTES = 8192
_BY_LOWER = {name.lower(): name for name in ARKIT_SHAPES}
_BONES = {"head": "Head", "righteye": "RightEye", "lefteye": "LeftEye"}
_PLACE = (0.0, 0.0, 0.0)
_VERSION = 6
_VALUES = 61
_SWAPPED = {
    "JawRight": "JawLeft",
    "JawLeft": "JawRight",
    "MouthRight": "MouthLeft",
    "MouthLeft": "MouthRight",
}
_LIVE_LINK_SHAPES = tuple(_SWAPPED.get(name, name) for name in ARKIT_SHAPES)
"""The packet's order, which is Unreal's: left before right, where the app's CSV has right before left."""
_INT, _FLOATS = struct.Struct(">i"), struct.Struct(f">{_VALUES}f")
_LONGEST_TEXT = 256


def kind_of(datagram: bytes) -> str:
    """Which app a datagram comes from; "" where it is none of theirs."""
    if datagram.startswith((b"/", b"#")) or len(datagram) > _MOST_BYTES:
        return ""
    if datagram[:1] == bytes([_VERSION]) and len(datagram) > _FLOATS.size:
        return LIVE_LINK_FACE
    return IFACIALMOCAP if b"|" in datagram else ""


def read(kind: str, datagram: bytes) -> tuple[dict[str, float], dict[str, Placed]]:
    """What one face says.

    Args:
        kind: what `kind_of` said.

    Returns:
        Weights and bones by name.

    Raises:
        AbsurdError: it is no face at all.
        MalformedError: it is damaged.
    """
    return _text(datagram) if kind == IFACIALMOCAP else _binary(datagram)


def _text(datagram: bytes) -> tuple[dict[str, float], dict[str, Placed]]:
    """`eyeBlink_L-37|...|=head#pitch,yaw,roll,x,y,z|rightEye#...|leftEye#...|`, in any order.

    The second version of the format writes & for -, so that weights may be negative.
    """
    try:
        text = datagram.decode("utf-8")
    except UnicodeDecodeError as error:
        raise AbsurdError("the face is not text") from error
    shapes: dict[str, float] = {}
    turns: dict[str, Placed] = {}
    for part in text.replace("=", "|").split("|"):
        if "#" in part:
            name, _, numbers = part.partition("#")
            bone = _BONES.get(name.lower())
            if bone is not None:
                turns[bone] = _PLACE, _turn([math.radians(n) for n in _numbers(numbers)])
        elif part:
            name, sign, number = part.partition("&" if "&" in part else "-")
            known = _BY_LOWER.get(_arkit(name).lower())
            if known is not None and sign:
                shapes[known] = _weight(_number(number) / 100)
    if not shapes and not turns:
        raise AbsurdError("there is no face in it")
    return shapes, turns


def _binary(datagram: bytes) -> tuple[dict[str, float], dict[str, Placed]]:
    """Version, device, subject, frame time, a count, and the values in Live Link's order."""
    at = 1
    for _ in range(2):
        if at + 4 > len(datagram):
            raise MalformedError("the face is cut off")
        (length,) = _INT.unpack_from(datagram, at)
        if not 0 <= length <= _LONGEST_TEXT:
            raise MalformedError("a text is longer than any")
        at += 4 + length
    at += 16
    if at + 1 + _FLOATS.size > len(datagram) or datagram[at] != _VALUES:
        raise MalformedError("the face is cut off")
    values = _FLOATS.unpack_from(datagram, at + 1)
    shapes = {name: _weight(value) for name, value in zip(_LIVE_LINK_SHAPES, values, strict=False)}
    angles = values[len(_LIVE_LINK_SHAPES) :]
    turns: dict[str, Placed] = {}
    for place, bone in enumerate(("Head", "LeftEye", "RightEye")):
        yaw, pitch, roll = angles[3 * place : 3 * place + 3]
        turns[bone] = _PLACE, _turn([pitch, yaw, roll])
    return shapes, turns


def _arkit(name: str) -> str:
    """eyeBlink_L is ARKit's eyeBlinkLeft."""
    if name.endswith("_L"):
        return name[:-2] + "Left"
    return name[:-2] + "Right" if name.endswith("_R") else name


def _number(text: str) -> float:
    try:
        return float(text.strip().replace(",", ".") or "nan")
    except ValueError as error:
        raise MalformedError("a number is none") from error


def _numbers(text: str) -> list[float]:
    numbers = [_number(part) for part in text.split(",")[:3]]
    if len(numbers) < 3:
        raise MalformedError("a turn is cut off")
    return numbers


def _weight(value: float) -> float:
    if not abs(value) <= 100.0:
        raise MalformedError("a weight is out of all bounds")
    return min(max(value, 0.0), 1.0)


def _turn(angles: list[float]) -> Quaternion:
    """Ry Rx Rz, as Unity reads Euler angles, from pitch, yaw, roll in radians."""
    if not all(abs(angle) <= 100.0 for angle in angles):
        raise MalformedError("an angle is none")
    (sx, cx), (sy, cy), (sz, cz) = ((math.sin(a / 2), math.cos(a / 2)) for a in angles)
    return (
        cy * sx * cz + sy * cx * sz,
        sy * cx * cz - cy * sx * sz,
        cy * cx * sz - sy * sx * cz,
        cy * cx * cz + sy * sx * sz,
    )
