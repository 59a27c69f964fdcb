"""What aligning found: one take with its curve in full, or many in a table to judge one by one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from PySide6.QtCore import QCoreApplication, QModelIndex, QPersistentModelIndex, QRectF, QSize, Qt, Signal
from PySide6.QtGui import QPainter
from PySide6.QtWidgets import (
    QAbstractItemView,
    QDialog,
    QHBoxLayout,
    QHeaderView,
    QPushButton,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QTableWidget,
    QTableWidgetItem,
    QVBoxLayout,
    QWidget,
)

from studio.ui import theme
from studio.ui.widgets.card import label
from studio.ui.widgets.plots import (
    CERTAIN,
    LIKELY,
    CorrelationPlot,
    paint_correlation,
    role_of,
)

if TYPE_CHECKING:
    from studio.motion.lag import Alignment

FOUND = Qt.ItemDataRole.UserRole + 1


@dataclass(frozen=True)
class Answer:
    """What aligning one take came to.

    Args:
        take: its id.
        found: None where it could not be read; `problem` says why.
        used: whether the offset was taken over.
    """

    take: str
    found: Alignment | None
    used: bool
    problem: str = ""


def judged(found: Alignment) -> str:
    """How sure an offset is, in words."""
    percent, offset = f"{found.confidence:.0%}", f"{found.offset * 1000:+.0f} ms"
    if found.confidence >= CERTAIN:
        return _tr("{0}, sure ({1})").format(offset, percent)
    if found.confidence >= LIKELY:
        return _tr("{0}, likely ({1}): listen").format(offset, percent)
    if found.confidence > 0:
        return _tr("Not sure ({0}): adjust by ear").format(percent)
    return _tr("Could not tell: adjust by ear")


class CurvePopup(QDialog):
    """One take's curve in full.

    Signals:
        claps_requested: try the claps in place of mouth and voice.
        used: take the offset over although it is not sure.
    """

    claps_requested = Signal()
    used = Signal()

    def __init__(self, found: Alignment, by: str, used: bool, parent: QWidget) -> None:
        super().__init__(parent, Qt.WindowType.Popup)
        self.setObjectName("align_popup")
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        by_words = {"mouth": _tr("By mouth and voice"), "clap": _tr("By claps")}
        column = QVBoxLayout(self)
        column.setContentsMargins(theme.BETWEEN, theme.BETWEEN, theme.BETWEEN, theme.BETWEEN)
        column.setSpacing(theme.INSIDE)
        title = label(f"{by_words[by]}: {judged(found)}", role_of(found.confidence))
        column.addWidget(title)
        column.addWidget(CorrelationPlot(found))
        hint = _tr("One high, narrow peak is a good sign; several of one height mean it is a guess.")
        column.addWidget(label(hint, "muted"))
        row = QHBoxLayout()
        row.addStretch(1)
        if not used and found.confidence > 0:
            row.addWidget(self._button(_tr("Use it anyway"), "align_use_button", self.used))
        if by == "mouth":
            row.addWidget(self._button(_tr("Try claps"), "align_claps_button", self.claps_requested))
        column.addLayout(row)

    def _button(self, text: str, name: str, signal: object) -> QPushButton:
        button = QPushButton(text)
        button.setObjectName(name)
        button.clicked.connect(signal)
        button.clicked.connect(self.close)
        return button


class AlignReport(QDialog):
    """Many takes, what was found for each, and whether it was used.

    Signals:
        take_chosen: the id of the take to show.
        use_requested: ids of takes whose offset is to be used although it is not sure.
    """

    take_chosen = Signal(str)
    use_requested = Signal(object)

    def __init__(self, answers: Sequence[Answer], parent: QWidget) -> None:
        super().__init__(parent)
        self.setObjectName("align_report")
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self.setWindowTitle(_tr("Aligned"))
        self.resize(760, 460)
        self._answers = list(answers)
        used = sum(one.used for one in answers)
        words = _tr("Aligned: {0} of {1}.").format(used, len(answers))
        self.table = self._build_table()
        self.use = QPushButton(_tr("Use the selected anyway"))
        self.use.setObjectName("align_report_use")
        self.use.setEnabled(False)
        self.use.clicked.connect(self._on_use)
        close = QPushButton(_tr("Close"))
        close.clicked.connect(self.accept)
        row = QHBoxLayout()
        row.addWidget(self.use)
        row.addStretch(1)
        row.addWidget(close)
        column = QVBoxLayout(self)
        column.setContentsMargins(theme.EDGE, theme.BETWEEN, theme.EDGE, theme.BETWEEN)
        column.setSpacing(theme.INSIDE)
        column.addWidget(label(words))
        column.addWidget(label(_tr("Double-click a take to hear and see it."), "muted"))
        column.addWidget(self.table, 1)
        column.addLayout(row)

    def _build_table(self) -> QTableWidget:
        titles = (_tr("Take"), _tr("How sure"), _tr("Each offset from -1 s to +1 s"), _tr("Result"))
        table = QTableWidget(len(self._answers), len(titles))
        table.setObjectName("align_report_table")
        table.setHorizontalHeaderLabels(list(titles))
        table.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        table.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        table.setItemDelegateForColumn(2, CurveDelegate(table))
        table.verticalHeader().hide()
        table.verticalHeader().setDefaultSectionSize(40)
        table.setShowGrid(False)
        for row, answer in enumerate(self._answers):
            self._fill(table, row, answer)
        header = table.horizontalHeader()
        header.setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        header.setSectionResizeMode(2, QHeaderView.ResizeMode.Stretch)
        table.itemSelectionChanged.connect(self._on_selection)
        table.cellDoubleClicked.connect(lambda row, _: self.take_chosen.emit(self._answers[row].take))
        return table

    def _fill(self, table: QTableWidget, row: int, answer: Answer) -> None:
        result = _tr("used") if answer.used else _tr("left as it is")
        words = (answer.take, judged(answer.found) if answer.found else answer.problem, "", result)
        for column, text in enumerate(words):
            item = QTableWidgetItem(text)
            if answer.found is not None and column == 1:
                item.setForeground(theme.colour(role_of(answer.found.confidence)))
            elif column == 2:
                item.setData(FOUND, answer.found)
            table.setItem(row, column, item)

    def _chosen(self) -> list[str]:
        rows = sorted({index.row() for index in self.table.selectedIndexes()})
        answers = (self._answers[row] for row in rows)
        return [one.take for one in answers if one.found is not None and not one.used]

    def _on_selection(self) -> None:
        self.use.setEnabled(bool(self._chosen()))

    def _on_use(self) -> None:
        takes = self._chosen()
        self.use_requested.emit(tuple(takes))
        for row, one in enumerate(self._answers):
            if one.take in takes:
                self._answers[row] = Answer(one.take, one.found, True)
                self._fill(self.table, row, self._answers[row])
        self._on_selection()


class CurveDelegate(QStyledItemDelegate):
    """Paints a curve into a cell."""

    def paint(
        self, painter: QPainter, option: QStyleOptionViewItem, index: QModelIndex | QPersistentModelIndex
    ) -> None:
        """The cell as the style has it, the curve above."""
        super().paint(painter, option, index)
        found = index.data(FOUND)
        if found is not None:
            painter.save()
            paint_correlation(painter, QRectF(option.rect).adjusted(8, 4, -8, -4), found)
            painter.restore()

    def sizeHint(self, option: QStyleOptionViewItem, index: QModelIndex | QPersistentModelIndex) -> QSize:
        """Wide enough to see a peak."""
        return QSize(220, 40)


def _tr(text: str) -> str:
    return QCoreApplication.translate("Aligning", text)
