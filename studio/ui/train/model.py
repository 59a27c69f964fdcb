"""What the Train tab knows: the data, the training under way, the run shown, and word of what changed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import QObject, QTimer, Signal

from studio.dataset import edits
from studio.errors import StudioError
from studio.evaluation.learning_curve import LearningCurve
from studio.evaluation.verdict import RunVerdict
from studio.project import Run
from studio.ui import tasks
from studio.ui.session import Session
from studio.ui.tasks import ChildTask, LatestTask
from studio.ui.train.data_facts import DataFacts, data_facts, one_for_validation
from studio.ui.train.run_facts import ProjectVerdicts, RunReader, VerdictReader
from studio.ui.train.run_trash import RunTrash
from studio.ui.train.task import TrainRequest, TrainTask
from studio.ui.undo import DatasetUndo, JointUndo

REFRESH_MS = 500
"""Epochs may come faster than anyone can read: the window follows at this pace."""


class TrainModel(QObject):
    """The only thing that the tab's cards share; it has no widgets.

    Args:
        session: the open project.
        child: runs the training; tests give one of their own.
        parent: as everywhere in Qt.

    Signals:
        data_changed: takes, choices or what may be done with them are others now.
        runs_changed: the runs on the disk may be others now.
        verdicts_changed: what is said of the runs, or the learning curve, is another now.
        refreshed: the training under way has come further; at a pace that people can read.
        shown_changed: the curves of another run are to be seen.
        choose_requested: id of the run to mark in the list.
        cancel_requested: the training under way was to be deleted.
        told: (sentence, remedy, the UndoScope that can take it back or None).
        failed: a StudioError that somebody should see.
    """

    data_changed = Signal()
    runs_changed = Signal()
    verdicts_changed = Signal()
    refreshed = Signal()
    shown_changed = Signal()
    choose_requested = Signal(str)
    cancel_requested = Signal()
    told = Signal(str, str, object)
    failed = Signal(object)

    def __init__(
        self, session: Session, child: ChildTask | None = None, parent: QObject | None = None
    ) -> None:
        super().__init__(parent)
        self._session = session
        self.active = False
        """Whether the tab is the one shown."""
        self.shown = ""
        """Id of the run whose curves are seen, "" for none or for a training that has no run yet."""
        self.facts: DataFacts | None = None
        """What there is to learn from; None without a project, or where there is nothing at all."""
        self.reader = RunReader()
        self._verdict_reader = VerdictReader()
        self._verdicts = ProjectVerdicts()
        self._reading = LatestTask(self)
        self.training = TrainTask(child or ChildTask(self), self)
        self.trash = RunTrash(self, lambda folder: self.training.running and folder == self.training.folder)
        self.data_undo = DatasetUndo(session, "train", self)
        self.undo_scope = JointUndo((self.data_undo, self.trash.steps), self)
        self._timer = QTimer(self)
        self._timer.setInterval(REFRESH_MS)
        self._timer.timeout.connect(self.refreshed)
        session.project_opened.connect(self.open)
        session.takes_changed.connect(self.refresh_data)
        session.dataset_changed.connect(self.refresh_data)
        session.runs_changed.connect(self.runs_changed)
        for changed in (self.runs_changed, self.data_changed):
            changed.connect(self._read_verdicts)
        self.trash.removed.connect(self._on_removed)
        self.trash.returned.connect(self._on_returned)
        self.trash.told.connect(self.told)
        self.trash.failed.connect(self.failed)
        self.training.run_began.connect(self._on_run_began)
        self.training.cancelled.connect(self._on_cancelled)
        self.training.ended.connect(self._on_ended)

    # -- what there is -----------------------------------------------------------------------------

    @property
    def here(self) -> bool:
        """Whether the training is of the project that is open."""
        project = self._session.project
        return project is not None and project.runs_folder == self.training.runs_folder

    @property
    def live_run(self) -> str | None:
        """The id of the run that is trained here, "" before it has one; None where no training is."""
        return self.training.run_id if self.training.running and self.here else None

    @property
    def shows_training(self) -> bool:
        """Whether what is seen is the training under way."""
        return self.live_run is not None and self.shown in ("", self.live_run)

    @property
    def shown_run(self) -> Run | None:
        """The run whose curves are to be seen."""
        project = self._session.project
        return next((run for run in project.runs if run.id == self.shown), None) if project else None

    @property
    def newest_first(self) -> list[Run]:
        """The project's runs."""
        project = self._session.project
        return self.reader.newest_first(project.runs_folder) if project is not None else []

    @property
    def curve(self) -> LearningCurve | None:
        """What more takes would bring, as it was measured last."""
        return self._verdicts.curve

    def verdict_on(self, run: Run) -> RunVerdict:
        """How good a run is, and what would help most, as it was read last."""
        return self._verdicts.of_runs.get(run.folder, RunVerdict())

    def is_judged(self, run: Run) -> bool:
        """Whether the verdict on a run was read yet."""
        return run.folder in self._verdicts.of_runs

    def read_verdict(self, run_id: str, on_read: Callable[[RunVerdict], None]) -> None:
        """Read the verdict on the open project's run of this id anew; an empty one where it has none."""
        project = self._session.project
        runs = [run for run in self.newest_first if run.id == run_id]
        if project is None or not runs:
            on_read(RunVerdict())
            return
        dataset, takes = project.dataset, project.takes
        tasks.run(
            lambda: self._verdict_reader.read(project, runs, dataset, takes),
            lambda found: on_read(found.of_runs[runs[0].folder]),
            owner=self,
        )

    def _read_verdicts(self) -> None:
        """Read on the pool what is said of the runs: their figures lie in files that may have changed."""
        project = self._session.project
        if project is None:
            self._reading.drop()
            self._show_verdicts(ProjectVerdicts())
            return
        runs, dataset, takes = self.newest_first, project.dataset, project.takes
        self._reading.run(
            lambda: self._verdict_reader.read(project, runs, dataset, takes), self._show_verdicts
        )

    def _show_verdicts(self, found: ProjectVerdicts) -> None:
        if found != self._verdicts:
            self._verdicts = found
            self.verdicts_changed.emit()

    # -- what happens to it ------------------------------------------------------------------------

    def activate(self) -> None:
        """The tab is shown."""
        self.active = True
        self.refresh_data()
        self.runs_changed.emit()
        self._refresh()

    def deactivate(self) -> None:
        """Another tab is shown; the training goes on."""
        self.active = False

    def close(self) -> None:
        """The window closes."""
        self._timer.stop()
        self.training.close()

    def open(self) -> None:
        """Show the project that is open now: its newest run, or the training under way where it is its."""
        # Steps of another project would move folders that are not in this one.
        self.trash.steps.forget()
        runs = self.newest_first
        self.shown = self.live_run if self.live_run is not None else runs[0].id if runs else ""
        self.shown_changed.emit()
        self.refresh_data()
        self.runs_changed.emit()
        if self.shown:
            self.choose_requested.emit(self.shown)

    def refresh_data(self) -> None:
        """Count what there is to learn from."""
        project = self._session.project
        # Counted, nothing at all would be a card full of zeros: the tab says what goes there instead.
        empty = project is None or not (project.takes or project.runs or self.training.running)
        self.facts = data_facts(project.dataset, project.takes) if project is not None and not empty else None
        self.data_changed.emit()

    def show(self, run_id: str) -> None:
        """Show the curves of a run."""
        if run_id and run_id != self.shown:
            self.shown = run_id
            self.shown_changed.emit()

    def set_aside(self) -> None:
        """Keep one take for validation, as a step of undo."""
        project = self._session.project
        chosen = one_for_validation(project.dataset, project.takes) if project else None
        if project is None or chosen is None:
            return
        try:
            # Under this tab's name, so that Undo takes it back here and not where nobody sees the takes.
            dataset = edits.set_split(project.dataset, [chosen], "val")
            self._session.edit(self.tr("Set {0} aside for validation").format(chosen), dataset, "train")
        except StudioError as error:
            self.failed.emit(error)
        else:
            self.told.emit(self.tr("{0} is kept for validation.").format(chosen), "", self.data_undo)

    # -- training ----------------------------------------------------------------------------------

    def start(self, request: TrainRequest) -> None:
        """Begin a training of the open project."""
        project = self._session.project
        if project is None or self.training.running:
            return
        # Only what was trained with is worth coming back to, not what was merely looked at.
        if request.recipe != self._session.settings.recipe:
            self._session.change_settings(recipe=request.recipe)
        self._begin(request.args(project.folder), project.runs_folder)

    def resume(self, run_id: str) -> None:
        """Go on with a run that did not come to its end."""
        project = self._session.project
        if project is not None and not self.training.running and run_id:
            args = ["train", str(project.folder), "--resume", run_id]
            self._begin(args, project.runs_folder, project.run(run_id))

    def start_smaller(self) -> None:
        """Go on with the smaller batch that was offered when memory ran out."""
        project = self._session.project
        if project is not None:
            self.training.start_smaller(project.runs)
            self._follow_training()

    def _begin(self, args: list[str], runs_folder: Path, run: Run | None = None) -> None:
        self.training.start(args, runs_folder, run)
        self._follow_training()

    def _follow_training(self) -> None:
        if self.training.running:
            self.shown = self.training.run_id
            self._timer.start()
            self._refresh()

    def _refresh(self) -> None:
        if self.training.running:
            self.refreshed.emit()

    def _on_run_began(self) -> None:
        self._session.runs_changed.emit()
        # A training goes on when its project is left, and must not choose a run in the next one.
        if self.here:
            self.shown = self.training.run_id
            self.choose_requested.emit(self.shown)

    def _on_cancelled(self) -> None:
        """Remove what the cancelled run left."""
        folder = self.training.folder
        if self.here:
            self.shown = ""
        sentence = self.tr("The training was cancelled.")
        # What a child says is never enough to move a folder: it has to lie among the runs.
        if folder is not None and folder.parent == self.training.runs_folder and folder.is_dir():
            self.trash.remove(folder, sentence)
        else:
            self.told.emit(sentence, "", None)

    def _on_ended(self, run_id: str) -> None:
        self._timer.stop()
        self._session.status_changed.emit("train", "", "")
        self._session.runs_changed.emit()
        if self.shown == run_id:
            self.choose_requested.emit(run_id)  # the list shows whose curves are seen
        self.shown_changed.emit()

    # -- runs --------------------------------------------------------------------------------------

    def add_run(self, folder: Path, sentence: str) -> None:
        """Show a run that came from elsewhere, which undo removes again."""
        self._session.runs_changed.emit()
        self.choose_requested.emit(folder.name)
        self.trash.add_imported(folder, sentence)

    def _on_removed(self, run_id: str) -> None:
        if self.shown == run_id:
            self.shown = ""
            self.shown_changed.emit()
        self._session.runs_changed.emit()

    def _on_returned(self, run_id: str) -> None:
        self._session.runs_changed.emit()
        self.choose_requested.emit(run_id)
