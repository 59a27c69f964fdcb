"""Presenter of takes whose sound, motion or folder is missing: marked, looked for in a folder, put back."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path

from PySide6.QtCore import QObject
from PySide6.QtWidgets import QFileDialog

from studio.dataset import edits, relink
from studio.dataset.relink import Missing, Search
from studio.take.take import Take
from studio.ui import tasks
from studio.ui.curate.model import CurateModel
from studio.ui.curate.view import CurateView
from studio.ui.session import Session


class MissingMediaPresenter(QObject):
    """Knows what is missing from the open project, and looks for it."""

    def __init__(self, view: CurateView, model: CurateModel, session: Session) -> None:
        super().__init__(view)
        self._view, self._model, self._session = view, model, session
        self.missing: tuple[Missing, ...] = ()
        self.searching = False
        """Whether a folder is being looked through."""
        self._put_back: tuple[str, ...] = ()
        session.project_opened.connect(self.refresh)
        session.takes_changed.connect(self.refresh)
        session.dataset_changed.connect(self._on_edited)
        view.library.find_requested.connect(lambda: self.ask(self.missing))
        view.inspector.find_requested.connect(self._ask_for)
        self.refresh()

    def refresh(self) -> None:
        """Look on the disk for what should be there."""
        project = self._session.project
        if project is None:
            self._show(())
        else:
            self._put_back = project.dataset.found
            takes = {take.id: take for take in project.takes}
            work = partial(relink.missing_files, project.dataset, takes)
            tasks.run(work, partial(self._on_listed, project.folder), lambda _: None, self)

    def ask(self, missing: tuple[Missing, ...]) -> None:
        """Ask for the folder to look through."""
        if not missing:
            self._model.show_message(self.tr("No files are missing."))
            return
        title = self.tr("Where are the files of {0}?").format(_named(missing))
        found = QFileDialog.getExistingDirectory(self._view, title, str(Path.home()))
        if found:
            self.find(Path(found), missing)

    def find(self, folder: Path, missing: tuple[Missing, ...] | None = None) -> None:
        """Look through a folder for what is missing (all of it where nothing is named) and put it back."""
        project = self._session.project
        if project is None or self.searching:
            return
        self.searching = True
        takes = {take.id: take for take in project.takes}
        self._session.status_changed.emit("job", self.tr("Looking for missing files…"), "")
        work = partial(_find, project.folder, missing or self.missing, takes, folder)
        tasks.run(work, partial(self._on_found, missing or self.missing), self._on_failed, self)

    def _on_edited(self) -> None:
        """Undo and redo may have moved files."""
        if self._model.dataset.found != self._put_back:
            self._model.playing.invalidate()
            self.refresh()

    def _ask_for(self, takes: tuple[str, ...]) -> None:
        self.ask(tuple(one for one in self.missing if one.take in takes))

    def _on_listed(self, folder: Path, missing: tuple[Missing, ...]) -> None:
        project = self._session.project
        # Another project may have been opened while the disk was read.
        if project is not None and project.folder == folder:
            self._show(missing)

    def _show(self, missing: tuple[Missing, ...]) -> None:
        self.missing = missing
        names: dict[str, tuple[str, ...]] = {}
        for one in missing:
            names[one.take] = (*names.get(one.take, ()), one.name)
        self._view.library.show_missing(names)
        self._view.inspector.show_missing(names)

    def _on_found(self, missing: tuple[Missing, ...], search: Search) -> None:
        self._end()
        project = self._session.project
        if project is None:
            return
        before = self._model.dataset
        if search.found:
            name = self.tr("Restore the files of {0}").format(_named(tuple(search.found)))
            paths = [one.path for one in search.found]
            self._model.edit(name, lambda data: edits.put_back(data, paths))
            self._session.refresh_takes()
            self._model.playing.invalidate()
            takes = {one.take for one in search.found}
            self._model.grading.ask_again(take for take in project.takes if take.id in takes)
        count, left = len(search.found), len(missing) - len(search.found)
        text = self.tr("{0} of {1} missing files were found and restored.").format(count, len(missing))
        remedy = self.tr("Look for the others in another folder.") if left else ""
        if search.unclear:
            remedy = self.tr("Several files could be {0}. Rename the right one to match the take.").format(
                _named(search.unclear)
            )
        self._model.show_message(text, remedy, since=before)

    def _on_failed(self, error: BaseException) -> None:
        self._end()
        self._session.refresh_takes()
        self._model.fail(error)

    def _end(self) -> None:
        self.searching = False
        self._session.status_changed.emit("job", "", "")


def _find(project: Path, missing: tuple[Missing, ...], takes: Mapping[str, Take], folder: Path) -> Search:
    """Runs on the thread pool."""
    search = relink.search(missing, takes, folder)
    for one, source in search.found.items():
        relink.put_back(project, one, source)
    return search


def _named(missing: tuple[Missing, ...]) -> str:
    takes = list(dict.fromkeys(one.take for one in missing))
    return takes[0] if len(takes) == 1 else f"{takes[0]} (+{len(takes) - 1})"
