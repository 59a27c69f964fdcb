"""A simple drawn face for films, since a stick figure has none: mouth, eyes and brows from the shapes. No Qt.

The same face as the window's, on a square of 200 units with its middle at (0, 0), y down.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from studio.render.face import FaceShape, face_shape
from studio.render.palette import Palette

if TYPE_CHECKING:
    from PIL import Image, ImageDraw

FINER = 2
"""Drawn this many times as large and made smaller again, for smooth edges."""
CURVE_POINTS = 14
Points = list[tuple[float, float]]
HEAD = (
    ((0, -94), (62, -94), (82, -50), (78, -4)),
    ((78, -4), (74, 44), (40, 92), (0, 94)),
    ((0, 94), (-40, 92), (-74, 44), (-78, -4)),
    ((-78, -4), (-82, -50), (-62, -94), (0, -94)),
)
"""The outline: four Bezier curves."""


class FaceCard:
    """Draws faces of one size.

    Args:
        side: pixels.
        palette: the colours.
    """

    def __init__(self, side: int, palette: Palette) -> None:
        self._side, self._palette = side, palette
        self._unit = side * FINER / 200.0
        self._blank = self._outline()

    def draw(self, values: Mapping[str, float]) -> NDArray[np.uint8]:
        """The face that blend shapes make: RGBA, (side, side, 4), clear around it."""
        from PIL import ImageDraw

        face = face_shape(values)
        image = self._blank.copy()
        pen = ImageDraw.Draw(image)
        self._eye(pen, face, 36, face.blink_left, face.brow_left)
        self._eye(pen, face, -36, face.blink_right, face.brow_right)
        self._mouth(pen, face)
        return np.asarray(image.reduce(FINER))

    def _outline(self) -> Image.Image:
        from PIL import Image, ImageDraw

        size = self._side * FINER
        image = Image.new("RGBA", (size, size), _rgb(self._palette.floor, 0))
        pen = ImageDraw.Draw(image)
        edge = [point for curve in HEAD for point in _bezier(*curve)]
        pen.polygon(self._at(edge), fill=_rgb(self._palette.floor, 235))
        pen.line(
            self._at([*edge, edge[0]]), fill=_rgb(self._palette.line), width=self._wide(3), joint="curve"
        )
        return image

    def _eye(self, pen: ImageDraw.ImageDraw, face: FaceShape, x: float, blink: float, brow: float) -> None:
        wide, high, y = 19.0, 13.0 * (1 + 0.35 * face.surprise) * (1 - blink), -18.0
        line, width = _rgb(self._palette.figure), self._wide(5)
        if high < 1.5:
            pen.line(self._at([(x - wide, y + 3), (x + wide, y + 3)]), fill=line, width=width)
        else:
            pen.ellipse(
                self._box(x, y, wide, high), fill=_rgb(self._palette.floor), outline=line, width=width
            )
            # The iris is cut off by the lids: no higher than the eye is open.
            iris = min(7.5, max(high - 2.5, 0.5))
            pen.ellipse(
                self._box(x + 9 * face.look[0], y - 6 * face.look[1] * high / 13, 7.5, iris), fill=line
            )
        inner, outer = (x - 20, x + 20) if x > 0 else (x + 20, x - 20)
        top = y - 26 - 10 * brow
        frown = max(-brow, 0.0)
        pen.line(self._at([(inner, top + 7 * frown), (outer, top - 3 * frown)]), fill=line, width=width)

    def _mouth(self, pen: ImageDraw.ImageDraw, face: FaceShape) -> None:
        half = 27.0 * (1 + 0.35 * face.wide) * (1 - 0.55 * face.round)
        gap, corner = 34.0 * face.open, 44.0 - 10.0 * face.smile
        top, bottom = 44.0 - 0.3 * gap, 44.0 + 0.7 * gap + 8.0 * max(face.smile, 0.0)
        line, width = _rgb(self._palette.figure), self._wide(5)
        left, right = (-half, corner), (half, corner)
        if face.open < 0.03:  # closed lips are a line
            lips = _bezier(left, (-half * 0.5, bottom), (half * 0.5, bottom), right)
            pen.line(self._at(lips), fill=line, width=width, joint="curve")
            return
        edge = _bezier(left, (-half * 0.5, top - 2), (half * 0.5, top - 2), right)
        edge += _bezier(right, (half * 0.6, bottom + 4), (-half * 0.6, bottom + 4), left)
        pen.polygon(self._at(edge), fill=_mixed(self._palette.floor, self._palette.figure, 0.27))
        pen.line(self._at([*edge, edge[0]]), fill=line, width=width, joint="curve")
        if face.open > 0.35:
            teeth = self._at([(-half * 0.5, top + 3), (half * 0.5, top + 3 + min(gap * 0.2, 5.0))])
            pen.rounded_rectangle(teeth, self._unit * 2, fill=_mixed(self._palette.floor, "#E8EAED", 0.63))

    def _at(self, points: Points) -> Points:
        middle = self._side * FINER / 2
        return [(middle + x * self._unit, middle + y * self._unit) for x, y in points]

    def _box(self, x: float, y: float, wide: float, high: float) -> Points:
        return self._at([(x - wide, y - high), (x + wide, y + high)])

    def _wide(self, units: float) -> int:
        return max(round(units * self._unit), 1)


def laid_over(picture: NDArray[np.uint8], card: NDArray[np.uint8], x: int, y: int) -> None:
    """Lay a card (h, w, 4) over a picture (H, W, 4) with its corner at a pixel; the picture is changed."""
    part = picture[y : y + len(card), x : x + card.shape[1]]
    alpha = card[..., 3:].astype(np.uint16)
    part[..., :3] = ((card[..., :3] * alpha + part[..., :3] * (255 - alpha)) // 255).astype(np.uint8)
    part[..., 3:] = np.maximum(part[..., 3:], card[..., 3:])


def _bezier(
    a: tuple[float, float], b: tuple[float, float], c: tuple[float, float], d: tuple[float, float]
) -> Points:
    t = np.linspace(0.0, 1.0, CURVE_POINTS)[:, None]
    p, q, r, s = (np.array(point, dtype=np.float64) for point in (a, b, c, d))
    curve = (1 - t) ** 3 * p + 3 * t * (1 - t) ** 2 * q + 3 * t**2 * (1 - t) * r + t**3 * s
    return [(float(x), float(y)) for x, y in curve]


def _rgb(value: str, alpha: int = 255) -> tuple[int, int, int, int]:
    red, green, blue = (int(value[i : i + 2], 16) for i in (1, 3, 5))
    return red, green, blue, alpha


def _mixed(under: str, over: str, amount: float) -> tuple[int, int, int, int]:
    a, b = _rgb(under), _rgb(over)
    red, green, blue = (round(p * (1 - amount) + q * amount) for p, q in zip(a[:3], b[:3], strict=True))
    return red, green, blue, 255
