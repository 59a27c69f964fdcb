"""What is said of a training under way, and of one that is over. Pure: no widgets."""

from __future__ import annotations

from PySide6.QtCore import QCoreApplication

from studio.ui.train.heard import TrainingProgress
from studio.ui.train.run_facts import RunFacts
from studio.ui.widgets.timeline.time_view import minutes


def in_strip(heard: TrainingProgress) -> str:
    """A training as a fact of the status strip."""
    facts = heard.facts
    if not facts.of:
        return _tr("Training: preparing")
    return _tr("Training {0} of {1}").format(facts.epochs, facts.of)


def of_training(heard: TrainingProgress, stopping: bool = False) -> str:
    """What a training does right now: before its first epoch, in its midst, or after the last.

    Args:
        heard: what it has said so far.
        stopping: it was asked to end, so that what was left means nothing.
    """
    if heard.measuring is not None:
        return _tr("measuring how well it does at each look-ahead: {0} %").format(heard.measuring)
    if not heard.facts.epochs and heard.step is None:
        return _preparing(heard)
    step = heard.step
    if step is None:
        return of_run(heard.facts, heard.eta if not stopping else None)
    of = _tr("epoch {0} of {1}, step {2} of {3}")
    first = of.format(step.epoch, step.of, step.step, step.steps)
    return _joined(first, heard.facts, heard.eta if not stopping else None)


def of_run(facts: RunFacts, eta: float | None = None) -> str:
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


def _preparing(heard: TrainingProgress) -> str:
    """What is done before the first epoch."""
    if heard.cleaning is not None:
        return _tr("cleaning the sound of {0}: {1} %").format(*heard.cleaning)
    if heard.listening is not None:
        return _tr("listening to {0}, take {1} of {2}; kept for the next training").format(*heard.listening)
    return _tr("reading the takes; the first epoch follows")


def _tr(text: str) -> str:
    return QCoreApplication.translate("TrainPresenter", text)
