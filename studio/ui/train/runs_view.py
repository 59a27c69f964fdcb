"""The list of training runs with their verdicts and notes, and what can be done with the chosen ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from PySide6.QtCore import QItemSelection, QItemSelectionModel, QSignalBlocker, Qt, Signal
from PySide6.QtGui import QColor
from PySide6.QtWidgets import (
    QAbstractItemView,
    QHeaderView,
    QPushButton,
    QStackedLayout,
    QTableWidget,
    QTableWidgetItem,
    QWidget,
)

from studio.ui import theme
from studio.ui.shortcuts import name_of, tip_of
from studio.ui.train.run_facts import RunFacts
from studio.ui.train.verdict_view import VerdictRow
from studio.ui.widgets.card import Card, label

RUN, STATUS, VERDICT, EPOCHS, BEST, ERROR, PEARSON, MOTION, NOTE = range(9)
DETAILS = range(EPOCHS, NOTE)
"""Columns for those who ask for figures."""
MOST_COMPARED = 6
"""Runs held side by side: more than that are no comparison but a list."""


@dataclass(frozen=True)
class RunRow:
    """One line of the table.

    Args:
        id: the run's id.
        status: "done", "stopped", "unfinished", "interrupted" or "running".
        facts: its figures.
        note: what a person wrote beside it.
        verdict: how good it is, in a few words.
    """

    id: str
    status: str
    facts: RunFacts
    note: str = ""
    verdict: str = ""


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
        super().__init__(0, 9, parent)
        self.setObjectName("runs_table")
        self.setAccessibleName(self.tr("Training runs"))
        titles = (
            self.tr("Run"), self.tr("State"), self.tr("Verdict"), self.tr("Epochs"), self.tr("Best"),
            self.tr("Error"), self.tr("Pearson r"), self.tr("Motion"), self.tr("Note"),
        )  # fmt: skip
        self.setHorizontalHeaderLabels(list(titles))
        self._explain_columns()
        self.show_details(False)
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

    def show_details(self, shown: bool) -> None:
        """Show the figures beside the words, or hide them."""
        for column in DETAILS:
            self.setColumnHidden(column, not shown)

    def show_rows(self, rows: Sequence[RunRow]) -> None:
        """Replace the list, keeping the selection and a note that is being written."""
        # A note that is being typed would be lost with its cell.
        if self.state() == QAbstractItemView.State.EditingState:
            return
        chosen, selected = self.chosen, self.all_chosen
        # Rows that are put back say nothing new: else the curves would be drawn again at every refresh.
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
        # The current row and the selected ones are two things: several stay selected while one is current.
        self.selectionModel().setCurrentIndex(index, QItemSelectionModel.SelectionFlag.NoUpdate)

    def choose(self, run_id: str) -> None:
        """Select a run."""
        for y in range(self.rowCount()):
            item = self.item(y, RUN)
            if item is not None and item.text() == run_id:
                # Not selectRow: while Ctrl is held, as by who comes by a key, it only turns the row over.
                self._make_current(y)
                self._select([y])

    def _show_row(self, y: int, row: RunRow) -> None:
        status, token = self._status(row.status)
        cells = ((row.id, ""), (status, token), (row.verdict, ""), *self._figures(row.facts), (row.note, ""))
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
            (_text(facts.error, 4), ""),
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
            "lively": (self.tr("lively"), "muted"),
            "still": (self.tr("still !"), "warn"),
            "shaky": (self.tr("shaky !"), "warn"),
        }
        return words.get(life, ("", ""))

    def _explain_columns(self) -> None:
        tips = {
            STATUS: self.tr("How the training ended; an unfinished or interrupted one can be resumed"),
            VERDICT: self.tr("How good it is; the whole of it stands below the list"),
            EPOCHS: self.tr("Rounds of learning that are done, and how many were planned"),
            BEST: self.tr(
                "The epoch that is kept and used: the best one on validation; of recipes that settle towards "
                "the end, the best of the last fifth"
            ),
            ERROR: self.tr(
                "How far the face is off on the validation takes (RMSE), or the body where there is no face: "
                "less is better. They also chose the epoch, so they flatter it a little. Compare only runs "
                "of the same takes. Beside a face a body does not count: it gestures differently each time."
            ),
            PEARSON: self.tr(
                "Whether it moves at the same moments as you (Pearson r): 1 follows exactly, 0 not at all. "
                "0.3 to 0.7 is usual: a voice does not tell everything."
            ),
            MOTION: self.tr(
                "How much it moves against you: 1.0 is as much, 0.8 to 1.25 is alive, above 1.6 is much "
                "more, below 0.3 stands still"
            ),
        }
        for column, text in tips.items():
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


class RunsCard(Card):
    """The table of runs with its buttons.

    Signals:
        review_requested, resume_requested, delete_requested, folder_requested, card_requested,
            export_requested: with the run's id.
        import_requested: bring in a run of another computer.
        compare_requested: ids of the runs to hold side by side.
        note_changed: (run id, text).
        run_chosen: id of the run whose curves to show.
    """

    review_requested = Signal(str)
    resume_requested = Signal(str)
    delete_requested = Signal(str)
    folder_requested = Signal(str)
    card_requested = Signal(str)
    export_requested = Signal(str)
    import_requested = Signal()
    compare_requested = Signal(tuple)
    note_changed = Signal(str, str)
    run_chosen = Signal(str)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(self.tr("Runs"), parent)
        self._resumable: frozenset[str] = frozenset()
        self._reviewable: frozenset[str] = frozenset()
        self._training, self._locked = False, ""
        self.table = RunsTable()
        self.table.run_chosen.connect(lambda _: self._show_buttons())
        self.table.run_chosen.connect(self.run_chosen)
        self.table.note_changed.connect(self.note_changed)
        self.table.run_opened.connect(self.review_requested)
        self._buttons: dict[str, QPushButton] = {}
        self._add_buttons()
        none = label(self.tr("No runs yet. Every training you start is listed here."), "muted")
        none.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self._stack = QStackedLayout()
        # In the card first: what comes into a free stack is shown at once, as a window of its own.
        self.body.addLayout(self._stack, 1)
        self._stack.addWidget(none)
        self._stack.addWidget(self.table)
        self._legend = label(
            self.tr(
                "On the validation takes. Error: how far off, less is better.   "
                "Pearson r: 1 follows exactly.   Motion: 1 moves as much as you do."
            ),
            "caption",
            "runs_legend",
        )
        self.verdict = VerdictRow()
        self.body.addWidget(self._legend)
        self.body.addWidget(self.verdict)
        self._legend.hide()

    def show_runs(self, rows: Sequence[RunRow], resumable: set[str], reviewable: set[str]) -> None:
        """Fill the list of runs."""
        self._resumable, self._reviewable = frozenset(resumable), frozenset(reviewable)
        self.table.show_rows(rows)
        self._stack.setCurrentIndex(1 if rows else 0)
        self._show_buttons()

    def show_state(self, training: bool, locked: str) -> None:
        """What can be done now.

        Args:
            training: a training is under way, so that none can be resumed.
            locked: why nothing can be changed here, "" where it can.
        """
        self._training, self._locked = training, locked
        self.table.set_editable(not locked)
        self._show_buttons()

    def _on_details(self, shown: bool) -> None:
        self.table.show_details(shown)
        self._legend.setVisible(shown)

    def _add_buttons(self) -> None:
        for name, signal, icon in (
            ("review_run", self.review_requested, "mdi6.eye-outline"),
            ("compare_runs", None, "mdi6.chart-bar"),
            ("card_of_run", self.card_requested, "mdi6.card-text-outline"),
            ("resume_run", self.resume_requested, "mdi6.play-circle-outline"),
            ("show_run_folder", self.folder_requested, "mdi6.folder-outline"),
            ("export_run", self.export_requested, "mdi6.export"),
            ("import_run", None, "mdi6.import"),
            ("delete_run", self.delete_requested, "mdi6.trash-can-outline"),
        ):
            button = QPushButton(name_of(name))
            button.setObjectName(name)
            theme.set_icon(button, icon, "muted")
            theme.as_role(button, "quiet")
            if signal is not None:
                button.clicked.connect(lambda _=False, s=signal: s.emit(self.table.chosen))
            self._buttons[name] = button
            self.head.addWidget(button)
        self.details = QPushButton(name_of("run_details"))
        self.details.setObjectName("run_details")
        self.details.setCheckable(True)
        self.details.setToolTip(tip_of("run_details"))
        theme.as_role(self.details, "quiet")
        self.details.toggled.connect(self._on_details)
        self.head.addWidget(self.details)
        self._buttons["import_run"].clicked.connect(self.import_requested)
        self._buttons["compare_runs"].clicked.connect(lambda: self.compare_requested.emit(self._comparable()))
        for name in ("export_run", "compare_runs"):
            self._buttons[name].setToolTip(tip_of(name))

    def _show_buttons(self) -> None:
        chosen, free = self.table.chosen, not self._locked
        for name, enabled in (
            ("review_run", chosen in self._reviewable),
            ("compare_runs", bool(self._comparable())),
            ("card_of_run", bool(chosen)),
            ("resume_run", free and chosen in self._resumable and not self._training),
            ("show_run_folder", bool(chosen)),
            ("export_run", chosen in self._reviewable),
            ("import_run", free),
            ("delete_run", free and bool(chosen)),
        ):
            self._buttons[name].setEnabled(enabled)
        for name in ("resume_run", "delete_run", "import_run"):
            self._buttons[name].setToolTip(self._locked)

    def _comparable(self) -> tuple[str, ...]:
        return tuple(run for run in self.table.all_chosen if run in self._reviewable)[:MOST_COMPARED]


def _text(value: float | None, decimals: int) -> str:
    return "" if value is None else f"{value:.{decimals}f}"
