"""Shows a run's curves, figures and preview: of the training under way, or of one in the list."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import QObject

from studio.ipc.events import EpochEvent
from studio.project import Run
from studio.ui.train import words
from studio.ui.train.heard import TrainingProgress
from studio.ui.train.previewing import PreviewPresenter
from studio.ui.train.run_facts import RunFacts, curves, epochs_of, run_facts
from studio.ui.train.view import TrainView


class ProgressPresenter(QObject):
    """Fills the progress card."""

    def __init__(self, view: TrainView) -> None:
        super().__init__(view)
        self._card = view.progress
        self._previewing = PreviewPresenter(view.progress.preview)

    def show_training(
        self, run_id: str, heard: TrainingProgress, folder: Path | None, stopping: bool
    ) -> None:
        """The training under way.

        Args:
            run_id: of its run, "" before it has one.
            heard: what it has said so far.
            folder: of its run, None before it has one.
            stopping: it was asked to end.
        """
        facts = heard.facts
        line = words.of_training(heard, stopping)
        self._card.show_progress(run_id or self.tr("Preparing"), line, heard.fraction)
        self._show(facts, heard.events, facts.advice)
        self._previewing.follow(folder, live=True)

    def show_run(self, run: Run | None) -> None:
        """A run of the list; None where none is chosen."""
        self._previewing.follow(run.folder if run is not None else None, live=False)
        if run is None:
            self._card.show_progress("", "", None)
            self._card.show_curves({}, None)
            self._card.show_alarm("")
            return
        events = epochs_of(run)
        facts = run_facts(events)
        still = self.tr("This model hardly moves. Train longer, take another preset, or add takes.")
        self._card.show_progress(run.id, words.of_run(facts), None)
        self._show(facts, events, still if facts.life == "still" else "")

    def _show(self, facts: RunFacts, events: Sequence[EpochEvent], alarm: str) -> None:
        self._card.show_curves(curves(events), facts.best)
        self._card.show_alarm(alarm)
