"""A simple drawn face, since a stick figure has none: mouth, eyes and brows from the blend shapes."""

from __future__ import annotations

from collections.abc import Mapping

from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QPainter, QPainterPath, QPaintEvent, QPen
from PySide6.QtWidgets import QSizePolicy, QWidget

from studio.render.face import FacePart, FaceShape, face_parts, face_shape
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
