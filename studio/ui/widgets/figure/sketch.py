"""What is drawn with plain lines: the figure until OpenGL is warm, and a simple face."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QLinearGradient, QPainter, QPainterPath, QPaintEvent, QPen
from PySide6.QtWidgets import QSizePolicy, QWidget

from studio.motion.skeleton import Skeleton
from studio.render import body
from studio.render.camera import Orbit, project, to_picture
from studio.render.face import FaceShape, face_shape
from studio.ui import theme


def draw_ground(painter: QPainter, rect: QRectF) -> None:
    """The gradient behind the figure."""
    gradient = QLinearGradient(rect.topLeft(), rect.bottomLeft())
    gradient.setColorAt(0.0, theme.colour("sky"))
    gradient.setColorAt(1.0, theme.colour("floor"))
    painter.fillRect(rect, gradient)


def draw_figure(
    painter: QPainter,
    rect: QRectF,
    orbit: Orbit,
    skeleton: Skeleton,
    world: NDArray[np.floating],
    token: str = "figure",
) -> None:
    """One figure as round-ended lines and a head.

    Args:
        painter: its coordinates are those of rect.
        rect: the picture.
        orbit: the camera.
        skeleton: J bones.
        world: Unity-space joints (J, 3).
        token: the theme's colour.
    """
    plan = body.Plan.of(skeleton)
    joints = to_picture(world)
    scale = plan.scale(joints)
    seen = project(joints, orbit, int(rect.width()), int(rect.height()), scale)
    per_metre = rect.height() / (2 * np.tan(np.radians(14.0)))
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    for start, end, radii in zip(plan.starts, plan.ends, plan.radii, strict=True):
        width = max(float(radii.mean()) * 2 * scale * per_metre / float(seen[end, 2]), 1.0)
        pen = QPen(theme.colour(token), width)
        pen.setCapStyle(Qt.PenCapStyle.RoundCap)
        painter.setPen(pen)
        painter.drawLine(QPointF(*seen[start, :2]), QPointF(*seen[end, :2]))
    if plan.head >= 0:
        centre, radius = body.head_ball(plan, joints, scale)
        x, y, depth = project(centre[None], orbit, int(rect.width()), int(rect.height()), scale)[0]
        size = radius * per_metre / depth
        painter.setPen(QPen(theme.colour(token), 1.5))  # a bright head on a bright ground needs an edge
        painter.setBrush(theme.colour("joint" if token == "figure" else token))
        painter.drawEllipse(QPointF(x, y), size, size)


class DrawnFace(QWidget):
    """A face drawn from shapes; `show_values` each frame."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.face: FaceShape | None = None
        self._token = "figure"
        self.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Preferred)
        self.setAccessibleName(self.tr("Drawn face"))
        self.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)

    def sizeHint(self) -> QSize:
        return QSize(116, 116)

    def set_token(self, token: str) -> None:
        """Draw in another colour of the theme ("figure" for predicted, "ghost" for captured)."""
        self._token = token
        self.update()

    def show_values(self, values: Mapping[str, float] | None) -> None:
        """Show blend shapes by name; None for no face."""
        face = face_shape(values) if values is not None else None
        if face != self.face:
            self.face = face
            self.update()

    def paintEvent(self, _event: QPaintEvent) -> None:
        if self.face is None:
            return
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        side = min(self.width(), self.height()) - 4
        painter.translate(self.width() / 2, self.height() / 2)
        painter.scale(side / 200.0, side / 200.0)
        line = theme.colour(self._token)
        fill = theme.colour("surface", 235)
        painter.setPen(QPen(theme.colour("line"), 3))
        painter.setBrush(fill)
        painter.drawPath(_head())
        painter.setPen(QPen(line, 5 if side < 180 else 3.5, Qt.PenStyle.SolidLine, Qt.PenCapStyle.RoundCap))
        _draw_eye(painter, self.face, line, 36, self.face.blink_left, self.face.brow_left)
        _draw_eye(painter, self.face, line, -36, self.face.blink_right, self.face.brow_right)
        _draw_mouth(painter, self.face, line)


def _head() -> QPainterPath:
    path = QPainterPath(QPointF(0, -94))
    path.cubicTo(62, -94, 82, -50, 78, -4)
    path.cubicTo(74, 44, 40, 92, 0, 94)
    path.cubicTo(-40, 92, -74, 44, -78, -4)
    path.cubicTo(-82, -50, -62, -94, 0, -94)
    return path


def _draw_eye(painter: QPainter, face: FaceShape, line: QColor, x: float, blink: float, brow: float) -> None:
    wide, height = 19.0, 13.0 * (1 + 0.35 * face.surprise) * (1 - blink)
    y = -18.0
    painter.setBrush(theme.colour("ground"))
    if height < 1.5:
        painter.drawLine(QPointF(x - wide, y + 3), QPointF(x + wide, y + 3))
    else:
        eye = QPainterPath()
        eye.addEllipse(QPointF(x, y), wide, height)
        painter.drawPath(eye)
        painter.save()
        painter.setClipPath(eye)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(line)
        painter.drawEllipse(QPointF(x + 9 * face.look[0], y - 6 * face.look[1]), 7.5, 7.5)
        painter.restore()
    inner, outer = (x - 20, x + 20) if x > 0 else (x + 20, x - 20)
    top = y - 26 - 10 * brow
    painter.drawLine(QPointF(inner, top + 7 * max(-brow, 0.0)), QPointF(outer, top - 3 * max(-brow, 0.0)))


def _draw_mouth(painter: QPainter, face: FaceShape, line: QColor) -> None:
    half = 27.0 * (1 + 0.35 * face.wide) * (1 - 0.55 * face.round)
    gap = 34.0 * face.open
    corner = 44.0 - 10.0 * face.smile
    top, bottom = 44.0 - 0.3 * gap, 44.0 + 0.7 * gap + 8.0 * max(face.smile, 0.0)
    path = QPainterPath(QPointF(-half, corner))
    path.cubicTo(-half * 0.5, top - 2, half * 0.5, top - 2, half, corner)
    path.cubicTo(half * 0.6, bottom + 4, -half * 0.6, bottom + 4, -half, corner)
    if face.open < 0.03:  # closed lips are a line
        painter.setBrush(Qt.BrushStyle.NoBrush)
        lips = QPainterPath(QPointF(-half, corner))
        lips.cubicTo(-half * 0.5, bottom, half * 0.5, bottom, half, corner)
        painter.drawPath(lips)
        return
    inside = QColor(line)
    inside.setAlpha(70)
    painter.setBrush(inside)
    painter.drawPath(path)
    if face.open > 0.35:
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(theme.colour("text", 160))
        painter.drawRoundedRect(QRectF(-half * 0.5, top + 3, half, min(gap * 0.2, 5.0)), 2, 2)
