"""Measures runs side by side in a child process, and shows what it found."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import QObject

from studio.errors import StudioError
from studio.ipc.events import (
    BaselinesEvent,
    ChildEvent,
    CompareDone,
    MeasuredEvent,
    MeasureProgressEvent,
    NoteEvent,
)
from studio.project import Project
from studio.ui.language import native, sentences
from studio.ui.session import Session
from studio.ui.tasks import ChildTask
from studio.ui.train.compare_view import CompareDialog, Comparison, Points, compared
from studio.ui.train.model import TrainModel
from studio.ui.train.run_facts import curves, epochs_of
from studio.ui.train.runs_view import RunsCard


class ComparePresenter(QObject):
    """Presenter of Compare: one comparison at a time, in a window of its own."""

    def __init__(self, view: RunsCard, model: TrainModel, session: Session) -> None:
        super().__init__(view)
        self._view, self._model, self._session = view, model, session
        self._notes: list[str] = []
        self._measured = 0
        self.dialog: CompareDialog | None = None
        """The comparison that is open."""
        self._task = ChildTask(self)
        self._task.told.connect(self._on_event)
        self._task.done.connect(self._on_done)
        self._task.failed.connect(self._on_failed)
        view.compare_requested.connect(self._on_compare)

    def close(self) -> None:
        """The window closes: nothing is measured any more."""
        self._task.close()
        if self.dialog is not None:
            self.dialog.close()

    def _on_compare(self, runs: tuple[str, ...]) -> None:
        project = self._session.project
        if project is None or not runs:
            return
        if self.dialog is not None:
            self.dialog.close()
        dialog = self.dialog = CompareDialog(runs, self._view)
        dialog.split_chosen.connect(lambda split: self._measure(project, runs, split))
        dialog.finished.connect(lambda _: self._on_closed(dialog))
        dialog.show_curves(_points(project, runs, "error"), _points(project, runs, "motion_ratio"))
        dialog.show()
        self._measure(project, runs, "test")

    def _on_closed(self, dialog: CompareDialog) -> None:
        if dialog is self.dialog:
            self.dialog = None
            self._task.drop()  # in the background: a window that is used must not wait for a child to end

    def _measure(self, project: Project, runs: Sequence[str], split: str) -> None:
        self._notes, self._measured = [], 0
        # In place of a measuring on the other split, which ends unheard.
        self._task.start(["compare", str(project.folder), *runs, "--split", split])
        if self.dialog is not None:
            self.dialog.show_busy(0, self.tr("Testing the runs on takes they have not seen…"))

    def _on_event(self, event: ChildEvent) -> None:
        if self.dialog is None:
            return
        match event:
            case MeasuredEvent():
                self._measured += 1
                self.dialog.show_busy(self._measured, self.tr("{0} is measured.").format(event.run))
            case MeasureProgressEvent():
                text = self.tr("{0} listens to {1}, take {2} of {3}.")
                text = text.format(event.run, event.take, event.done + 1, event.of)
                self.dialog.show_busy(self._measured + event.fraction, text)
            case BaselinesEvent():
                text = self.tr("The simple guesses to beat are made: {0} %.")
                self.dialog.show_busy(self._measured, text.format(round(100 * event.fraction)))
            case NoteEvent(text=str(text)) if text:
                self._notes.append(native(text))

    def _on_done(self, done: CompareDone) -> None:
        if self.dialog is not None:
            found = compared(done)
            self.dialog.show_compared(found, self._note(found))

    def _on_failed(self, error: StudioError) -> None:
        if self.dialog is not None:
            self.dialog.show_failure(sentences(error.what, error.remedy))

    def _note(self, found: Comparison) -> str:
        takes = ", ".join(found.takes[:4]) + ("…" if len(found.takes) > 4 else "")
        legend = self.tr("✓ closest to the captured motion, which the line on each bar shows")
        return "   ".join([takes, legend, *self._notes])


def _points(project: Project, runs: Sequence[str], metric: str) -> Points:
    return {run: curves(epochs_of(project.run(run))).get(metric, []) for run in runs}
