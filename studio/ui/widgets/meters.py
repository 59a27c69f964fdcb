"""Meters: the level of the sound, and the values of blend shapes as bars."""

from __future__ import annotations

import time
from collections.abc import Mapping

from PySide6.QtCore import QEvent, QPointF, QRectF, QSize, Qt, QTimer, Signal
from PySide6.QtGui import (
    QAccessible,
    QAccessibleValueChangeEvent,
    QFontMetricsF,
    QHelpEvent,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPen,
    QResizeEvent,
    QStaticText,
)
from PySide6.QtWidgets import (
    QAbstractScrollArea,
    QComboBox,
    QHBoxLayout,
    QLineEdit,
    QSizePolicy,
    QToolTip,
    QVBoxLayout,
    QWidget,
)

from studio.motion.channels import is_blink_shape, is_mouth_shape
from studio.ui import theme
from studio.ui.widgets.card import heading

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
        self.setToolTip(self.tr("Aim for peaks in the yellow. Click CLIP to reset."))
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


ROW_PX = 22
HOLD_S = 1.5
SORT_EVERY_S = 0.7
"""Sorted by activity, rows change places no more often than this, so that one can read them."""
ACTIVITY_FADE_S = 1.2


class MeteredShape:
    """One shape: its value, its peak for a while, how much it moved lately, and its name ready to paint."""

    __slots__ = ("activity", "low", "name", "peak", "peak_at", "text", "token", "value")

    def __init__(self, name: str) -> None:
        self.name = name
        self.low = name.lower()
        self.value = self.peak = self.activity = 0.0
        self.peak_at = 0.0
        self.text = QStaticText()
        self.token = 0 if is_mouth_shape(name) else 1 if is_blink_shape(name) or "look" in self.low else 2

    def feed(self, value: float, now: float, fade: float) -> None:
        """Take a new value in; fade is how much of the old activity is left."""
        self.activity = self.activity * fade + abs(value - self.value)
        self.value = value
        if value >= self.peak or now - self.peak_at > HOLD_S:
            self.peak, self.peak_at = value, now


class MeterList(QAbstractScrollArea):
    """The painted rows; only those in sight are painted."""

    def __init__(self) -> None:
        super().__init__()
        self.setObjectName("shape_list")
        self.setFrameShape(QAbstractScrollArea.Shape.NoFrame)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.viewport().setAutoFillBackground(False)
        self.rows: list[MeteredShape] = []
        self.sentence = ""
        self.sources: dict[str, str] = {}
        """Who gives a shape, where that is worth saying: a row's tooltip."""
        self._numbers = [QStaticText(f"{n / 100:.2f}") for n in range(101)]
        self._name_width = 90.0
        self.verticalScrollBar().setSingleStep(ROW_PX)

    def show_rows(self, rows: list[MeteredShape]) -> None:
        """Paint these channels from now on."""
        if rows != self.rows:
            self.rows = rows
            self._measure()
        self.viewport().update()

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._measure()

    def changeEvent(self, event: QEvent) -> None:
        super().changeEvent(event)
        if event.type() == QEvent.Type.PaletteChange:
            self.viewport().update()

    def viewportEvent(self, event: QEvent) -> bool:
        if event.type() == QEvent.Type.ToolTip and isinstance(event, QHelpEvent):
            QToolTip.showText(event.globalPos(), self.tip_at(event.pos().y()), self.viewport())
            return True
        return super().viewportEvent(event)

    def tip_at(self, y: int) -> str:
        """What is said of the row at a height: its whole name, and who gives it."""
        index = (y + self.verticalScrollBar().value()) // ROW_PX
        if not 0 <= index < len(self.rows):
            return ""
        name = self.rows[index].name
        source = self.sources.get(name)
        return self.tr("{0}, from {1}").format(name, source) if source else name

    def minimumSizeHint(self) -> QSize:
        return QSize(180, 3 * ROW_PX)

    def paintEvent(self, _event: QPaintEvent) -> None:
        painter = QPainter(self.viewport())
        area = QRectF(self.viewport().rect())
        if not self.rows:
            painter.setPen(theme.colour("muted"))
            flags = Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap
            painter.drawText(area.adjusted(12, 0, -12, 0), int(flags), self.sentence)
            painter.end()
            return
        painter.setFont(theme.figures_font())
        scrolled = self.verticalScrollBar().value()
        first = scrolled // ROW_PX
        last = min(len(self.rows), int(first + area.height() // ROW_PX + 2))
        bar_left, bar_right = self._name_width + 10, area.width() - 44
        for index in range(first, last):
            self._paint_row(painter, self.rows[index], index * ROW_PX - scrolled, bar_left, bar_right)
        painter.end()

    def _paint_row(self, painter: QPainter, row: MeteredShape, top: float, left: float, right: float) -> None:
        value = min(max(row.value, 0.0), 1.0)
        still = row.value == 0.0
        painter.setPen(theme.colour("muted" if still else "text"))
        painter.drawStaticText(QPointF(0, top + 3), row.text)
        painter.drawStaticText(QPointF(right + 10, top + 3), self._numbers[int(value * 100 + 0.5)])
        bar = QRectF(left, top + 8, max(right - left, 4), 7)
        painter.fillRect(bar, theme.colour("raised"))
        if value > 0:
            painter.fillRect(
                QRectF(bar.left(), bar.top(), bar.width() * value, 7), theme.data_colour(row.token)
            )
        peak = min(max(row.peak, 0.0), 1.0)
        if peak > 0.01:
            x = bar.left() + bar.width() * peak
            painter.fillRect(QRectF(x - 1, bar.top() - 1, 2, 9), theme.colour("text"))

    def _measure(self) -> None:
        metrics = QFontMetricsF(theme.figures_font())
        longest = max((metrics.horizontalAdvance(row.name) for row in self.rows), default=60.0)
        self._name_width = min(longest, max(self.viewport().width() * 0.46, 60.0))
        for row in self.rows:
            short = metrics.elidedText(row.name, Qt.TextElideMode.ElideMiddle, self._name_width)
            if row.text.text() != short:
                row.text = QStaticText(short)
        bar = self.verticalScrollBar()
        bar.setPageStep(self.viewport().height())
        bar.setRange(0, max(0, len(self.rows) * ROW_PX - self.viewport().height()))


class ShapeMeters(QWidget):
    """Search, order, and the meters themselves."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setAccessibleName(self.tr("Blend shapes"))
        self._channels: dict[str, MeteredShape] = {}
        self._sorted_at = self._fed_at = 0.0
        self._order: list[MeteredShape] = []
        self._count = heading(self.tr("Blend shapes"))
        self.search = QLineEdit()
        self.search.setObjectName("shape_search")
        self.search.setPlaceholderText(self.tr("Search"))
        self.search.setAccessibleName(self.tr("Search blend shapes"))
        self.search.setClearButtonEnabled(True)
        self.search.textChanged.connect(self._reorder)
        self.sort = QComboBox()
        self.sort.setObjectName("shape_sort")
        self.sort.setAccessibleName(self.tr("Order of blend shapes"))
        self.sort.addItem(self.tr("By name"), "name")
        self.sort.addItem(self.tr("By activity"), "activity")
        self.sort.currentIndexChanged.connect(self._reorder)
        self.list = MeterList()
        self.list.sentence = self.tr("Every face shape your program sends appears here.")
        head = QHBoxLayout()
        head.setSpacing(theme.INSIDE)
        head.addWidget(self.search, 1)
        head.addWidget(self.sort)
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(theme.INSIDE)
        column.addWidget(self._count)
        column.addLayout(head)
        column.addWidget(self.list, 1)
        self._still = QTimer(self)  # lets peaks fall although nothing comes in any more
        self._still.setInterval(500)
        self._still.timeout.connect(self._on_still)

    def show_sources(self, sources: Mapping[str, str]) -> None:
        """Say in each row's tooltip who gives the shape."""
        self.list.sources = dict(sources)

    def show_values(self, values: Mapping[str, float]) -> None:
        """Show the latest weight of every shape by name; those no longer sent stay at their last value."""
        now = time.monotonic()
        fade = 0.5 ** ((now - self._fed_at) / ACTIVITY_FADE_S) if self._fed_at else 0.0
        self._fed_at = now
        known = len(self._channels)
        for name, value in values.items():
            channel = self._channels.get(name)
            if channel is None:
                channel = self._channels[name] = MeteredShape(name)
            channel.feed(value if value == value else 0.0, now, fade)
        if len(self._channels) != known:
            self._count.setText(f"{self.tr('Blend shapes').upper()}  {len(self._channels)}")
            self._reorder()
        elif self.sort.currentData() == "activity" and now - self._sorted_at > SORT_EVERY_S:
            self._reorder()
        else:
            self.list.viewport().update()
        if not self._still.isActive():
            self._still.start()

    def clear(self) -> None:
        """Forget all shapes."""
        self._channels.clear()
        self._still.stop()
        self._count.setText(self.tr("Blend shapes").upper())
        self._reorder()

    @property
    def shown_names(self) -> tuple[str, ...]:
        """The shapes listed, from the top."""
        return tuple(row.name for row in self.list.rows)

    def _reorder(self) -> None:
        self._sorted_at = time.monotonic()
        searched = self.search.text().strip().lower()
        rows = [channel for channel in self._channels.values() if searched in channel.low]
        if self.sort.currentData() == "activity":
            rows.sort(key=lambda row: (-round(row.activity, 2), row.low))
        else:
            rows.sort(key=lambda row: row.low)
        self.list.show_rows(rows)

    def _on_still(self) -> None:
        now = time.monotonic()
        if now - self._fed_at < 1.0:
            return
        for channel in self._channels.values():
            channel.peak = channel.value
        self.list.viewport().update()
        self._still.stop()
