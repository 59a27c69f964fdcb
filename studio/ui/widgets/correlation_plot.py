"""How well motion and sound fit at every offset: a small curve with its best place marked."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from PySide6.QtCore import QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QPainter, QPaintEvent, QPen, QPolygonF
from PySide6.QtWidgets import QToolButton, QWidget

from studio.ui import theme

if TYPE_CHECKING:
    from studio.motion.lag import Alignment

CERTAIN, LIKELY = 0.75, 0.5
"""Confidence from which an offset is called sure, and likely."""


def role_of(confidence: float) -> str:
    """The colour that says how sure an offset is."""
    return "good" if confidence >= CERTAIN else "warn"


def paint_correlation(painter: QPainter, area: QRectF, found: Alignment, scale: bool = False) -> None:
    """Paint the curve over its offsets, a line at 0 ms and one at the offset found.

    Args:
        area: pixels it fills.
        found: offsets and how well each fits.
        scale: whether offsets are written below.
    """
    if scale:
        area = area.adjusted(0, 0, 0, -16)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    low, high = min(float(found.curve.min(initial=0.0)), 0.0), max(float(found.curve.max(initial=0.0)), 0.1)
    first, last = float(found.offsets[0]), float(found.offsets[-1])

    def x(t: float) -> float:
        return area.left() + (t - first) / (last - first) * area.width()

    painter.setPen(QPen(theme.colour("line"), 1))
    painter.drawLine(QPointF(x(0.0), area.top()), QPointF(x(0.0), area.bottom()))
    heights = area.bottom() - 2 - (found.curve - low) / (high - low) * (area.height() - 4)
    points = [QPointF(x(float(t)), float(y)) for t, y in zip(found.offsets, heights, strict=True)]
    painter.setPen(QPen(theme.data_colour(0), 1.5))
    painter.drawPolyline(QPolygonF(points))
    if found.confidence > 0:
        painter.setPen(QPen(theme.colour(role_of(found.confidence)), 1.5))
        painter.drawLine(QPointF(x(found.offset), area.top()), QPointF(x(found.offset), area.bottom()))
    if scale:
        painter.setFont(theme.figures_font(theme.CAPTION_PX))
        painter.setPen(theme.colour("muted"))
        marks = np.linspace(first, last, 5).tolist()
        for t in marks:
            left = min(max(x(t) - 40, area.left()), area.right() - 80)
            side = Qt.AlignmentFlag.AlignHCenter
            if t in (marks[0], marks[-1]):
                side = Qt.AlignmentFlag.AlignLeft if t == marks[0] else Qt.AlignmentFlag.AlignRight
            text = f"{t * 1000:+.0f} ms" if t else "0 ms"
            painter.drawText(QRectF(left, area.bottom() + 2, 80, 14), side, text)


class CorrelationButton(QToolButton):
    """The curve in small; a click looks closer."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("align_curve")
        self.setAccessibleName(self.tr("How well each offset fits"))
        self.setToolTip(self.tr("How well each offset fits: one clear peak is good. Click to look closer."))
        self.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self._found: Alignment | None = None
        self.hide()

    @property
    def found(self) -> Alignment | None:
        """What is drawn."""
        return self._found

    def show_found(self, found: Alignment | None) -> None:
        """Draw this, or take the button away."""
        self._found = found
        self.setVisible(found is not None)
        self.update()

    def sizeHint(self) -> QSize:
        """A small strip."""
        return QSize(96, 30)

    def paintEvent(self, event: QPaintEvent) -> None:
        """The button with the curve on it."""
        super().paintEvent(event)
        if self._found is not None:
            painter = QPainter(self)
            paint_correlation(painter, QRectF(self.rect()).adjusted(5, 4, -5, -4), self._found)
            painter.end()


class CorrelationPlot(QWidget):
    """The curve in full, with its offsets in milliseconds."""

    def __init__(self, found: Alignment, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("correlation_plot")
        self.setAccessibleName(self.tr("How well each offset fits"))
        self._found = found

    def sizeHint(self) -> QSize:
        """Wide enough to read a peak off."""
        return QSize(440, 150)

    def paintEvent(self, _event: QPaintEvent) -> None:
        """The curve on the ground of pictures."""
        painter = QPainter(self)
        painter.fillRect(self.rect(), theme.colour("ground"))
        paint_correlation(painter, QRectF(self.rect()).adjusted(10, 8, -10, -2), self._found, scale=True)
        painter.end()
