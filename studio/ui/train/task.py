"""The training under way: a child process, the run it makes, and how far it is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from PySide6.QtCore import QObject, Signal

from studio.ipc.events import ChildEvent, OutOfMemoryEvent, StartedEvent, TrainDone
from studio.project import Run
from studio.ui.tasks import ChildTask
from studio.ui.train.progress import TrainingProgress
from studio.ui.train.run_facts import epochs_of


@dataclass(frozen=True)
class TrainRequest:
    """What Start training asks for.

    Args:
        recipe: the recipe's name.
        changed: its values that are to be others, as --set takes them.
    """

    recipe: str
    changed: tuple[str, ...] = ()

    def args(self, project: Path) -> list[str]:
        """The command that trains a project so."""
        sets = [part for changed in self.changed for part in ("--set", changed)]
        return ["train", str(project), "--recipe", self.recipe, *sets]


class TrainTask(QObject):
    """One training at a time, in a child process that outlives the tab's being shown.

    Args:
        child: runs the command; tests give one that only records what it is asked.

    Signals:
        began: a training begins; its run may come later.
        changed: it begins, is asked to stop, or measures now: buttons say something else.
        run_began: the run is there; `run_id` says which.
        done: (run id, whether it was stopped early).
        failed: a StudioError; `offer` may say how to go on.
        cancelled: it was cancelled, and what it made is to go.
        ended: run id, "" where none had begun; after any of those, and after a resumed run was cancelled.
    """

    began = Signal()
    changed = Signal()
    run_began = Signal()
    done = Signal(str, bool)
    failed = Signal(object)
    cancelled = Signal()
    ended = Signal(str)

    def __init__(self, child: ChildTask, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._child = child
        self._args: list[str] = []
        self._cancelling = False
        self._failed_run = ""
        self.running = False
        self.run_id = ""
        self.folder: Path | None = None
        """The run's, None before it is known."""
        self.runs_folder: Path | None = None
        """Where the runs of its project lie, which need not be the one that is open."""
        self.progress = TrainingProgress()
        self.resuming = False
        self.stopping = False
        child.told.connect(self._on_event)
        child.done.connect(self._on_done)
        child.failed.connect(self._on_failed)
        child.cancelled.connect(self._on_cancelled)
        child.ended.connect(self._on_ended)

    @property
    def measuring(self) -> bool:
        """Whether the learning is over and the look-aheads are being measured."""
        return self.progress.measuring is not None

    @property
    def log(self) -> str:
        """What the training said, for a log to read."""
        return "\n".join([*self.progress.notes, self._child.log]).strip()

    def start(self, args: list[str], runs_folder: Path, run: Run | None = None) -> None:
        """Begin a training.

        Args:
            args: of the command.
            runs_folder: where its run will lie.
            run: one it goes on with, None for a new one.
        """
        self._args, self.runs_folder = args, runs_folder
        self.progress = TrainingProgress(epochs_of(run) if run is not None else [])
        self.run_id, self.folder = (run.id, run.folder) if run is not None else ("", None)
        self.resuming, self.stopping, self._cancelling = run is not None, False, False
        self.running = True
        self._child.start(args)
        self.began.emit()
        self.changed.emit()

    def start_smaller(self, runs: Sequence[Run]) -> None:
        """Go on after memory ran out, with the smaller batch that was offered; `runs` are the project's."""
        if self.running or not self.progress.smaller or self.runs_folder is None:
            return
        run = next((run for run in runs if run.id == self._failed_run), None)
        args = smaller_batch_args(self._args, run.id if run is not None else "", self.progress.smaller)
        self.start(args, self.runs_folder, run)

    def stop(self) -> None:
        """Ask it to end well after this epoch; while it measures, to leave the rest of that out."""
        if self.running:
            self.stopping = True
            self._child.stop()
            self.changed.emit()

    def cancel(self) -> None:
        """End it now; a new run is removed, a resumed one stays as it was."""
        if self.running:
            self._cancelling = True
            self._child.cancel()

    def close(self) -> None:
        """The window closes: the child ends, keeping what it has."""
        self.running = False
        self._child.close()

    def _on_event(self, event: ChildEvent) -> None:
        # Memory may run out before the training begins, and its run be there already.
        if isinstance(event, StartedEvent | OutOfMemoryEvent) and event.run and not self.run_id:
            self.run_id = event.run
            self.folder = Path(event.folder) if isinstance(event, StartedEvent) and event.folder else None
            self.run_began.emit()
        learning = not self.measuring
        self.progress.update(event)
        if learning and self.measuring:
            self.stopping = False  # that stop ended the learning; the next one ends the measuring
            self.changed.emit()

    def _on_done(self, done: TrainDone) -> None:
        # Cancelled too late for the child, which was measuring what it had learnt.
        if self._cancelling and not self.resuming:
            self._on_cancelled()
        else:
            self.done.emit(done.run or self.run_id, done.stopped)

    def _on_failed(self, error: BaseException) -> None:
        self._failed_run = self.run_id
        self.failed.emit(error)

    def _on_cancelled(self) -> None:
        if self.resuming:
            return
        if self.folder is None and self.runs_folder is not None and self.run_id:
            self.folder = self.runs_folder / self.run_id
        self.progress = TrainingProgress()
        self.cancelled.emit()

    def _on_ended(self) -> None:
        self.running = False
        run, self.run_id, self.folder = self.run_id, "", None
        self.changed.emit()
        self.ended.emit(run)


def smaller_batch_args(args: Sequence[str], run: str, smaller: str) -> list[str]:
    """The command that goes on with a smaller batch.

    Args:
        args: of the command whose memory ran out.
        run: the run it had begun, "" for none.
        smaller: the setting that may fit.
    """
    # The run's own folder knows the recipe and what was changed of it.
    resumed = [*args[:2], "--resume", run] if run and "--resume" not in args else list(args)
    return [*resumed, "--set", smaller]
