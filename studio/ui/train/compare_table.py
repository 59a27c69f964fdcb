"""The table of a comparison: a figure a row, a run a column, each number over its bar."""

from __future__ import annotations

from PySide6.QtCore import QCoreApplication, QModelIndex, QPersistentModelIndex, QRectF, QSize, Qt
from PySide6.QtGui import QPainter
from PySide6.QtWidgets import (
    QAbstractItemView,
    QHeaderView,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QTableWidget,
    QTableWidgetItem,
    QWidget,
)

from studio.ui import theme
from studio.ui.train.compare_facts import Cell, Comparison, FigureRow, title

CELL, MARK, COLOUR = Qt.ItemDataRole.UserRole, Qt.ItemDataRole.UserRole + 1, Qt.ItemDataRole.UserRole + 2
BAR_PX, ROW_PX = 4, 32
LEAST_MARK = 0.02
"""Nearer to the left end a tick says nothing."""
_GREY = 7
"""The data colour of what is no run."""


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
