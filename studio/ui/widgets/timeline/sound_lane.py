"""How sound is painted into a timeline's lane: as a waveform or a spectrogram, and the colours for heat."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QColor, QImage, QPainter

from studio.sound.spectrogram import FLOOR_DB, STEP_DB
from studio.ui import theme
from studio.ui.widgets.timeline.content import Floats, Lane, PeakSource, SpectrumSource
from studio.ui.widgets.timeline.time_view import TimeView

SHOWN_DB = 65.0
"""From the loudest colour down to the darkest."""
PITCHES_HZ = (100.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0)
LABEL_PX = 14


def paint_spectrum(painter: QPainter, area: QRectF, source: SpectrumSource, view: TimeView) -> None:
    """Paint the stretch in view into an area, low pitches at the bottom."""
    ratio = painter.device().devicePixelRatioF()
    part = source.part(view.start, view.end, max(int(area.width() * ratio), 1))
    painter.fillRect(area, theme.colour("ground"))
    image = spectrum_image(part.data, source.top_db)
    left, right = (area.left() + view.x(t) for t in (part.start, part.end))
    painter.setRenderHint(QPainter.RenderHint.SmoothPixmapTransform)
    painter.drawImage(QRectF(left, area.top(), right - left, area.height()), image)


def spectrum_image(data: NDArray[np.uint8], top_db: float) -> QImage:
    """The colours of loudness values (K, BANDS), K pixels wide."""
    top = (top_db - FLOOR_DB) / STEP_DB
    level = np.clip(np.arange(256) - (top - SHOWN_DB / STEP_DB), 0, SHOWN_DB / STEP_DB)
    table = heat_table()[(level * 255 / (SHOWN_DB / STEP_DB)).astype(np.uint8)]
    pixels = np.ascontiguousarray(table[data.T[::-1]])
    height, width = pixels.shape
    image = QImage(pixels.data, width, height, 4 * width, QImage.Format.Format_RGB32)
    return image.copy()  # the copy owns its memory, the array goes


def paint_pitches(painter: QPainter, lane: Lane, left: float, source: SpectrumSource) -> None:
    """Some pitches at their heights, in the gutter."""
    painter.setFont(theme.figures_font(theme.CAPTION_PX))
    painter.setPen(theme.colour("muted"))
    bands = source.pitches_hz
    above = float(lane.bottom)
    for hz in PITCHES_HZ:
        y = lane.bottom - lane.height * float(np.interp(hz, bands, np.linspace(0.0, 1.0, len(bands))))
        if hz > bands[-1] or y - LABEL_PX / 2 < lane.top or y + LABEL_PX / 2 > above:
            continue
        above = y - LABEL_PX / 2
        text = f"{hz / 1000:g} kHz" if hz >= 1000 else f"{hz:g} Hz"
        room = QRectF(0, y - LABEL_PX / 2, left - 8, LABEL_PX)
        painter.drawText(room, Qt.AlignmentFlag.AlignVCenter | Qt.AlignmentFlag.AlignRight, text)


VIRIDIS = (
    (68, 1, 84), (72, 40, 120), (62, 74, 137), (49, 104, 142), (38, 130, 142),
    (31, 158, 137), (53, 183, 121), (110, 206, 88), (181, 222, 43), (253, 231, 37),
)  # fmt: skip
"""Ten stops of matplotlib's viridis."""


def heat_colours(level: NDArray[np.floating]) -> NDArray[np.uint8]:
    """Red, green and blue of values 0..1, (..., 3)."""
    stops = np.linspace(0, 1, len(VIRIDIS))
    channels = [np.interp(level, stops, [stop[i] for stop in VIRIDIS]) for i in range(3)]
    return np.stack(channels, axis=-1).astype(np.uint8)


@cache
def heat_table() -> NDArray[np.uint32]:
    """The scale in 256 steps as 0xffRRGGBB, (256,); silence is darker than the scale's first colour."""
    rgb = heat_colours(np.linspace(0, 1, 256)).astype(np.uint32)
    # The scale's violet is bright for a silent background: the lowest quarter fades to nearly black.
    fade = np.clip(np.linspace(0.12, 4.12, 256), 0, 1)[:, None]
    rgb = (rgb * fade).astype(np.uint32)
    return np.asarray(0xFF000000 | (rgb[:, 0] << 16) | (rgb[:, 1] << 8) | rgb[:, 2], dtype=np.uint32)


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
