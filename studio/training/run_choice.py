"""Which run is to make a motion, and in what manner: run, style, seed and liveliness (no torch)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from studio.files.atomic import safe_name
from studio.project import Run
from studio.training.styles import AVERAGE

DRAWING_FORMS = frozenset({"mixture"})
"""Forms of recipes whose networks draw their motion, for runs that do not say whether they draw."""


@dataclass(frozen=True)
class RunSelection:
    """What is to make the motion.

    Args:
        run: the run's id, "" for no run.
        style: one that it knows, "" for the one chosen on validation.
        seed: which of the takes that a run draws, for runs that draw.
        liveliness: how far drawn motion goes from what is expected: 0 not at all, 1 as it was learnt.
    """

    run: str = ""
    style: str = ""
    seed: int = 0
    liveliness: float = 1.0

    @property
    def words(self) -> tuple[str, ...]:
        """What `saia generate` is told besides the run and the sound."""
        style = (f"--style={self.style}",) if self.style else ()
        lively = (f"--liveliness={self.liveliness:g}",) if self.liveliness != 1.0 else ()
        return (*style, *lively, f"--seed={self.seed}") if self.seed else (*style, *lively)

    @property
    def title(self) -> str:
        """What people call it."""
        more = self._more()
        return f"{self.run} ({', '.join(more)})" if more else self.run

    @property
    def name(self) -> str:
        """Part of a file's name."""
        more = self._more()
        return safe_name("_".join([self.run, *more])) if more else self.run

    def _more(self) -> list[str]:
        """What it differs in from what the run does unasked."""
        more = [self.style] if self.style else []
        more += [f"x{self.liveliness:g}"] if self.liveliness != 1.0 else []
        return more + ([str(self.seed + 1)] if self.seed else [])


@dataclass(frozen=True)
class RunChoice:
    """A run that can generate.

    Args:
        id: its id.
        styles: what it can be asked for, "average" among them; empty where it learnt none.
        style: the one used unless another is asked for.
        draws: the same sound gives another motion with another seed.
    """

    id: str
    styles: tuple[str, ...] = ()
    style: str = ""
    draws: bool = False


def newest(runs: Sequence[Run]) -> Run:
    """The run trained last, so that a person sees what it learnt without looking for it."""
    return max(runs, key=lambda run: (run.folder.stat().st_mtime, run.id))


def run_choice(run: Run) -> RunChoice:
    """A run with the styles that its report names."""
    report = run.facts
    draws = report.form in DRAWING_FORMS if report.draws is None else report.draws
    if not report.styles:
        return RunChoice(run.id, draws=draws)
    return RunChoice(run.id, (AVERAGE, *report.styles), report.style or AVERAGE, draws)
