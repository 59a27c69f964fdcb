"""The Train tab: what there is to learn from, which preset, the curves while it learns, and all runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from PySide6.QtCore import QSignalBlocker, Qt, Signal
from PySide6.QtWidgets import (
    QComboBox,
    QHBoxLayout,
    QPushButton,
    QSizePolicy,
    QStackedLayout,
    QVBoxLayout,
    QWidget,
)

from studio.ui import theme
from studio.ui.train.advanced import AdvancedDrawer, Form
from studio.ui.train.data_card import DataCard
from studio.ui.train.data_facts import DataFacts
from studio.ui.train.preset_card import PresetCard
from studio.ui.train.progress_card import ProgressCard
from studio.ui.train.runs_table import RunRow, RunsTable
from studio.ui.widgets.card import Card, EmptyState, label

MOST_COMPARED = 6
"""Runs held side by side: more than that are no comparison but a list."""


@dataclass(frozen=True)
class PresetChoice:
    """A preset card: key, title, how long it takes here, what it is for."""

    key: str
    title: str
    duration: str
    summary: str


@dataclass(frozen=True)
class TrainRequest:
    """What Start training asks for.

    Args:
        recipe: the recipe's name.
        changed: its values that are to be others, as --set takes them.
    """

    recipe: str
    changed: tuple[str, ...] = ()


class TrainView(QWidget):
    """The tab's layout.

    Signals:
        start_requested: a Wish.
        stop_requested, cancel_requested: end the training, keeping or removing the run.
        mend_requested: set a take aside for validation.
        curate_requested, record_requested: go to that tab.
        review_requested, resume_requested, delete_requested, folder_requested, card_requested,
            export_requested: with the run's id.
        import_requested: bring in a run of another computer.
        compare_requested: ids of the runs to hold side by side.
        note_changed: (run id, text).
        run_chosen: id of the run whose curves to show.
        recipe_chosen: the recipe's name was changed by hand.
        preset_chosen: a preset's key.
    """

    start_requested = Signal(object)
    stop_requested = Signal()
    cancel_requested = Signal()
    mend_requested = Signal()
    curate_requested = Signal()
    record_requested = Signal()
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
    recipe_chosen = Signal(str)
    preset_chosen = Signal(str)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setObjectName("page")
        self._presets: list[PresetCard] = []
        self._resumable: frozenset[str] = frozenset()
        self._reviewable: frozenset[str] = frozenset()
        self._running = False
        self._can_train = False
        self._locked = ""
        self._room = QWidget()
        self.empty = EmptyState(
            "mdi6.school-outline",
            self.tr("Training learns from takes. Record a take, or import a run made elsewhere."),
            self.tr("Record a take"),
            "train_go_record",
        )
        self.empty.clicked.connect(self.record_requested)
        bring = self._bring = QPushButton(self.tr("Import a run"))
        bring.setObjectName("train_import_run")
        theme.as_role(bring, "quiet")
        bring.clicked.connect(self.import_requested)
        column = self.empty.layout()
        assert isinstance(column, QVBoxLayout)
        column.insertWidget(column.count() - 1, bring, 0, Qt.AlignmentFlag.AlignHCenter)
        self._stack = QStackedLayout(self)
        self._stack.addWidget(self.empty)
        self._stack.addWidget(self._room)
        rows = QVBoxLayout(self._room)
        rows.setContentsMargins(theme.PAGE, theme.PAGE, theme.PAGE, theme.PAGE)
        rows.setSpacing(12)
        top = QHBoxLayout()
        top.setSpacing(12)
        self._data = DataCard()
        self._data.curate_requested.connect(self.curate_requested)
        self._data.mend_requested.connect(self.mend_requested)
        self.progress = ProgressCard()
        self.progress.stop_requested.connect(self.stop_requested)
        self.progress.cancel_requested.connect(self.cancel_requested)
        top.addWidget(self._data, 4)
        top.addWidget(self._preset_card(), 9)
        rows.addLayout(top)
        rows.addWidget(self.progress, 3)
        rows.addWidget(self._runs_card(), 2)

    # -- what is shown -----------------------------------------------------------------------------

    def show_empty(self, empty: bool) -> None:
        """Show the empty state, or the room."""
        self._stack.setCurrentIndex(0 if empty else 1)

    def show_locked(self, reason: str) -> None:
        """Why nothing can be changed here; "" where it can."""
        self._locked = reason
        self.runs.set_editable(not reason)
        self._data.show_locked(reason)
        self._bring.setEnabled(not reason)
        self._bring.setToolTip(reason or self.tr("A run exported on another computer needs no takes here"))
        self._show_buttons()

    def show_data(self, facts: DataFacts) -> None:
        """Fill the data card."""
        self._data.show_facts(facts)
        self._can_train = facts.can_train
        self._show_buttons()

    def show_presets(self, presets: Sequence[PresetChoice], chosen: str) -> None:
        """Fill the row of preset cards."""
        for card in self._presets:
            card.setParent(None)
            card.deleteLater()
        self._presets = []
        for preset in presets:
            card = PresetCard(f"preset_{preset.key}", preset.title, preset.duration, preset.summary)
            card.setProperty("key", preset.key)
            card.setChecked(preset.key == chosen)
            card.clicked.connect(lambda _=False, key=preset.key: self.preset_chosen.emit(key))
            card.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
            self._preset_row.addWidget(card, 1)
            self._presets.append(card)

    def show_recipes(self, recipes: Sequence[tuple[str, str, str]]) -> None:
        """Fill the recipe list with (name, title, summary)."""
        with QSignalBlocker(self.recipe):
            self.recipe.clear()
            for name, title, summary in recipes:
                self.recipe.addItem(title, name)
                self.recipe.setItemData(self.recipe.count() - 1, summary, Qt.ItemDataRole.ToolTipRole)

    def choose(self, preset: str, recipe: str, forms: Sequence[Form]) -> None:
        """Mark a preset ("" for none) and its recipe, and show its forms in the drawer."""
        for card in self._presets:
            card.setAutoExclusive(False)
            card.setChecked(card.property("key") == preset)
            card.setAutoExclusive(True)
        with QSignalBlocker(self.recipe):
            self.recipe.setCurrentIndex(max(self.recipe.findData(recipe), 0))
        self.recipe.setToolTip(str(self.recipe.currentData(Qt.ItemDataRole.ToolTipRole) or ""))
        self.drawer.show_forms(forms)

    def show_running(self, running: bool, stopping: bool = False, measuring: bool = False) -> None:
        """Switch between the states of the buttons."""
        self._running = running
        self.progress.show_running(running, stopping, measuring)
        self._show_buttons()

    def show_runs(self, rows: Sequence[RunRow], resumable: set[str], reviewable: set[str]) -> None:
        """Fill the list of runs."""
        self._resumable, self._reviewable = frozenset(resumable), frozenset(reviewable)
        self.runs.show_rows(rows)
        self._runs_stack.setCurrentIndex(1 if rows else 0)
        self._legend.setVisible(bool(rows))
        self._show_buttons()

    # -- parts -------------------------------------------------------------------------------------

    def _preset_card(self) -> Card:
        card = Card(self.tr("Preset"))
        self._preset_row = QHBoxLayout()
        self._preset_row.setSpacing(theme.INSIDE)
        card.body.addLayout(self._preset_row, 1)
        row = QHBoxLayout()
        row.setSpacing(theme.INSIDE)
        self.recipe = QComboBox()
        self.recipe.setObjectName("recipe")
        self.recipe.setAccessibleName(self.tr("Recipe"))
        self.recipe.setMinimumWidth(200)
        self.recipe.currentIndexChanged.connect(
            lambda _: self.recipe_chosen.emit(str(self.recipe.currentData() or ""))
        )
        self.advanced = QPushButton(self.tr("Advanced"))
        self.advanced.setObjectName("advanced")
        self.advanced.setCheckable(True)
        theme.set_icon(self.advanced, "mdi6.tune-variant", "muted")
        theme.as_role(self.advanced, "quiet")
        self.start = QPushButton(self.tr("Start training"))
        self.start.setObjectName("start_training")
        theme.as_role(self.start, "primary")
        self.start.clicked.connect(lambda: self.start_requested.emit(self._wish()))
        recipe_label = label(self.tr("Recipe"), "muted")
        recipe_label.setBuddy(self.recipe)
        row.addWidget(recipe_label)
        row.addWidget(self.recipe)
        row.addWidget(self.advanced)
        row.addStretch(1)
        row.addWidget(self.start)
        self.drawer = AdvancedDrawer()
        self.drawer.hide()
        self.advanced.toggled.connect(self.drawer.setVisible)
        card.body.addWidget(self.drawer)
        card.body.addLayout(row)
        return card

    def _runs_card(self) -> Card:
        card = Card(self.tr("Runs"))
        self.runs = RunsTable()
        self.runs.run_chosen.connect(lambda _: self._show_buttons())
        self.runs.run_chosen.connect(self.run_chosen)
        self.runs.note_changed.connect(self.note_changed)
        self.runs.run_opened.connect(self.review_requested)
        self._run_buttons: dict[str, QPushButton] = {}
        for name, words, signal, icon in (
            ("review_run", self.tr("Review"), self.review_requested, "mdi6.eye-outline"),
            ("compare_runs", self.tr("Compare"), None, "mdi6.chart-bar"),
            ("card_of_run", self.tr("Model card"), self.card_requested, "mdi6.card-text-outline"),
            ("resume_run", self.tr("Resume"), self.resume_requested, "mdi6.play-circle-outline"),
            ("show_run_folder", self.tr("Folder"), self.folder_requested, "mdi6.folder-outline"),
            ("export_run", self.tr("Export run"), self.export_requested, "mdi6.export"),
            ("import_run", self.tr("Import a run"), None, "mdi6.import"),
            ("delete_run", self.tr("Delete"), self.delete_requested, "mdi6.trash-can-outline"),
        ):
            button = QPushButton(words)
            button.setObjectName(name)
            theme.set_icon(button, icon, "muted")
            theme.as_role(button, "quiet")
            if signal is not None:
                button.clicked.connect(lambda _=False, s=signal: s.emit(self.runs.chosen))
            self._run_buttons[name] = button
            card.head.addWidget(button)
        self._run_buttons["import_run"].clicked.connect(self.import_requested)
        self._run_buttons["export_run"].setToolTip(
            self.tr("The run as one file, to use it in another project or on another computer")
        )
        self._run_buttons["compare_runs"].clicked.connect(
            lambda: self.compare_requested.emit(self._comparable())
        )
        none = label(
            self.tr("No run yet. Each training becomes one line here, to compare and to review."), "muted"
        )
        none.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self._runs_stack = QStackedLayout()
        self._runs_stack.addWidget(none)
        self._runs_stack.addWidget(self.runs)
        card.body.addLayout(self._runs_stack, 1)
        legend = self._legend = label(
            self.tr(
                "Error: how far off, less is better.   Pearson r: 1 follows exactly.   "
                "Motion: 1 moves as much as you do."
            ),
            "caption",
            "runs_legend",
        )
        card.body.addWidget(legend)
        card.setMinimumHeight(190)
        return card

    def _show_buttons(self) -> None:
        chosen = self.runs.chosen
        free = not self._locked
        self.start.setEnabled(free and self._can_train and not self._running)
        running = self.tr("A training is under way") if self._running else ""
        self.start.setToolTip(self._locked or running or self.tr("Learn from the training takes"))
        self._run_buttons["review_run"].setEnabled(chosen in self._reviewable)
        self._run_buttons["resume_run"].setEnabled(free and chosen in self._resumable and not self._running)
        self._run_buttons["compare_runs"].setEnabled(bool(self._comparable()))
        self._run_buttons["compare_runs"].setToolTip(
            self.tr("Hold the selected runs against each other and against simple guesses, on takes they "
                    "have not learnt from; select several with Ctrl or Shift")
        )  # fmt: skip
        self._run_buttons["export_run"].setEnabled(chosen in self._reviewable)
        self._run_buttons["card_of_run"].setEnabled(bool(chosen))
        self._run_buttons["show_run_folder"].setEnabled(bool(chosen))
        self._run_buttons["delete_run"].setEnabled(free and bool(chosen))
        self._run_buttons["import_run"].setEnabled(free)
        for name in ("resume_run", "delete_run", "import_run"):
            self._run_buttons[name].setToolTip(self._locked)

    def _comparable(self) -> tuple[str, ...]:
        return tuple(run for run in self.runs.all_chosen if run in self._reviewable)[:MOST_COMPARED]

    def _wish(self) -> TrainRequest:
        # Values of a drawer that was never opened are the recipe's own.
        changed = self.drawer.overrides() if self.advanced.isChecked() else ()
        return TrainRequest(str(self.recipe.currentData() or ""), changed)
