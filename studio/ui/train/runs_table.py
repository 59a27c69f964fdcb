"""The list of training runs with their figures and notes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from PySide6.QtCore import QItemSelection, QItemSelectionModel, QSignalBlocker, Qt, Signal
from PySide6.QtGui import QColor
from PySide6.QtWidgets import QAbstractItemView, QHeaderView, QTableWidget, QTableWidgetItem, QWidget

from studio.ui import theme
from studio.ui.train.run_facts import RunFacts

RUN, STATUS, EPOCHS, BEST, RMSE, PEARSON, MOTION, NOTE = range(8)


@dataclass(frozen=True)
class RunRow:
    """One line of the table.

    Args:
        id: the run's id.
        status: "done", "stopped", "unfinished", "interrupted" or "running".
        facts: its figures.
        note: what a person wrote beside it.
    """

    id: str
    status: str
    facts: RunFacts
    note: str = ""


class RunsTable(QTableWidget):
    """Runs, newest first.

    Signals:
        run_chosen: id of the selected run, "" for none.
        note_changed: (id, text).
        run_opened: id of a run that was double-clicked.
    """

    run_chosen = Signal(str)
    note_changed = Signal(str, str)
    run_opened = Signal(str)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(0, 8, parent)
        self.setObjectName("runs_table")
        self.setAccessibleName(self.tr("Training runs"))
        titles = (
            self.tr("Run"), self.tr("State"), self.tr("Epochs"), self.tr("Best"), self.tr("Error"),
            self.tr("Pearson r"), self.tr("Motion"), self.tr("Note"),
        )  # fmt: skip
        self.setHorizontalHeaderLabels(list(titles))
        self._explain_columns()
        self.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        self.setSelectionMode(QAbstractItemView.SelectionMode.ExtendedSelection)
        self.setShowGrid(False)
        self.verticalHeader().hide()
        self.verticalHeader().setDefaultSectionSize(30)
        header = self.horizontalHeader()
        header.setHighlightSections(False)
        header.setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        header.setSectionResizeMode(NOTE, QHeaderView.ResizeMode.Stretch)
        header.setMinimumSectionSize(64)
        header.setDefaultAlignment(Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter)
        self.itemSelectionChanged.connect(lambda: self.run_chosen.emit(self.chosen))
        self.itemChanged.connect(self._on_item_changed)
        self.cellDoubleClicked.connect(self._on_double_click)

    @property
    def chosen(self) -> str:
        """The selected run's id, of several the one clicked last, or ""."""
        rows = [index.row() for index in self.selectionModel().selectedRows()]
        if not rows:
            return ""
        item = self.item(self.currentRow() if self.currentRow() in rows else rows[0], RUN)
        return item.text() if item is not None else ""

    @property
    def all_chosen(self) -> tuple[str, ...]:
        """All selected runs' ids, in the order of the table."""
        rows = sorted(index.row() for index in self.selectionModel().selectedRows())
        return tuple(item.text() for row in rows if (item := self.item(row, RUN)) is not None)

    def set_editable(self, editable: bool) -> None:
        """Whether notes can be written."""
        keys = QAbstractItemView.EditTrigger
        usual = keys.DoubleClicked | keys.EditKeyPressed | keys.AnyKeyPressed
        self.setEditTriggers(usual if editable else keys.NoEditTriggers)

    def show_rows(self, rows: Sequence[RunRow]) -> None:
        """Replace the list, keeping the selection and a note that is being written."""
        if self.state() == QAbstractItemView.State.EditingState:
            return
        chosen, selected = self.chosen, self.all_chosen
        with QSignalBlocker(self), QSignalBlocker(self.selectionModel()):
            self.setRowCount(len(rows))
            for y, row in enumerate(rows):
                self._show_row(y, row)
            self._select([y for y, row in enumerate(rows) if row.id in selected])
            for y, row in enumerate(rows):
                if row.id == chosen:
                    self._make_current(y)
        if self.chosen != chosen:
            self.run_chosen.emit(self.chosen)

    def show_facts(self, run_id: str, facts: RunFacts) -> bool:
        """Bring the figures of a run's line up to date; whether there is such a line."""
        for y in range(self.rowCount()):
            item = self.item(y, RUN)
            if item is not None and item.text() == run_id:
                with QSignalBlocker(self):
                    for x, (text, colour) in enumerate(self._figures(facts), EPOCHS):
                        self._show_cell(y, x, text, colour)
                return True
        return False

    def _select(self, rows: Sequence[int]) -> None:
        selection = QItemSelection()
        for y in rows:
            selection.select(self.model().index(y, 0), self.model().index(y, self.columnCount() - 1))
        self.selectionModel().select(selection, QItemSelectionModel.SelectionFlag.ClearAndSelect)
        self.viewport().update()

    def _make_current(self, y: int) -> None:
        index = self.model().index(y, max(self.currentColumn(), 0))
        self.selectionModel().setCurrentIndex(index, QItemSelectionModel.SelectionFlag.NoUpdate)

    def choose(self, run_id: str) -> None:
        """Select a run."""
        for y in range(self.rowCount()):
            item = self.item(y, RUN)
            if item is not None and item.text() == run_id:
                self.selectRow(y)

    def _show_row(self, y: int, row: RunRow) -> None:
        status, token = self._status(row.status)
        cells = ((row.id, ""), (status, token), *self._figures(row.facts), (row.note, ""))
        for x, (text, colour) in enumerate(cells):
            self._show_cell(y, x, text, colour)

    def _figures(self, facts: RunFacts) -> tuple[tuple[str, str], ...]:
        """Texts and colours of the cells from EPOCHS to MOTION."""
        life, life_token = self._life(facts.life)
        motion = "" if facts.motion_ratio is None else f"{facts.motion_ratio:.2f} {life}"
        of = f" / {facts.of}" if facts.of else ""
        return (
            (f"{facts.epochs}{of}" if facts.epochs else "", ""),
            ("" if facts.best is None else str(facts.best), ""),
            (_text(facts.rmse, 4), ""),
            (_text(facts.pearson, 2), ""),
            (motion, life_token),
        )

    def _show_cell(self, y: int, x: int, text: str, colour: str) -> None:
        item = QTableWidgetItem(text)
        flags = Qt.ItemFlag.ItemIsEnabled | Qt.ItemFlag.ItemIsSelectable
        item.setFlags(flags | Qt.ItemFlag.ItemIsEditable if x == NOTE else flags)
        item.setFont(theme.figures_font())
        if colour:
            item.setForeground(QColor(getattr(theme.colours(), colour)))
        if x == NOTE:
            item.setToolTip(self.tr("Double-click to write a note"))
        self.setItem(y, x, item)

    def _status(self, status: str) -> tuple[str, str]:
        words = {
            "done": (self.tr("done"), "good"),
            "stopped": (self.tr("stopped early"), "muted"),
            "running": (self.tr("training"), "accent"),
            "unfinished": (self.tr("unfinished"), "warn"),
            "interrupted": (self.tr("interrupted"), "warn"),
        }
        return words.get(status, (status, "muted"))

    def _life(self, life: str) -> tuple[str, str]:
        words = {
            "alive": (self.tr("alive"), "good"),
            "calm": (self.tr("calm"), "muted"),
            "still": (self.tr("still !"), "warn"),
            "shaky": (self.tr("shaky !"), "warn"),
        }
        return words.get(life, ("", ""))

    def _explain_columns(self) -> None:
        told = {
            STATUS: self.tr("How the training ended; an unfinished or interrupted one can be resumed"),
            EPOCHS: self.tr("Rounds of learning that are done, and how many were planned"),
            BEST: self.tr("The epoch with the lowest loss on validation; its weights are kept and used"),
            RMSE: self.tr(
                "How far face and body together are off on takes it has not learnt from (RMSE): below 0.1 is "
                "good, less is better. Compare only runs of the same takes. Review's is the face's alone."
            ),
            PEARSON: self.tr(
                "Whether it moves at the same moments as you (Pearson r): 1 follows exactly, 0 not at all. "
                "0.3 to 0.7 is usual: a voice does not tell everything."
            ),
            MOTION: self.tr(
                "How much it moves against you: 1.0 is as much, 0.8 to 1.25 is alive, below 0.3 stands still"
            ),
        }
        for column, text in told.items():
            item = self.horizontalHeaderItem(column)
            assert item is not None
            item.setToolTip(text)

    def _on_item_changed(self, item: QTableWidgetItem) -> None:
        run = self.item(item.row(), RUN)
        if item.column() == NOTE and run is not None:
            self.note_changed.emit(run.text(), item.text())

    def _on_double_click(self, row: int, column: int) -> None:
        run = self.item(row, RUN)
        if column != NOTE and run is not None:
            self.run_opened.emit(run.text())


def _text(value: float | None, decimals: int) -> str:
    return "" if value is None else f"{value:.{decimals}f}"
