"""What a face looks like, read from blend shapes of any set, as a drawing, and fitted to an avatar."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from studio.motion.avatar import Avatar
from studio.motion.channels import is_blink_shape, is_mouth_shape
from studio.render.palette import Palette, mixed, rgb

if TYPE_CHECKING:
    from PIL import Image, ImageDraw

OPENERS: dict[str, tuple[float, float, float]] = {
    "a": (0.85, 0.0, 0.0), "aa": (0.85, 0.0, 0.0), "i": (0.25, 0.6, 0.0), "ih": (0.25, 0.6, 0.0),
    "u": (0.25, 0.0, 0.9), "ou": (0.25, 0.0, 0.9), "e": (0.5, 0.4, 0.0), "ee": (0.5, 0.4, 0.0),
    "o": (0.65, 0.0, 0.6), "oh": (0.65, 0.0, 0.6), "jawopen": (1.0, 0.0, 0.0),
    "mouthfunnel": (0.2, 0.0, 0.6), "mouthpucker": (0.0, 0.0, 1.0), "mouthclose": (-0.9, 0.0, 0.0),
}  # fmt: skip
"""Whole names -> how far they open, widen and round the mouth."""

WORDS: tuple[tuple[str, tuple[float, float, float]], ...] = (
    ("oh", (0.5, 0.0, 0.6)), ("oo", (0.2, 0.0, 0.8)), ("funnel", (0.06, 0.0, 0.12)),
    ("pucker", (0.0, 0.0, 0.45)), ("stretch", (0.0, 0.3, 0.0)), ("dimple", (0.0, 0.2, 0.0)),
    ("lowerlipdepress", (0.25, 0.0, 0.0)), ("lowerdown", (0.15, 0.0, 0.0)),
    ("upperlipraise", (0.12, 0.0, 0.0)), ("upperup", (0.12, 0.0, 0.0)), ("press", (-0.15, 0.0, 0.0)),
    ("suck", (-0.1, 0.0, 0.0)), ("rolllower", (-0.2, 0.0, 0.0)), ("rollupper", (-0.2, 0.0, 0.0)),
)  # fmt: skip
"""Parts of other names -> the same, each side of a pair counting alone."""


@dataclass(frozen=True)
class FaceShape:
    """A face in a few numbers.

    Args:
        open: lips apart, 0..1.
        wide: mouth corners drawn outwards, 0..1.
        round: lips pursed, 0..1.
        smile: corners up, -1..1.
        blink_left, blink_right: lids closed, 0..1, the face's own sides.
        brow_left, brow_right: brows up (+) or down (-), -1..1.
        look: where the eyes point, right and up of the viewer positive, -1..1 each.
        surprise: eyes widened, 0..1.
    """

    open: float = 0.0
    wide: float = 0.0
    round: float = 0.0
    smile: float = 0.0
    blink_left: float = 0.0
    blink_right: float = 0.0
    brow_left: float = 0.0
    brow_right: float = 0.0
    look: tuple[float, float] = (0.0, 0.0)
    surprise: float = 0.0


def face_shape(values: Mapping[str, float]) -> FaceShape:
    """The face that blend shapes make.

    Args:
        values: name -> weight 0..1, VRM0, VRM1, ARKit or a rig's own names.
    """
    v = {_plain(name): float(value) for name, value in values.items()}
    lips, wide, pursed = _mouth(v)
    both = _one(v, "blink")
    joy = max(_one(v, "joy", "happy"), _one(v, "fun", "relaxed") * 0.7)
    sad, angry = _one(v, "sorrow", "sad"), _one(v, "angry")
    surprise = max(_one(v, "surprised"), _pair(v, "eyewide"))
    smile = joy + _pair(v, "mouthsmile", "lipcornerpull", "lipcornerpullopen")
    smile -= 0.8 * sad + _pair(v, "mouthfrown")
    raised = _one(v, "browinnerup") * 0.6 + 0.8 * surprise
    left = raised + _one(v, "browouterupleft") * 0.6 - _one(v, "browdownleft") - angry
    right = raised + _one(v, "browouterupright") * 0.6 - _one(v, "browdownright") - angry
    return FaceShape(
        _unit(lips),
        _unit(wide + 0.5 * max(smile, 0.0)),
        _unit(pursed),
        min(max(smile, -1.0), 1.0),
        _unit(max(both, _one(v, "blinkl", "blinkleft", "eyeblinkleft"))),
        _unit(max(both, _one(v, "blinkr", "blinkright", "eyeblinkright"))),
        min(max(left, -1.0), 1.0),
        min(max(right, -1.0), 1.0),
        _look(v),
        _unit(surprise),
    )


def _mouth(v: Mapping[str, float]) -> tuple[float, float, float]:
    total = [0.0, 0.0, 0.0]
    for name, value in v.items():
        weights = OPENERS.get(name)
        if weights is None:
            weights = next((w for word, w in WORDS if _has(name, word)), None)
        if weights is not None:
            for i, weight in enumerate(weights):
                total[i] += weight * value
    jaw = v.get("jawopen", 0.0)
    # ARKit's MouthClose is measured with the jaw open.
    if v.get("mouthclose", 0.0) > 0.0:
        total[0] = max(total[0], 0.1 * jaw)
    return total[0], total[1], total[2]


def _has(name: str, word: str) -> bool:
    # "oh" and "oo" are too short to look for anywhere but in names that begin with mouth.
    return word in name if len(word) > 2 else name.startswith("mouth" + word)


def _look(v: Mapping[str, float]) -> tuple[float, float]:
    # The face looks at the viewer: its own left is the viewer's right.
    x = _one(v, "lookleft") - _one(v, "lookright")
    x += 0.5 * (v.get("eyelookoutleft", 0.0) + v.get("eyelookinright", 0.0))
    x -= 0.5 * (v.get("eyelookinleft", 0.0) + v.get("eyelookoutright", 0.0))
    y = _one(v, "lookup") - _one(v, "lookdown") + _pair(v, "eyelookup") - _pair(v, "eyelookdown")
    return min(max(x, -1.0), 1.0), min(max(y, -1.0), 1.0)


def _plain(name: str) -> str:
    return name.lower().replace("_", "").replace(" ", "").replace(".", "")


def _one(v: Mapping[str, float], *names: str) -> float:
    return max((v.get(name, 0.0) for name in names), default=0.0)


def _pair(v: Mapping[str, float], *stems: str) -> float:
    """The mean of left and right of each stem, the largest of them; rigs write the side in many ways."""
    best = 0.0
    for stem in stems:
        for left, right in (("left", "right"), ("l", "r")):
            for before in ("", "mouth", "eye"):
                sides = (v.get(before + stem + left), v.get(before + stem + right))
                found = [side for side in sides if side is not None]
                if found:
                    best = max(best, sum(found) / len(found))
    return best


def _unit(value: float) -> float:
    return min(max(value, 0.0), 1.0)


def fitted(avatar: Avatar, shapes: Mapping[str, float]) -> Mapping[str, float]:
    """Shapes with what moves the avatar's mouth and eyes added, where none of theirs does.

    Near enough to look at, never exact: jaw and lips become vowels, lids become blinks.
    """
    if not shapes or not avatar.expressions:
        return shapes
    known = [name for name in shapes if avatar.face.moved_by(name)]
    mouth = any(is_mouth_shape(name) for name in known)
    eyes = any(is_blink_shape(name) for name in known)
    if mouth and eyes:
        return shapes
    face, more = face_shape(shapes), dict(shapes)
    if not mouth:
        spread = max(1.0 - face.round - face.wide, 0.0)
        more |= {
            "A": face.open * spread,
            "I": face.wide * (1.0 - 0.5 * face.open),
            "O": face.round * face.open,
            "U": face.round * (1.0 - face.open),
            "Joy": max(face.smile, 0.0) * 0.6,
        }
    if not eyes:
        more |= {"Blink_L": face.blink_left, "Blink_R": face.blink_right}
    return more


Point = tuple[float, float]
Bezier = tuple[Point, Point, Point, Point]
Box = tuple[float, float, float, float]


@dataclass(frozen=True)
class FacePart:
    """One outline of the drawn face; units are 1/200 of its side, (0, 0) its middle, y down.

    Args:
        kind: "head", "eye", "iris", "lid", "brow", "lips" (closed), "mouth" (open) or "teeth".
        curves: its outline as Bezier curves, of which a straight line is one; none where it is a box.
        box: middle and half sizes (x, y, across, down) of an ellipse, or of the teeth's rectangle.
    """

    kind: str
    curves: tuple[Bezier, ...] = ()
    box: Box = (0.0, 0.0, 0.0, 0.0)


_HEAD = FacePart(
    "head",
    (
        ((0, -94), (62, -94), (82, -50), (78, -4)),
        ((78, -4), (74, 44), (40, 92), (0, 94)),
        ((0, 94), (-40, 92), (-74, 44), (-78, -4)),
        ((-78, -4), (-82, -50), (-62, -94), (0, -94)),
    ),
)
EYE_HEIGHT = 13.0
"""Half of an open eye; the eye of a person who looks up or down moves against this."""
# An eye that is open less than this is drawn as a line.
_SHUT = 1.5


def face_parts(face: FaceShape) -> list[FacePart]:
    """The one drawn face, from back to front; the window and films only differ in what they draw it with."""
    sides = ((36.0, face.blink_left, face.brow_left), (-36.0, face.blink_right, face.brow_right))
    eyes = (part for x, blink, brow in sides for part in _eye_parts(face, x, blink, brow))
    return [_HEAD, *eyes, *_mouth_parts(face)]


def _eye_parts(face: FaceShape, x: float, blink: float, brow: float) -> list[FacePart]:
    across, down, y = 19.0, EYE_HEIGHT * (1 + 0.35 * face.surprise) * (1 - blink), -18.0
    if down < _SHUT:
        parts = [FacePart("lid", (_line((x - across, y + 3), (x + across, y + 3)),))]
    else:
        iris = (x + 9 * face.look[0], y - 6 * face.look[1], 7.5, 7.5)
        parts = [FacePart("eye", box=(x, y, across, down)), FacePart("iris", box=iris)]
    inner, outer = (x - 20, x + 20) if x > 0 else (x + 20, x - 20)
    top, frown = y - 26 - 10 * brow, max(-brow, 0.0)
    return [*parts, FacePart("brow", (_line((inner, top + 7 * frown), (outer, top - 3 * frown)),))]


def _mouth_parts(face: FaceShape) -> list[FacePart]:
    half = 27.0 * (1 + 0.35 * face.wide) * (1 - 0.55 * face.round)
    gap, corner = 34.0 * face.open, 44.0 - 10.0 * face.smile
    top, bottom = 44.0 - 0.3 * gap, 44.0 + 0.7 * gap + 8.0 * max(face.smile, 0.0)
    left, right = (-half, corner), (half, corner)
    # Closed lips are a line.
    if face.open < 0.03:
        return [FacePart("lips", ((left, (-half * 0.5, bottom), (half * 0.5, bottom), right),))]
    upper = (left, (-half * 0.5, top - 2), (half * 0.5, top - 2), right)
    lower = (right, (half * 0.6, bottom + 4), (-half * 0.6, bottom + 4), left)
    parts = [FacePart("mouth", (upper, lower))]
    if face.open > 0.35:
        tall = min(gap * 0.2, 5.0)
        parts.append(FacePart("teeth", box=(0.0, top + 3 + tall / 2, half * 0.5, tall / 2)))
    return parts


def _line(start: Point, end: Point) -> Bezier:
    return start, start, end, end


FINER = 2
"""Drawn this many times as large and made smaller again, for smooth edges."""
CURVE_POINTS = 14
Points = list[Point]


class FaceCard:
    """Draws faces of one size for films, since a stick figure has none. No Qt.

    Args:
        side: pixels.
        palette: the colours.
    """

    def __init__(self, side: int, palette: Palette) -> None:
        self._side, self._palette = side, palette
        self._unit = side * FINER / 200.0
        # The outline never changes, and is most of the work.
        self._blank = self._outline()

    def draw(self, values: Mapping[str, float]) -> NDArray[np.uint8]:
        """The face that blend shapes make: RGBA, (side, side, 4), clear around it."""
        from PIL import ImageDraw

        image = self._blank.copy()
        pen = ImageDraw.Draw(image)
        eye = _HEAD
        for part in face_parts(face_shape(values))[1:]:
            eye = part if part.kind == "eye" else eye
            self._draw(pen, part, eye)
        return np.asarray(image.reduce(FINER))

    def _outline(self) -> Image.Image:
        from PIL import Image, ImageDraw

        size = self._side * FINER
        image = Image.new("RGBA", (size, size), (*_bytes(self._palette.floor), 0))
        pen = ImageDraw.Draw(image)
        edge = self._edge(_HEAD)
        pen.polygon(edge, fill=(*_bytes(self._palette.floor), 235))
        pen.line([*edge, edge[0]], fill=_bytes(self._palette.line), width=self._wide(3), joint="curve")
        return image

    def _draw(self, pen: ImageDraw.ImageDraw, part: FacePart, eye: FacePart) -> None:
        floor, line, width = self._palette.floor, _bytes(self._palette.figure), self._wide(5)
        match part.kind:
            case "lid" | "brow":
                ends = self._at([part.curves[0][0], part.curves[0][-1]])
                pen.line(ends, fill=line, width=width)
            case "eye":
                pen.ellipse(self._box(part.box), fill=_bytes(floor), outline=line, width=width)
            case "iris":
                # PIL cuts nothing off at the lids: the iris is made no higher than the eye is open instead.
                (x, y, across, down), (_, middle, _, opened) = part.box, eye.box
                y = middle + (y - middle) * opened / EYE_HEIGHT
                pen.ellipse(self._box((x, y, across, min(down, max(opened - 2.5, 0.5)))), fill=line)
            case "lips":
                pen.line(self._edge(part), fill=line, width=width, joint="curve")
            case "mouth":
                edge = self._edge(part)
                pen.polygon(edge, fill=mixed(floor, self._palette.figure, 0.27))
                pen.line([*edge, edge[0]], fill=line, width=width, joint="curve")
            case "teeth":
                pen.rounded_rectangle(self._box(part.box), self._unit * 2, fill=mixed(floor, "#E8EAED", 0.63))

    def _edge(self, part: FacePart) -> Points:
        return self._at([point for curve in part.curves for point in _bezier(*curve)])

    def _at(self, points: Points) -> Points:
        middle = self._side * FINER / 2
        return [(middle + x * self._unit, middle + y * self._unit) for x, y in points]

    def _box(self, box: Box) -> Points:
        x, y, across, down = box
        return self._at([(x - across, y - down), (x + across, y + down)])

    def _wide(self, units: float) -> int:
        return max(round(units * self._unit), 1)


def laid_over(picture: NDArray[np.uint8], card: NDArray[np.uint8], x: int, y: int) -> None:
    """Lay a card (h, w, 4) over a picture (H, W, 4) with its corner at a pixel; the picture is changed."""
    part = picture[y : y + len(card), x : x + card.shape[1]]
    over, under = card[..., 3:] / 255.0, part[..., 3:] / 255.0
    alpha = over + under * (1.0 - over)
    colour = card[..., :3] * over + part[..., :3] * under * (1.0 - over)
    part[..., :3] = (colour / np.maximum(alpha, 1e-6)).round().astype(np.uint8)
    part[..., 3:] = (255.0 * alpha).round().astype(np.uint8)


def _bezier(
    a: tuple[float, float], b: tuple[float, float], c: tuple[float, float], d: tuple[float, float]
) -> Points:
    t = np.linspace(0.0, 1.0, CURVE_POINTS)[:, None]
    p, q, r, s = (np.array(point, dtype=np.float64) for point in (a, b, c, d))
    curve = (1 - t) ** 3 * p + 3 * t * (1 - t) ** 2 * q + 3 * t**2 * (1 - t) * r + t**3 * s
    return [(float(x), float(y)) for x, y in curve]


def _bytes(value: str) -> tuple[int, int, int]:
    red, green, blue = rgb(value).tolist()
    return red, green, blue
