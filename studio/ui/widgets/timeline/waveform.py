"""Sound as a picture: columns of smallest and largest samples, painted at the screen's own resolution."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QRectF, QSize
from PySide6.QtGui import QColor, QImage, QPainter, QPaintEvent
from PySide6.QtWidgets import QWidget

from studio.sound.peaks import block_extremes
from studio.ui import theme
from studio.ui.widgets.timeline.content import Floats, PeakSource


class SamplePeaks:
    """Peaks of samples held in memory: a pyramid of ever coarser blocks, each level four times the last.

    Args:
        samples: float32 mono (N,), full scale +-1.
        sample_rate: samples per second.
    """

    FACTOR = 4

    def __init__(self, samples: Floats, sample_rate: int) -> None:
        self._rate = sample_rate
        low = high = np.asarray(samples, dtype=np.float32).reshape(-1)
        self._levels = [(low, high)]
        while len(low) > 4096:
            kept = len(low) // self.FACTOR * self.FACTOR
            low = low[:kept].reshape(-1, self.FACTOR).min(axis=1)
            high = high[:kept].reshape(-1, self.FACTOR).max(axis=1)
            self._levels.append((low, high))

    def columns(self, start: float, end: float, count: int) -> tuple[Floats, Floats]:
        """Smallest and largest sample in each of `count` equal stretches, (count,); silence outside."""
        per_column = (end - start) * self._rate / max(count, 1)
        level = 0
        while level + 1 < len(self._levels) and self.FACTOR ** (level + 1) <= per_column / 2:
            level += 1
        low, high = self._levels[level]
        edges = np.linspace(start, end, count + 1) * self._rate / self.FACTOR**level
        return block_extremes(low, high, edges)


def waveform_image(low: Floats, high: Floats, height: int, colour: QColor) -> QImage:
    """The picture of some columns, transparent around it.

    Args:
        low, high: (W,) full scale +-1.
        height: pixels.
        colour: of the loudest parts; edges are blended by how much of a pixel they cover.
    """
    middle = (height - 1) / 2
    top = middle - np.clip(high, -1, 1) * middle
    bottom = np.maximum(middle - np.clip(low, -1, 1) * middle, top + 1.0)
    return columns_image(top, bottom, height, colour)


def columns_image(
    top: NDArray[np.floating], bottom: NDArray[np.floating], height: int, colour: QColor
) -> QImage:
    """A picture with one vertical bar a column, its ends blended by how much of a pixel they cover.

    A numpy picture takes a millisecond where QPainter strokes thousands of steep lines in seconds.

    Args:
        top, bottom: ends of each bar in pixels from above, (W,); NaN for none.
        height: pixels.
        colour: of the bars.
    """
    rows = np.arange(height, dtype=np.float32)[:, None]
    ends = np.nan_to_num(np.stack([top, bottom]), nan=-2.0).astype(np.float32)
    cover = np.clip(np.minimum(rows + 1, ends[1]) - np.maximum(rows, ends[0]), 0, 1)
    width = cover.shape[1]
    pixels = np.empty((height, width, 4), np.uint8)
    for i, part in enumerate((colour.blue(), colour.green(), colour.red(), 255)):
        pixels[..., i] = cover * (part * colour.alphaF())
    image = QImage(pixels.data, width, height, 4 * width, QImage.Format.Format_ARGB32_Premultiplied)
    return image.copy()  # the copy owns its memory, the array goes


def paint_waveform(painter: QPainter, area: QRectF, source: PeakSource, start: float, end: float) -> None:
    """Paint sound from start to end seconds into an area, one column a device pixel."""
    ratio = painter.device().devicePixelRatioF()
    columns, height = max(int(area.width() * ratio), 1), max(int(area.height() * ratio), 2)
    low, high = source.columns(start, end, columns)
    image = waveform_image(low, high, height, QColor(theme.data_colour(0)))
    image.setDevicePixelRatio(ratio)
    painter.drawImage(area.topLeft(), image)


class Waveform(QWidget):
    """A small still picture of a whole sound, for lists and cards."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._source: PeakSource | None = None
        self._duration = 0.0
        self.setAccessibleName(self.tr("Waveform"))

    def set_sound(self, source: PeakSource | None, duration: float = 0.0) -> None:
        """Show this sound from 0 to its duration in seconds, or nothing."""
        self._source, self._duration = source, duration
        self.update()

    def sizeHint(self) -> QSize:
        """A strip of a list's height."""
        return QSize(160, 32)

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Paint the sound, or a silent line."""
        painter = QPainter(self)
        if self._source is not None and self._duration > 0:
            paint_waveform(painter, QRectF(self.rect()), self._source, 0.0, self._duration)
        painter.end()
