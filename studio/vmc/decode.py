"""Decodes one message: a VMC message's kind, name and values, or a phone's whole face. Pure.

Source: VMC protocol V3.1; iFacialMocap's page for developers (UDP 49983, text, weights 0 to 100, degrees);
Live Link Face's packets as Unreal Engine reads them (UDP 11111, version 6, big-endian, 61 floats, radians).
Both apps turn head and eyes about Unity's axes: pitch about x, yaw about y, roll about z.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple, Protocol

from studio.motion.channels import ARKIT_SHAPES, canonical_bone, canonical_shape
from studio.vmc import openseeface, osc, vtube_studio
from studio.vmc.openseeface import OPENSEEFACE
from studio.vmc.osc import AbsurdError, MalformedError
from studio.vmc.vtube_studio import VTUBE_STUDIO

MAX_SHAPES, MAX_BONES, MAX_NAME = 1024, 256, 128
"""Names kept of a sender at most, so that a hostile one cannot make memory grow."""
# Names remembered of those that were left out, so that a flood cannot make this set grow either.
_MOST_LEFT_OUT = 4 * MAX_SHAPES
_MAX_POSITION, _MAX_WEIGHT = 1000.0, 100.0

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
Placed = tuple[Vector, Quaternion]


class Sink(Protocol):
    """Whoever wants to hear what messages say."""

    def bone(self, name: str, placed: Placed) -> None:
        """A bone stands so."""

    def shape(self, name: str, weight: float) -> None:
        """A blend shape weighs so much."""

    def root(self, placed: Placed) -> None:
        """The avatar stands there."""

    def apply(self) -> None:
        """The shapes sent so far hold now."""

    def time(self, seconds: float) -> None:
        """The sender's clock says so."""

    def age(self, seconds: float) -> None:
        """What the next frame shows happened so long before it was sent."""

    def picture(self, age: float, flags: int, main: Vector) -> None:
        """A camera took a picture so long ago; what is known of it, and jaw, mouth and blinks in it."""

    def state(self, numbers: tuple[int, ...]) -> None:
        """Loaded, calibration state and mode, tracking: as many as came."""

    def avatar(self, texts: tuple[str, ...]) -> None:
        """Path, title and hash of the avatar: as many as came."""


_SEVEN, _ONE = struct.Struct(">7f"), struct.Struct(">f")
_APPLY_HEAD = b"/VMC/Ext/Blend/Apply\x00"
_BONE_HEAD = b"/VMC/Ext/Bone/Pos\x00\x00\x00,sfffffff\x00\x00\x00"
_ROOT_HEAD = b"/VMC/Ext/Root/Pos\x00\x00\x00,sfffffff\x00\x00\x00"
_TIME_HEAD = b"/VMC/Ext/T\x00\x00,f\x00\x00"
_SHAPE_HEAD = b"/VMC/Ext/Blend/Val\x00\x00,sf\x00"


class Decoder:
    """Reads VMC messages of one sender; keeps the names it has met, and only so many of them.

    A decoder for each sender: names that a hostile one makes up leave the others theirs.

    Args:
        spellings: shapes as others spell them, by their name in small letters.
    """

    def __init__(self, spellings: Mapping[str, str] = MappingProxyType({})) -> None:
        self._spellings = spellings
        self._left_out: set[str] = set()
        self._bones: set[str] = set()
        self._shapes: dict[str, str] = {}
        self._bone_heads: dict[bytes, str] = {}
        self._shape_heads: dict[bytes, str] = {}
        self._root_head: bytes | None = None
        self._last_state: tuple[bytes, tuple[int, ...]] = (b"", ())

    def decode(self, part: bytes, sink: Sink) -> None:
        """Read one message and tell the sink what it says.

        Raises:
            AbsurdError: no motion program sends that.
            MalformedError: it is damaged, or its values are beyond all bounds.
        """
        # The two messages that make up nearly all traffic differ only in their last bytes, so their whole
        # head (address, types, name) is looked up at once instead of being parsed.
        name = self._bone_heads.get(part[:-28])
        if name is not None:
            sink.bone(name, self._placed(_SEVEN.unpack_from(part, len(part) - 28)))
            return
        name = self._shape_heads.get(part[:-4])
        if name is not None:
            sink.shape(name, _weight(_ONE.unpack_from(part, len(part) - 4)[0]))
        elif part.startswith(_APPLY_HEAD):
            sink.apply()
        elif part[:-4] == _TIME_HEAD:
            sink.time(_finite(_ONE.unpack_from(part, len(part) - 4)[0]))
        elif part[:-28] == self._root_head:
            sink.root(self._placed(_SEVEN.unpack_from(part, len(part) - 28)))
        elif part == self._last_state[0]:
            sink.state(self._last_state[1])
        else:
            self._decode_rare(part, sink)

    def _decode_rare(self, part: bytes, sink: Sink) -> None:
        match osc.address(part):
            case "/VMC/Ext/Bone/Pos":
                sink.bone(*self._new_bone(part))
            case "/VMC/Ext/Blend/Val":
                sink.shape(*self._new_shape(part))
            case "/VMC/Ext/T":
                sink.time(_number(osc.arguments(part), 0))
            case "/VMC/Ext/Root/Pos":
                arguments = osc.arguments(part)
                # VMagicMirror sends the root with an empty name.
                _name(arguments, may_be_empty=True)
                sink.root(self._placed(_seven(arguments)))
                if part.startswith(_ROOT_HEAD) and len(arguments) == 8:
                    self._root_head = part[:-28]
            case "/Saia/Age":
                # The studio's own webcam says so; other programs pass over what they do not know.
                sink.age(_number(osc.arguments(part), 0))
            case "/Saia/Picture":
                arguments = osc.arguments(part)
                flags = int(_number(arguments, 0)) & 0xFF
                jaw, mouth, blinks = (_weight(_number(arguments, i)) for i in (2, 3, 4))
                sink.picture(_number(arguments, 1), flags, (jaw, mouth, blinks))
            case "/VMC/Ext/OK":
                numbers = tuple(a for a in osc.arguments(part)[:4] if isinstance(a, int))
                self._last_state = part, numbers
                sink.state(numbers)
            case "/VMC/Ext/VRM":
                sink.avatar(tuple(a[:1024] for a in osc.arguments(part)[:3] if isinstance(a, str)))
            case _:
                # Its address means nothing here.
                pass

    def _new_bone(self, part: bytes) -> tuple[str, Placed]:
        """A bone message whose head is not known yet, or that is written in an unusual way."""
        arguments = osc.arguments(part)
        name = canonical_bone(_name(arguments))
        if name not in self._bones and len(self._bones) >= MAX_BONES:
            raise self._one_too_many(name, "more bones than any body has")
        placed = self._placed(_seven(arguments))
        self._bones.add(name)
        if part.startswith(_BONE_HEAD) and len(arguments) == 8 and len(self._bone_heads) < 4 * MAX_BONES:
            self._bone_heads[part[:-28]] = name
        return name, placed

    def _new_shape(self, part: bytes) -> tuple[str, float]:
        arguments = osc.arguments(part)
        name = canonical_shape(_name(arguments))
        if name.lower() not in self._shapes and len(self._shapes) >= MAX_SHAPES:
            raise self._one_too_many(name.lower(), "more blend shapes than any face has")
        weight = _weight(_number(arguments, 1))
        # A sender that changes the case of its names still means the same shape.
        lower = name.lower()
        name = self._shapes.setdefault(lower, self._spellings.get(lower, name))
        if part.startswith(_SHAPE_HEAD) and len(arguments) == 2 and len(self._shape_heads) < 4 * MAX_SHAPES:
            self._shape_heads[part[:-4]] = name
        return name, weight

    def _one_too_many(self, name: str, what: str) -> MalformedError:
        """An avatar with too many names sends the same ones again and again; a flood, ever new ones."""
        if name in self._left_out:
            return MalformedError(what)
        if len(self._left_out) < _MOST_LEFT_OUT:
            self._left_out.add(name)
        return AbsurdError(what)

    def _placed(self, seven: tuple[float, ...]) -> Placed:
        """A position and a unit rotation; NaN fails every comparison and so is refused too."""
        px, py, pz, x, y, z, w = seven
        if not (abs(px) <= _MAX_POSITION and abs(py) <= _MAX_POSITION and abs(pz) <= _MAX_POSITION):
            raise MalformedError("a position is out of this world")
        # Bounds so wide that only damage falls outside; what is merely not of length one is made so.
        square = x * x + y * y + z * z + w * w
        if not 1e-6 <= square <= 1e6:
            raise MalformedError("a rotation is no rotation")
        if abs(square - 1.0) > 1e-6:
            length = math.sqrt(square)
            x, y, z, w = x / length, y / length, z / length, w / length
        return (px, py, pz), (x, y, z, w)


def _weight(value: float) -> float:
    if not abs(value) <= _MAX_WEIGHT:
        raise MalformedError("a weight is out of all bounds")
    return min(max(value, 0.0), 1.0)


def _name(arguments: list[object], may_be_empty: bool = False) -> str:
    name = arguments[0] if arguments else None
    if not isinstance(name, str) or len(name) > MAX_NAME or not (name or may_be_empty):
        raise MalformedError("a name is missing or has no end")
    return name


def _number(arguments: list[object], index: int) -> float:
    value = arguments[index] if index < len(arguments) else None
    if not isinstance(value, int | float):
        raise MalformedError("a number is missing")
    return _finite(value)


def _finite(value: float) -> float:
    if not abs(value) <= 1e15:
        raise MalformedError("a number is not one")
    return float(value)


def _seven(arguments: list[object]) -> tuple[float, ...]:
    return tuple(_number(arguments, i) for i in range(1, 8))


IFACIALMOCAP, LIVE_LINK_FACE = "iFacialMocap", "Live Link Face"
IFACIALMOCAP_PORT, LIVE_LINK_PORT = 49983, 11111
HELLO = b"iFacialMocap_sahuasouryya9218sauhuiayeta91555dy3719"
"""What asks a phone on its port 49983 to begin sending here."""

_MOST_BYTES = 8192
# Names beyond ARKit's that an app may add to them one day; a flood of made-up ones has more.
_MOST_UNKNOWN = 16
_BY_LOWER = {name.lower(): name for name in ARKIT_SHAPES}
_BONES = {"head": "Head", "righteye": "RightEye", "lefteye": "LeftEye"}
_PLACE = (0.0, 0.0, 0.0)
_VERSION = 6
_VALUES = 61
# The app's CSV names right before left where the packet has left before right.
_SWAPPED = {
    "JawRight": "JawLeft",
    "JawLeft": "JawRight",
    "MouthRight": "MouthLeft",
    "MouthLeft": "MouthRight",
}
# The packet's order, which is Unreal's: left before right, where the app's CSV has right before left.
_LIVE_LINK_SHAPES = tuple(_SWAPPED.get(name, name) for name in ARKIT_SHAPES)
_INT, _FLOATS = struct.Struct(">i"), struct.Struct(f">{_VALUES}f")
_LONGEST_TEXT = 256


def face_app(datagram: bytes) -> str:
    """Which app a datagram comes from; "" where it is none of theirs."""
    if openseeface.recognises(datagram):
        return OPENSEEFACE
    if datagram.startswith((b"/", b"#")) or len(datagram) > _MOST_BYTES:
        return ""
    if vtube_studio.recognises(datagram):
        return VTUBE_STUDIO
    if datagram[:1] == bytes([_VERSION]) and len(datagram) > _FLOATS.size:
        return LIVE_LINK_FACE
    return IFACIALMOCAP if b"|" in datagram else ""


class ReceivedFace(NamedTuple):
    """What one face says.

    Args:
        shapes, bones: weights and bones by name; none of both where its app sees no face.
        unknown: values that are left out, because no face has anything of their name.
    """

    shapes: dict[str, float]
    bones: dict[str, Placed]
    unknown: int = 0


def read_face(kind: str, datagram: bytes) -> ReceivedFace:
    """What one face says.

    Args:
        kind: what `face_app` said.

    Raises:
        AbsurdError: it is no face at all.
        MalformedError: it is damaged.
    """
    if kind == OPENSEEFACE:
        shapes, turn = openseeface.read(datagram)
        return ReceivedFace(shapes, {"Head": (_PLACE, turn)} if turn is not None else {})
    if kind == VTUBE_STUDIO:
        return _read_vtube_studio(datagram)
    return _read_ifacialmocap(datagram) if kind == IFACIALMOCAP else _read_live_link(datagram)


def _read_ifacialmocap(datagram: bytes) -> ReceivedFace:
    """`eyeBlink_L-37|...|=head#pitch,yaw,roll,x,y,z|rightEye#...|leftEye#...|`, in any order.

    The second version of the format writes & for -, so that weights may be negative.
    """
    try:
        text = datagram.decode("utf-8")
    except UnicodeDecodeError as error:
        raise AbsurdError("the face is not text") from error
    shapes: dict[str, float] = {}
    turns: dict[str, Placed] = {}
    unknown = 0
    for part in text.replace("=", "|").split("|"):
        if "#" in part:
            name, _, numbers = part.partition("#")
            bone = _BONES.get(name.lower())
            if bone is not None:
                turns[bone] = _PLACE, _turn([math.radians(n) for n in _angles(numbers)])
        elif part:
            # Only the second version of the format has &, and in it weights may be negative.
            name, sign, number = part.partition("&" if "&" in part else "-")
            known = _BY_LOWER.get(_arkit(name).lower())
            if known is not None and sign:
                shapes[known] = _face_weight(_face_number(number) / 100)
            else:
                unknown += 1
    if not shapes and not turns:
        raise AbsurdError("there is no face in it")
    return _face(shapes, turns, unknown)


def _read_vtube_studio(datagram: bytes) -> ReceivedFace:
    weights, turn = vtube_studio.read(datagram)
    known = ((_BY_LOWER.get(name.lower()), weight) for name, weight in weights.items())
    shapes = {name: _face_weight(weight) for name, weight in known if name is not None}
    turns = {"Head": (_PLACE, _turn(list(map(math.radians, turn))))} if turn is not None else {}
    return _face(shapes, turns, len(weights) - len(shapes))


def _face(shapes: dict[str, float], bones: dict[str, Placed], unknown: int) -> ReceivedFace:
    """A face of an app that names its shapes; AbsurdError where its names are no face's."""
    # A flood of them must not pass for a face that holds still.
    if unknown > _MOST_UNKNOWN or (unknown and not shapes):
        raise AbsurdError("nobody's face has those shapes")
    return ReceivedFace(shapes, bones, unknown)


def _read_live_link(datagram: bytes) -> ReceivedFace:
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
    shapes = {name: _face_weight(value) for name, value in zip(_LIVE_LINK_SHAPES, values, strict=False)}
    angles = values[len(_LIVE_LINK_SHAPES) :]
    turns: dict[str, Placed] = {}
    for place, bone in enumerate(("Head", "LeftEye", "RightEye")):
        yaw, pitch, roll = angles[3 * place : 3 * place + 3]
        turns[bone] = _PLACE, _turn([pitch, yaw, roll])
    return ReceivedFace(shapes, turns)


def _arkit(name: str) -> str:
    """eyeBlink_L is ARKit's eyeBlinkLeft."""
    if name.endswith("_L"):
        return name[:-2] + "Left"
    return name[:-2] + "Right" if name.endswith("_R") else name


def _face_number(text: str) -> float:
    try:
        return float(text.strip().replace(",", ".") or "nan")
    except ValueError as error:
        raise MalformedError("a number is none") from error


def _angles(text: str) -> list[float]:
    numbers = [_face_number(part) for part in text.split(",")[:3]]
    if len(numbers) < 3:
        raise MalformedError("a turn is cut off")
    return numbers


def _face_weight(value: float) -> float:
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
