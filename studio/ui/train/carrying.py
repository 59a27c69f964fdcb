"""A run's model card, and the run as one file: out to another computer, and in from there."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from PySide6.QtCore import QObject, QUrl, Signal
from PySide6.QtGui import QDesktopServices
from PySide6.QtWidgets import QFileDialog, QWidget

from studio.errors import StudioError
from studio.evaluation import model_card
from studio.ipc.events import UnpackDone
from studio.project import Project
from studio.training.run_file import SUFFIX
from studio.ui import messages
from studio.ui.tasks import Job
from studio.ui.train.card_dialog import CardDialog


class RunTransfer(QObject):
    """The thought behind Model card, Export run and Import a run.

    Signals:
        arrived: folder of a run that was imported, and the sentence that says so.
    """

    arrived = Signal(object, str)

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self._parent = parent
        self._jobs: list[Job] = []
        self.dialog: CardDialog | None = None

    def close(self) -> None:
        """The window closes."""
        for job in self._jobs:
            job.close()

    def show_card(self, project: Project, run_id: str, locked: str = "") -> None:
        """Show a run's card, written anew from what is known of it; `locked` says why its note stays."""
        folder = project.run(run_id).folder
        dialog = self.dialog = CardDialog(run_id, self._parent)
        dialog.licence_written.connect(lambda text: self._keep(folder, dialog, text))
        dialog.browser_wanted.connect(lambda: self._browse(folder))
        dialog.show_card(model_card.card_html(folder), model_card.licence_of(folder))
        dialog.show_locked(locked)
        dialog.finished.connect(lambda _: self._on_closed(dialog))
        dialog.show()

    def ask_export(self, project: Project, run_id: str) -> None:
        """Ask where to, and write the run there."""
        title, words = (
            self.tr("Export {0}").format(run_id),
            self.tr("Run of Saia Studio (*{0})").format(SUFFIX),
        )
        start = str(project.exports_folder / f"{project.name}_{run_id}{SUFFIX}")
        found, _ = QFileDialog.getSaveFileName(self._parent, title, start, words)
        if found:
            whole = found.endswith(SUFFIX)
            self.export(project, run_id, Path(found if whole else found + SUFFIX), replace=whole)

    def export(self, project: Project, run_id: str, target: Path, replace: bool = False) -> None:
        """Write a run into one file.

        Args:
            project, run_id: the run.
            target: the file.
            replace: a file there may be written over, as the dialog has asked.
        """
        words = ["pack", str(project.folder), "--run", run_id, "-o", str(target)]
        words += ["--force"] if replace else []
        told = self.tr("{0} is in {1}. Open it in another project with Import a run.")
        self._start(words, lambda _: messages.show_note(self._parent, told.format(run_id, target.name)))

    def ask_import(self, project: Project) -> None:
        """Ask for a file, and bring it in."""
        words = self.tr("Run of Saia Studio (*{0})").format(SUFFIX)
        found, _ = QFileDialog.getOpenFileName(self._parent, self.tr("Import a run"), str(Path.home()), words)
        if found:
            self.bring_in(project, Path(found))

    def bring_in(self, project: Project, source: Path) -> None:
        """Make a run of a file; it is looked at in a child process before it becomes one."""

        def done(made: UnpackDone) -> None:
            told = self.tr("{0} is {1} now.").format(source.name, made.run)
            self.arrived.emit(project.runs_folder / made.run, told)

        self._start(["unpack", str(source), str(project.folder)], done)

    def _start(self, words: list[str], done: Any) -> None:
        job = Job(self)
        self._jobs.append(job)
        job.done.connect(done)
        job.failed.connect(lambda what, remedy: messages.show_failure(self._parent, what, remedy))
        job.ended.connect(lambda: self._on_ended(job))
        job.start(words)

    def _on_ended(self, job: Job) -> None:
        self._jobs.remove(job)
        job.deleteLater()

    def _keep(self, folder: Path, dialog: CardDialog, text: str) -> None:
        try:
            model_card.keep_licence(folder, text)
        except StudioError as error:
            messages.show_error(self._parent, error)
            return
        dialog.show_card(model_card.card_html(folder), text, saved=True)

    def _browse(self, folder: Path) -> None:
        try:
            path = model_card.write_card(folder)
        except StudioError as error:
            messages.show_error(self._parent, error)
            return
        QDesktopServices.openUrl(QUrl.fromLocalFile(str(path)))

    def _on_closed(self, dialog: CardDialog) -> None:
        if dialog is self.dialog:
            self.dialog = None
