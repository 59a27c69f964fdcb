"""What the Train tab does: counts the data, starts and follows the training child, keeps the runs."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QObject, QTimer

from studio.dataset import edits
from studio.errors import StudioError
from studio.ipc.events import ChildEvent, EpochEvent, OutOfMemoryEvent, StartedEvent, TrainDone
from studio.project import Run
from studio.ui import messages, undo
from studio.ui.session import Session
from studio.ui.tasks import Job
from studio.ui.train import words
from studio.ui.train.choices import Choices
from studio.ui.train.data_facts import data_facts, one_for_validation
from studio.ui.train.ending import CloseChoice, ask_how_to_end
from studio.ui.train.following import ProgressPresenter
from studio.ui.train.heard import TrainingProgress, smaller_batch_note
from studio.ui.train.removing import RunTrashPresenter
from studio.ui.train.run_facts import epochs_of
from studio.ui.train.run_keeping import RunningTraining, RunsPresenter
from studio.ui.train.view import TrainRequest, TrainView
from studio.ui.undo import DatasetUndo, JointUndo

REFRESH_MS = 500
"""Epochs may come faster than anyone can read: the window follows at this pace."""


class TrainPresenter(QObject):
    """Thought of the Train tab; the training itself runs in a child process."""

    def __init__(self, view: TrainView, session: Session) -> None:
        super().__init__(view)
        self._view = view
        self._session = session
        self._job: Job | None = None
        self._run_id = ""  # of the training under way
        self._folder: Path | None = None
        self._runs_folder: Path | None = None
        """Where the runs of its project lie, which need not be the one that is open."""
        self._words: list[str] = []  # of the command it runs, or ran last
        self._heard = TrainingProgress()
        self._resuming = False
        self._offered_run = ""  # the one whose memory ran out
        self._closing = False  # the window goes once the training has ended
        self._shown = ""  # the run whose curves are seen
        self._stopping = False
        self._active = False
        self._timer = QTimer(self)
        self._timer.setInterval(REFRESH_MS)
        self._timer.timeout.connect(self._follow)
        self._following = ProgressPresenter(view)
        self._removing = RunTrashPresenter(
            view, lambda folder: self._job is not None and folder == self._folder
        )
        self._removing.removed.connect(self._on_removed)
        self._removing.returned.connect(self._on_returned)
        self._data_undo = DatasetUndo(session, "train", self)
        self.undo_scope = JointUndo((self._data_undo, self._removing.steps), self)
        self._keeping = RunsPresenter(view, session, self._live, self._removing)
        self._keeping.cancel_wished.connect(self._on_cancel)
        self._choices = Choices(view, session)
        view.start_requested.connect(self._on_start)
        view.stop_requested.connect(self._on_stop)
        view.cancel_requested.connect(self._on_cancel)
        view.mend_requested.connect(self._on_mend)
        view.progress.offer_taken.connect(self._on_smaller)
        view.record_requested.connect(lambda: session.tab_requested.emit("record"))
        view.curate_requested.connect(lambda: session.tab_requested.emit("curate"))
        view.resume_requested.connect(self._on_resume)
        view.run_chosen.connect(self._on_run_chosen)
        session.project_opened.connect(self._on_project)
        session.takes_changed.connect(self._show_data)
        session.dataset_changed.connect(self._show_data)
        session.runs_changed.connect(self._keeping.show)
        view.show_running(False)
        self._on_project()

    @property
    def training(self) -> bool:
        """Whether a training is under way."""
        return self._job is not None

    @property
    def _here(self) -> bool:
        """Whether the training is of the project that is open."""
        project = self._session.project
        return project is not None and project.runs_folder == self._runs_folder

    def activate(self) -> None:
        """The tab is shown."""
        self._active = True
        self._show_data()
        self._keeping.show()
        self._follow()

    def deactivate(self) -> None:
        """Another tab is shown; the training goes on."""
        self._active = False

    def may_close(self) -> bool:
        """Whether the window may close; a training under way asks what becomes of it."""
        if not self.training:
            return True
        chosen = ask_how_to_end(self._view, self._run_id, self._resuming)
        job = self._job
        if job is None:  # it ended while the question stood
            return chosen is not CloseChoice.GO_ON
        if chosen is CloseChoice.KEEP:
            self._closing = True
            self._on_stop()
        elif chosen is CloseChoice.DISCARD:
            folder = self._folder
            self.close()
            if folder is not None and folder.is_dir():
                self._removing.remove(folder, self.tr("Removed {0}.").format(folder.name))
        return chosen is CloseChoice.DISCARD

    def close(self) -> None:
        """The window closes: the child ends, keeping what it has."""
        self._timer.stop()
        self._keeping.close()
        if self._job is not None:
            job, self._job = self._job, None
            job.close()

    # -- training ----------------------------------------------------------------------------------

    def _on_start(self, wish: TrainRequest) -> None:
        project = self._session.project
        if project is None or self._job is not None:
            return
        if wish.recipe != self._session.settings.recipe:
            self._session.change_settings(recipe=wish.recipe)
        self._runs_folder = project.runs_folder
        words = ["train", str(project.folder), "--recipe", wish.recipe]
        for changed in wish.changed:
            words += ["--set", changed]
        self._begin(words, [])

    def _on_resume(self, run_id: str) -> None:
        project = self._session.project
        if project is None or self._job is not None or not run_id:
            return
        self._runs_folder = project.runs_folder
        self._go_on(["train", str(project.folder), "--resume", run_id], project.run(run_id))

    def _go_on(self, words: list[str], run: Run) -> None:
        self._folder = run.folder
        self._begin(words, epochs_of(run), run.id)

    def _on_smaller(self) -> None:
        """Train on with the smaller batch that was offered when memory ran out."""
        project, smaller = self._session.project, self._heard.smaller
        if project is None or self._job is not None or not smaller:
            return
        run = next((run for run in project.runs if run.id == self._offered_run), None)
        words = smaller_batch_note(self._words, run.id if run is not None else "", smaller)
        if run is None:
            self._begin(words, [])
        else:
            self._go_on(words, run)

    def _begin(self, words: list[str], events: list[EpochEvent], run_id: str = "") -> None:
        job = Job(self)
        job.told.connect(self._on_event)
        job.done.connect(self._on_done)
        job.failed.connect(self._on_failed)
        job.cancelled.connect(self._on_cancelled)
        job.ended.connect(self._on_ended)
        self._job, self._heard, self._stopping = job, TrainingProgress(list(events)), False
        self._run_id, self._shown, self._words = run_id, run_id, words
        self._folder = self._folder if run_id else None
        self._resuming, self._closing = bool(run_id), False
        job.start(words)
        self._view.progress.show_alarm("")
        self._view.progress.show_offer("", "")
        self._view.show_running(True)
        self._timer.start()
        self._follow()

    def _on_stop(self) -> None:
        if self._job is not None:
            self._stopping = True
            self._job.stop()
            self._view.show_running(True, stopping=True, measuring=self._heard.measuring is not None)

    def _on_cancel(self) -> None:
        if self._job is None:
            return
        question = self.tr("Cancel this training?")
        details = self.tr("The run and what it has learnt so far are removed.")
        if self._resuming:
            details = self.tr("What it learnt before it was resumed stays.")
        if not self._heard.events or messages.ask(
            self._view, question, details, self.tr("Cancel training"), self.tr("Go on training")
        ):
            self.cancel()

    def cancel(self) -> None:
        """End the training now and remove its run."""
        if self._job is not None:
            self._job.cancel()

    def _on_event(self, event: ChildEvent) -> None:
        # Memory may run out before the training begins, and its run be there already.
        if isinstance(event, StartedEvent | OutOfMemoryEvent) and event.run and not self._run_id:
            self._run_id = event.run
            self._folder = Path(event.folder) if isinstance(event, StartedEvent) and event.folder else None
            self._session.runs_changed.emit()
            if self._here:
                self._shown = self._run_id
                self._view.runs.choose(self._run_id)
        learning = self._heard.measuring is None
        self._heard.take(event)
        if learning and self._heard.measuring is not None:
            self._view.show_running(True, measuring=True)  # a stop before this one ended the learning

    def _on_done(self, done: TrainDone) -> None:
        if self._job is not None and self._job.cancelling and not self._resuming:
            self._on_cancelled()  # too late for the child, which was measuring what it had learnt
            return
        run = done.run or self._run_id
        text = self.tr("{0} stopped; its best epoch is kept.") if done.stopped else self.tr("{0} is trained.")
        action = (self.tr("Review it"), lambda: self._keeping.review(run))
        messages.show_note(self._view, text.format(run), action=action if self._here else None)

    def _on_failed(self, what: str, remedy: str) -> None:
        smaller = self._heard.smaller
        self._offered_run = self._run_id
        if smaller:
            remedy = self.tr("What was learnt is kept; a smaller batch may fit.")
            button = self.tr("Train with a smaller batch ({0})").format(smaller.rpartition(".")[2])
            self._view.progress.show_offer(f"{what} {remedy}", button)
        self._closing = False  # who closed the window must see what became of the training
        messages.show_failure(self._view, what, remedy)

    def _on_cancelled(self) -> None:
        """Remove what the cancelled run left; a resumed one stays as it was."""
        folder = self._folder
        if self._resuming:
            return
        if folder is None and self._runs_folder is not None and self._run_id:
            folder = self._runs_folder / self._run_id
        self._shown, self._heard = "" if self._here else self._shown, TrainingProgress()
        told = self.tr("The training was cancelled and its run removed.")
        if folder is not None and folder.parent == self._runs_folder and folder.is_dir():
            self._removing.remove(folder, told)
        else:
            messages.show_note(self._view, told)

    def _on_ended(self) -> None:
        job = self._job
        self._timer.stop()
        self._follow()
        self._job = None
        finished, self._run_id, self._folder = self._run_id, "", None
        if job is not None:
            job.deleteLater()
        self._session.status_changed.emit("train", "", "")
        self._view.show_running(False)
        self._session.runs_changed.emit()
        if self._shown == finished:
            self._view.runs.choose(finished)  # the list shows whose curves are seen
        self._show_shown()
        if self._closing:
            QTimer.singleShot(0, self._view.window(), self._view.window().close)

    # -- what is seen ------------------------------------------------------------------------------

    def _follow(self) -> None:
        """Bring the display up to the training under way."""
        if self._job is None:
            return
        self._session.status_changed.emit("train", words.in_strip(self._heard), "")
        if not self._active:
            return
        self._view.progress.show_log("\n".join([*self._heard.notes, self._job.log]).strip())
        if self._here and self._shown in (self._run_id, ""):
            self._following.show_training(self._run_id, self._heard, self._folder, self._stopping)
        self._keeping.show_live()

    def _show_shown(self) -> None:
        """The curves of the run that is chosen in the list."""
        project = self._session.project
        self._following.show_run(
            next((r for r in project.runs if r.id == self._shown), None) if project else None
        )

    def _show_data(self) -> None:
        project = self._session.project
        self._view.show_locked(self._session.locked_reason)
        if project is None:
            self._view.show_empty(True)
            return
        empty = not project.takes and not project.runs and self._job is None
        self._view.show_empty(empty)
        if not empty:
            self._view.show_data(data_facts(project.dataset, project.takes))

    def _on_run_chosen(self, run_id: str) -> None:
        if run_id and run_id != self._shown:
            self._shown = run_id
            if run_id == self._run_id and self._here:
                self._follow()
            else:
                self._show_shown()

    def _on_project(self) -> None:
        self._removing.steps.forget()
        if self._job is None or not self._here:
            runs = self._keeping.newest_first()
            self._shown = runs[0].id if runs else ""
            self._show_shown()
        else:
            self._shown = self._run_id
        self._show_data()
        self._keeping.show()
        if self._shown:
            self._view.runs.choose(self._shown)

    # -- runs --------------------------------------------------------------------------------------

    def _live(self) -> RunningTraining | None:
        return (
            RunningTraining(self._run_id, self._heard.events)
            if self._job is not None and self._here
            else None
        )

    def _on_removed(self, run_id: str) -> None:
        if self._shown == run_id:
            self._shown = ""
            self._show_shown()
        self._session.runs_changed.emit()

    def _on_returned(self, run_id: str) -> None:
        self._session.runs_changed.emit()
        self._view.runs.choose(run_id)

    def _on_mend(self) -> None:
        project = self._session.project
        chosen = one_for_validation(project.dataset, project.takes) if project else None
        if project is None or chosen is None:
            return
        try:
            dataset = edits.set_split(project.dataset, [chosen], "val")
            self._session.edit(self.tr("Set {0} aside for validation").format(chosen), dataset, "train")
        except StudioError as error:
            messages.show_error(self._view, error)
        else:
            undo.tell_change(
                self._view, self._data_undo, self.tr("{0} is kept for validation.").format(chosen)
            )
