"""A simple drawn face, since a stick figure has none: mouth, eyes and brows from the blend shapes."""

from __future__ import annotations

from collections.abc import Mapping

from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QPainter, QPainterPath, QPaintEvent, QPen
from PySide6.QtWidgets import QSizePolicy, QWidget

from studio.render.face import FaceShape, face_shape
from studio.ui import theme


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
