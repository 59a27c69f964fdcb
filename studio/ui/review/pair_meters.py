"""Blend-shape meters: a bar for the predicted value, a mark for the captured one; the liveliest first."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from PySide6.QtCore import QRectF, QSize, Qt
from PySide6.QtGui import QPainter, QPaintEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

from studio.ui import theme

ROW_PX = 20


class PairMeters(QWidget):
    """As many meters as fit, in a fixed order given by `set_names`."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("face_meters")
        self.setAccessibleName(self.tr("Face meters"))
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self._names: tuple[str, ...] = ()
        self._predicted: Mapping[str, float] | None = None
        self._captured: Mapping[str, float] | None = None

    def sizeHint(self) -> QSize:
        return QSize(260, 8 * ROW_PX)

    def minimumSizeHint(self) -> QSize:
        return QSize(180, 5 * ROW_PX)

    def set_names(self, names: Sequence[str]) -> None:
        """Which shapes, the most interesting first."""
        self._names = tuple(names)
        self.update()

    def show_values(
        self, predicted: Mapping[str, float] | None, captured: Mapping[str, float] | None
    ) -> None:
        """Values by name; None where there is no such motion."""
        self._predicted, self._captured = predicted, captured
        self.update()

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setFont(theme.figures_font(theme.CAPTION_PX))
        if not self._names:
            painter.setPen(theme.colour("muted"))
            painter.drawText(self.rect(), Qt.AlignmentFlag.AlignCenter, self.tr("No blend shapes to show."))
            return
        label_width = min(128, self.width() // 2)
        for row, name in enumerate(self._names[: max(self.height() // ROW_PX, 1)]):
            self._paint_row(painter, name, QRectF(0, row * ROW_PX, self.width(), ROW_PX), label_width)

    def _paint_row(self, painter: QPainter, name: str, row: QRectF, label_width: int) -> None:
        painter.setPen(theme.colour("muted"))
        text = painter.fontMetrics().elidedText(name, Qt.TextElideMode.ElideMiddle, label_width - 8)
        painter.drawText(QRectF(0, row.top(), label_width, ROW_PX), Qt.AlignmentFlag.AlignVCenter, text)
        first = self._predicted if self._predicted is not None else self._captured
        value = float((first or {}).get(name, 0.0))
        track = QRectF(label_width, row.top() + 6, row.width() - label_width - 38, 8)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(theme.colour("raised"))
        painter.drawRoundedRect(track, 3, 3)
        painter.setBrush(theme.colour("figure"))
        filled = QRectF(track)
        filled.setWidth(track.width() * min(max(value, 0.0), 1.0))
        if filled.width() > 1:
            painter.drawRoundedRect(filled, 3, 3)
        if self._predicted is not None and self._captured is not None and name in self._captured:
            x = track.left() + track.width() * min(max(self._captured[name], 0.0), 1.0)
            painter.setBrush(theme.colour("ghost"))
            painter.drawRect(QRectF(x - 1, track.top() - 3, 2.5, track.height() + 6))
        painter.setPen(theme.colour("text"))
        box = QRectF(row.right() - 34, row.top(), 34, ROW_PX)
        painter.drawText(box, Qt.AlignmentFlag.AlignVCenter | Qt.AlignmentFlag.AlignRight, f"{value:.2f}")
