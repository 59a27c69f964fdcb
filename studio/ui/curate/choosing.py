"""Choices made for one take or many at once: split, stars, performer, tags, note, and removal."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QCoreApplication, QObject, QPoint, QUrl
from PySide6.QtGui import QDesktopServices

from studio.dataset import edits
from studio.dataset.balance import balanced_split
from studio.dataset.dataset import Dataset
from studio.errors import StudioError
from studio.take.take import Take
from studio.ui import messages
from studio.ui.curate import marks
from studio.ui.curate.inspector import tags_of
from studio.ui.curate.take_rows import TakeRow
from studio.ui.curate.view import CurateView
from studio.ui.plural import counted
from studio.ui.session import Session

if TYPE_CHECKING:
    from studio.ui.curate.presenter import CuratePresenter


class Choosing(QObject):
    """Turns what is clicked in table, menu and inspector into named steps of undo."""

    def __init__(self, view: CurateView, session: Session, room: CuratePresenter) -> None:
        super().__init__(room)
        self._view, self._session, self._room = view, session, room
        library = view.library
        library.menu_requested.connect(self._on_menu)
        library.split_requested.connect(self._on_split_for_me)
        library.model.text_edited.connect(self._on_text_edited)
        library.delegate.stars_clicked.connect(self._on_stars_clicked)
        view.inspector.choice_changed.connect(self.choose)
        view.menu_chosen.connect(self._on_menu_chosen)

    def choose(self, field: str, value: object, ids: tuple[str, ...]) -> None:
        """Set one field of some selections."""
        ids = tuple(one for one in ids if one in self._room.dataset)
        if not ids:
            return
        who = ids[0] if len(ids) == 1 else self.tr("{0} takes").format(len(ids))
        name, change = marks.CHOICES[field]
        title = QCoreApplication.translate("Choices", name).format(who)
        self._room.edit(title, lambda data: change(data, ids, value))

    def _on_text_edited(self, selection_id: str, column: str, text: str) -> None:
        value = tags_of(text) if column == "tags" else text.strip()
        self.choose(column, value, (selection_id,))

    def _on_stars_clicked(self, selection_id: str, stars: int) -> None:
        if self._room.editable:
            self.choose("stars", stars, (selection_id,))

    def _on_split_for_me(self) -> None:
        rows = self._view.library.model.rows
        seconds = {row.id: row.seconds for row in rows}
        unfit = {row.selection.take for row in rows if not _judges(row)}
        # A take that is missing may be found again; one that was recorded without motion never trains.
        useless = [r.id for r in rows if r.take is not None and r.selection.split and not _whole(r)]

        def divided(data: Dataset) -> Dataset:
            return balanced_split(edits.set_split(data, useless, ""), seconds, unfit=unfit)

        if self._room.edit(self.tr("Split for me"), divided):
            self._room.say(self._told_split(useless))

    def _told_split(self, useless: Sequence[str]) -> str:
        """How many takes do what; those that training has no use for are named as such."""
        whole = {row.id for row in self._view.library.model.rows if _whole(row)}
        used = {s: [x.id for x in self._room.dataset.of_split(s)] for s in ("train", "val", "test")}
        count = {split: len(whole.intersection(ids)) for split, ids in used.items()}
        parts = (
            counted(count["train"], self.tr("1 take trains"), self.tr("{0} takes train")),
            counted(count["val"], self.tr("1 checks the training"), self.tr("{0} check the training")),
            counted(count["test"], self.tr("1 tests it"), self.tr("{0} test it")),
        )
        sentence = self.tr("{0}, {1}, {2}.").format(*parts)
        one = self.tr("{0} is not used: training needs both sound and motion.").format(*useless[:1], "")
        many = self.tr("{0} takes are not used: training needs both sound and motion.")
        return f"{sentence} {counted(len(useless), one, many)}" if useless else sentence

    def _on_menu(self, place: QPoint) -> None:
        rows = self._room.chosen_rows
        if rows:
            names = sorted({s.performer for s in self._room.dataset.selections if s.performer})
            locked = all(row.selection.locked for row in rows)
            self._view.show_menu(place, names, locked, self._room.editable)

    def _on_menu_chosen(self, what: str, value: object) -> None:
        rows = self._room.chosen_rows
        takes = [row.take for row in rows if row.take is not None]
        if what in marks.CHOICES:
            self.choose(what, value, tuple(row.id for row in rows))
        elif what == "ask":
            inspector = self._view.inspector
            (inspector.tags if value == "tags" else inspector.performer).setFocus()
        elif what == "align":
            self._room.aligning.start("clap" if value == "clap" else "mouth")
        elif what == "check":
            self._room.grading.ask_again(takes)
            self._room.refresh()
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
        self._room.playing.pause()
        try:
            data = self._room.dataset
            unused = [
                take.id for take in takes if all(s.id in gone for s in edits.selections_of(data, take.id))
            ]
            parts = {row.id for row in rows if row.take is None or row.take.id not in unused}
            project.remove_takes(list(dict.fromkeys(unused)), parts)
            self._session.dataset_changed.emit()
        except StudioError as error:
            self._session.takes_changed.emit()  # some may be gone
            messages.show_error(self._view, error)
            return
        self._session.takes_changed.emit()
        what = counted(len(rows), self.tr("1 take removed."), self.tr("{0} takes removed."))
        messages.show_note(self._view, what, "", (self.tr("Undo"), self._room.undo))


def _whole(row: TakeRow) -> bool:
    """Whether a take has both sound and motion, which training needs."""
    return row.take is not None and bool(row.take.audio_path and row.take.motion_path)


def _judges(row: TakeRow) -> bool:
    """Whether a take is good enough to judge a training by."""
    return _whole(row) and row.grade != "D"
