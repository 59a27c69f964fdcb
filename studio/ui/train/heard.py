"""What the training child has said so far. Pure: no Qt widgets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from studio.ui.train.run_facts import RunFacts, run_facts


@dataclass
class Heard:
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

    events: list[dict[str, Any]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    cleaning: tuple[str, int] | None = None
    listening: tuple[str, int, int] | None = None
    step: dict[str, Any] | None = None
    measuring: int | None = None
    smaller: str = ""

    def take(self, event: dict[str, Any]) -> None:
        """Remember an event."""
        kind = event.get("event")
        if kind == "epoch":
            self.events.append(event)
            self.step = None
        elif kind == "step":
            self.step = event
        elif kind == "cleaning":
            self.cleaning = str(event.get("take")), round(100 * float(event.get("fraction") or 0.0))
        elif kind == "look_aheads":
            self.measuring = round(100 * float(event.get("fraction") or 0.0))
        elif kind == "listening":
            self.cleaning = None
            self.listening = str(event.get("take")), int(event.get("number") or 0), int(event.get("of") or 0)
        elif kind == "started":
            self.cleaning = self.listening = None
        elif kind == "out_of_memory":
            self.smaller = str(event.get("setting") or "")
        elif event.get("text"):
            self.notes.append(str(event["text"]))

    @property
    def facts(self) -> RunFacts:
        """The run at a glance."""
        return run_facts(self.events)

    @property
    def fraction(self) -> float:
        """How much is done, 0..1, of listening to the takes, then of the epochs; -1 where nobody can tell."""
        done, of = self.facts.epochs, self.facts.of or (self.step or {}).get("of")
        if not of and self.listening is not None and self.listening[2] > 1:
            return (self.listening[1] - 1) / self.listening[2]
        if not of:
            return -1.0
        return min(1.0, (done + self._part) / float(of))

    @property
    def eta(self) -> float | None:
        """Seconds left, by what came last."""
        if self.step is not None and isinstance(self.step.get("eta_s"), int | float):
            return float(self.step["eta_s"])
        return self.facts.eta

    @property
    def _part(self) -> float:
        step, steps = ((self.step or {}).get(key) for key in ("step", "steps"))
        return float(step) / float(steps) if step and steps else 0.0


def smaller_again(words: Sequence[str], run: str, smaller: str) -> list[str]:
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
