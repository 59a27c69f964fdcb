"""Measures runs side by side in a child process, and shows what it found."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import QObject
from PySide6.QtWidgets import QWidget

from studio.ipc.events import (
    BaselinesEvent,
    ChildEvent,
    CompareDone,
    MeasuredEvent,
    MeasureProgressEvent,
    NoteEvent,
)
from studio.project import Project
from studio.ui.tasks import Job
from studio.ui.train.compare_dialog import CompareDialog, Points
from studio.ui.train.compare_facts import Comparison, compared
from studio.ui.train.run_facts import curves, epochs_of


class ComparePresenter(QObject):
    """One comparison at a time, in a window of its own.

    Args:
        parent: the tab it belongs to.
    """

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self._parent = parent
        self._job: Job | None = None
        self._notes: list[str] = []
        self._measured = 0
        self.dialog: CompareDialog | None = None

    def open(self, project: Project, runs: Sequence[str]) -> None:
        """Compare some runs."""
        if self.dialog is not None:
            self.dialog.close()
        dialog = self.dialog = CompareDialog(runs, self._parent)
        dialog.ground_chosen.connect(lambda split: self._measure(project, runs, split))
        dialog.finished.connect(lambda _: self._on_closed(dialog))
        dialog.show_curves(_points(project, runs, "rmse"), _points(project, runs, "motion_ratio"))
        dialog.show()
        self._measure(project, runs, "test")

    def close(self) -> None:
        """The window closes: nothing is measured any more."""
        if self._job is not None:
            self._job.close()
        if self.dialog is not None:
            self.dialog.close()

    def _on_closed(self, dialog: CompareDialog) -> None:
        if dialog is self.dialog:
            self.dialog = None
            self._end_job()

    def _end_job(self) -> None:
        job, self._job = self._job, None
        if job is None:
            return
        if job.running:
            job.ended.connect(job.deleteLater)
            job.cancel()  # a window that is used must not wait for a child to end
        else:
            job.deleteLater()

    def _measure(self, project: Project, runs: Sequence[str], split: str) -> None:
        self._end_job()
        self._notes, self._measured = [], 0
        job = self._job = Job(self)
        job.told.connect(lambda event: self._on_event(job, event))
        job.done.connect(lambda done: self._on_done(job, done))
        job.failed.connect(lambda what, remedy: self._on_failed(job, f"{what} {remedy}"))
        job.start(["compare", str(project.folder), *runs, "--split", split])
        if self.dialog is not None:
            self.dialog.show_busy(0, self.tr("The runs listen to takes that they have not learnt from."))

    def _on_event(self, job: Job, event: ChildEvent) -> None:
        if job is not self._job or self.dialog is None:
            return
        match event:
            case MeasuredEvent():
                self._measured += 1
                self.dialog.show_busy(self._measured, self.tr("{0} is measured.").format(event.run))
            case MeasureProgressEvent():
                words = self.tr("{0} listens to {1}, take {2} of {3}.")
                told = words.format(event.run, event.take, event.done + 1, event.of)
                self.dialog.show_busy(self._measured + event.fraction, told)
            case BaselinesEvent():
                told = self.tr("The simple guesses to beat are made: {0} %.")
                self.dialog.show_busy(self._measured, told.format(round(100 * event.fraction)))
            case NoteEvent(text=str(text)) if text:
                self._notes.append(text)

    def _on_done(self, job: Job, done: CompareDone) -> None:
        if job is self._job and self.dialog is not None:
            found = compared(done)
            self.dialog.show_compared(found, self._told(found))

    def _on_failed(self, job: Job, sentence: str) -> None:
        if job is self._job and self.dialog is not None:
            self.dialog.show_failure(sentence)

    def _told(self, found: Comparison) -> str:
        takes = ", ".join(found.ground[:4]) + ("…" if len(found.ground) > 4 else "")
        words = [takes, self.tr("✓ nearest to the captured motion, whose value is the tick on each bar")]
        return "   ".join([*words, *self._notes])


def _points(project: Project, runs: Sequence[str], metric: str) -> Points:
    return {run: curves(epochs_of(project.run(run))).get(metric, []) for run in runs}
