"""Presenter of "Move like this": the run in A is shown a style by some seconds of the take on the stage."""

from __future__ import annotations

from dataclasses import replace

from PySide6.QtCore import QObject

from studio.ipc.events import ChildEvent, DoneEvent, ProgressEvent, StyleDone
from studio.project.run import BASE_VOICE
from studio.ui.review.model import A, ReviewModel
from studio.ui.review.run_view import RunBar
from studio.ui.session import Session
from studio.ui.tasks import ChildTask

SECONDS = 10.0
"""Taken around the playhead where nothing is selected."""


class StylePresenter(QObject):
    """Has a style fitted in a child process, then chooses it.

    Args:
        bar: its layout.
        model: what is on the stage.
        session: knows the open project.
        child: runs the command; one of its own where None.
    """

    def __init__(
        self, bar: RunBar, model: ReviewModel, session: Session, child: ChildTask | None = None
    ) -> None:
        super().__init__(bar)
        self._bar, self._model, self._session = bar, model, session
        self._child = child or ChildTask(self)
        self._child.told.connect(self._on_event)
        self._child.done.connect(self._on_done)
        self._child.failed.connect(model.failed)
        self._child.ended.connect(self._on_ended)
        bar.style_requested.connect(self._on_requested)
        bar.style_progress.cancelled.connect(self._child.cancel)
        model.project_changed.connect(self._on_project)
        for changed in (model.item_changed, model.items_changed, model.loaded, model.pairing_changed):
            changed.connect(self._show_choice)

    def close(self) -> None:
        """The window closes."""
        self._child.close()

    @property
    def span(self) -> tuple[float, float]:
        """What shows the style: the selected stretch, or what is used around the playhead, seconds."""
        model = self._model
        if model.span is not None:
            return model.span
        start, end = model.used
        position = model.player.position if model.player is not None else start
        # Whole where it can be: at either end of the take as much comes from the other side.
        first = max(min(position - SECONDS / 2, end - SECONDS), start)
        return first, min(first + SECONDS, end)

    def _show_choice(self) -> None:
        model = self._model
        take = model.item.take if model.item is not None else None
        captured = take is not None and model.captured.motion is not None
        possible = captured and model.sides[A].selection.run not in ("", BASE_VOICE)
        self._bar.show_style_choice(possible)
        self._bar.move_like_this.setEnabled(not self._child.running)

    def _on_requested(self) -> None:
        item, project = self._model.item, self._session.project
        if item is None or item.take is None or project is None:
            return
        name = item.selection.id if item.selection is not None else item.take.id
        start, end = self.span
        run = self._model.sides[A].selection.run
        between = ["--from", f"{start:.3f}", "--to", f"{end:.3f}"]
        self._child.start(["style", str(project.folder), run, name, *between])
        text = self.tr("{0} looks at {1}").format(run, item.title)
        self._bar.style_progress.show_progress(text, -1.0)
        self._show_choice()

    def _on_event(self, event: ChildEvent) -> None:
        if isinstance(event, ProgressEvent):
            percent = self.tr("{0} %").format(round(100 * event.fraction))
            self._bar.style_progress.show_progress(percent, event.fraction)

    def _on_done(self, done: DoneEvent) -> None:
        assert isinstance(done, StyleDone)
        side = self._model.sides[A]
        # Another run may have been chosen meanwhile.
        chosen = side.selection.run == done.run
        if chosen:
            side.selection = replace(side.selection, style=done.style)
        # The lists of styles are read anew everywhere, and show what is selected now.
        self._session.runs_changed.emit()
        if chosen:
            self._model.request_motions(A)

    def _on_ended(self) -> None:
        self._bar.style_progress.show_progress("", None)
        self._show_choice()

    def _on_project(self) -> None:
        self._child.drop()
        self._on_ended()
