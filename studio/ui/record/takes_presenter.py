"""Presenter of the takes of today: heard again, kept, noted, thrown away."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path

from PySide6.QtCore import QObject

from studio.capture.health import losses
from studio.dataset import edits
from studio.errors import StudioError
from studio.take.take import Take
from studio.ui import messages, tasks, undo
from studio.ui.record.model import TAB, RecordModel, SavedTake
from studio.ui.record.takes_view import TakeLine, TakesCard
from studio.ui.session import Session

EVENING = timedelta(hours=8)
"""How long a take stays listed past midnight."""


@dataclass(frozen=True)
class Verdict:
    """A take's grade and the worst thing found in it."""

    grade: str
    reason: str


class TakesPresenter(QObject):
    """Fills the card, does what its buttons request, and tells of takes that were saved."""

    def __init__(self, card: TakesCard, model: RecordModel, session: Session) -> None:
        super().__init__(card)
        self._card, self._model, self._session = card, model, session
        # By folder and not by id: another project has takes of the same names.
        self._verdicts: dict[Path, Verdict] = {}
        self._checking: set[Path] = set()
        card.play_requested.connect(model.player.toggle)
        card.keep_requested.connect(self._on_keep)
        card.redo_requested.connect(self._on_redo)
        card.note_written.connect(self._on_note)
        card.curate_requested.connect(lambda: session.tab_requested.emit("curate"))
        model.player.changed.connect(self.refresh)
        model.saved.connect(self._on_saved)
        model.cut_off.connect(lambda cut: messages.show_failure(card, cut.what, cut.remedy))
        model.recovered.connect(self._on_recovered)
        session.project_opened.connect(self.refresh)
        session.takes_changed.connect(self.refresh)
        session.dataset_changed.connect(self.refresh)
        self.refresh()

    def refresh(self) -> None:
        """List today's takes and have new ones checked."""
        takes = self._todays()
        self._card.show_lines([self._line(take) for take in takes])
        if not self._session.rolling:  # a check reads the disk; a recording has it to itself
            for take in takes:
                self._check(take)

    # -- what happened ---------------------------------------------------------------------------

    def _on_saved(self, saved: SavedTake) -> None:
        take, cut = saved.take, saved.cut
        if take.info.duration > 0:
            self._show_saved(take, saved.moved_ms)
        if cut is not None:  # in the place of the note: this is what has to be read
            messages.show_failure(self._card, cut.what, cut.remedy)

    def _show_saved(self, take: Take, moved_ms: float) -> None:
        play = (self.tr("Play"), lambda: self._model.player.toggle(take.id))
        seconds = f"{take.info.duration:.1f}"
        if not take.info.frames:
            text = self.tr("{0} is saved with sound alone: {1} s.").format(take.id, seconds)
            remedy = self.tr(
                "No motion came in. Start the motion sender or the practice performer and redo it."
            )
            messages.show_warning(self._card, text, remedy, play)
            return
        details = list(losses(take.info))
        if moved_ms:
            moved = self.tr("Its motion is moved by {0} ms, as the sync test found.")
            details.insert(0, moved.format(f"{moved_ms:+.0f}"))
        text = self.tr("{0} is saved: {1} s.").format(take.id, seconds)
        messages.show_note(self._card, text, " ".join(details), play)

    def _on_recovered(self, takes: tuple[Take, ...], failed: tuple[tuple[str, StudioError], ...]) -> None:
        if takes:
            names = ", ".join(f"{take.id} ({take.info.duration:.0f} s)" for take in takes)
            text = self.tr("A recording that was cut short was recovered: {0}.").format(names)
            damage = " ".join(take.info.extra.get("damage", "") for take in takes).strip()
            show = messages.show_warning if damage else messages.show_note
            show(self._card, text, damage or self.tr("It is among your takes."))
        for name, error in failed[:1]:  # one message at a time: the next opening tells of the rest
            text = self.tr("{0} was not recovered. {1}").format(name, error.what)
            messages.show_failure(self._card, text, error.remedy)

    # -- the list --------------------------------------------------------------------------------

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
            playing=self._model.player.take_id == take.id,
        )

    def _check(self, take: Take) -> None:
        if take.folder in self._checking:
            return
        self._checking.add(take.folder)

        def done(verdict: Verdict) -> None:
            self._verdicts[take.folder] = verdict
            self.refresh()

        tasks.run(lambda: _judge(take), done, lambda _e: done(Verdict("?", "")), owner=self)

    # -- what its buttons do ---------------------------------------------------------------------

    def _edit(self, work: Callable[[], None]) -> None:
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
        self._edit(lambda: self._session.edit(name.format(take_id), changed, TAB))

    def _on_note(self, take_id: str, note: str) -> None:
        project = self._session.project
        if project is None or take_id not in project.dataset:
            return
        changed = edits.set_note(project.dataset, take_id, note)
        name = self.tr("Note on {0}").format(take_id)
        self._edit(lambda: self._session.edit(name, changed, TAB))

    def _on_redo(self, take_id: str) -> None:
        project = self._session.project
        if project is None or self._session.rolling:
            return
        take = project.take(take_id)
        self._model.player.stop()
        try:
            self._session.remove_take(take_id, TAB)
        except StudioError as error:
            messages.show_error(self._card, error)
            return
        undo.tell_change(self._card, self._model.undo_scope, self.tr("{0} is in the trash.").format(take_id))
        self._model.record_again(take)


def of_today(created: str, now: datetime) -> bool:
    """Whether a take was made today; who records past midnight still has the takes of that evening.

    Args:
        created: as the take has it, ISO 8601. now: with its time zone.
    """
    try:
        created_at = datetime.fromisoformat(created).astimezone(now.tzinfo)
    except ValueError:
        return False
    return created_at.date() == now.date() or now - created_at < EVENING


def _judge(take: Take) -> Verdict:
    """What the check of a take comes to. Runs on a pool thread."""
    from studio.take.check import check_take

    report = check_take(take)
    return Verdict(report.grade, report.reason if report.findings else "")
