"""Presenters of library and inspector: takes are chosen, changed, split and removed; and of the data card."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import QObject, QPoint, QUrl
from PySide6.QtGui import QDesktopServices
from PySide6.QtWidgets import QFileDialog

from studio.dataset import edits
from studio.dataset.balance import ALL_TRAIN, balanced_split, shares_for
from studio.dataset.dataset import Dataset
from studio.errors import StudioError
from studio.files.atomic import safe_name
from studio.ipc.events import CheckedEvent, ChildEvent, DoneEvent, ReadEvent
from studio.take.take import Take
from studio.ui import messages
from studio.ui.curate.checks import all_marks, placed
from studio.ui.curate.inspector_view import Inspector, tags_of
from studio.ui.curate.library_view import Library
from studio.ui.curate.model import CHOICES, CurateModel
from studio.ui.curate.take_table import TakeRow
from studio.ui.curate.view import CurateView
from studio.ui.messages import counted
from studio.ui.session import Session
from studio.ui.shortcuts import name_of
from studio.ui.tasks import ChildTask


class LibraryPresenter(QObject):
    """Which take is shown and which are selected; what is clicked there becomes a named step of undo."""

    def __init__(self, view: CurateView, model: CurateModel, session: Session) -> None:
        super().__init__(view)
        self._view, self._model, self._session = view, model, session
        library = self._library = view.library
        model.rows_changed.connect(self._show_rows)
        model.graded.connect(lambda: library.show_rows(model.rows))
        model.select_requested.connect(lambda one: library.select([one]))
        model.reveal_requested.connect(library.reveal)
        model.library_requested.connect(library.show_takes)
        model.flash_requested.connect(library.flash)
        library.current_changed.connect(model.show)
        library.chosen_changed.connect(model.choose_rows)
        # Sorting sends no word of its own, and "from top to bottom" is another order then.
        library.filter.layoutChanged.connect(lambda: model.choose_rows(library.chosen))
        library.import_requested.connect(lambda: session.import_requested.emit(()))
        library.folder_requested.connect(session.import_folder_requested)
        library.import_cancelled.connect(session.import_cancelled)
        session.import_progress.connect(library.show_import)
        session.import_pictured.connect(library.show_import_picture)
        library.menu_requested.connect(self._on_menu)
        library.split_requested.connect(self._on_split_for_me)
        library.model.text_edited.connect(self._on_text_edited)
        library.delegate.stars_clicked.connect(self._on_stars_clicked)
        view.menu_chosen.connect(self._on_menu_chosen)

    def _show_rows(self) -> None:
        rows, library = self._model.rows, self._library
        library.set_editable(self._model.editable)
        library.show_rows(rows)
        if rows and not library.current:
            library.select([rows[0].id])
        if self._model.row is None:
            # The one that was shown is gone, or another project is open.
            self._model.show(library.current)

    def _on_text_edited(self, selection_id: str, column: str, text: str) -> None:
        value = tags_of(text) if column == "tags" else text.strip()
        self._model.choose(column, value, (selection_id,))

    def _on_stars_clicked(self, selection_id: str, stars: int) -> None:
        if self._model.editable:
            self._model.choose("stars", stars, (selection_id,))

    def _on_split_for_me(self) -> None:
        rows = self._model.rows
        seconds = {row.id: row.seconds for row in rows}
        unfit = {row.selection.take for row in rows if not _judges(row)}
        # A take that is missing may be found again; one that was recorded without motion never trains.
        useless = [r.id for r in rows if r.take is not None and r.selection.split and not _whole(r)]
        usable: dict[str, float] = {}
        for row in rows:
            if row.selection.split and row.selection.take not in unfit:
                usable[row.selection.take] = usable.get(row.selection.take, 0.0) + row.seconds
        shares = shares_for(usable.values())

        def divided(data: Dataset) -> Dataset:
            return balanced_split(edits.set_split(data, useless, ""), seconds, shares, unfit)

        before = self._model.dataset
        if self._model.edit(name_of("split_takes"), divided):
            self._model.show_message(self._split_text(useless, shares is ALL_TRAIN), since=before)

    def _split_text(self, useless: Sequence[str], little: bool) -> str:
        """How many takes do what, and why none checks the training where there are few.

        Those that training has no use for are named as such.
        """
        whole = {row.id for row in self._model.rows if _whole(row)}
        used = {s: [x.id for x in self._model.dataset.of_split(s)] for s in ("train", "val", "test")}
        count = {split: len(whole.intersection(ids)) for split, ids in used.items()}
        parts = (
            counted(count["train"], self.tr("1 take for training"), self.tr("{0} takes for training")),
            counted(count["val"], self.tr("1 for validation"), self.tr("{0} for validation")),
            counted(count["test"], self.tr("1 for testing"), self.tr("{0} for testing")),
        )
        sentence = self.tr("{0}, {1}, {2}.").format(*parts)
        if little and count["train"]:
            sentence = self.tr("{0}. With so little, all of it trains.").format(parts[0])
            sentence += " " + self.tr("The end of the longest take checks the training.")
        one = self.tr("{0} is not used: training needs both sound and motion.").format(*useless[:1], "")
        many = self.tr("{0} takes are not used: training needs both sound and motion.")
        return f"{sentence} {counted(len(useless), one, many)}" if useless else sentence

    def _on_menu(self, place: QPoint) -> None:
        rows = self._model.chosen_rows
        if rows:
            names = sorted({s.performer for s in self._model.dataset.selections if s.performer})
            locked = all(row.selection.locked for row in rows)
            self._view.show_menu(place, names, locked, self._model.editable)

    def _on_menu_chosen(self, what: str, value: object) -> None:
        rows = self._model.chosen_rows
        takes = [row.take for row in rows if row.take is not None]
        if what in CHOICES:
            self._model.choose(what, value, tuple(row.id for row in rows))
        elif what == "ask":
            inspector = self._view.inspector
            (inspector.tags if value == "tags" else inspector.performer).setFocus()
        elif what == "align":
            self._model.align_requested.emit("clap" if value == "clap" else "mouth")
        elif what == "check":
            self._model.grading.ask_again(takes)
            self._model.refresh()
        elif what == "folder" and takes:
            QDesktopServices.openUrl(QUrl.fromLocalFile(str(Path(takes[0].folder))))
        elif what == "remove":
            self._remove(rows, takes)

    def _remove(self, rows: tuple[TakeRow, ...], takes: list[Take]) -> None:
        """Remove selections; a take nobody uses any more goes to the project's trash. Undo brings it back."""
        project = self._session.project
        if project is None:
            return
        gone = {row.id for row in rows}
        self._model.playing.pause()
        data = self._model.dataset
        try:
            unused = [
                take.id for take in takes if all(s.id in gone for s in edits.selections_of(data, take.id))
            ]
            parts = {row.id for row in rows if row.take is None or row.take.id not in unused}
            project.remove_takes(list(dict.fromkeys(unused)), parts)
            self._session.dataset_changed.emit()
        except StudioError as error:
            # Some may be gone.
            self._session.takes_changed.emit()
            messages.show_error(self._view, error)
            return
        self._session.takes_changed.emit()
        what = counted(len(rows), self.tr("1 take removed."), self.tr("{0} takes removed."))
        self._model.show_message(what, since=data)


class DataCardPresenter(QObject):
    """Runs `saia card` for the open project: counted by a child process, opened with one click."""

    def __init__(self, library: Library, model: CurateModel, session: Session) -> None:
        super().__init__(library)
        self._library, self._session = library, session
        self._path = Path()
        self._job = ChildTask(self)
        self._job.told.connect(self._on_event)
        self._job.done.connect(self._on_done)
        self._job.failed.connect(lambda error: messages.show_error(library, error))
        self._job.ended.connect(lambda: self._show_status(""))
        library.card_requested.connect(self._ask)

    @property
    def running(self) -> bool:
        """Whether a card is being made."""
        return self._job.running

    def close(self) -> None:
        """End the child."""
        self._job.close()

    def make(self, path: Path) -> None:
        """Write the card of the open project."""
        project = self._session.project
        if project is None or self._job.running:
            return
        self._path = path if path.suffix.lower() in (".html", ".htm") else path.with_name(path.name + ".html")
        self._show_status(self.tr("Counting for the data card…"))
        self._job.start(["card", str(project.folder), "-o", str(self._path)])

    def _ask(self) -> None:
        project = self._session.project
        if project is None:
            return
        name = f"{safe_name(project.name)}.html"
        place = str((project.exports_folder if project.exports_folder.is_dir() else Path.home()) / name)
        kinds = self.tr("Web page (*.html)")
        found, _ = QFileDialog.getSaveFileName(self._library, self.tr("Data card"), place, kinds)
        if found:
            self.make(Path(found))

    def _on_event(self, event: ChildEvent) -> None:
        if isinstance(event, CheckedEvent | ReadEvent):
            self._show_status(self.tr("Counting for the data card… {0}").format(f"{event.fraction:.0%}"))

    def _on_done(self, _done: DoneEvent) -> None:
        path = self._path

        def show_it() -> None:
            QDesktopServices.openUrl(QUrl.fromLocalFile(str(path)))

        show = (self.tr("Open"), show_it)
        messages.show_note(self._library, self.tr("The data card is in {0}.").format(path.name), "", show)

    def _show_status(self, sentence: str) -> None:
        self._session.status_changed.emit("job", sentence, "")


def _whole(row: TakeRow) -> bool:
    """Whether a take has both sound and motion, which training needs."""
    return row.take is not None and row.take.trains


def _judges(row: TakeRow) -> bool:
    """Whether a take is good enough to judge a training by."""
    return _whole(row) and row.grade != "D"


class InspectorPresenter(QObject):
    """Keeps the inspector at the selected rows."""

    def __init__(self, inspector: Inspector, model: CurateModel, _session: Session) -> None:
        super().__init__(inspector)
        self._inspector, self._model = inspector, model
        model.rows_changed.connect(lambda: inspector.set_editable(model.editable))
        model.chosen_changed.connect(self._show)
        model.graded.connect(self._show)
        inspector.choice_changed.connect(model.choose)
        inspector.findings.chosen.connect(model.go_to)
        inspector.findings.exclude_requested.connect(
            lambda mark: model.exclude((mark.t, mark.t + mark.duration))
        )

    def _show(self) -> None:
        rows = self._model.chosen_rows
        names = sorted({s.performer for s in self._model.dataset.selections if s.performer})
        self._inspector.show_rows(rows, names)
        findings = self._inspector.findings
        row = rows[0] if len(rows) == 1 else None
        if row is None or row.take is None:
            findings.show_marks((), (), self.tr("Select one take to see its checks.") if rows else "")
        elif row.report is None:
            findings.show_marks((), (), self.tr("Being checked…"))
        else:
            sentence = self.tr("No problems found in this take.")
            findings.show_marks(all_marks(row.report), placed(row.report), sentence)
