"""The window that holds runs against each other: a table of figures with bars, and curves."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from PySide6.QtCore import (
    QT_TRANSLATE_NOOP,
    QCoreApplication,
    QModelIndex,
    QPersistentModelIndex,
    QRectF,
    QSize,
    Qt,
    Signal,
)
from PySide6.QtGui import QPainter
from PySide6.QtWidgets import (
    QAbstractItemView,
    QComboBox,
    QDialog,
    QHBoxLayout,
    QHeaderView,
    QProgressBar,
    QPushButton,
    QStackedLayout,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QTableWidget,
    QTableWidgetItem,
    QVBoxLayout,
    QWidget,
)

from studio.evaluation.learning_curve import error_of
from studio.evaluation.verdict import better_of
from studio.ipc.events import CompareDone
from studio.ui import theme
from studio.ui.language import native
from studio.ui.shortcuts import name_of, tip_of
from studio.ui.train.run_facts import ALIVE
from studio.ui.widgets.card import label
from studio.ui.widgets.plots import LossPlot

CAPTURED = "captured"
BASELINES = ("ridge", "train_mean", "zero")


@dataclass(frozen=True)
class Figure:
    """A figure: key in the metrics, title, decimals, one sentence about it, and its unit."""

    key: str
    title: str
    decimals: int
    tip: str
    unit: str = ""


_AS_MUCH = QT_TRANSLATE_NOOP("Compare", "1 moves as much as the performer")
FIGURES = tuple(
    Figure(*words)
    for words in (
        ("error", QT_TRANSLATE_NOOP("Compare", "Error"), 4,
         QT_TRANSLATE_NOOP("Compare",
                           "Root mean square error of the face, or of the body where there is no face; "
                           "smaller is nearer")),
        ("pearson", QT_TRANSLATE_NOOP("Compare", "Follows (r)"), 2,
         QT_TRANSLATE_NOOP("Compare", "How well the curves follow the captured ones; 1 is perfect")),
        ("pearson_mouth", QT_TRANSLATE_NOOP("Compare", "Mouth follows (r)"), 2,
         QT_TRANSLATE_NOOP("Compare", "The same for the shapes of the mouth")),
        ("pearson_jaw", QT_TRANSLATE_NOOP("Compare", "Jaw follows (r)"), 2,
         QT_TRANSLATE_NOOP("Compare", "The same for the shape that opens the jaw")),
        ("motion_ratio", QT_TRANSLATE_NOOP("Compare", "Motion"), 2,
         QT_TRANSLATE_NOOP("Compare", "How much it moves; 1 moves as much as the performer, 0 stands still")),
        ("std_ratio", QT_TRANSLATE_NOOP("Compare", "Reach"), 2,
         QT_TRANSLATE_NOOP("Compare", "How wide the poses are; 1 is as wide as the performer's")),
        ("jerk_ratio", QT_TRANSLATE_NOOP("Compare", "Jerk"), 2,
         QT_TRANSLATE_NOOP("Compare", "Jitter: 1 is as smooth as the performer")),
        ("closure_recall", QT_TRANSLATE_NOOP("Compare", "Lips close"), 2,
         QT_TRANSLATE_NOOP("Compare", "How often the lips close when they should")),
        ("closure_precision", QT_TRANSLATE_NOOP("Compare", "Closed rightly"), 2,
         QT_TRANSLATE_NOOP("Compare", "Share of its closed mouths that the performer closed too")),
        ("sync_match", QT_TRANSLATE_NOOP("Compare", "Fits its sound"), 2,
         QT_TRANSLATE_NOOP("Compare",
                           "How often it fits its own sound better than another; 1 always, 0.5 is chance")),
        ("mouth_lag_ms", QT_TRANSLATE_NOOP("Compare", "Mouth after voice"), 0,
         QT_TRANSLATE_NOOP("Compare", "How late the mouth comes after the voice"), "ms"),
        ("blinks_per_minute", QT_TRANSLATE_NOOP("Compare", "Blinks a minute"), 1,
         QT_TRANSLATE_NOOP("Compare", "People blink 10 to 30 times a minute while they speak")),
        ("geodesic_deg", QT_TRANSLATE_NOOP("Compare", "Bones off"), 2,
         QT_TRANSLATE_NOOP("Compare", "Mean angle between predicted and captured bones"), "°"),
        ("wrist_cm", QT_TRANSLATE_NOOP("Compare", "Wrists off"), 1,
         QT_TRANSLATE_NOOP("Compare", "Mean distance of the wrists from where they were"), "cm"),
        ("motion_ratio_head", QT_TRANSLATE_NOOP("Compare", "Motion of the head"), 2, _AS_MUCH),
        ("motion_ratio_torso", QT_TRANSLATE_NOOP("Compare", "Motion of the torso"), 2, _AS_MUCH),
        ("motion_ratio_arms", QT_TRANSLATE_NOOP("Compare", "Motion of the arms"), 2, _AS_MUCH),
        ("frechet", QT_TRANSLATE_NOOP("Compare", "Strangeness"), 2,
         QT_TRANSLATE_NOOP("Compare", "Frechet distance of the motion: 0 is the same, 1 a frozen mean")),
    )
)  # fmt: skip


PLAIN = frozenset({"pearson_mouth", "pearson", "motion_ratio", "closure_recall", "sync_match"})
"""Figures that a performer understands without a lesson; the others are behind Details."""


@dataclass(frozen=True)
class Cell:
    """A value, the length of its bar 0..1, and whether it is nearest to the captured motion's."""

    value: float | None
    bar: float = 0.0
    best: bool = False


@dataclass(frozen=True)
class FigureRow:
    """One figure of everything compared, in the order of the columns."""

    figure: Figure
    cells: tuple[Cell, ...]
    mark: float | None
    """Where the captured motion's own value lies on the bars, 0..1."""


@dataclass(frozen=True)
class Comparison:
    """The table.

    Args:
        columns: ids of the runs, then of the baselines, then "captured".
        runs: how many of the columns are runs.
        rows: the figures that apply to any.
        takes: ids of those measured on.
        split: what they are used for.
    """

    columns: tuple[str, ...]
    runs: int
    rows: tuple[FigureRow, ...]
    takes: tuple[str, ...]
    split: str
    better: str = ""
    """Which run is better and why, in a sentence."""


def compared(done: CompareDone) -> Comparison:
    """The table of the last line of `saia compare --json`."""
    runs, baselines = done.runs, done.baselines
    order = [name for name in BASELINES if name in baselines]
    columns = (*runs, *order, CAPTURED)
    found = [*runs.values(), *(baselines[name] for name in order), done.captured]
    found = [{**one, "error": error_of(one)} for one in found]
    rows = [_row(figure, [_number(one.get(figure.key)) for one in found], len(runs)) for figure in FIGURES]
    shown = tuple(row for row in rows if any(cell.value is not None for cell in row.cells[:-1]))
    better = native(better_of(runs, done.per_take))
    return Comparison(columns, len(runs), shown, done.takes, done.split, better)


def title(column: str) -> str:
    """A column's heading."""
    words = {
        "ridge": _tr("Simple guess"),
        "train_mean": _tr("Mean pose"),
        "zero": _tr("Rest pose"),
        CAPTURED: _tr("Captured"),
    }
    return words.get(column, column)


def _row(figure: Figure, values: Sequence[float | None], runs: int) -> FigureRow:
    known = [abs(value) for value in values if value is not None]
    longest = max(known, default=0.0)
    nearest = _nearest(values[:runs], values[-1])
    cells = [
        Cell(value, max(value, 0.0) / longest if value is not None and longest > 0 else 0.0, i == nearest)
        for i, value in enumerate(values)
    ]
    ideal = values[-1]
    return FigureRow(
        figure, tuple(cells), abs(ideal) / longest if ideal is not None and longest > 0 else None
    )


def _nearest(values: Sequence[float | None], ideal: float | None) -> int | None:
    """Which value alone is nearest to the ideal; None where nothing can be said."""
    if ideal is None:
        return None
    known = sorted((abs(value - ideal), i) for i, value in enumerate(values) if value is not None)
    return known[0][1] if len(known) > 1 and known[0][0] < known[1][0] else None


def _number(value: object) -> float | None:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        return None
    return float(value)


def _tr(text: str) -> str:
    return QCoreApplication.translate("Compare", text)


Points = Mapping[str, Sequence[tuple[int, float | None]]]

CELL, MARK, COLOUR = Qt.ItemDataRole.UserRole, Qt.ItemDataRole.UserRole + 1, Qt.ItemDataRole.UserRole + 2
BAR_PX, ROW_PX = 4, 32
LEAST_MARK = 0.02
"""Nearer to the left end a tick says nothing."""
_GREY = 7
"""The data colour of what is no run."""


class CompareDialog(QDialog):
    """Runs side by side; work goes on in the window behind it.

    Args:
        runs: their ids, in the order of the columns.
        parent: the tab.

    Signals:
        split_chosen: measure on another split, "test" or "val".
    """

    split_chosen = Signal(str)

    def __init__(self, runs: Sequence[str], parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("compare_dialog")
        self.setWindowTitle(self.tr("Compare runs"))
        # Each comparison is a window of its own; kept, they would gather unseen.
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self.resize(1040, 680)
        self.table = CompareTable()
        self._better = label("", "", "compare_better")
        self._better.setFont(theme.ui_font(theme.TITLE_PX, semibold=True))
        self._better.setWordWrap(True)
        self._better.hide()
        self.details = QPushButton(name_of("run_details"))
        self.details.setObjectName("compare_details")
        self.details.setToolTip(tip_of("run_details"))
        self.details.setCheckable(True)
        theme.as_role(self.details, "quiet")
        self._note = label("", "muted", "compare_told")
        self._note.setWordWrap(True)
        self._state = label("", "muted", "compare_state")
        self._bar = QProgressBar()
        self._bar.setRange(0, 100 * (len(runs) + 1))
        self._bar.setTextVisible(False)
        self._bar.setAccessibleName(self.tr("Measuring"))
        self.ground = QComboBox()
        self.ground.setObjectName("compare_ground")
        self.ground.setAccessibleName(self.tr("Measured on"))
        self.ground.addItem(self.tr("Test takes"), "test")
        self.ground.addItem(self.tr("Validation takes"), "val")
        self.ground.currentIndexChanged.connect(
            lambda _: self.split_chosen.emit(str(self.ground.currentData()))
        )
        series = [(run, run) for run in runs]
        self.error_plot = LossPlot(self.tr("Error on held-back takes"), series)
        words = self.tr("In the green band it moves as much as the performer")
        self.motion_plot = LossPlot(self.tr("Motion against captured"), series, (*ALIVE, words), 2)
        column = QVBoxLayout(self)
        column.setContentsMargins(theme.BETWEEN, theme.BETWEEN, theme.BETWEEN, theme.BETWEEN)
        column.setSpacing(12)
        column.addWidget(self._better)
        column.addLayout(self._head())
        self._stack = QStackedLayout()
        column.addLayout(self._stack, 3)
        self._fill_stack()
        figures = QWidget()
        plots = QHBoxLayout(figures)
        plots.setContentsMargins(0, 0, 0, 0)
        plots.setSpacing(theme.BETWEEN)
        plots.addWidget(self.error_plot, 1)
        plots.addWidget(self.motion_plot, 1)
        column.addWidget(figures, 2)
        figures.hide()
        self.details.toggled.connect(figures.setVisible)
        self.details.toggled.connect(self.table.show_details)
        close = QPushButton(self.tr("Close"))
        close.setObjectName("compare_close")
        close.clicked.connect(self.accept)
        column.addWidget(close, 0, Qt.AlignmentFlag.AlignRight)

    def show_busy(self, measured: float, text: str) -> None:
        """Say how many runs have been measured, and how much of the next one."""
        self._stack.setCurrentIndex(0)
        self._better.hide()
        self._bar.setVisible(True)
        self._bar.setValue(round(100 * measured))
        self._state.setText(text)
        self.ground.setEnabled(False)

    def show_failure(self, sentence: str) -> None:
        """Say why there is no table."""
        self._stack.setCurrentIndex(0)
        self._bar.setVisible(False)
        self._state.setText(sentence)
        self.ground.setEnabled(True)

    def show_compared(self, compared: Comparison, note: str) -> None:
        """Show the table.

        Args:
            compared: its content.
            note: what is to be known of it.
        """
        self._better.setText(compared.better)
        self._better.setVisible(bool(compared.better))
        self.table.show_compared(compared)
        self._note.setText(note)
        self._stack.setCurrentIndex(1)
        self.ground.setEnabled(True)

    def show_curves(self, error: Points, motion: Points) -> None:
        """The curves of each run, by its id."""
        self.error_plot.show_points(error, None)
        self.motion_plot.show_points(motion, None)

    def _head(self) -> QHBoxLayout:
        row = QHBoxLayout()
        caption = label(self.tr("Measured on"), "muted")
        caption.setBuddy(self.ground)
        row.addWidget(caption)
        row.addWidget(self.ground)
        row.addWidget(self._note, 1)
        row.addWidget(self.details)
        return row

    def _fill_stack(self) -> None:
        busy = QWidget()
        column = QVBoxLayout(busy)
        column.addStretch(1)
        self._state.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self._state.setWordWrap(True)
        column.addWidget(self._state)
        column.addWidget(self._bar)
        column.addStretch(1)
        self._stack.addWidget(busy)
        self._stack.addWidget(self.table)


class CompareTable(QTableWidget):
    """Figures as numbers and bars; the run nearest to the captured motion is marked in each row."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("compare_table")
        self._details = False
        self._plain: list[bool] = []
        self.setAccessibleName(self.tr("Figures side by side"))
        self.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.setSelectionMode(QAbstractItemView.SelectionMode.NoSelection)
        self.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.setShowGrid(False)
        self.setItemDelegate(_Bars(self))
        self.verticalHeader().setDefaultSectionSize(ROW_PX)
        self.verticalHeader().setSectionResizeMode(QHeaderView.ResizeMode.Fixed)
        self.horizontalHeader().setSectionResizeMode(QHeaderView.ResizeMode.Stretch)
        self.horizontalHeader().setMinimumSectionSize(92)

    def show_compared(self, compared: Comparison) -> None:
        """Fill it."""
        self.clear()
        self.setRowCount(len(compared.rows))
        self.setColumnCount(len(compared.columns))
        self.setHorizontalHeaderLabels([title(column) for column in compared.columns])
        self._plain = []
        for y, row in enumerate(compared.rows):
            head = QTableWidgetItem(QCoreApplication.translate("Compare", row.figure.title))
            head.setToolTip(QCoreApplication.translate("Compare", row.figure.tip))
            self.setVerticalHeaderItem(y, head)
            self._plain.append(row.figure.key in PLAIN)
            for x, cell in enumerate(row.cells):
                self.setItem(y, x, self._item(row, cell, x if x < compared.runs else _GREY))

        self.show_details(self._details)

    def show_details(self, shown: bool) -> None:
        """Show every figure, or those of PLAIN alone."""
        self._details = shown
        for y, plain in enumerate(self._plain):
            self.setRowHidden(y, not (plain or shown))

    def _item(self, row: FigureRow, cell: Cell, colour: int) -> QTableWidgetItem:
        text = "" if cell.value is None else f"{cell.value:.{row.figure.decimals}f} {row.figure.unit}".strip()
        item = QTableWidgetItem(f"✓ {text}" if cell.best else text)
        item.setTextAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        item.setFont(theme.figures_font(semibold=cell.best))
        item.setData(CELL, cell.bar if cell.value is not None else None)
        item.setData(MARK, row.mark)
        item.setData(COLOUR, colour)
        tip = QCoreApplication.translate("Compare", row.figure.tip)
        item.setToolTip(f"{tip}\n{self.tr('Closest to the captured motion')}" if cell.best else tip)
        return item


class _Bars(QStyledItemDelegate):
    """Draws a bar under the number, and a tick where the captured motion lies."""

    def sizeHint(self, option: QStyleOptionViewItem, index: QModelIndex | QPersistentModelIndex) -> QSize:
        return QSize(92, ROW_PX)

    def paint(
        self,
        painter: QPainter,
        option: QStyleOptionViewItem,
        index: QModelIndex | QPersistentModelIndex,
    ) -> None:
        super().paint(painter, option, index)
        bar = index.data(CELL)
        if bar is None:
            return
        rect = QRectF(option.rect).adjusted(8, 0, -8, 0)
        track = QRectF(rect.left(), rect.bottom() - BAR_PX - 2, rect.width(), BAR_PX)
        painter.save()
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(theme.colour("raised"))
        painter.drawRoundedRect(track, 2, 2)
        painter.setBrush(theme.data_colour(int(index.data(COLOUR))))
        painter.drawRoundedRect(QRectF(track.left(), track.top(), track.width() * float(bar), BAR_PX), 2, 2)
        mark = index.data(MARK)
        if mark is not None and float(mark) > LEAST_MARK:
            painter.setBrush(theme.colour("text"))
            x = min(track.left() + track.width() * float(mark), track.right() - 1)
            painter.drawRect(QRectF(x - 1, track.top() - 3, 2, BAR_PX + 6))
        painter.restore()
