"""How much of the takes is for training, validation and testing, as one bar."""

from __future__ import annotations

from collections.abc import Mapping

from PySide6.QtCore import QRectF, QSize, Qt
from PySide6.QtGui import QPainter, QPaintEvent
from PySide6.QtWidgets import QSizePolicy, QWidget

from studio.ui import theme
from studio.ui.curate.take_delegate import SPLIT_COLOURS
from studio.ui.curate.take_table import split_title
from studio.ui.widgets.timeline.time_view import clock


class SplitBar(QWidget):
    """Seconds of train, val and test side by side."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("split_bar")
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self._seconds: dict[str, float] = {}

    def show_seconds(self, seconds: Mapping[str, float]) -> None:
        """Seconds by split."""
        self._seconds = {split: seconds.get(split, 0.0) for split in SPLIT_COLOURS}
        words = ", ".join(f"{split_title(s)} {clock(v)}" for s, v in self._seconds.items())
        self.setAccessibleName(self.tr("Length by split: {0}").format(words))
        self.setToolTip(words)
        self.update()

    def sizeHint(self) -> QSize:
        """A bar and a line of captions."""
        return QSize(240, 26)

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint the bar and what it means."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(Qt.PenStyle.NoPen)
        total = sum(self._seconds.values())
        bar = QRectF(0, 0, self.width(), 5)
        painter.setBrush(theme.colour("raised"))
        painter.drawRoundedRect(bar, 2.5, 2.5)
        x = 0.0
        for split, seconds in self._seconds.items():
            wide = self.width() * seconds / total if total else 0.0
            painter.setBrush(theme.data_colour(SPLIT_COLOURS[split]))
            if wide > 1:
                painter.drawRoundedRect(QRectF(x, 0, wide - 1, 5), 2.5, 2.5)
            x += wide
        self._paint_captions(painter, total)
        painter.end()

    def _paint_captions(self, painter: QPainter, total: float) -> None:
        painter.setFont(theme.figures_font(theme.CAPTION_PX))
        x = 0.0
        for split, seconds in self._seconds.items():
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(theme.data_colour(SPLIT_COLOURS[split]))
            painter.drawEllipse(QRectF(x, 13, 7, 7))
            share = f"  {seconds / total:.0%}" if total else ""
            text = f"{split_title(split)}  {clock(seconds, 1.0)}{share}"
            painter.setPen(theme.colour("muted"))
            wide = painter.fontMetrics().horizontalAdvance(text)
            painter.drawText(QRectF(x + 12, 8, wide + 4, 17), Qt.AlignmentFlag.AlignVCenter, text)
            x += wide + 32
