"""Material brought into the open project by a child process, with its progress in the status strip."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from PySide6.QtCore import QObject
from PySide6.QtWidgets import QWidget

from studio.errors import StudioError
from studio.ui import messages
from studio.ui.bone_fixing import BoneFixing, Skeleton
from studio.ui.jobs import Job
from studio.ui.plural import counted
from studio.ui.session import Session


class Importer(QObject):
    """Runs `saia import` for dropped or chosen paths, one batch at a time."""

    def __init__(self, session: Session, window: QWidget) -> None:
        super().__init__(window)
        self._session = session
        self._window = window
        self._folder = Path()
        self._refused: list[tuple[str, str]] = []
        self._skeleton: Skeleton | None = None
        """One whose bones were guessed, or could not be: what the person may correct."""
        self.bones = BoneFixing(session, window)
        self._job = Job(self)
        self._job.event_received.connect(self._on_event)
        self._job.done.connect(self._on_done)
        self._job.failed.connect(self._on_failed)
        self._job.ended.connect(self._on_ended)
        session.import_cancelled.connect(self._job.cancel)

    @property
    def running(self) -> bool:
        """Whether a batch is being imported."""
        return self._job.running

    def start(self, paths: tuple[Path, ...]) -> None:
        """Import paths, or say why not."""
        project = self._session.project
        if project is None:
            what = self.tr("There is no project to import into.")
            messages.show_error(self._window, StudioError(what, self.tr("Open or make a project first.")))
        elif self._job.running:
            what = self.tr("Another import is still going on.")
            messages.show_error(self._window, StudioError(what, self.tr("Drop these files when it is done.")))
        else:
            self._folder = project.folder
            self._refused.clear()
            self._skeleton = None
            self._tell(self.tr("Importing…"), None)
            self._job.start(["import", str(project.folder), *map(str, paths)])

    def close(self) -> None:
        """End the child; what it has saved stays."""
        self._job.close()

    def _on_event(self, event: dict[str, Any]) -> None:
        take, kind = event.get("take"), event.get("event")
        if kind == "bones" and self._skeleton is None:
            self._skeleton = Skeleton.of_event(event)
        if kind == "problem":
            self._refused.append((str(event.get("what", "")), str(event.get("remedy", ""))))
        if kind in ("take", "problem"):
            sentence = self.tr("Imported {0}").format(take) if take else self.tr("Importing…")
            self._tell(sentence, event.get("fraction"))

    def _on_done(self, facts: dict[str, Any]) -> None:
        project = self._session.project
        if project is None or project.folder != self._folder:
            return
        count = len(facts.get("takes", ()))
        if self._refused:
            what, remedy = self._refused[0]
            told = self._told(count)
            one, many = self.tr("1 file could not be read."), self.tr("{0} files could not be read.")
            left = counted(len(self._refused), one, many)
            messages.show_failure(self._window, f"{told} {left}", f"{what} {remedy}")
            self._offer_bones()
            return
        show = (self.tr("Show in Curate"), lambda: self._session.tab_requested.emit("curate"))
        said = self._told(count)
        if self._skeleton is None:
            messages.show_note(self._window, said, "", show)
            return
        guess = self.tr("Bones of {0} were matched by their names.").format(self._skeleton.path.name)
        messages.show_note(self._window, said, guess, (self.tr("Check the bones"), self._show_bones))

    def _told(self, count: int) -> str:
        return counted(count, self.tr("1 take imported."), self.tr("{0} takes imported."))

    def _on_failed(self, what: str, remedy: str) -> None:
        messages.show_failure(self._window, what, remedy)
        self._offer_bones()

    def _offer_bones(self) -> None:
        """Where a skeleton could not be recognised at all, ask at once which joint is which bone."""
        if self._skeleton is not None and self._skeleton.take is None:
            self._show_bones()

    def _show_bones(self) -> None:
        if self._skeleton is not None:
            self.bones.ask(self._skeleton)

    def _on_ended(self) -> None:
        self._tell("", None)
        # A cancelled or failed batch keeps the takes it had finished.
        project = self._session.project
        if project is not None and project.folder == self._folder:
            self._session.refresh_takes()

    def _tell(self, sentence: str, fraction: float | None) -> None:
        self._session.status_changed.emit("job", sentence, "")
        self._session.import_progress.emit(sentence, fraction)
