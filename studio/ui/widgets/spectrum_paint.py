"""How a spectrogram is painted into a timeline's sound lane, and its pitches beside it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QImage, QPainter

from studio.take.spectrogram import FLOOR_DB, STEP_DB
from studio.ui import theme
from studio.ui.widgets.heat_colours import heat_table
from studio.ui.widgets.time_view import TimeView
from studio.ui.widgets.timeline_content import Lane, SpectrumSource

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
