"""How a timeline is painted: the lanes, once, into a picture, and what moves above them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QCoreApplication, QPointF, QRectF, QSize, Qt
from PySide6.QtGui import QBrush, QColor, QFontMetricsF, QImage, QPainter, QPen, QPixmap, QPolygonF

from studio.dataset import Label
from studio.ui import theme
from studio.ui.widgets.timeline.content import (
    GUTTER,
    LEAST_ROW,
    Content,
    Curve,
    Floats,
    Lane,
    Mark,
    PeakSource,
    Span,
)
from studio.ui.widgets.timeline.sound_lane import (
    columns_image,
    heat_colours,
    paint_pitches,
    paint_spectrum,
    paint_waveform,
)
from studio.ui.widgets.timeline.time_view import TimeView, ticks

LINE_PX = 1.5
"""Thickness of a motion curve."""
SMALLEST_LABEL = 14.0
"""Pixels a label is drawn wide at least, so that a moment can be seen and clicked."""


def area(lane: Lane, left: float, view: TimeView) -> QRectF:
    """The rectangle a lane's content fills, right of the gutter."""
    return QRectF(left, lane.top, view.width, lane.height)


def label_rect(label: Label, lane: Lane, left: float, view: TimeView) -> QRectF:
    """Where a label lies on its lane; a moment is as wide as its text needs."""
    x = left + view.x(label.t)
    wide = max(view.x(label.t + label.duration) - view.x(label.t), SMALLEST_LABEL)
    if label.duration <= 0:
        metrics = QFontMetricsF(theme.ui_font(theme.CAPTION_PX))
        wide = max(wide, metrics.horizontalAdvance(label.text) + 14)
    return QRectF(x, lane.top + _inset(lane), wide, lane.height - 2 * _inset(lane))


def _inset(lane: Lane) -> float:
    """Above and below a bar: in a thin lane its words need the room."""
    return 0.5 if lane.height <= LEAST_ROW else 2.5


def paint_ruler(painter: QPainter, lane: Lane, left: float, view: TimeView) -> None:
    """Times above, a tick under each."""
    box = area(lane, left, view)
    painter.fillRect(box, theme.colour("surface"))
    marks = ticks(view)
    painter.setFont(theme.figures_font(theme.CAPTION_PX))
    painter.setPen(theme.colour("line"))
    for t in marks.minor:
        x = left + view.x(t)
        painter.drawLine(QPointF(x, box.bottom() - 4), QPointF(x, box.bottom() - 1))
    for t, text in marks.major:
        x = left + view.x(t)
        painter.setPen(theme.colour("disabled"))
        painter.drawLine(QPointF(x, box.bottom() - 9), QPointF(x, box.bottom() - 1))
        painter.setPen(theme.colour("muted"))
        room = QRectF(x + (9 if x <= left + 1 else 4), box.top() + 3, 110, box.height() - 6)
        if room.left() + painter.fontMetrics().horizontalAdvance(text) > box.right():
            continue  # half a time is read as another one
        painter.drawText(room, Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter, text)


def paint_sound(
    painter: QPainter, lane: Lane, left: float, view: TimeView, source: PeakSource | None, silent: str
) -> None:
    """The waveform around its zero line, or a sentence where there is no sound."""
    box = area(lane, left, view)
    painter.fillRect(box, theme.colour("ground"))
    painter.setPen(theme.colour("line"))
    painter.drawLine(QPointF(box.left(), box.center().y()), QPointF(box.right(), box.center().y()))
    if source is None:
        painter.setPen(theme.colour("disabled"))
        painter.setFont(theme.ui_font(theme.CAPTION_PX))
        painter.drawText(box, Qt.AlignmentFlag.AlignCenter, silent)
        return
    inner = box.adjusted(0, 4, 0, -4)
    paint_waveform(painter, inner, source, view.start, view.end)


def paint_curves(
    painter: QPainter, lane: Lane, left: float, view: TimeView, curves: Mapping[str, Curve]
) -> None:
    """All motion curves over each other, each in its own range."""
    box = area(lane, left, view)
    painter.fillRect(box, theme.colour("ground"))
    ratio = painter.device().devicePixelRatioF()
    columns, height = max(int(box.width() * ratio), 1), max(int(box.height() * ratio), 2)
    for curve in curves.values():
        low, high = curve.columns(view.start, view.end, columns)
        room, half = height - 8 * ratio, LINE_PX * ratio / 2
        top, bottom = (height - 4 * ratio - part * room for part in (high, low))
        image = columns_image(top - half, bottom + half, height, theme.data_colour(curve.colour))
        image.setDevicePixelRatio(ratio)
        painter.drawImage(box.topLeft(), image)


def paint_labels(
    painter: QPainter,
    lane: Lane,
    left: float,
    view: TimeView,
    labels: Sequence[Label],
    chosen: Label | None,
) -> None:
    """One tier's labels as rounded bars with their text."""
    box = area(lane, left, view)
    painter.fillRect(box.adjusted(0, 1, 0, -1), theme.colour("surface"))
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.setFont(theme.ui_font(theme.CAPTION_PX))
    for label in labels:
        if label.tier != lane.tier or label.t > view.end or label.t + label.duration < view.start - view.span:
            continue
        rect = label_rect(label, lane, left, view)
        picked = label == chosen
        painter.setPen(QPen(theme.colour("accent" if picked else "disabled"), 1.4 if picked else 1.0))
        painter.setBrush(theme.colour("accent_soft" if picked else "raised"))
        painter.drawRoundedRect(rect.adjusted(0.5, 0.5, -0.5, -0.5), 4, 4)
        # Text starts where the bar begins to be seen, so a long label keeps its name while scrolling.
        seen = rect.intersected(QRectF(left, lane.top, view.width, lane.height)).adjusted(6, 0, -4, 0)
        if seen.width() > 6:
            painter.setPen(theme.colour("text"))
            text = painter.fontMetrics().elidedText(
                label.text, Qt.TextElideMode.ElideRight, int(seen.width()) + 1
            )
            painter.drawText(seen, Qt.AlignmentFlag.AlignVCenter | Qt.AlignmentFlag.AlignLeft, text)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing, False)


def mark_rect(mark: Mark, lane: Lane, left: float, view: TimeView) -> QRectF:
    """Where a problem lies on its lane, at least wide enough for its sign."""
    x, end = view.x(mark.t), view.x(mark.t + mark.duration)
    return QRectF(left + x, lane.top + _inset(lane), max(end - x, 16.0), lane.height - 2 * _inset(lane))


def paint_problems(painter: QPainter, lane: Lane, left: float, view: TimeView, marks: Sequence[Mark]) -> None:
    """Problems as coloured bars with a sign and, where there is room, their name."""
    box = area(lane, left, view)
    painter.fillRect(box.adjusted(0, 1, 0, -1), theme.colour("surface"))
    font = theme.ui_font(theme.CAPTION_PX, semibold=True)
    painter.setFont(font)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    rects = [mark_rect(mark, lane, left, view) for mark in marks]
    for i, (mark, rect) in enumerate(zip(marks, rects, strict=True)):
        if rect.left() > box.right() or rect.right() < box.left():
            continue
        colour = theme.colour(mark.severity)
        fill = QColor(colour)
        fill.setAlpha(56)
        painter.setPen(QPen(colour, 1))
        painter.setBrush(fill)
        painter.drawRoundedRect(rect.adjusted(0.5, 0.5, -0.5, -0.5), 3, 3)
        ahead = min((r.left() for r in rects[i + 1 :] if r.left() > rect.left()), default=box.right())
        _paint_title(painter, rect.intersected(box), mark.title, min(ahead, box.right()))
    painter.setRenderHint(QPainter.RenderHint.Antialiasing, False)


def _paint_title(painter: QPainter, rect: QRectF, title: str, limit: float) -> None:
    """The sign and name of a problem inside its bar, or the sign inside and the name right of it."""
    metrics = painter.fontMetrics()
    middle = Qt.AlignmentFlag.AlignVCenter | Qt.AlignmentFlag.AlignLeft
    if rect.width() >= metrics.horizontalAdvance(f"!  {title}") + 12:
        painter.drawText(rect.adjusted(6, 0, 0, 0), middle, f"!  {title}")
        return
    painter.drawText(rect, Qt.AlignmentFlag.AlignCenter, "!")
    place = QRectF(rect.right() + 4, rect.top(), limit - rect.right() - 8, rect.height())
    if place.width() > 24:
        text = metrics.elidedText(title, Qt.TextElideMode.ElideRight, int(place.width()))
        painter.drawText(place, middle, text)


def paint_heat(
    painter: QPainter, lane: Lane, left: float, view: TimeView, times: NDArray[np.float64], values: Floats
) -> None:
    """Values 0..1 over time as colours of viridis."""
    box = area(lane, left, view)
    columns = max(int(view.width), 1)
    moments = view.start + (np.arange(columns) + 0.5) / columns * view.span
    level = np.interp(moments, times, np.clip(values, 0, 1)) if len(times) else np.zeros(columns)
    rgba = np.full((1, columns, 4), 255, np.uint8)
    rgba[0, :, :3] = heat_colours(level)
    image = QImage(rgba.data, columns, 1, 4 * columns, QImage.Format.Format_RGBA8888)
    painter.drawImage(box, image)


def paint_excluded(
    painter: QPainter, spread: Span, left: float, view: TimeView, spans: Sequence[Span]
) -> None:
    """Hatching from top to bottom of the spread over what is left out of training."""
    for start, end in spans:
        rect = _box(spread, left, view, (start, end))
        painter.fillRect(rect, theme.colour("ground", 150))
        painter.fillRect(rect, QBrush(theme.colour("disabled", 90), Qt.BrushStyle.BDiagPattern))
        painter.setPen(theme.colour("disabled"))
        painter.drawLine(rect.topLeft(), rect.bottomLeft())
        painter.drawLine(rect.topRight(), rect.bottomRight())


def paint_unmade(
    painter: QPainter, spread: Span, left: float, view: TimeView, span: Span, words: str
) -> None:
    """A shade over what is still being made, with the line that it moves along."""
    rect = _box(spread, left, view, span)
    if rect.width() <= 0:
        return
    painter.fillRect(rect, theme.colour("accent_soft", 150))
    painter.setPen(QPen(theme.colour("accent"), 2))
    painter.drawLine(rect.topLeft(), rect.bottomLeft())
    painter.setFont(theme.ui_font(theme.CAPTION_PX))
    painter.setPen(theme.colour("text"))
    if painter.fontMetrics().horizontalAdvance(words) + 16 < rect.width():
        painter.drawText(QPointF(rect.left() + 8, rect.bottom() - 8), words)


def paint_outside(painter: QPainter, spread: Span, left: float, view: TimeView, in_out: Span) -> None:
    """Shade what lies before the in point and after the out point."""
    shade = theme.colour("ground", 165)
    for span in ((view.start, in_out[0]), (in_out[1], view.end)):
        if span[1] > span[0]:
            painter.fillRect(_box(spread, left, view, span), shade)


def paint_span(painter: QPainter, spread: Span, left: float, view: TimeView, span: Span, alpha: int) -> None:
    """A selected or looped span in the accent colour."""
    painter.fillRect(_box(spread, left, view, span), theme.colour("accent", alpha))


def paint_parts(painter: QPainter, spread: Span, left: float, view: TimeView, parts: Sequence[Span]) -> None:
    """What a cut would keep, framed and numbered; what it would leave out is shaded."""
    ends = [view.start, *(t for part in parts for t in part), view.end]
    for gap in zip(ends[::2], ends[1::2], strict=True):
        if gap[1] > gap[0]:
            box = _box(spread, left, view, gap)
            painter.fillRect(box, theme.colour("ground", 165))
            painter.fillRect(box, QBrush(theme.colour("disabled", 130), Qt.BrushStyle.BDiagPattern))
    painter.setFont(theme.figures_font(theme.CAPTION_PX))
    for number, part in enumerate(parts, 1):
        if part[1] < view.start or part[0] > view.end:
            continue
        box = _box(spread, left, view, part)
        painter.setPen(QPen(theme.colour("warn"), 1, Qt.PenStyle.DashLine))
        painter.drawLine(box.topLeft(), box.bottomLeft())
        painter.drawLine(box.topRight(), box.bottomRight())
        text = str(number)
        wide = painter.fontMetrics().horizontalAdvance(text) + 8
        if box.width() > wide + 4:
            tag = QRectF(max(box.left(), left) + 2, box.top() + 2, wide, 16)
            painter.fillRect(tag, theme.colour("warn"))
            painter.setPen(theme.colour("ground"))
            painter.drawText(tag, Qt.AlignmentFlag.AlignCenter, text)


def paint_handles(painter: QPainter, bottom: float, left: float, view: TimeView, in_out: Span) -> None:
    """The in and out points: a flag on the ruler, a line through all lanes."""
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    for t, way in zip(in_out, (1, -1), strict=True):
        x = left + view.x(t)
        painter.setPen(QPen(theme.colour("text"), 1.5))
        painter.drawLine(QPointF(x, 2), QPointF(x, bottom))
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(theme.colour("text"))
        flag = [QPointF(x, 2), QPointF(x + way * 9, 2), QPointF(x + way * 9, 9), QPointF(x, 15)]
        painter.drawPolygon(QPolygonF(flag))
    painter.setRenderHint(QPainter.RenderHint.Antialiasing, False)


def paint_playhead(painter: QPainter, bottom: float, x: float) -> None:
    """The moment that is heard and seen."""
    x = round(x) + 0.5
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.setPen(QPen(theme.colour("accent"), 1.5))
    painter.drawLine(QPointF(x, 8), QPointF(x, bottom))
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(theme.colour("accent"))
    painter.drawPolygon(QPolygonF([QPointF(x - 6, 6), QPointF(x + 6, 6), QPointF(x, 15)]))
    painter.setRenderHint(QPainter.RenderHint.Antialiasing, False)


def paint_overview(painter: QPainter, lane: Lane, left: float, view: TimeView) -> None:
    """The whole length as a groove, what is shown as its thumb."""
    groove = QRectF(left, lane.top + 3, view.width, lane.height - 6)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(theme.colour("surface"))
    painter.drawRoundedRect(groove, 3, 3)
    if view.duration > 0 and view.span < view.duration * 0.999:
        x = left + view.start / view.duration * view.width
        wide = max(view.span / view.duration * view.width, 24.0)
        x = min(x, left + view.width - wide)
        painter.setBrush(theme.colour("disabled"))
        painter.drawRoundedRect(QRectF(x, groove.top(), wide, groove.height()), 3, 3)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing, False)


def paint_gutter(painter: QPainter, lane: Lane, left: float, name: str, legend: Mapping[str, Curve]) -> None:
    """The lane's name at the left; for motion, the names of the curves in their colours."""
    painter.setFont(theme.ui_font(theme.CAPTION_PX))
    spare = max((painter.fontMetrics().height() - lane.height) / 2, 0.0)  # a thin lane's name overhangs
    room = QRectF(0, lane.top - spare, left - 8, lane.height + 2 * spare)
    if not legend:
        painter.setPen(theme.colour("muted"))
        text = painter.fontMetrics().elidedText(name, Qt.TextElideMode.ElideRight, int(room.width()))
        painter.drawText(room, Qt.AlignmentFlag.AlignVCenter | Qt.AlignmentFlag.AlignRight, text)
        return
    line = 15
    fit = max(int(lane.height // line), 1)
    names = list(legend)
    shown = names if len(names) <= fit else [*names[: fit - 1], f"+ {len(names) - fit + 1}"]
    top = lane.top + (lane.height - line * len(shown)) / 2
    for i, text in enumerate(shown):
        colour = theme.data_colour(legend[text].colour) if text in legend else theme.colour("muted")
        painter.setPen(colour)
        row = QRectF(0, top + i * line, left - 8, line)
        painter.drawText(
            row,
            Qt.AlignmentFlag.AlignVCenter | Qt.AlignmentFlag.AlignRight,
            painter.fontMetrics().elidedText(text, Qt.TextElideMode.ElideRight, int(row.width())),
        )


def _box(spread: Span, left: float, view: TimeView, span: Span) -> QRectF:
    """The rectangle of a span, at least a pixel wide."""
    x, end = view.x(span[0]), view.x(span[1])
    return QRectF(left + x, spread[0], max(end - x, 1.0), spread[1] - spread[0])


def still_picture(
    content: Content, lanes: tuple[Lane, ...], view: TimeView, size: QSize, ratio: float
) -> QPixmap:
    """Everything that does not move with the playhead.

    Args:
        size: of the widget.
        ratio: device pixels a pixel.
    """
    picture = QPixmap(size * ratio)
    picture.setDevicePixelRatio(ratio)
    picture.fill(theme.colour("surface"))
    painter = QPainter(picture)
    for lane in lanes:
        _paint_gutter(painter, content, lane, view)
        painter.save()
        painter.setClipRect(QRectF(GUTTER, lane.top, view.width, lane.height))
        _paint_lane(painter, content, lane, view)
        painter.restore()
    painter.setClipRect(QRectF(GUTTER, 0, view.width, size.height()))
    paint_excluded(painter, spread(lanes), GUTTER, view, content.excluded)
    painter.end()
    return picture


def paint_above(painter: QPainter, content: Content, lanes: tuple[Lane, ...], view: TimeView) -> None:
    """What moves or changes while one works: ends, selection, loop, cuts, playhead."""
    whole = spread(lanes)
    if content.handles:
        paint_outside(painter, whole, GUTTER, view, content.in_out)
    if content.unmade is not None:
        paint_unmade(painter, whole, GUTTER, view, content.unmade, _tr("generating"))
    if content.span is not None:
        paint_span(painter, whole, GUTTER, view, content.span, 50)
    if content.loop is not None:
        edge = float(lanes[0].bottom)
        paint_span(painter, (edge - 5, edge), GUTTER, view, content.loop, 200)
    if content.parts:
        paint_parts(painter, whole, GUTTER, view, content.parts)
    if content.handles:
        paint_handles(painter, whole[1], GUTTER, view, content.in_out)
    paint_playhead(painter, whole[1], GUTTER + view.x(content.playhead))


def spread(lanes: tuple[Lane, ...]) -> tuple[float, float]:
    """Top of the sound and bottom of the last lane above the overview."""
    return float(lanes[0].bottom), float(max(one.bottom for one in lanes if one.kind != "overview"))


def _paint_lane(painter: QPainter, content: Content, lane: Lane, view: TimeView) -> None:
    if view.duration <= 0 and lane.kind != "sound":
        return
    if lane.kind == "ruler":
        paint_ruler(painter, lane, GUTTER, view)
    elif lane.kind == "sound" and content.spectrum is not None:
        paint_spectrum(painter, area(lane, GUTTER, view), content.spectrum, view)
    elif lane.kind == "sound":
        silent = content.silent if view.duration > 0 else ""
        paint_sound(painter, lane, GUTTER, view, content.sound, silent)
    elif lane.kind == "heat" and content.heat is not None:
        paint_heat(painter, lane, GUTTER, view, *content.heat)
    elif lane.kind == "motion":
        paint_curves(painter, lane, GUTTER, view, content.curves)
    elif lane.kind == "labels":
        paint_labels(painter, lane, GUTTER, view, content.labels, content.chosen)
    elif lane.kind == "problems":
        paint_problems(painter, lane, GUTTER, view, content.problems)
    elif lane.kind == "overview":
        paint_overview(painter, lane, GUTTER, view)


def _paint_gutter(painter: QPainter, content: Content, lane: Lane, view: TimeView) -> None:
    if view.duration <= 0:
        return
    if lane.kind == "sound" and content.spectrum is not None:
        paint_pitches(painter, lane, GUTTER, content.spectrum)
        return
    names = {
        "sound": _tr("Sound"), "motion": _tr("Motion"), "problems": _tr("Problems"),
        "labels": content.tier_titles.get(lane.tier, lane.tier), "heat": _tr("Error"),
    }  # fmt: skip
    if lane.kind in names:
        legend = content.curves if lane.kind == "motion" else {}
        paint_gutter(painter, lane, GUTTER, names[lane.kind], legend)


def _tr(text: str) -> str:
    return QCoreApplication.translate("Timeline", text)
