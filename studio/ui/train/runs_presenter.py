"""The list of runs, and what is done with one of them: review, resume, note, show its folder, delete."""

from __future__ import annotations

from PySide6.QtCore import QObject, QUrl
from PySide6.QtGui import QDesktopServices

from studio.errors import StudioError
from studio.files import atomic
from studio.project import Run
from studio.ui import messages
from studio.ui.language import native
from studio.ui.session import Session
from studio.ui.train.model import TrainModel
from studio.ui.train.run_facts import NOTE_FILE, RunFacts, has_state, note_of, run_facts
from studio.ui.train.run_trash import trash_text
from studio.ui.train.runs_view import RunRow, RunsCard


class RunsPresenter(QObject):
    """Presenter of the card of runs."""

    def __init__(self, view: RunsCard, model: TrainModel, session: Session) -> None:
        super().__init__(view)
        self._view, self._model, self._session = view, model, session
        view.run_chosen.connect(model.show)
        view.resume_requested.connect(model.resume)
        view.review_requested.connect(self._on_review)
        view.delete_requested.connect(self._on_delete)
        view.folder_requested.connect(self._on_folder)
        view.note_changed.connect(self._on_note)
        for changed in (model.runs_changed, model.verdicts_changed):
            changed.connect(self._show)
        model.refreshed.connect(self._follow)
        model.choose_requested.connect(view.table.choose)
        model.data_changed.connect(self._show_state)
        model.training.changed.connect(self._show_state)

    def _show(self) -> None:
        """Bring the list up to what is on the disk."""
        # A run that is trained says less of itself on the disk than its child has told.
        live, runs = self._model.live_run, self._model.newest_first
        rows = [self._row(run) for run in runs]
        idle = {run.id for run in runs if run.id != live}
        resumable = {run.id for run in runs if run.id in idle and run.status != "done" and has_state(run)}
        self._view.show_runs(rows, resumable, {run.id for run in runs if run.has_weights})

    def _follow(self) -> None:
        """Bring the line of the training under way up to what it said; the disk is left alone."""
        live = self._model.live_run
        if self._model.active and live is not None:
            facts = self._model.training.progress.facts
            if not self._view.table.show_facts(live, facts):
                self._show()

    def _show_state(self) -> None:
        self._view.show_state(self._model.training.running, self._session.locked_reason)

    def _row(self, run: Run) -> RunRow:
        live = run.id == self._model.live_run
        words = "" if live else native(self._model.verdict_on(run).short)
        return RunRow(run.id, self._status(run), self._facts(run), note_of(run), words)

    def _facts(self, run: Run) -> RunFacts:
        if run.id == self._model.live_run:
            return run_facts(self._model.training.progress.epochs)
        return self._model.reader.facts(run)

    def _status(self, run: Run) -> str:
        if run.id == self._model.live_run:
            return "running"
        # A run whose report still says so was killed in the middle.
        return "unfinished" if run.status in ("running", "failed") else run.status

    def _on_review(self, run_id: str) -> None:
        if run_id:
            self._session.review_requested.emit(run_id)

    def _on_delete(self, run_id: str) -> None:
        project = self._session.project
        if project is None or not run_id:
            return
        if run_id == self._model.live_run:
            self._model.cancel_requested.emit()
            return
        question = self.tr("Delete {0}?").format(run_id)
        if messages.ask(self._view, question, trash_text(), self.tr("Delete run")):
            self._model.trash.remove(project.run(run_id).folder, self.tr("Removed {0}.").format(run_id))

    def _on_folder(self, run_id: str) -> None:
        if self._session.project is not None and run_id:
            folder = self._session.project.run(run_id).folder
            QDesktopServices.openUrl(QUrl.fromLocalFile(str(folder)))

    def _on_note(self, run_id: str, text: str) -> None:
        project = self._session.project
        if project is None:
            return
        try:
            with atomic.written(project.run(run_id).folder / NOTE_FILE) as temporary:
                temporary.write_text(text.strip(), encoding="utf-8")
        except StudioError as error:
            messages.show_error(self._view, error)
