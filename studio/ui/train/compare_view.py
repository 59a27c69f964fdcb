"""The window that holds runs against each other: a table of figures with bars, and curves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from PySide6.QtCore import QCoreApplication, QModelIndex, QPersistentModelIndex, QRectF, QSize, Qt, Signal
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

from studio.ui import theme
from studio.ui.train.compare_facts import Cell, Comparison, FigureRow, title
from studio.ui.train.run_facts import ALIVE
from studio.ui.widgets.card import label
from studio.ui.widgets.plots import LossPlot

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
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self.resize(1040, 680)
        self.table = CompareTable()
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
        self.error_plot = LossPlot(self.tr("Error on validation"), series)
        words = self.tr("In the green band it moves as much as the performer")
        self.motion_plot = LossPlot(self.tr("Motion against captured"), series, (*ALIVE, words), 2)
        column = QVBoxLayout(self)
        column.setContentsMargins(theme.BETWEEN, theme.BETWEEN, theme.BETWEEN, theme.BETWEEN)
        column.setSpacing(12)
        column.addLayout(self._head())
        column.addLayout(self._middle(), 3)
        plots = QHBoxLayout()
        plots.setSpacing(theme.BETWEEN)
        plots.addWidget(self.error_plot, 1)
        plots.addWidget(self.motion_plot, 1)
        column.addLayout(plots, 2)
        close = QPushButton(self.tr("Close"))
        close.setObjectName("compare_close")
        close.clicked.connect(self.accept)
        column.addWidget(close, 0, Qt.AlignmentFlag.AlignRight)

    def show_busy(self, measured: float, text: str) -> None:
        """Say how many runs have been measured, and how much of the next one."""
        self._stack.setCurrentIndex(0)
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
        return row

    def _middle(self) -> QStackedLayout:
        busy = QWidget()
        column = QVBoxLayout(busy)
        column.addStretch(1)
        self._state.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self._state.setWordWrap(True)
        column.addWidget(self._state)
        column.addWidget(self._bar)
        column.addStretch(1)
        self._stack = QStackedLayout()
        self._stack.addWidget(busy)
        self._stack.addWidget(self.table)
        return self._stack


class CompareTable(QTableWidget):
    """Figures as numbers and bars; the run nearest to the captured motion is marked in each row."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("compare_table")
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
        for y, row in enumerate(compared.rows):
            head = QTableWidgetItem(QCoreApplication.translate("Compare", row.figure.title))
            head.setToolTip(QCoreApplication.translate("Compare", row.figure.tip))
            self.setVerticalHeaderItem(y, head)
            for x, cell in enumerate(row.cells):
                self.setItem(y, x, self._item(row, cell, x if x < compared.runs else _GREY))

    def _item(self, row: FigureRow, cell: Cell, colour: int) -> QTableWidgetItem:
        text = "" if cell.value is None else f"{cell.value:.{row.figure.decimals}f} {row.figure.unit}".strip()
        item = QTableWidgetItem(f"✓ {text}" if cell.best else text)
        item.setTextAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        item.setFont(theme.figures_font(semibold=cell.best))
        item.setData(CELL, cell.bar if cell.value is not None else None)
        item.setData(MARK, row.mark)
        item.setData(COLOUR, colour)
        tip = QCoreApplication.translate("Compare", row.figure.tip)
        item.setToolTip(f"{tip}\n{self.tr('Nearest to the captured motion')}" if cell.best else tip)
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
