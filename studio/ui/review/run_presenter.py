"""Presenter of the bar over Review's stage: which runs are seen, and the motions they make."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from PySide6.QtCore import QObject

from studio.motion import Motion
from studio.project.run import BASE_VOICE
from studio.training.styles import RunSelection
from studio.ui.generate_task import GenerateTask
from studio.ui.review.model import A, B, ReviewModel
from studio.ui.review.run_view import RunBar
from studio.ui.session import Session


class RunPresenter(QObject):
    """Chooses the runs of the two sides, and has their motions made.

    Args:
        bar: its layout.
        model: what is on the stage.
        session: knows the open project.

    Attributes:
        tasks: what makes the motions of A and of B.
    """

    def __init__(self, bar: RunBar, model: ReviewModel, session: Session) -> None:
        super().__init__(bar)
        self._bar, self._model, self._session = bar, model, session
        self.tasks = GenerateTask(self), GenerateTask(self)
        for side, task in enumerate(self.tasks):
            task.grown.connect(partial(model.set_motion, side, complete=False))
            task.predicted.connect(partial(self._on_predicted, side))
            task.progressed.connect(self._on_progress)
            task.failed.connect(partial(self._on_failed, side))
        bar.chosen.connect(self._on_chosen)
        bar.two_toggled.connect(self._on_two)
        bar.front_requested.connect(self._on_front)
        bar.cancelled.connect(self._on_cancelled)
        model.project_changed.connect(lambda: bar.show_two(False))
        model.items_changed.connect(self._show_runs)
        model.leaving.connect(lambda: self._cancel(A, B))
        model.motions_requested.connect(self._on_requested)

    def close(self) -> None:
        """The window closes."""
        for task in self.tasks:
            task.close()

    def _cancel(self, *sides: int) -> None:
        for side in sides:
            self.tasks[side].cancel()

    def _show_runs(self) -> None:
        """Fill the bar with the runs there are; one that is gone is no longer selected."""
        choices = {choice.id: choice for choice in self._model.runs()}
        for side in self._model.sides:
            known = choices.get(side.selection.run)
            # A run may have been removed, or trained again without the style, since it was chosen.
            if known is None:
                side.selection = RunSelection()
            elif side.selection.style and side.selection.style not in known.styles:
                side.selection = replace(side.selection, style="")
            if known is not None and not {name for name, _ in side.selection.mix} <= set(known.styles):
                side.selection = replace(side.selection, mix=())
        self._bar.show_runs(list(choices.values()), [side.selection for side in self._model.sides])

    def _on_requested(self, sides: tuple[int, ...]) -> None:
        # Cancelled first, so that a side that is asked for anew finds its child free.
        self._cancel(*sides)
        self._request_next()

    def _request_next(self) -> None:
        """Have made what is selected and not there; B after A, since one child fills the machine."""
        model, project = self._model, self._session.project
        sound = model.item.sound if model.item is not None and model.player is not None else None
        if project is None or sound is None:
            return
        for number, task in enumerate(self.tasks[: 2 if model.two else 1]):
            side = model.sides[number]
            if side.selection.run and not side.requested and not any(one.busy for one in self.tasks):
                side.requested = True
                task.request(project, project.run(side.selection.run), sound, model.words(number))

    def _on_chosen(self, side: int, selection: RunSelection) -> None:
        before = self._model.sides[side].selection
        if (before.run, before.style) == (selection.run, selection.style):
            # Only another draw of it.
            selection = replace(selection, mix=before.mix)
        self._model.sides[side].selection = selection
        if side == A:
            self._model.captured_only = not selection.run
        self._model.request_motions(side)

    def _on_two(self, two: bool) -> None:
        self._model.two = two
        if two and not self._model.sides[B].selection.run:
            self._model.sides[B].selection = self._counterpart()
            self._show_runs()
        self._model.request_motions(B)

    def _counterpart(self) -> RunSelection:
        """Something to compare A with: the newest other run, another style of the same, the base voice."""
        choices, first = self._model.runs(), self._model.sides[A].selection
        others = [choice.id for choice in choices if choice.id != first.run]
        if trained := [run for run in others if run != BASE_VOICE]:
            return RunSelection(trained[-1])
        # Without another run a style is the next best thing to compare with; not the one that A shows.
        styles = [
            name for run in choices if run.id == first.run for name in run.styles
            if name != (first.style or run.style)
        ]  # fmt: skip
        if styles:
            return RunSelection(first.run, styles[0])
        return RunSelection(others[0]) if others else RunSelection()

    def _on_front(self, side: int) -> None:
        """Switch between A and B, at once: both are tuned already."""
        if self._model.both_ready and side != self._model.front:
            self._model.front = side
            self._model.motion_changed.emit()

    def _on_progress(self, text: str, fraction: float | None) -> None:
        self._model.set_generating(any(task.busy for task in self.tasks))
        self._bar.show_generating(text, fraction)

    def _on_predicted(self, side: int, motion: Motion) -> None:
        # Before B is asked for, since that may bring its motion at once, from the cache.
        self._model.set_motion(side, motion, complete=True)
        self._request_next()

    def _on_failed(self, side: int, error: BaseException) -> None:
        self._model.discard_motion(side)
        self._model.failed.emit(error)
        self._request_next()

    def _on_cancelled(self) -> None:
        """What takes too long is not waited for: the side shows no run any more."""
        side = A if self.tasks[A].busy else B
        self._cancel(side)
        self._model.sides[side].clear()
        self._model.sides[side].selection = RunSelection()
        self._model.captured_only = self._model.captured_only or side == A
        self._show_runs()
        self._model.discard_motion(side)
        self._request_next()
