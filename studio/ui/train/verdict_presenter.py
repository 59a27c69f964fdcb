"""Says how good the shown run is, and measures in a child process what more takes would bring."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QObject

from studio.evaluation.verdict import RunVerdict, curve_text
from studio.ipc.events import ChildEvent, CurveDone, CurveProgressEvent
from studio.ui import messages
from studio.ui.language import native
from studio.ui.session import Session
from studio.ui.tasks import ChildTask
from studio.ui.train.model import TrainModel
from studio.ui.train.verdict_view import VerdictRow


class VerdictPresenter(QObject):
    """Presenter of the verdict row.

    Args:
        view: the row.
        model: which run is shown.
        session: knows the open project.
        child: measures the learning curve; tests give one of their own.
    """

    def __init__(
        self, view: VerdictRow, model: TrainModel, session: Session, child: ChildTask | None = None
    ) -> None:
        super().__init__(view)
        self._view, self._model, self._session = view, model, session
        self._measured: Path | None = None
        self._task = child or ChildTask(self)
        self._task.told.connect(self._on_told)
        self._task.done.connect(self._on_done)
        self._task.failed.connect(lambda error: model.failed.emit(error))
        self._task.ended.connect(self._show_curve)
        view.curve_requested.connect(self._on_requested)
        view.curve_cancelled.connect(self._task.cancel)
        for changed in (model.shown_changed, model.runs_changed, model.data_changed, model.verdicts_changed):
            changed.connect(self._show)
        model.training.changed.connect(self._show)
        session.project_opened.connect(self._on_project)

    def close(self) -> None:
        """The window closes: nothing is measured any more."""
        self._task.close()

    def _show(self) -> None:
        run = self._model.shown_run
        found = self._model.verdict_on(run) if run is not None else RunVerdict()
        if self._model.shows_training:
            nothing = self.tr("The verdict appears here when training has finished.")
        elif run is None:
            nothing = self.tr("Select a run to see its verdict.")
        elif self._model.is_judged(run):
            nothing = self.tr("Nothing was measured of this run. Compare measures it.")
        else:
            nothing = ""
        self._view.show_verdict(RunVerdict() if self._model.shows_training else found, nothing)
        self._show_curve()

    def _show_curve(self) -> None:
        if self._task.running:
            return
        facts, curve = self._model.facts, self._model.curve
        why = self._session.locked_reason
        if not why and (facts is None or not facts.can_train):
            why = self.tr("There is nothing to learn from yet")
        elif not why and not (facts and facts.val.takes + facts.test.takes):
            why = self.tr("Keep a take for validation or test first: it is measured on those")
        elif not why and self._model.training.running:
            why = self.tr("A training is under way")
        self._view.show_curve(not why, why, native(curve_text(curve)) if curve is not None else "")

    def _on_requested(self) -> None:
        project = self._session.project
        if project is not None and not self._task.running:
            self._measured = project.folder
            self._task.start(["curve", str(project.folder)])
            self._view.show_measuring(self.tr("Training on a quarter, a half and all"), 0.0)

    def _on_told(self, event: ChildEvent) -> None:
        if isinstance(event, CurveProgressEvent):
            text = self.tr("Training {0} of {1}").format(event.number, event.of)
            self._view.show_measuring(text, event.fraction)

    def _on_done(self, done: CurveDone) -> None:
        self._model.runs_changed.emit()
        messages.show_note(self._view, done.text)

    def _on_project(self) -> None:
        # What is measured belongs to the project that was left.
        project = self._session.project
        if self._task.running and (project is None or project.folder != self._measured):
            self._task.drop()
        self._show()
