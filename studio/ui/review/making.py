"""The motions on Review's stage: asked of one run or two, tuned, and switched between."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from PySide6.QtCore import QObject, QTimer, Signal

from studio.motion import Motion
from studio.playback.layers import Tuning
from studio.training.styles import RunSelection
from studio.ui import messages, tasks
from studio.ui.review import clip
from studio.ui.review.clip import Tuned
from studio.ui.review.listing import ReviewList
from studio.ui.review.predicting import GenerateTask
from studio.ui.review.scene import A, B, ReviewScene
from studio.ui.review.view import ReviewView
from studio.ui.session import Session

TUNE_MS = 120

Result = tuple[Tuned | None, list[Tuned | None]]


class GenerationPresenter(QObject):
    """Keeps the scene's motions what its sides want and its sliders say.

    Signals:
        changed: the scene's motions are others now.
        spoilt: what A or B is has changed, so that a comparison under way means nothing any more.

    Attributes:
        captured_only: "no run" is a choice, not only where nothing was chosen.
    """

    changed = Signal()
    spoilt = Signal()

    def __init__(self, view: ReviewView, scene: ReviewScene, listing: ReviewList, session: Session) -> None:
        super().__init__(view)
        self._view, self._scene, self._listing, self._session = view, scene, listing, session
        self.captured_only = False
        self._turn = 0  # what was tuned for another stage is dropped
        self._tuning = self._again = False
        self._calm: tuple[Motion, Tuning, Tuned] | None = None  # the captured motion, tuned before
        self._timer = QTimer(self)
        self._timer.setSingleShot(True)
        self._timer.setInterval(TUNE_MS)
        self._timer.timeout.connect(self.tune)
        self._children = (GenerateTask(self), GenerateTask(self))
        for side, child in enumerate(self._children):
            child.grown.connect(partial(self._on_grown, side))
            child.predicted.connect(partial(self._on_predicted, side))
            child.progressed.connect(view.bar.show_generating)
            child.failed.connect(partial(self._on_failed, side))
        view.tune.tuning_changed.connect(lambda _: self._timer.start())
        view.bar.chosen.connect(self._on_chosen)
        view.bar.two_toggled.connect(self._on_two)
        view.bar.front_requested.connect(self._on_front)
        view.bar.cancelled.connect(self._on_cancelled)

    @property
    def busy(self) -> bool:
        """Whether a child process is making motion."""
        return any(child.busy for child in self._children)

    def forget(self) -> None:
        """The sound goes from the stage: make nothing of it any more."""
        self._turn += 1
        self._calm = None
        for child in self._children:
            child.cancel()

    def close(self) -> None:
        """The window closes."""
        self._timer.stop()
        for child in self._children:
            child.close()

    def show_runs(self) -> None:
        """Fill the bar with the runs there are; what is gone is wanted no more."""
        choices = {choice.id: choice for choice in self._listing.runs()}
        for side in self._scene.sides:
            known = choices.get(side.wanted.run)
            if known is None:
                side.wanted = RunSelection()
            elif side.wanted.style and side.wanted.style not in known.styles:
                side.wanted = replace(side.wanted, style="")
        self._view.bar.show_runs(list(choices.values()), [side.wanted for side in self._scene.sides])

    def ask(self, *sides: int) -> None:
        """Make the motions of some sides anew, and meanwhile show what there is."""
        self.spoilt.emit()
        self._turn += 1
        self._scene.front = A
        for side in sides:
            self._scene.sides[side].clear()
            self._children[side].cancel()
        self._next()
        self.tune()

    def tune(self) -> None:
        """Lay the sliders over all motions, and compare them with the captured one.

        One after another: what is wished for meanwhile is done once more afterwards, so that a motion that
        grows, and a slider that is drawn along, are seen on their way.
        """
        if self._tuning:
            self._again = True
            return
        self._tuning, self._again = True, False
        turn, tuning, scene = self._turn, self._view.tune.tuning, self._scene
        truth = scene.captured.motion
        wanted = [(side.motion, truth if side.whole else None) for side in scene.sides]
        calm = self._calm if self._calm and self._calm[0] is truth and self._calm[1] == tuning else None

        def work() -> Result:
            mine = calm[2] if calm else clip.tune(truth, None, tuning) if truth is not None else None
            return mine, [clip.tune(one, other, tuning) if one is not None else None for one, other in wanted]

        def show(result: Result) -> None:
            self._tuning = False
            if turn == self._turn:
                scene.calm = result[0]
                self._calm = (truth, tuning, result[0]) if truth is not None and result[0] else None
                for side, tuned in zip(scene.sides, result[1], strict=True):
                    side.tuned = tuned
                self.changed.emit()
            if self._again:
                self.tune()

        def failed(error: BaseException) -> None:
            self._tuning = False
            messages.show_error(self._view, error)
            if self._again:
                self.tune()

        tasks.run(work, show, failed, owner=self)

    def _next(self) -> None:
        """Ask for what is wanted and not there; B after A, since one child fills the machine."""
        scene, project = self._scene, self._session.project
        sound = scene.source.sound if scene.source is not None and scene.player is not None else None
        if project is None or sound is None:
            return
        for side, child in zip(scene.sides[: 2 if scene.two else 1], self._children, strict=False):
            if side.wanted.run and not side.asked and not self.busy:
                side.asked = True
                child.request(project, project.run(side.wanted.run), sound, side.wanted.words)

    def _on_chosen(self, side: int, wanted: RunSelection) -> None:
        self._scene.sides[side].wanted = wanted
        if side == A:
            self.captured_only = not wanted.run
        self.ask(side)

    def _on_two(self, two: bool) -> None:
        scene = self._scene
        scene.two = two
        if two and not scene.sides[B].wanted.run:
            scene.sides[B].wanted = self._another()
            self.show_runs()
        self.ask(B)

    def _another(self) -> RunSelection:
        """Something to hold beside A: the newest other run, else another style of the same."""
        choices, first = self._listing.runs(), self._scene.sides[A].wanted
        others = [choice for choice in choices if choice.id != first.run]
        if others:
            return RunSelection(others[-1].id)
        styles = [
            name for run in choices if run.id == first.run for name in run.styles
            if name != (first.style or run.style)
        ]  # fmt: skip
        return RunSelection(first.run, styles[0]) if styles else RunSelection()

    def _on_front(self, side: int) -> None:
        """Switch between A and B, at once."""
        if self._scene.both_ready and side != self._scene.front:
            self._scene.front = side
            self.changed.emit()

    def _on_grown(self, side: int, motion: Motion) -> None:
        """The beginning is there: it can be seen, and played."""
        self._scene.sides[side].motion = motion
        self.tune()

    def _on_predicted(self, side: int, motion: Motion) -> None:
        self._scene.sides[side].motion = motion
        self._scene.sides[side].whole = True
        self._next()
        self.tune()

    def _on_failed(self, side: int, error: BaseException) -> None:
        self._turn += 1
        self._scene.sides[side].motion = self._scene.sides[side].tuned = None
        messages.show_error(self._view, error)
        self._next()
        self.tune()

    def _on_cancelled(self) -> None:
        side = A if self._children[A].busy else B
        self._children[side].cancel()
        self._turn += 1
        self._scene.sides[side].clear()
        self._scene.sides[side].wanted = RunSelection()
        self.captured_only = self.captured_only or side == A
        self.show_runs()
        self._next()
        self.tune()
