"""The list of runs, and what is done with them: review, compare, note, show, take along, delete."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from PySide6.QtCore import QObject, QUrl, Signal
from PySide6.QtGui import QDesktopServices

from studio.errors import StudioError
from studio.files import atomic
from studio.ipc.events import EpochEvent
from studio.project import Run
from studio.ui import messages
from studio.ui.session import Session
from studio.ui.train.carrying import RunTransfer
from studio.ui.train.comparing import ComparePresenter
from studio.ui.train.removing import RunTrashPresenter, where_it_goes
from studio.ui.train.run_facts import RunFacts, run_facts
from studio.ui.train.run_reading import NOTE_FILE, RunReading, has_state, note_of
from studio.ui.train.runs_table import RunRow
from studio.ui.train.view import TrainView


@dataclass(frozen=True)
class RunningTraining:
    """The training under way: its run's id and its epochs so far."""

    run: str
    events: Sequence[EpochEvent]


class RunsPresenter(QObject):
    """Thought of the card of runs.

    Args:
        view: the tab.
        session: the open project.
        live: gives the training under way, None where there is none.
        removing: puts runs away.

    Signals:
        cancel_wished: the run under way was to be deleted.
    """

    cancel_wished = Signal()

    def __init__(
        self,
        view: TrainView,
        session: Session,
        live: Callable[[], RunningTraining | None],
        removing: RunTrashPresenter,
    ) -> None:
        super().__init__(view)
        self._view, self._session, self._live, self._removing = view, session, live, removing
        self._reading = RunReading()
        self._comparing = ComparePresenter(view)
        view.review_requested.connect(self.review)
        view.compare_requested.connect(self._on_compare)
        self._carrying = RunTransfer(view)
        self._carrying.arrived.connect(self._on_arrived)
        view.card_requested.connect(
            lambda run: self._with_project(self._carrying.show_card, run, locked=session.locked_reason)
        )
        view.export_requested.connect(lambda run: self._with_project(self._carrying.ask_export, run))
        view.import_requested.connect(lambda: self._with_project(self._carrying.ask_import))
        session.run_dropped.connect(self._on_dropped)
        view.delete_requested.connect(self._on_delete)
        view.folder_requested.connect(self._on_folder)
        view.note_changed.connect(self._on_note)

    def close(self) -> None:
        """The window closes."""
        self._comparing.close()
        self._carrying.close()

    def show(self) -> None:
        """Bring the list up to what is on the disk."""
        project, live = self._session.project, self._live()
        if project is None:
            self._view.show_runs([], set(), set())
            return
        runs = self.newest_first()
        rows = [RunRow(run.id, self._status(run, live), self._facts(run, live), note_of(run)) for run in runs]
        idle = {run.id for run in runs if live is None or run.id != live.run}
        resumable = {r.id for r in runs if r.id in idle and r.status != "done" and has_state(r)}
        self._view.show_runs(rows, resumable, {r.id for r in runs if r.has_weights})

    def show_live(self) -> None:
        """Bring the line of the training under way up to what it said; the disk is left alone."""
        live = self._live()
        if live is not None and not self._view.runs.show_facts(live.run, run_facts(live.events)):
            self.show()

    def newest_first(self) -> list[Run]:
        """The project's runs."""
        project = self._session.project
        return self._reading.newest_first(project.runs_folder) if project is not None else []

    def review(self, run_id: str) -> None:
        """Show a run in Review."""
        if run_id:
            self._session.wanted_run = run_id
            self._session.tab_requested.emit("review")

    def _facts(self, run: Run, live: RunningTraining | None) -> RunFacts:
        return run_facts(live.events) if live is not None and run.id == live.run else self._reading.facts(run)

    def _status(self, run: Run, live: RunningTraining | None) -> str:
        if live is not None and run.id == live.run:
            return "running"
        # A run whose report still says so was killed in the middle.
        return "unfinished" if run.status in ("running", "failed") else run.status

    def _on_compare(self, runs: tuple[str, ...]) -> None:
        if self._session.project is not None and runs:
            self._comparing.open(self._session.project, runs)

    def _with_project(self, work: Callable[..., None], *words: str | Path, **more: str) -> None:
        if self._session.project is not None and all(words):
            work(self._session.project, *words, **more)

    def _on_dropped(self, path: Path) -> None:
        project = self._session.project
        if project is not None and project.read_only:
            messages.show_failure(self._view, self._session.locked_reason, project.read_only_remedy)
            return
        self._with_project(self._carrying.bring_in, path)

    def _on_arrived(self, folder: Path, told: str) -> None:
        self._session.runs_changed.emit()
        self._view.runs.choose(folder.name)
        self._removing.brought_in(folder, told)

    def _on_delete(self, run_id: str) -> None:
        project, live = self._session.project, self._live()
        if project is None or not run_id:
            return
        if live is not None and run_id == live.run:
            self.cancel_wished.emit()
            return
        question = self.tr("Delete {0}?").format(run_id)
        if messages.ask(self._view, question, where_it_goes(), self.tr("Delete run")):
            self._removing.remove(project.run(run_id).folder, self.tr("Removed {0}.").format(run_id))

    def _on_folder(self, run_id: str) -> None:
        if self._session.project is not None and run_id:
            folder = self._session.project.run(run_id).folder
            QDesktopServices.openUrl(QUrl.fromLocalFile(str(folder)))

    def _on_note(self, run_id: str, text: str) -> None:
        project = self._session.project
        if project is None:
            return
        try:
            with atomic.written(project.run(run_id).folder / NOTE_FILE) as beside:
                beside.write_text(text.strip(), encoding="utf-8")
        except StudioError as error:
            messages.show_error(self._view, error)
