"""Many sounds or takes at once: what, by which run, as which formats, where to, and how far it is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QCloseEvent
from PySide6.QtWidgets import (
    QCheckBox,
    QComboBox,
    QDialog,
    QFileDialog,
    QGridLayout,
    QHBoxLayout,
    QHeaderView,
    QLineEdit,
    QProgressBar,
    QPushButton,
    QTreeWidget,
    QTreeWidgetItem,
    QVBoxLayout,
    QWidget,
)

from studio.export.options import FormatChoice
from studio.training.styles import RunChoice, RunSelection
from studio.ui import theme
from studio.ui.language import native
from studio.ui.review.export_view import MoreFormats
from studio.ui.widgets.card import label
from studio.ui.widgets.run_chooser import RunChooser

KINDS = "*.wav *.mp3 *.flac *.ogg *.opus *.m4a *.aac *.mp4 *.mov *.mkv *.webm"


@dataclass(frozen=True)
class BatchRequest:
    """What a batch is to make.

    Args:
        sounds: files and folders; empty for the takes of the project.
        selection: what makes the motion, and how; no run for the captured one.
        formats: names of formats.
        folder: where to.
        tuned: with the sliders of Tune.
    """

    sounds: tuple[Path, ...]
    selection: RunSelection
    formats: tuple[str, ...]
    folder: Path
    tuned: bool


class BatchDialog(QDialog):
    """The form and, while it works, its queue. Work goes on in the window behind it.

    Args:
        runs: those that can generate.
        proposed: the one that is chosen at first, and how it is to move.
        formats: those that can be written.
        folder: proposed for what is made.
        parent: the tab.

    Signals:
        start_requested: a BatchRequest.
        skip_requested: number of an entry that is no longer wanted.
        cancel_requested: none of them is.
        folder_requested: show what was made.
    """

    start_requested = Signal(object)
    skip_requested = Signal(int)
    cancel_requested = Signal()
    folder_requested = Signal()

    def __init__(
        self,
        runs: Sequence[RunChoice],
        proposed: RunSelection,
        formats: Sequence[FormatChoice],
        folder: Path,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self.setObjectName("batch_dialog")
        self.setWindowTitle(self.tr("Batch"))
        self.resize(720, 560)
        self._sounds: tuple[Path, ...] = ()
        self._titles = {one.name: native(one.title) for one in formats}
        column = QVBoxLayout(self)
        column.setContentsMargins(theme.BETWEEN, theme.BETWEEN, theme.BETWEEN, theme.BETWEEN)
        column.setSpacing(12)
        self._form = QWidget()
        self._form.setLayout(self._build_form(runs, proposed, formats, folder))
        column.addWidget(self._form)
        self.details = label("", "", "batch_details")
        self.details.setWordWrap(True)
        self.details.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self.details.hide()
        self.list = self._build_list()
        column.addWidget(self.list, 1)
        column.addWidget(self.details)
        self.bar = QProgressBar()
        self.bar.setObjectName("batch_bar")
        self.bar.setTextVisible(False)
        self.bar.setRange(0, 1000)
        self.bar.setAccessibleName(self.tr("Batch progress"))
        self.message = label("", "muted", "batch_told")
        self.message.setWordWrap(True)
        column.addWidget(self.bar)
        column.addWidget(self.message)
        column.addLayout(self._build_buttons())
        self._show_material()
        self.show_busy(False)

    # -- what is shown -----------------------------------------------------------------------------

    def set_sounds(self, paths: Sequence[Path]) -> None:
        """Files and folders of sounds."""
        self._sounds = tuple(paths)
        self.material.setCurrentIndex(0)
        self._show_material()

    def show_busy(self, busy: bool) -> None:
        """Lock the form while it works."""
        self._form.setEnabled(not busy)
        self.start.setVisible(not busy)
        self.skip.setVisible(busy)
        self.cancel.setVisible(busy)
        self.bar.setVisible(busy)
        self._show_material()

    def show_entries(self, names: Sequence[str]) -> None:
        """The queue, nothing of it done yet."""
        self.list.clear()
        self._show_details()
        for name in names:
            item = QTreeWidgetItem([name, self.tr("waiting"), ""])
            item.setToolTip(0, name)
            self.list.addTopLevelItem(item)

    def show_entry(self, index: int, state: str, text: str = "") -> None:
        """How one of them fares: "running", "done", "failed" or "cancelled"."""
        item = self.list.topLevelItem(index)
        if item is None:
            return
        titles = {
            "running": self.tr("generating"), "done": self.tr("done"), "failed": self.tr("failed"),
            "cancelled": self.tr("cancelled"),
        }  # fmt: skip
        tokens = {"done": "good", "failed": "bad", "running": "accent"}
        item.setText(1, titles.get(state, state))
        item.setForeground(1, theme.colour(tokens.get(state, "muted")))
        item.setText(2, text)
        item.setToolTip(2, text)
        if state == "running":
            self.list.scrollToItem(item)
        if state == "failed" and self.list.currentItem() is None:
            # The first failure is read without a click.
            self.list.setCurrentItem(item)
            # What is selected can be cancelled, which this cannot.
            item.setSelected(False)
        self._show_details()

    def show_progress(self, index: int, own: float, fraction: float, left: str) -> None:
        """How far one of them and all of it is."""
        item = self.list.topLevelItem(index)
        # At the end its column says what became of it, which no late progress may write over.
        if item is not None and fraction < 1:
            item.setText(2, self.tr("{0} %").format(round(100 * own)))
        self.bar.setValue(round(1000 * fraction))
        self.message.setText(left)

    def show_message(self, text: str, role: str = "muted") -> None:
        """Say how it ended, or what is missing."""
        theme.as_role(self.message, role)
        self.message.setText(text)

    def show_folder_button(self, shown: bool) -> None:
        """Offer to look at what was made."""
        self.show_folder.setVisible(shown)

    # -- Qt ----------------------------------------------------------------------------------------

    def closeEvent(self, event: QCloseEvent) -> None:
        """A batch under way goes on behind a closed dialog; "Batch…" brings it back."""
        event.accept()

    # -- parts -------------------------------------------------------------------------------------

    def _on_start(self) -> None:
        folder = self.folder.text().strip()
        takes = self.material.currentData() == "takes"
        if not takes and not self._sounds:
            self.show_message(self.tr("Choose the sounds first."), "warn")
        elif not takes and not self.run.currentData():
            self.show_message(self.tr("Choose a run: sounds need one to become motion."), "warn")
        elif folder:
            names = self.more.chosen(besides="") or ("vrma",)
            # Sounds chosen before "all takes" was are still in the form.
            sounds = () if takes else self._sounds
            target, tuned = Path(folder).expanduser(), self.tuned.isChecked()
            self.start_requested.emit(BatchRequest(sounds, self.chooser.wanted, names, target, tuned))

    def _on_skip(self) -> None:
        for item in self.list.selectedItems():
            self.skip_requested.emit(self.list.indexOfTopLevelItem(item))

    def _choose_files(self) -> None:
        kinds = self.tr("Sound and video ({0})").format(KINDS)
        found, _ = QFileDialog.getOpenFileNames(self, self.tr("Sounds of the batch"), "", kinds)
        if found:
            self.set_sounds([Path(name) for name in found])

    def _choose_material(self) -> None:
        found = QFileDialog.getExistingDirectory(self, self.tr("Folder of sounds"))
        if found:
            self.set_sounds([Path(found)])

    def _choose_folder(self) -> None:
        found = QFileDialog.getExistingDirectory(self, self.tr("Export into"), self.folder.text())
        if found:
            self.folder.setText(found)

    def _show_material(self) -> None:
        takes = self.material.currentData() == "takes"
        for button in (self.files, self.whole_folder):
            button.setVisible(not takes)
        if takes:
            text = self.tr("Every take, trimmed as in Curate: captured, or predicted by a run.")
        elif len(self._sounds) == 1:
            text = str(self._sounds[0])
        else:
            text = self.tr("{0} files").format(len(self._sounds)) if self._sounds else ""
        self.chosen.setText(text)
        self.run.setItemText(0, self.tr("Captured motion only") if takes else self.tr("Choose a run"))

    def _show_details(self) -> None:
        """All of what happened to the entry that is looked at: in its row there is room for a part of it."""
        item = self.list.currentItem()
        text = item.toolTip(2) if item is not None else ""
        self.details.setText(f"{item.text(0)}: {text}" if item is not None and text else "")
        self.details.setVisible(bool(text))

    def _show_run_options(self) -> None:
        """How the run is to move, in text: an icon alone does not say it."""
        self.run_options.setText(self.chooser.manner)
        self.run_options.setVisible(bool(self.chooser.manner))

    def _show_formats(self) -> None:
        names = self.more.chosen(besides="") or ("vrma",)
        self.formats.setText(", ".join(self._titles.get(name, name) for name in names))

    def _build_form(
        self, runs: Sequence[RunChoice], proposed: RunSelection, formats: Sequence[FormatChoice], folder: Path
    ) -> QGridLayout:
        self.material = QComboBox()
        self.material.setObjectName("batch_material")
        self.material.addItem(self.tr("Sounds"), "sounds")
        self.material.addItem(self.tr("All takes of the project"), "takes")
        self.material.currentIndexChanged.connect(lambda _: self._show_material())
        self.files = self._small(self.tr("Choose files"), "batch_files", self._choose_files)
        self.whole_folder = self._small(self.tr("Choose a folder"), "batch_sounds", self._choose_material)
        self.chosen = label("", "caption", "batch_chosen")
        self.chosen.setAccessibleName(self.tr("Chosen sounds"))
        self.chosen.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self._build_run(runs, proposed)
        self.more = MoreFormats()
        self.more.show_formats({one.name: f"{native(one.title)} ({one.suffix})" for one in formats})
        self.more.changed.connect(self._show_formats)
        self.formats = label("", "", "batch_formats")
        self._show_formats()
        self.folder = QLineEdit(str(folder))
        self.folder.setObjectName("batch_folder")
        self.tuned = QCheckBox(self.tr("With Tune settings"))
        self.tuned.setObjectName("batch_tuned")
        # As in Export: what is tuned is what is exported.
        self.tuned.setChecked(True)
        browse = self._small(self.tr("Choose"), "batch_browse", self._choose_folder)
        return self._lay_out(
            (self.tr("Of"), (self.material, self.files, self.whole_folder)),
            ("", (self.chosen,)),
            (self.tr("Run"), (self.chooser,)),
            ("", (self.run_options,)),
            ("", (self.tuned,)),
            (self.tr("Formats"), (self.formats, self.more)),
            (self.tr("Folder"), (self.folder, browse)),
        )

    def _lay_out(self, *rows: tuple[str, tuple[QWidget, ...]]) -> QGridLayout:
        """Rows of text and what they name, the first widget of each as wide as there is room."""
        grid = QGridLayout()
        grid.setContentsMargins(0, 0, 0, 0)
        grid.setSpacing(theme.INSIDE)
        grid.setColumnStretch(1, 1)
        for row, (text, widgets) in enumerate(rows):
            grid.addWidget(label(text, "muted"), row, 0)
            line = QHBoxLayout()
            line.setSpacing(theme.INSIDE)
            for place, widget in enumerate(widgets):
                if text:
                    widget.setAccessibleName(text)
                line.addWidget(widget, 1 if place == 0 and widget is not self.chooser else 0)
            line.addStretch(0)
            grid.addLayout(line, row, 1)
        return grid

    def _build_run(self, runs: Sequence[RunChoice], proposed: RunSelection) -> None:
        """The same choice as over the stage, on what is chosen there."""
        self.chooser = RunChooser("", "_batch", "")
        self.chooser.caption.hide()
        self.run = self.chooser.run
        self.run_options = label("", "caption", "batch_manner")
        self.run_options.setWordWrap(True)
        self.chooser.show_runs(runs, proposed)
        self.chooser.chosen.connect(lambda _: self._show_run_options())
        self._show_run_options()

    def _small(self, text: str, name: str, slot: object) -> QPushButton:
        button = QPushButton(text)
        button.setObjectName(name)
        button.clicked.connect(slot)
        return button

    def _build_list(self) -> QTreeWidget:
        tree = QTreeWidget()
        tree.setObjectName("batch_list")
        tree.setAccessibleName(self.tr("Queue"))
        tree.setHeaderLabels([self.tr("File"), self.tr("State"), self.tr("What happened")])
        tree.setRootIsDecorated(False)
        tree.setSelectionMode(QTreeWidget.SelectionMode.ExtendedSelection)
        tree.currentItemChanged.connect(lambda *_: self._show_details())
        tree.setTextElideMode(Qt.TextElideMode.ElideMiddle)
        tree.header().setSectionResizeMode(0, QHeaderView.ResizeMode.Interactive)
        tree.header().resizeSection(0, 260)
        return tree

    def _build_buttons(self) -> QHBoxLayout:
        self.start = self._small(self.tr("Start the batch"), "batch_start", self._on_start)
        theme.as_role(self.start, "primary")
        self.skip = self._small(self.tr("Cancel selected"), "batch_skip", self._on_skip)
        self.cancel = self._small(self.tr("Cancel all"), "batch_cancel", self.cancel_requested)
        self.show_folder = self._small(
            self.tr("Open folder"), "batch_show_folder", self.folder_requested
        )  # fmt: skip
        self.show_folder.hide()
        row = QHBoxLayout()
        row.addWidget(self.show_folder)
        row.addStretch(1)
        for button in (self.skip, self.cancel, self.start):
            row.addWidget(button)
        return row
