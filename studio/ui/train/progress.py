"""How far a training is, from the events of its child, and how that is said. Pure: no Qt widgets."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from PySide6.QtCore import QCoreApplication

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
)
from studio.ui.train.run_facts import RunFacts, run_facts
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
                self.notes.append(text)

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
        return _tr("measuring how well it does at each look-ahead: {0} %").format(progress.measuring)
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
        parts.append(_tr("best {0}").format(facts.best))
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
