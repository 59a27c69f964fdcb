"""What is done of the way from the first take to going live, read from the project's real state."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject

from studio.ui.next_steps_view import STEPS, StepStrip
from studio.ui.session import Session

if TYPE_CHECKING:
    from studio.project import Project

RECORD_SECONDS = 120.0

_WHERE = {
    "record": ("record", "record_button"),
    "check": ("curate", "to_fix_button"),
    "train": ("train", "start_training"),
    "watch": ("review", "play_button"),
    "live": ("live", "live_start"),
}
"""The tab of each step, and the name of what does it there."""


class StepsPresenter(QObject):
    """Presenter of the strip of next steps.

    Args:
        strip: the strip.
        session: whose project is read, and whose settings keep what its files do not tell.
        go: shows a tab and puts the focus on what has this name.
    """

    def __init__(self, strip: StepStrip, session: Session, go: Callable[[str, str], None]) -> None:
        super().__init__(strip)
        self.strip, self._session, self._go = strip, session, go
        strip.step_requested.connect(lambda step: self._go(*_WHERE[step]))
        strip.dismissed.connect(lambda: session.change_settings(next_steps=False))
        for changed in (session.project_opened, session.takes_changed, session.runs_changed):
            changed.connect(self.refresh)
        session.settings_changed.connect(self._on_settings)
        session.step_done.connect(self._keep)
        self.refresh()

    def refresh(self) -> None:
        """Read anew what is done."""
        project = self._session.project
        self.strip.setVisible(project is not None and self._session.settings.next_steps)
        if project is not None:
            done = steps_done(project, self._kept(project))
            seconds = 0.0 if "record" in done else used_seconds(project)
            self.strip.show_recorded(seconds, RECORD_SECONDS)
            self.strip.show_steps(done, next((step for step in STEPS if step not in done), ""))

    def _kept(self, project: Project) -> tuple[str, ...]:
        return tuple(step for step in STEPS if self._session.settings.has_step(step, project.folder))

    def _keep(self, step: str) -> None:
        """Remember a step that the project's files do not tell of."""
        project, settings = self._session.project, self._session.settings
        if project is not None and not settings.has_step(step, project.folder):
            self._session.change_settings(steps_done=settings.with_step(step, project.folder).steps_done)
            self.refresh()

    def _on_settings(self, changed: frozenset[str]) -> None:
        if "next_steps" in changed:
            self.refresh()


def steps_done(project: Project, kept: tuple[str, ...]) -> tuple[str, ...]:
    """The steps that are done in a project, in their order.

    Args:
        project: its takes tell how much there is to learn from, its runs whether anything was learnt.
        kept: steps that were done once, which no file tells of.
    """
    found = set(kept)
    # The best so far is kept from the first epoch on: a training under way is not done.
    if any(run.has_weights and run.status != "running" for run in project.runs):
        found.add("train")
    # Who has trained had enough, however little it was.
    if "train" in found or used_seconds(project) >= RECORD_SECONDS:
        found.add("record")
    return tuple(step for step in STEPS if step in found)


def used_seconds(project: Project) -> float:
    """Seconds of the takes that are used for anything, as they are trimmed."""
    takes = {take.id: take.info.duration for take in project.takes}
    used = (s for s in project.dataset.selections if s.split and s.take in takes)
    return sum(s.seconds(takes[s.take]) for s in used)
