"""How a row of the library is painted: stars that can be clicked, a split chip, a grade, the sound."""

from __future__ import annotations

from collections import OrderedDict
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import (
    QAbstractItemModel,
    QEvent,
    QLineF,
    QModelIndex,
    QObject,
    QPersistentModelIndex,
    QPointF,
    QRectF,
    QSize,
    Qt,
    QTimer,
    Signal,
)
from PySide6.QtGui import QColor, QFont, QFontMetrics, QMouseEvent, QPainter, QPalette, QPen
from PySide6.QtWidgets import QStyle, QStyledItemDelegate, QStyleOptionViewItem

from studio.take.take import Take
from studio.ui import tasks, theme
from studio.ui.curate.take_table import COLUMNS, MISSING_ROLE, ROW_ROLE, TakeRow, split_title
from studio.ui.language import native
from studio.ui.widgets.timeline.time_view import clock

Index = QModelIndex | QPersistentModelIndex
STAR_PX = 15
SPLIT_COLOURS = {"train": 0, "val": 1, "test": 4}
GRADE_TOKENS = {"A": "good", "B": "good", "C": "warn", "D": "bad"}
ROW_PX = 32
LEAST_SOUND_PX = 24
FLASH_ALPHA = 70
PARTS = 48
MOST_WAITING = 40
"""What was asked for longer ago has been scrolled away."""
TELL_MS = 150

Levels = NDArray[np.float32]


class Thumbnails(QObject):
    """Loudness of takes, 0 to 1 in PARTS parts.

    Signals:
        made: pictures were added; sent a few times a second at most.
    """

    made = Signal()

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._kept: dict[Path, Levels | None] = {}
        self._waiting: OrderedDict[Path, float] = OrderedDict()
        self._task: tasks.Task | None = None
        self._tell = QTimer(self)
        self._tell.setSingleShot(True)
        self._tell.setInterval(TELL_MS)
        self._tell.timeout.connect(self.made)

    def levels(self, take: Take) -> Levels | None:
        """Loudness of a take's sound (PARTS,); None where there is none, or not yet: `made` follows."""
        path = take.audio_path
        if path is None:
            return None
        if path not in self._kept:
            self._waiting[path] = take.info.audio_seconds
            self._waiting.move_to_end(path)
            while len(self._waiting) > MOST_WAITING:
                self._waiting.popitem(last=False)
            self._next()
            return None
        return self._kept[path]

    def forget_missing(self) -> None:
        """Look again for sounds that could not be read."""
        self._kept = {path: levels for path, levels in self._kept.items() if levels is not None}

    def _next(self) -> None:
        if self._task is None and self._waiting:
            path, seconds = self._waiting.popitem()
            self._task = tasks.run(
                partial(_levels, path, seconds),
                partial(self._on_made, path),
                lambda _: self._on_made(path, None),
                self,
            )

    def _on_made(self, path: Path, levels: Levels | None) -> None:
        self._task = None
        self._kept[path] = levels
        if not self._tell.isActive():
            self._tell.start()
        self._next()


def _levels(path: Path, seconds: float) -> Levels:
    """Runs on the thread pool."""
    from studio.sound.peaks import peaks

    low, high = peaks(path).columns(0.0, max(seconds, 0.1), PARTS)
    levels: Levels = np.maximum(np.abs(low), np.abs(high)).astype(np.float32)
    # As loud as the take itself is, so that a quiet one shows its shape too.
    return levels / max(float(levels.max(initial=0.0)), 0.05)


class TakeDelegate(QStyledItemDelegate):
    """Paints the columns that are more than a text.

    Signals:
        stars_clicked: (selection id, stars).
    """

    stars_clicked = Signal(str, int)

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.thumbnails = Thumbnails(self)
        self.flashed: frozenset[str] = frozenset()
        """Ids of the selections whose rows are lit up."""

    def sizeHint(self, option: QStyleOptionViewItem, index: Index) -> QSize:
        """Rows of one height."""
        return QSize(super().sizeHint(option, index).width(), ROW_PX)

    def paint(self, painter: QPainter, option: QStyleOptionViewItem, index: Index) -> None:
        """Paint one cell."""
        row = index.data(ROW_ROLE)
        self._paint_cell(painter, option, index, row)
        if isinstance(row, TakeRow) and row.id in self.flashed:
            # Over everything: the row may be selected.
            light = theme.colour("accent")
            light.setAlpha(FLASH_ALPHA)
            painter.fillRect(option.rect, light)

    def _paint_cell(self, painter: QPainter, option: QStyleOptionViewItem, index: Index, row: object) -> None:
        column = COLUMNS[index.column()]
        if column in ("performer", "emotion", "tags", "note") or not isinstance(row, TakeRow):
            super().paint(painter, option, index)
            return
        painter.save()
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        self._paint_ground(painter, option)
        box = QRectF(option.rect).adjusted(8, 0, -6, 0)
        if column == "take":
            levels = self.thumbnails.levels(row.take) if row.take is not None else None
            wide = _paint_name(painter, box, row, index)
            if levels is not None:
                _paint_sound(painter, QRectF(option.rect).adjusted(wide + 16, 6, -6, -6), levels)
        elif column == "length":
            painter.setFont(theme.figures_font())
            painter.setPen(theme.colour("muted"))
            painter.drawText(box, _RIGHT, clock(row.seconds))
        elif column == "stars":
            _paint_stars(painter, box, row.selection.stars)
        elif column == "split":
            _paint_split(painter, box, row)
        else:
            _paint_grade(painter, box, row)
        painter.restore()

    def editorEvent(
        self, event: QEvent, model: QAbstractItemModel, option: QStyleOptionViewItem, index: Index
    ) -> bool:
        """A click on the stars sets them; on the first one again takes it away."""
        if COLUMNS[index.column()] != "stars" or event.type() != QEvent.Type.MouseButtonRelease:
            return super().editorEvent(event, model, option, index)
        assert isinstance(event, QMouseEvent)
        left = option.rect.left() + 8
        count = int((event.position().x() - left) // STAR_PX) + 1
        row = index.data(ROW_ROLE)
        if event.button() != Qt.MouseButton.LeftButton or not 1 <= count <= 5 or not isinstance(row, TakeRow):
            return False
        self.stars_clicked.emit(row.id, 0 if count == row.selection.stars == 1 else count)
        return True

    def _paint_ground(self, painter: QPainter, option: QStyleOptionViewItem) -> None:
        state = option.state
        rect = option.rect
        if state & QStyle.StateFlag.State_Selected:
            painter.fillRect(rect, option.palette.color(QPalette.ColorRole.Highlight))
        elif state & QStyle.StateFlag.State_MouseOver:
            painter.fillRect(rect, theme.colour("raised"))


_LEFT = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter
_RIGHT = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter


def _paint_sound(painter: QPainter, box: QRectF, levels: Levels) -> None:
    """The sound beside the name, where there is room for it."""
    if box.width() < LEAST_SOUND_PX:
        return
    step = box.width() / len(levels)
    painter.setPen(QPen(theme.colour("disabled"), max(step * 0.5, 1.0)))
    middle, half = box.center().y(), box.height() / 2
    lines = []
    for i, level in enumerate(levels.tolist()):
        x, y = box.left() + (i + 0.5) * step, max(level * half, 0.5)
        lines.append(QLineF(x, middle - y, x, middle + y))
    painter.drawLines(lines)


def _paint_name(painter: QPainter, box: QRectF, row: TakeRow, index: Index) -> int:
    """Paint a take's name; gives how wide it is."""
    missing = index.data(MISSING_ROLE)
    painter.setFont(theme.ui_font())
    painter.setPen(theme.colour("bad" if missing else "text" if row.selection.split else "muted"))
    short = painter.fontMetrics().elidedText(index.data(), Qt.TextElideMode.ElideMiddle, int(box.width()))
    # Takes of a slate differ at their end.
    painter.drawText(box, _LEFT, short)
    return painter.fontMetrics().horizontalAdvance(index.data())


def _paint_stars(painter: QPainter, box: QRectF, stars: int) -> None:
    font = QFont(theme.ui_font())
    font.setPixelSize(STAR_PX)
    painter.setFont(font)
    for i in range(5):
        painter.setPen(theme.colour("warn" if i < stars else "line"))
        place = QRectF(box.left() + i * STAR_PX, box.top(), STAR_PX, box.height())
        painter.drawText(place, Qt.AlignmentFlag.AlignCenter, "★")


def _paint_split(painter: QPainter, box: QRectF, row: TakeRow) -> None:
    split = row.selection.split
    if not split:
        painter.setFont(theme.ui_font(theme.CAPTION_PX))
        painter.setPen(theme.colour("disabled"))
        painter.drawText(box, _LEFT, split_title(split))
        return
    text = split_title(split) + (" 🔒︎" if row.selection.locked else "")
    _chip(painter, box, text, theme.data_colour(SPLIT_COLOURS[split]))


def _paint_grade(painter: QPainter, box: QRectF, row: TakeRow) -> None:
    if not row.grade:
        painter.setPen(theme.colour("disabled"))
        painter.drawText(box, _LEFT, "…")
        return
    colour = theme.colour(GRADE_TOKENS.get(row.grade, "muted"))
    badge = QRectF(box.left(), box.center().y() - 9, 18, 18)
    fill = QColor(colour)
    fill.setAlpha(46)
    painter.setPen(colour)
    painter.setBrush(fill)
    painter.drawRoundedRect(badge, 4, 4)
    painter.setFont(theme.ui_font(theme.CAPTION_PX, semibold=True))
    painter.drawText(badge, Qt.AlignmentFlag.AlignCenter, row.grade)
    painter.setFont(theme.ui_font(theme.CAPTION_PX))
    painter.setPen(theme.colour("muted"))
    room = box.adjusted(26, 0, 0, 0)
    painter.drawText(room, _LEFT, in_two_lines(native(row.reason), painter.fontMetrics(), int(room.width())))


def in_two_lines(text: str, metrics: QFontMetrics, width: int) -> str:
    """A sentence in one line where it fits, else in two, the second cut where even that is too little.

    Args:
        text: what is said.
        metrics: of the font it is written in.
        width: pixels there are.
    """
    if metrics.horizontalAdvance(text) <= width:
        return text
    words = text.split()
    count = 0
    while count < len(words) and metrics.horizontalAdvance(" ".join(words[: count + 1])) <= width:
        count += 1
    rest = " ".join(words[count:]) if count else text
    short = metrics.elidedText(rest, Qt.TextElideMode.ElideRight, width)
    return f"{' '.join(words[:count])}\n{short}" if count else short


def _chip(painter: QPainter, box: QRectF, text: str, colour: QColor) -> None:
    font = theme.ui_font(theme.CAPTION_PX, semibold=True)
    painter.setFont(font)
    wide = painter.fontMetrics().horizontalAdvance(text) + 16
    chip = QRectF(QPointF(box.left(), box.center().y() - 9), QPointF(box.left() + wide, box.center().y() + 9))
    fill = QColor(colour)
    fill.setAlpha(70)
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(fill)
    painter.drawRoundedRect(chip, 9, 9)
    # Data colours are too pale to read on a light ground.
    painter.setPen(theme.colour("text"))
    painter.drawText(chip, Qt.AlignmentFlag.AlignCenter, text)
