"""The blind vote: chance decides the order, the answer is kept, and only then the names are told."""

from __future__ import annotations

import random
from collections.abc import Callable

from PySide6.QtCore import QObject

from studio.errors import StudioError
from studio.project import Project
from studio.ui import messages
from studio.ui.review import votes
from studio.ui.review.run_bar import RunBar
from studio.ui.review.scene import ReviewScene


class VotePresenter(QObject):
    """The vote's thought.

    Args:
        bar: its buttons.
        scene: what is compared.
        project: gives the open project.
        show: brings the stage up to the scene.
    """

    def __init__(
        self, bar: RunBar, scene: ReviewScene, project: Callable[[], Project | None], show: Callable[[], None]
    ) -> None:
        super().__init__(bar)
        self._bar, self._scene, self._project, self._show = bar, scene, project, show
        self._order = (0, 1)
        bar.vote.vote_requested.connect(self._on_begin)
        bar.vote.voted.connect(self._on_voted)
        bar.vote.cancelled.connect(self.end)

    def end(self) -> None:
        """No vote any more; the names are seen again."""
        if self._scene.blind:
            self._scene.blind = False
            self._bar.end_vote()
            self._show()

    def _on_begin(self) -> None:
        if not self._scene.both_ready:
            return
        self._order = random.SystemRandom().choice(((0, 1), (1, 0)))
        self._scene.blind, self._scene.front = True, self._order[0]
        self._bar.begin_vote(self._order)
        self._show()

    def _on_voted(self, side: int) -> None:
        scene, project = self._scene, self._project()
        if project is None or scene.source is None or not scene.blind:
            return
        a, b = (one.wanted for one in scene.sides)
        better = "" if side < 0 else "ab"[side]
        vote = votes.Vote(a, b, better, scene.source.title, "ab"[self._order[0]])
        try:
            votes.keep(project, vote)
        except StudioError as error:
            messages.show_error(self._bar, error)
        if side >= 0:
            scene.front = side
        self.end()
        self._bar.vote.show_result(self._words(better, votes.tally(votes.kept(project), a, b)))

    def _words(self, better: str, count: votes.Tally) -> str:
        said = {
            "a": self.tr("You chose A."),
            "b": self.tr("You chose B."),
        }.get(better, self.tr("You saw no difference."))
        votes_so_far = self.tr("So far A {0}, B {1}, neither {2}.")
        return f"{said} {votes_so_far.format(count.a, count.b, count.neither)}"
