"""A timeline's two layers: the lanes, painted once into a picture, and what moves above them."""

from __future__ import annotations

from PySide6.QtCore import QCoreApplication, QRectF, QSize
from PySide6.QtGui import QPainter, QPixmap

from studio.ui import theme
from studio.ui.widgets.timeline import paint
from studio.ui.widgets.timeline.content import GUTTER, Content, Lane
from studio.ui.widgets.timeline.sound_lane import paint_pitches, paint_spectrum
from studio.ui.widgets.timeline.time_view import TimeView


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
    paint.paint_excluded(painter, spread(lanes), GUTTER, view, content.excluded)
    painter.end()
    return picture


def paint_above(painter: QPainter, content: Content, lanes: tuple[Lane, ...], view: TimeView) -> None:
    """What moves or changes while one works: ends, selection, loop, cuts, playhead."""
    whole = spread(lanes)
    if content.handles:
        paint.paint_outside(painter, whole, GUTTER, view, content.in_out)
    if content.unmade is not None:
        paint.paint_unmade(painter, whole, GUTTER, view, content.unmade, _tr("being made"))
    if content.span is not None:
        paint.paint_span(painter, whole, GUTTER, view, content.span, 50)
    if content.loop is not None:
        edge = float(lanes[0].bottom)
        paint.paint_span(painter, (edge - 5, edge), GUTTER, view, content.loop, 200)
    if content.parts:
        paint.paint_parts(painter, whole, GUTTER, view, content.parts)
    if content.handles:
        paint.paint_handles(painter, whole[1], GUTTER, view, content.in_out)
    paint.paint_playhead(painter, whole[1], GUTTER + view.x(content.playhead))


def spread(lanes: tuple[Lane, ...]) -> tuple[float, float]:
    """Top of the sound and bottom of the last lane above the overview."""
    return float(lanes[0].bottom), float(lanes[-2].bottom)


def _paint_lane(painter: QPainter, content: Content, lane: Lane, view: TimeView) -> None:
    if view.duration <= 0 and lane.kind != "sound":
        return
    if lane.kind == "ruler":
        paint.paint_ruler(painter, lane, GUTTER, view)
    elif lane.kind == "sound" and content.spectrum is not None:
        paint_spectrum(painter, paint.area(lane, GUTTER, view), content.spectrum, view)
    elif lane.kind == "sound":
        silent = content.silent if view.duration > 0 else ""
        paint.paint_sound(painter, lane, GUTTER, view, content.sound, silent)
    elif lane.kind == "heat" and content.heat is not None:
        paint.paint_heat(painter, lane, GUTTER, view, *content.heat)
    elif lane.kind == "motion":
        paint.paint_curves(painter, lane, GUTTER, view, content.curves)
    elif lane.kind == "labels":
        paint.paint_labels(painter, lane, GUTTER, view, content.labels, content.chosen)
    elif lane.kind == "problems":
        paint.paint_problems(painter, lane, GUTTER, view, content.problems)
    elif lane.kind == "overview":
        paint.paint_overview(painter, lane, GUTTER, view)


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
        paint.paint_gutter(painter, lane, GUTTER, names[lane.kind], legend)


def _tr(text: str) -> str:
    return QCoreApplication.translate("Timeline", text)
