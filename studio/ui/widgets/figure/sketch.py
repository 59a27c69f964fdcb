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
from studio.render.camera import NOWHERE, Orbit, project, to_picture
from studio.render.face import FacePart, FaceShape, face_parts, face_shape
from studio.render.scene import STICK_HEAD
from studio.ui import theme


def draw_ground(painter: QPainter, rect: QRectF) -> None:
    """The gradient behind the figure."""
    gradient = QLinearGradient(rect.topLeft(), rect.bottomLeft())
    gradient.setColorAt(0.0, theme.colour("sky"))
    gradient.setColorAt(1.0, theme.colour("floor"))
    painter.fillRect(rect, gradient)


def draw_nobody(painter: QPainter, rect: QRectF, icon: str, side: int, words: str) -> None:
    """A symbol of so many pixels and a sentence, where no figure is."""
    middle = rect.center()
    symbol = theme.icon(icon, "line").pixmap(side, side)
    painter.drawPixmap(QPointF(middle.x() - side / 2, middle.y() - side * 0.85), symbol)
    painter.setFont(theme.ui_font())
    painter.setPen(theme.colour("muted"))
    box = QRectF(middle.x() - 190, middle.y() + side * 0.15 + 16, 380, 64)
    flags = Qt.AlignmentFlag.AlignHCenter | Qt.AlignmentFlag.AlignTop | Qt.TextFlag.TextWordWrap
    painter.drawText(box.intersected(rect.adjusted(12, 0, -12, 0)), int(flags), words)


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
    picture, tall, away = (int(rect.width()), int(rect.height())), scale, NOWHERE
    if plan.head >= 0:  # long legs are seen whole, and a close camera looks at this body's face
        rest, _ = skeleton.forward(skeleton.rest_positions, skeleton.rest_rotations)
        head = to_picture(rest[plan.head])
        tall = max(scale, float(head[1] / STICK_HEAD[1]))
        away = head - STICK_HEAD * tall
    seen = project(joints, orbit, *picture, tall, away=away)
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
        x, y, depth = project(centre[None], orbit, *picture, tall, away=away)[0]
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
        outline = QPen(line, 5 if side < 180 else 3.5, Qt.PenStyle.SolidLine, Qt.PenCapStyle.RoundCap)
        eye = QPainterPath()
        for part in face_parts(self.face):
            path = _path(part)
            painter.setPen(outline)
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.setClipping(False)
            match part.kind:
                case "head":
                    painter.setPen(QPen(theme.colour("line"), 3))
                    painter.setBrush(theme.colour("surface", 235))
                case "eye":
                    painter.setBrush(theme.colour("ground"))
                    eye = path
                case "iris":
                    painter.setClipPath(eye)  # the lids cut it off
                    painter.setPen(Qt.PenStyle.NoPen)
                    painter.setBrush(line)
                case "mouth":
                    inside = QColor(line)
                    inside.setAlpha(70)
                    painter.setBrush(inside)
                case "teeth":
                    painter.setPen(Qt.PenStyle.NoPen)
                    painter.setBrush(theme.colour("text", 160))
            painter.drawPath(path)


def _path(part: FacePart) -> QPainterPath:
    path = QPainterPath()
    x, y, across, down = part.box
    if part.kind == "teeth":
        path.addRoundedRect(QRectF(x - across, y - down, 2 * across, 2 * down), 2, 2)
    elif not part.curves:
        path.addEllipse(QPointF(x, y), across, down)
    else:
        path.moveTo(*part.curves[0][0])
        for _, first, second, end in part.curves:
            path.cubicTo(*first, *second, *end)
    return path
