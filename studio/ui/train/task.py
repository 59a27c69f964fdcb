"""The training under way: a child process, the run it makes, how far it is, and how that is said."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from PySide6.QtCore import QCoreApplication, QObject, Signal

from studio.ipc.events import (
    ChildEvent,
    CleaningEvent,
    EpochEvent,
    ListeningEvent,
    LookAheadsEvent,
    NoteEvent,
    OutOfMemoryEvent,
    StartedEvent,
    StepEvent,
    TrainDone,
)
from studio.project import Run
from studio.ui.language import native
from studio.ui.tasks import ChildTask
from studio.ui.train.run_facts import RunFacts, epochs_of, run_facts
from studio.ui.widgets.timeline.time_view import minutes


@dataclass
class TrainingProgress:
    """Events of one training, as they come.

    Args:
        epochs: those of earlier sittings of a resumed run first.
        notes: sentences worth keeping in the log.
        cleaning: (take, percent) while cleaned sound is made.
        listening: (take, number, of) while the sounds of the takes are worked out.
        step: the newest step of the epoch under way, None where it is over.
        measuring: percent of what is measured after the last epoch.
        smaller: after memory ran out, the setting that may fit.
    """

    epochs: list[EpochEvent] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    cleaning: tuple[str, int] | None = None
    listening: tuple[str, int, int] | None = None
    step: StepEvent | None = None
    measuring: int | None = None
    smaller: str = ""

    def update(self, event: ChildEvent) -> None:
        """Come further by one event."""
        match event:
            case EpochEvent():
                self.epochs.append(event)
                self.step = None
            case StepEvent():
                self.step = event
            case CleaningEvent():
                self.cleaning = event.take, round(100 * event.fraction)
            case LookAheadsEvent():
                self.measuring = round(100 * event.fraction)
            case ListeningEvent():
                self.cleaning = None
                self.listening = event.take, event.number, event.of
            case StartedEvent():
                self.cleaning = self.listening = None
            case OutOfMemoryEvent():
                self.smaller = event.setting
            case NoteEvent(text=str(text)) if text:
                self.notes.append(native(text))

    @property
    def facts(self) -> RunFacts:
        """The run at a glance."""
        return run_facts(self.epochs)

    @property
    def fraction(self) -> float:
        """How much is done, 0..1, of listening to the takes, then of the epochs; -1 where nobody can tell."""
        done, of = self.facts.epochs, self.facts.of or (self.step.of if self.step else 0)
        if not of and self.listening is not None and self.listening[2] > 1:
            return (self.listening[1] - 1) / self.listening[2]
        if not of:
            return -1.0
        return min(1.0, (done + self._part) / float(of))

    @property
    def eta(self) -> float | None:
        """Seconds left, by what came last."""
        if self.step is not None and math.isfinite(self.step.eta_s):
            return self.step.eta_s
        return self.facts.eta

    @property
    def _part(self) -> float:
        return self.step.step / self.step.steps if self.step and self.step.steps else 0.0


def strip_text(progress: TrainingProgress) -> str:
    """A training as a fact of the status strip."""
    facts = progress.facts
    if not facts.of:
        return _tr("Training: preparing")
    return _tr("Training {0} of {1}").format(facts.epochs, facts.of)


def training_text(progress: TrainingProgress, stopping: bool = False) -> str:
    """What a training does right now: before its first epoch, in its midst, or after the last.

    Args:
        progress: how far it is.
        stopping: it was asked to end, so that what was left means nothing.
    """
    if progress.measuring is not None:
        return _tr("measuring how good it is: {0} %").format(progress.measuring)
    if not progress.facts.epochs and progress.step is None:
        return _preparing(progress)
    step = progress.step
    if step is None:
        return run_text(progress.facts, progress.eta if not stopping else None)
    first = _tr("epoch {0} of {1}, step {2} of {3}").format(step.epoch, step.of, step.step, step.steps)
    return _joined(first, progress.facts, progress.eta if not stopping else None)


def run_text(facts: RunFacts, eta: float | None = None) -> str:
    """How far a run came; "" where it has no epoch.

    Args:
        facts: of the run.
        eta: seconds left, None where nothing goes on.
    """
    if not facts.epochs:
        return ""
    return _joined(_tr("epoch {0} of {1}").format(facts.epochs, facts.of or facts.epochs), facts, eta)


def _joined(first: str, facts: RunFacts, eta: float | None) -> str:
    parts = [first]
    if facts.best is not None:
        parts.append(_tr("epoch {0} kept").format(facts.best))
    if facts.seconds is not None:
        parts.append(_tr("{0} s each").format(f"{facts.seconds:.1f}"))
    if eta is not None:
        parts.append(_tr("{0} left").format(minutes(eta)))
    return "   ".join(parts)


def _preparing(progress: TrainingProgress) -> str:
    """What is done before the first epoch."""
    if progress.cleaning is not None:
        return _tr("cleaning the sound of {0}: {1} %").format(*progress.cleaning)
    if progress.listening is not None:
        return _tr("listening to {0}, take {1} of {2}; kept for the next training").format(
            *progress.listening
        )
    return _tr("reading the takes; the first epoch follows")


def _tr(text: str) -> str:
    return QCoreApplication.translate("TrainPresenter", text)


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
        # The child reports `done` after it has ended: whether a training is under way is kept here, for cards
        # are still told of its run then.
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
        # Who is told may start the next training at once, which must find these free.
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
