"""Thought behind the takes of today: heard again with the figure moving, kept, noted, thrown away."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Signal

from studio.dataset import edits
from studio.errors import StudioError
from studio.motion import Motion, Pose
from studio.take.take import Take
from studio.ui import messages, tasks, undo
from studio.ui.record.takes_list import TakeLine, TakesCard
from studio.ui.session import Session
from studio.ui.undo import DatasetUndo

if TYPE_CHECKING:
    from studio.playback.player import Player


TAB = "record"
"""Whose steps of undo these are."""
EVENING = timedelta(hours=8)
"""How long a take stays listed past midnight."""


@dataclass(frozen=True)
class Verdict:
    """A take's grade and the worst thing found in it."""

    grade: str
    reason: str


@dataclass
class TakePlayback:
    """A take that is being played."""

    take: Take
    player: Player
    motion: Motion | None


class TakesPresenter(QObject):
    """Fills the card and does what its buttons say.

    Signals:
        redo_requested: a take was thrown away; record the slate of this take again.
    """

    redo_requested = Signal(object)

    def __init__(self, card: TakesCard, session: Session, parent: QObject) -> None:
        super().__init__(parent)
        self._card = card
        self._session = session
        self._verdicts: dict[Path, Verdict] = {}
        self._asked: set[Path] = set()
        self._hearing: TakePlayback | None = None
        self._wanted = ""
        self.undo_scope = DatasetUndo(session, TAB, self)
        card.play_requested.connect(self.toggle_play)
        card.keep_requested.connect(self._on_keep)
        card.redo_requested.connect(self._on_redo)
        card.note_written.connect(self._on_note)
        card.curate_requested.connect(lambda: session.tab_requested.emit("curate"))
        session.takes_changed.connect(self.refresh)
        session.dataset_changed.connect(self.refresh)

    @property
    def hearing(self) -> TakePlayback | None:
        """What is played now; None once it has ended."""
        if self._hearing is not None and not self._hearing.player.playing:
            self.stop()
        return self._hearing

    def pose_now(self) -> tuple[Motion, Pose] | None:
        """The pose of the take being played."""
        hearing = self.hearing
        if hearing is None or hearing.motion is None or not len(hearing.motion):
            return None
        return hearing.motion, hearing.motion.pose(hearing.player.position)

    def refresh(self) -> None:
        """List today's takes and have new ones checked."""
        takes = self._todays()
        self._card.show_lines([self._line(take) for take in takes])
        if not self._session.rolling:  # a check reads the disk; a recording has it to itself
            for take in takes:
                self._check(take)

    def toggle_play(self, take_id: str) -> None:
        """Play a take, or stop it."""
        playing = self._hearing.take.id if self._hearing else ""
        self.stop()
        if take_id == playing or self._session.project is None or self._session.rolling:
            return
        self._wanted = take_id
        take = self._session.project.take(take_id)
        tasks.run(lambda: _open(take), self._on_opened, self._show_error, owner=self)

    def stop(self) -> None:
        """Stop playing."""
        self._wanted = ""
        if self._hearing is not None:
            hearing, self._hearing = self._hearing, None
            tasks.run(hearing.player.close, lambda _r: None, self._show_error, owner=self)
            self.refresh()

    def _on_opened(self, hearing: TakePlayback) -> None:
        if hearing.take.id != self._wanted:
            tasks.run(hearing.player.close, lambda _r: None, self._show_error, owner=self)
            return
        self._hearing = hearing
        if hearing.player.problem is not None:
            messages.show_error(self._card, hearing.player.problem)
        self.refresh()

    def _todays(self) -> list[Take]:
        project = self._session.project
        if project is None:
            return []
        now = datetime.now().astimezone()
        takes = [take for take in project.takes if of_today(take.info.created, now)]
        return sorted(takes, key=lambda take: take.info.created, reverse=True)

    def _line(self, take: Take) -> TakeLine:
        project = self._session.project
        assert project is not None
        verdict = self._verdicts.get(take.folder, Verdict("", ""))
        selection = next((s for s in project.dataset.selections if s.id == take.id), None)
        seconds = round(take.info.duration)
        return TakeLine(
            take.id,
            f"{seconds // 60}:{seconds % 60:02d}",
            verdict.grade,
            verdict.reason,
            kept=selection is not None and selection.stars > 0,
            note=selection.note if selection else "",
            playing=self._hearing is not None and self._hearing.take.id == take.id,
        )

    def _check(self, take: Take) -> None:
        if take.folder in self._asked:
            return
        self._asked.add(take.folder)

        def done(verdict: Verdict) -> None:
            self._verdicts[take.folder] = verdict
            self.refresh()

        tasks.run(lambda: _judge(take), done, lambda _e: done(Verdict("?", "")), owner=self)

    def _edit(self, name: str, work: Callable[[], None]) -> None:
        try:
            work()
        except StudioError as error:
            messages.show_error(self._card, error)

    def _on_keep(self, take_id: str) -> None:
        project = self._session.project
        if project is None or take_id not in project.dataset:
            return
        kept = project.dataset[take_id].stars > 0
        name = self.tr("Unkeep {0}") if kept else self.tr("Keep {0}")
        changed = edits.set_stars(project.dataset, [take_id], 0 if kept else 3)
        self._edit(take_id, lambda: self._session.edit(name.format(take_id), changed, TAB))

    def _on_note(self, take_id: str, note: str) -> None:
        project = self._session.project
        if project is None or take_id not in project.dataset:
            return
        changed = edits.set_note(project.dataset, take_id, note)
        name = self.tr("Note on {0}").format(take_id)
        self._edit(take_id, lambda: self._session.edit(name, changed, TAB))

    def _on_redo(self, take_id: str) -> None:
        project = self._session.project
        if project is None or self._session.rolling:
            return
        take = project.take(take_id)
        self.stop()
        try:
            self._session.remove_take(take_id, TAB)
        except StudioError as error:
            messages.show_error(self._card, error)
            return
        undo.tell_change(self._card, self.undo_scope, self.tr("{0} is in the trash.").format(take_id))
        self.redo_requested.emit(take)

    def _show_error(self, error: BaseException) -> None:
        messages.show_error(self._card, error)


def of_today(created: str, now: datetime) -> bool:
    """Whether a take was made today; who records past midnight still has the takes of that evening.

    Args:
        created: as the take has it, ISO 8601. now: with its time zone.
    """
    try:
        made = datetime.fromisoformat(created).astimezone(now.tzinfo)
    except ValueError:
        return False
    return made.date() == now.date() or now - made < EVENING


def _open(take: Take) -> TakePlayback:
    """Everything needed to play a take, already playing. Runs on a pool thread."""
    from studio.playback.player import Player
    from studio.take.motion_file import load_motion

    motion = load_motion(take)
    player = Player(take.audio_path, take.info.duration or None)
    player.play()
    return TakePlayback(take, player, motion)


def _judge(take: Take) -> Verdict:
    """The take's check in two words. Runs on a pool thread."""
    from studio.take.check import check_take

    report = check_take(take)
    return Verdict(report.grade, report.reason if report.findings else "")
