"""The level of a microphone: loudness, peak, hold, and a lamp that stays on after clipping."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QPointF, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QAccessible, QAccessibleValueChangeEvent, QMouseEvent, QPainter, QPaintEvent, QPen
from PySide6.QtWidgets import QSizePolicy, QWidget

from studio.ui import theme

LOWEST_DBFS = -60.0
WARN_DBFS, BAD_DBFS = -12.0, -3.0
"""Speech that peaks between the two is as loud as it may be; above, it is about to clip."""
MARKS = (-60, -48, -36, -24, -12, 0)
LAMP_PX = 38


class LevelMeterBar(QWidget):
    """A bar from -60 to 0 dBFS in green, yellow and red.

    Signals:
        reset_requested: the clip lamp was clicked.
    """

    reset_requested = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("level_meter")
        self.setAccessibleName(self.tr("Microphone level"))
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.setToolTip(self.tr("Peaks belong in the yellow. Click the lamp to put it out."))
        self.values: tuple[float, float, float] | None = None
        self.clipped = False

    def sizeHint(self) -> QSize:
        return QSize(240, 36)

    def show_level(self, peak_dbfs: float, rms_dbfs: float, hold_dbfs: float, clipped: bool) -> None:
        """Show the level now; repaints only where a pixel would change."""
        values = (round(peak_dbfs, 1), round(rms_dbfs, 1), round(hold_dbfs, 1))
        if (values, clipped) == (self.values, self.clipped):
            return
        if clipped != self.clipped:
            name = self.tr("Microphone level, clipped") if clipped else self.tr("Microphone level")
            self.setAccessibleName(name)
        self.values, self.clipped = values, clipped
        QAccessible.updateAccessibility(QAccessibleValueChangeEvent(self, int(values[0])))
        self.update()

    def clear(self) -> None:
        """Show that there is no microphone."""
        if self.values is not None or self.clipped:
            self.values, self.clipped = None, False
            self.update()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        if event.position().x() > self.width() - LAMP_PX:
            self.reset_requested.emit()

    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        if event.type() == QEvent.Type.PaletteChange:
            self.update()

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        bar = QRectF(0, 2, self.width() - LAMP_PX - 8, 14)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(theme.colour("raised"))
        painter.drawRoundedRect(bar, 3, 3)
        self._paint_zones(painter, bar)
        self._paint_scale(painter, bar)
        self._paint_lamp(painter)
        painter.end()

    def _paint_zones(self, painter: QPainter, bar: QRectF) -> None:
        zones = (
            (LOWEST_DBFS, WARN_DBFS, "good"), (WARN_DBFS, BAD_DBFS, "warn"), (BAD_DBFS, 0.0, "record"),
        )  # fmt: skip
        peak, rms, hold = self.values or (LOWEST_DBFS, LOWEST_DBFS, LOWEST_DBFS)
        for low, high, token in zones:
            painter.fillRect(self._span(bar, low, high), theme.colour(token, 34))
            if peak > low:
                painter.fillRect(self._span(bar, low, min(peak, high)), theme.colour(token, 150))
            if rms > low:
                painter.fillRect(self._span(bar, low, min(rms, high)), theme.colour(token))
        if hold > LOWEST_DBFS:
            x = self._x(bar, hold)
            painter.fillRect(QRectF(x - 1, bar.top(), 2, bar.height()), theme.colour("text"))

    def _paint_scale(self, painter: QPainter, bar: QRectF) -> None:
        painter.setFont(theme.figures_font(9))
        painter.setPen(theme.colour("muted"))
        for mark in MARKS:
            x = self._x(bar, mark)
            box = QRectF(x - 14, bar.bottom() + 3, 28, 12)
            box.moveLeft(min(max(box.left(), -2.0), bar.right() - 26))
            flag = Qt.AlignmentFlag.AlignHCenter
            if mark == LOWEST_DBFS:
                box, flag = QRectF(0, box.top(), 28, 12), Qt.AlignmentFlag.AlignLeft
            painter.drawText(box, int(flag | Qt.AlignmentFlag.AlignVCenter), f"{mark}")

    def _paint_lamp(self, painter: QPainter) -> None:
        lamp = QRectF(self.width() - LAMP_PX, 1.5, LAMP_PX - 1, 15)
        painter.setPen(QPen(theme.colour("record" if self.clipped else "line"), 1))
        painter.setBrush(theme.colour("record") if self.clipped else Qt.BrushStyle.NoBrush)
        painter.drawRoundedRect(lamp, 3, 3)
        painter.setPen(Qt.GlobalColor.white if self.clipped else theme.colour("muted"))
        painter.setFont(theme.ui_font(9, semibold=True))
        painter.drawText(lamp, int(Qt.AlignmentFlag.AlignCenter), self.tr("CLIP"))
        if self.values is not None:
            painter.setPen(theme.colour("muted"))
            painter.setFont(theme.figures_font(10))
            box = QRectF(lamp.left() - 6, lamp.bottom() + 2, LAMP_PX + 6, 14)
            painter.drawText(box, int(Qt.AlignmentFlag.AlignRight), f"{self.values[2]:.0f} dB")

    @staticmethod
    def _x(bar: QRectF, dbfs: float) -> float:
        share = (min(max(dbfs, LOWEST_DBFS), 0.0) - LOWEST_DBFS) / -LOWEST_DBFS
        return bar.left() + share * bar.width()

    def _span(self, bar: QRectF, low: float, high: float) -> QRectF:
        top, bottom = QPointF(self._x(bar, low), bar.top()), QPointF(self._x(bar, high), bar.bottom())
        return QRectF(top, bottom)
