"""What the training child has said so far. Pure: no Qt widgets."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

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


@dataclass
class TrainingProgress:
    """Events of one training, as they come.

    Args:
        events: epochs, those of earlier sittings of a resumed run first.
        notes: sentences worth keeping in the log.
        cleaning: (take, percent) while cleaned sound is made.
        listening: (take, number, of) while the sounds of the takes are worked out.
        step: the newest step of the epoch under way, None where it is over.
        measuring: percent of what is measured after the last epoch.
        smaller: after memory ran out, the setting that may fit.
    """

    events: list[EpochEvent] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    cleaning: tuple[str, int] | None = None
    listening: tuple[str, int, int] | None = None
    step: StepEvent | None = None
    measuring: int | None = None
    smaller: str = ""

    def take(self, event: ChildEvent) -> None:
        """Remember an event."""
        match event:
            case EpochEvent():
                self.events.append(event)
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
        return run_facts(self.events)

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


def smaller_batch_note(words: Sequence[str], run: str, smaller: str) -> list[str]:
    """The command that goes on with a smaller batch.

    Args:
        words: the command whose memory ran out.
        run: the run it had begun, "" for none.
        smaller: the setting that may fit.
    """
    kept, resumed = list(words), "--resume" in words
    if run and not resumed:
        # The run's own folder knows the recipe and what was changed of it.
        kept = [words[0], words[1], "--resume", run]
    return [*kept, "--set", smaller]
