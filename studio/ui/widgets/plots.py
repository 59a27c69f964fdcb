"""Plots that several places draw: values by epoch, and how well sound and motion match by offset."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from PySide6.QtCore import QEvent, QPointF, QRectF, QSize, Qt, QTimer
from PySide6.QtGui import QPainter, QPaintEvent, QPen, QPolygonF
from PySide6.QtWidgets import QFrame, QHBoxLayout, QLabel, QToolButton, QVBoxLayout, QWidget

from studio.ui import theme

if TYPE_CHECKING:
    import pyqtgraph as pg

MOST_TICKS = 16
LEAST_ROOM = 0.05
"""Of a value: less change than that looks like a great one, or fills the axis with digits."""
REDRAW_MS = 500
"""Curves are redrawn at most this often, however fast epochs come."""


class LossPlot(QWidget):
    """Named curves over epochs, with a legend that also tells the last value.

    Args:
        title: above the plot.
        series: (key, words) of each curve, in the order of the data colours.
        target: (low, high, words) of a band worth being in, or None.
        decimals: of the values in the legend.
    """

    def __init__(
        self,
        title: str,
        series: Sequence[tuple[str, str]],
        target: tuple[float, float, str] | None = None,
        decimals: int = 4,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self._series, self._decimals, self._target = tuple(series), decimals, target
        self._points: dict[str, tuple[list[int], list[float]]] = {}
        self._best: int | None = None
        self._plot: pg.PlotWidget | None = None
        self._curves: dict[str, Any] = {}
        self._best_line: Any = None
        self._band: Any = None
        self._values: dict[str, QLabel] = {}
        self._timer = QTimer(self)
        self._timer.setSingleShot(True)
        self._timer.setInterval(REDRAW_MS)
        self._timer.timeout.connect(self._redraw)
        self._layout = QVBoxLayout(self)
        self._layout.setContentsMargins(0, 0, 0, 0)
        self._layout.setSpacing(theme.TIGHT)
        self._layout.addLayout(self._legend(title))
        self.setMinimumHeight(150)
        self.setAccessibleName(title)

    def clear(self) -> None:
        """Begin anew."""
        self._points = {}
        self._best = None
        self._redraw()

    def show_points(self, points: Mapping[str, Sequence[tuple[int, float | None]]], best: int | None) -> None:
        """Replace all curves; drawn soon.

        Args:
            points: key -> (epoch, value) pairs; None and non-finite values leave a gap out.
            best: the best epoch so far.
        """
        self._points = {}
        for key, _ in self._series:
            pairs = points.get(key, ())
            good = [(e, float(v)) for e, v in pairs if v is not None and math.isfinite(v)]
            self._points[key] = ([e for e, _ in good], [v for _, v in good])
        self._best = best
        if not self._timer.isActive():
            self._timer.start()

    @property
    def points(self) -> dict[str, tuple[list[int], list[float]]]:
        """Epochs and values of each curve, as they are drawn soon."""
        return self._points

    @property
    def drawn(self) -> dict[str, int]:
        """How many points of each curve are drawn already."""
        epochs = {key: curve.getData()[0] for key, curve in self._curves.items()}
        return {key: 0 if found is None else len(found) for key, found in epochs.items()}

    @property
    def value_range(self) -> tuple[float, float]:
        """The least and the greatest value of the axis that is drawn."""
        low, high = self._plot.viewRange()[1] if self._plot is not None else (0.0, 1.0)
        return float(low), float(high)

    @property
    def marks_best(self) -> bool:
        """Whether the best epoch is marked."""
        return self._best_line is not None and bool(self._best_line.isVisible())

    def value_text(self, key: str) -> str:
        """The newest value of a curve, as the legend says it."""
        return self._values[key].text()

    def _legend(self, title: str) -> QHBoxLayout:
        row = QHBoxLayout()
        row.setSpacing(theme.INSIDE)
        heading = QLabel(title)
        theme.as_role(heading, "heading")
        row.addWidget(heading)
        row.addStretch(1)
        for index, (key, text) in enumerate(self._series):
            swatch = QFrame()
            swatch.setFixedSize(12, 3)
            swatch.setStyleSheet(f"background: {theme.DATA[index]}; border-radius: 1px;")
            value = QLabel("")
            value.setFont(theme.figures_font(theme.CAPTION_PX))
            self._values[key] = value
            caption = QLabel(text)
            theme.as_role(caption, "caption")
            for widget in (swatch, caption, value):
                row.addWidget(widget)
        return row

    def showEvent(self, event: Any) -> None:
        self._make_plot()
        super().showEvent(event)

    def changeEvent(self, event: QEvent) -> None:
        if event.type() == QEvent.Type.PaletteChange and self._plot is not None:
            theme.style_plot(self._plot)
            pen = self._best_line.pen
            pen.setColor(theme.colour("accent"))
            self._best_line.setPen(pen)
            self._best_line.label.setColor(theme.colour("accent"))
        super().changeEvent(event)

    def _make_plot(self) -> None:
        """The plot itself, when it is first seen: pyqtgraph takes half a second to import."""
        if self._plot is not None:
            return
        import pyqtgraph as pg

        plot = pg.PlotWidget()
        plot.setMenuEnabled(False)
        plot.setMouseEnabled(x=False, y=False)
        plot.hideButtons()
        item = plot.getPlotItem()
        assert item is not None
        theme.style_plot(plot)
        item.setLabel("bottom", self.tr("epoch"), color=theme.colours().muted, **{"font-size": "11px"})
        item.getAxis("left").setWidth(52)
        item.getAxis("left").enableAutoSIPrefix(False)
        item.getAxis("bottom").enableAutoSIPrefix(False)
        if self._target is not None:
            low, high, words = self._target
            shade = theme.colour("good", 28)
            self._band = pg.LinearRegionItem(
                (low, high), "horizontal", brush=shade, pen=pg.mkPen(None), movable=False
            )
            item.addItem(self._band)
            self._band.setToolTip(words)
        for index, (key, _) in enumerate(self._series):
            symbol = {"symbol": "o", "symbolSize": 4, "symbolBrush": theme.DATA[index], "symbolPen": None}
            self._curves[key] = item.plot([], [], pen=theme.plot_pen(index, 2.0), **symbol)
        self._best_line = pg.InfiniteLine(
            angle=90,
            pen=pg.mkPen(theme.colours().accent, width=1, style=pg.QtCore.Qt.PenStyle.DashLine),
            label=self.tr("kept"),
            labelOpts={"position": 0.92, "color": theme.colours().accent, "anchors": [(0, 0.5), (1, 0.5)]},
        )
        self._best_line.hide()
        item.addItem(self._best_line)
        self._plot = plot
        self._layout.addWidget(plot, 1)
        self._redraw()

    def _redraw(self) -> None:
        for key, label in self._values.items():
            values = self._points.get(key, ([], []))[1]
            label.setText(f"{values[-1]:.{self._decimals}f}" if values else "")
        if self._plot is None:
            return
        for key, curve in self._curves.items():
            curve.setData(*self._points.get(key, ([], [])))
        self._best_line.setVisible(self._best is not None)
        if self._best is not None:
            self._best_line.setValue(self._best)
            tip = self.tr("Epoch {0} has the lowest loss on validation: its weights are kept")
            self._plot.setToolTip(tip.format(self._best))
        self._set_range()

    def _set_range(self) -> None:
        assert self._plot is not None
        item = self._plot.getPlotItem()
        epochs = [e for xs, _ in self._points.values() for e in xs]
        values = [v for _, ys in self._points.values() for v in ys]
        if self._target is not None:
            values += [0.0, self._target[1] * 1.1]
        if not values:
            item.setXRange(0, 10, padding=0)
            item.setYRange(0, 1, padding=0.02)
            return
        low, high = min(values), max(values)
        room = max(high - low, LEAST_ROOM * max(abs(high), 1e-6))
        low = min(low, (low + high - room) / 2)
        high = max(high, low + room)
        first, last = min(epochs, default=0), max([*epochs, 5])
        item.setXRange(first, last, padding=0.02)
        step = epoch_step(last - first)
        item.getAxis("bottom").setTickSpacing(levels=[(step, 0)])
        item.setYRange(
            max(low - 0.08 * room, 0.0) if low >= 0 else low - 0.08 * room, high + 0.08 * room, padding=0
        )


def epoch_step(span: int) -> int:
    """Epochs from one number under a plot to the next: whole ones, however few or many there are."""
    step = 1
    while span > MOST_TICKS * step:
        step = step * 5 // 2 if str(step).startswith("2") else step * 2
    return step


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
