"""A performer's picture in two images, what stays behind and their own part; and how finely it is drawn."""

from __future__ import annotations

import sys
import threading
from collections import deque

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPoint, QRect, QRectF, Qt
from PySide6.QtGui import QColor, QImage, QPainter

from studio.errors import StudioError
from studio.render.background import ROOM, Background
from studio.render.camera import Orbit
from studio.render.palette import Palette
from studio.render.scene import RenderScene

CHECKER = 12
"""Pixels of a square of the board that stands for nothing."""


class FigurePicture:
    """What a scene made last; of a picture whose background stays only the performer's part is made anew."""

    def __init__(self, scene: RenderScene) -> None:
        self._scene = scene
        self._under: QImage | None = None
        self._layer: QImage | None = None
        self._corner = QPoint()
        self._size = (1, 1)
        self._key: tuple[object, ...] = ()
        """What the image behind was made for."""
        self._passing: tuple[object, ...] = ()

    def draw(
        self,
        orbit: Orbit,
        size: tuple[int, int],
        finer: int,
        background: Background,
        palette: Palette,
        stays: bool = False,
    ) -> QRect:
        """Make it anew.

        Args:
            orbit: the camera.
            size: width and height, pixels.
            finer: the performer is drawn so many times as large, for smooth edges.
            background: what is behind them.
            palette: the room's colours.
            stays: nothing moves, so that the room is worth drawing apart at once.

        Returns:
            The part of it that may have changed.
        """
        scene, before = self._scene, self._part
        camera = scene.camera(orbit) if background.is_room else ()
        key = (size, background, palette, finer, camera)
        changed, self._size = key != self._key, size
        if changed and background.is_room and key != self._passing and not stays:
            # The camera moves: all of it at once, since the room would be drawn for this picture alone.
            self._passing, self._key = key, ()
            self._under, self._layer = image_of(scene.render(orbit, *size)), None
            return QRect(0, 0, *size)
        if changed:
            self._key = key
            self._under = self._behind(orbit, size, finer, background, palette)
        layer = scene.figure(orbit, *size, finer, shadow=background.is_room)
        self._corner = QPoint(layer.x, layer.y)
        self._layer = image_of(layer.pixels, QImage.Format.Format_RGBA8888_Premultiplied)
        return QRect(0, 0, *size) if changed else before.united(self._part)

    def paint(self, painter: QPainter, rect: QRectF) -> None:
        """Paint it over a rectangle."""
        painter.save()
        painter.translate(rect.topLeft())
        wide, high = rect.width() / self._size[0], rect.height() / self._size[1]
        if (wide, high) != (1.0, 1.0):
            painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
            painter.scale(wide, high)
        if self._under is not None:
            painter.drawImage(QPoint(), self._under)
        if self._layer is not None:
            painter.drawImage(self._corner, self._layer)
        painter.restore()

    def in_widget(self, part: QRect, size: tuple[int, int]) -> QRect:
        """A part of it in the pixels of a widget of a size, with a little around it."""
        wide, high = size[0] / self._size[0], size[1] / self._size[1]
        corner = QPoint(int(part.x() * wide) - 1, int(part.y() * high) - 1)
        return QRect(corner, QPoint(int((part.right() + 1) * wide) + 2, int((part.bottom() + 1) * high) + 2))

    @property
    def image(self) -> QImage:
        """All of it as one image."""
        made = QImage(*self._size, QImage.Format.Format_ARGB32_Premultiplied)
        made.fill(Qt.GlobalColor.transparent)
        painter = QPainter(made)
        self.paint(painter, QRectF(made.rect()))
        painter.end()
        return made

    @property
    def _part(self) -> QRect:
        return (
            QRect(self._corner, self._layer.size()) if self._layer is not None else QRect(0, 0, *self._size)
        )

    def _behind(
        self, orbit: Orbit, size: tuple[int, int], finer: int, background: Background, palette: Palette
    ) -> QImage | None:
        if background.is_clear:
            return None
        if background.is_room:
            return image_of(self._scene.room(orbit, *size, finer))
        return background_image(background, size, palette)


def background_image(background: Background, size: tuple[int, int], palette: Palette) -> QImage:
    """A colour, an image, or the room's wall; the wall as well where the image cannot be read any more."""
    try:
        return image_of(background.painted(*size, palette))
    except StudioError:
        return image_of(ROOM.painted(*size, palette))


def draw_checkers(painter: QPainter, rect: QRectF, dark: QColor, light: QColor) -> None:
    """The board that stands for nothing."""
    painter.fillRect(rect, dark)
    for row in range(int(rect.height()) // CHECKER + 1):
        for column in range(row % 2, int(rect.width()) // CHECKER + 1, 2):
            square = QRectF(column * CHECKER, row * CHECKER, CHECKER, CHECKER)
            painter.fillRect(square.translated(rect.topLeft()) & rect, light)


def image_of(pixels: NDArray[np.uint8], kind: QImage.Format = QImage.Format.Format_RGBX8888) -> QImage:
    """A picture (H, W, 4) as Qt has it, with its own copy, in the order of bytes that is painted fastest."""
    height, width = pixels.shape[:2]
    if not height or not width:
        return QImage()
    made = QImage(np.ascontiguousarray(pixels).data, width, height, width * 4, kind)
    painted = QImage.Format.Format_RGB32
    if kind == QImage.Format.Format_RGBA8888_Premultiplied:
        painted = QImage.Format.Format_ARGB32_Premultiplied
    return made.convertToFormat(painted)


SHARES, USUAL = (2.0, 1.0, 0.7, 0.5), 1
"""Of a picture's height and width that are drawn, scaled to fit: finer where that costs nearly nothing."""
SLOW, EASY = 0.025, 0.018
"""Seconds: a picture that takes longer is drawn coarser; one that would take no longer finer, finer again."""
FINE_SLOW, FINE_EASY = 0.0125, 0.01
"""The same of pictures finer than the screen, which may not cost a single one a second."""
_KEPT = 12


class Detail:
    """Chooses the share by what pictures took."""

    def __init__(self) -> None:
        self._step = USUAL
        self._costs: deque[float] = deque(maxlen=_KEPT)

    @property
    def share(self) -> float:
        """Of the height and width to draw."""
        return SHARES[self._step]

    def saw(self, cost: float) -> None:
        """A picture took so many seconds."""
        self._costs.append(cost)
        if len(self._costs) < _KEPT:
            return
        # The quickest counts: a computer that is held up by something else for a while is not slow.
        quickest = min(self._costs)
        if quickest > (FINE_SLOW if self.share > 1.0 else SLOW) and self._step < len(SHARES) - 1:
            self._go(self._step + 1)
        elif self._step:
            finer = SHARES[self._step - 1]
            if max(self._costs) * (finer / self.share) ** 2 < (FINE_EASY if finer > 1.0 else EASY):
                self._go(self._step - 1)

    def begin_anew(self) -> None:
        """Something else is drawn, or in another size."""
        self._go(USUAL)

    def go_coarsest(self) -> None:
        """Pictures hold up everything: no more than must be, until they are quick again."""
        self._go(len(SHARES) - 1)

    def _go(self, step: int) -> None:
        self._step = step
        self._costs.clear()


_loading: threading.Thread | None = None
_done = threading.Event()


def loaded() -> bool:
    """Whether pyvista can be imported at once; begins to load it where nobody has."""
    global _loading
    if "pyvista" not in sys.modules and _loading is None:
        # No daemon: a thread left in the midst of VTK's loading would abort a program that ends.
        _loading = threading.Thread(target=_load, name="load pyvista")
        _loading.start()
    return _loading is None or _done.is_set() or not _loading.is_alive()


def _load() -> None:
    try:
        import pyvista  # noqa: F401
    except (ImportError, OSError):
        return  # whoever uses it meets the same error and says so
    finally:
        _done.set()
