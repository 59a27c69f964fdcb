"""Presenter of the takes of today: heard again, kept, noted, thrown away."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject

from studio.capture.health import losses
from studio.dataset import edits
from studio.errors import StudioError, say
from studio.settings import NO_MICROPHONE
from studio.take.take import Take
from studio.ui import messages, tasks, undo
from studio.ui.language import native, sentences
from studio.ui.record.model import TAB, RecordModel, SavedTake
from studio.ui.record.takes_view import TakeLine, TakesCard
from studio.ui.session import Session

if TYPE_CHECKING:
    from studio.take.check import Proof

EVENING = timedelta(hours=8)
"""How long a take stays listed past midnight."""


@dataclass(frozen=True)
class Verdict:
    """A take's grade, the worst thing found in it, and whether its files hold all of it."""

    grade: str
    reason: str
    proof: Proof | None = None


class TakesPresenter(QObject):
    """Fills the card, does what its buttons request, and tells of takes that were saved."""

    def __init__(self, card: TakesCard, model: RecordModel, session: Session) -> None:
        super().__init__(card)
        self._card, self._model, self._session = card, model, session
        # By folder and not by id: another project has takes of the same names.
        self._verdicts: dict[Path, Verdict] = {}
        self._checking: set[Path] = set()
        # Saved a moment ago: what is wrong with it is said at once, before the next one starts.
        self._unproven: set[Path] = set()
        self._redone = ""
        card.play_requested.connect(model.player.toggle)
        card.keep_requested.connect(self._on_keep)
        card.redo_requested.connect(self._on_redo)
        card.note_written.connect(self._on_note)
        card.curate_requested.connect(lambda: session.tab_requested.emit("curate"))
        model.player.changed.connect(self.refresh)
        model.countdown.cancelled.connect(self._on_redo_cancelled)
        model.countdown.ended.connect(self._forget_redo)
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
        if not self._session.rolling:
            # A check reads the disk; a recording has it to itself.
            for take in takes:
                self._check(take)

    # -- what happened ---------------------------------------------------------------------------

    def _on_saved(self, saved: SavedTake) -> None:
        take, cut = saved.take, saved.cut
        if cut is None and take.info.frames:
            # Of one that was cut off or has no motion a message stands already.
            self._unproven.add(take.folder)
            self._check(take)
        if take.info.duration > 0:
            self._show_saved(take, saved.moved_ms)
        if cut is not None:
            # In the place of the note: this is what has to be read.
            messages.show_failure(self._card, cut.what, cut.remedy)

    def _show_saved(self, take: Take, moved_ms: float) -> None:
        play = (self.tr("Play"), lambda: self._model.player.toggle(take.id))
        back, rolls = (self.tr("Undo"), lambda: self._remove(take.id)), self._session.rolling_changed
        seconds = f"{take.info.duration:.1f}"
        if not take.info.frames:
            text = self.tr("{0} is saved with sound only: {1} s.").format(take.id, seconds)
            remedy = self.tr(
                "No motion came in. Start your tracking app or the practice performer, then re-record."
            )
            messages.show_warning(self._card, text, remedy, play, rolls, back)
            return
        details = [native(loss) for loss in losses(take.info)]
        if moved_ms:
            moved = self.tr("Motion is shifted by {0} ms, based on the sync test.")
            details.insert(0, moved.format(f"{moved_ms:+.0f}"))
        text = self.tr("{0} is saved: {1} s.").format(take.id, seconds)
        messages.show_note(self._card, text, " ".join(details), play, rolls, also=back)

    def _on_recovered(self, takes: tuple[Take, ...], failed: tuple[tuple[str, StudioError], ...]) -> None:
        if takes:
            names = ", ".join(f"{take.id} ({take.info.duration:.0f} s)" for take in takes)
            text = self.tr("A recording that was cut short was recovered: {0}.").format(names)
            damage = " ".join(take.info.extra.get("damage", "") for take in takes).strip()
            show = messages.show_warning if damage else messages.show_note
            show(self._card, text, damage or self.tr("It is among your takes."))
        for name, error in failed[:1]:
            # One message at a time: the next opening tells of the rest.
            text = self.tr("{0} was not recovered. {1}").format(name, native(error.what))
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
        seconds, proof = round(take.info.duration), verdict.proof
        return TakeLine(
            take.id,
            f"{seconds // 60}:{seconds % 60:02d}",
            verdict.grade,
            "" if proof is not None and verdict.reason == proof.what else native(verdict.reason),
            kept=selection is not None and selection.stars > 0,
            note=selection.note if selection else "",
            playing=self._model.player.take_id == take.id,
            proof=sentences(proof.what, proof.remedy) if proof else "",
            proven=proof.good if proof else True,
            details=native(proof.details) if proof else "",
            recorded=not take.info.source.startswith("imported"),
        )

    def _check(self, take: Take) -> None:
        if take.folder in self._checking:
            return
        # At once and not when the report is there: lists are shown anew while it is being checked.
        self._checking.add(take.folder)

        def done(verdict: Verdict) -> None:
            self._verdicts[take.folder] = verdict
            if take.folder in self._unproven:
                self._unproven.discard(take.folder)
                self._tell_unproven(take, verdict.proof)
            self.refresh()

        tasks.run(lambda: _judge(take), done, lambda error: done(_unchecked(error)), owner=self)

    def _tell_unproven(self, take: Take, proof: Proof | None) -> None:
        """Say of a take that was just saved that it is not whole; a good one says so in its row."""
        project = self._session.project
        if proof is None or proof.good or project is None or take.folder.parent != project.takes_folder:
            return
        if not take.info.audio_file and self._model.sound_device == NO_MICROPHONE:
            # Without sound by choice: its row says so, and a message at each take would be one too many.
            return
        again = (self.tr("Re-record"), lambda: self._on_redo(take.id))
        messages.show_warning(self._card, f"{take.id}: {native(proof.what)}", proof.remedy, again)

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
        take = self._remove(take_id)
        if take is not None:
            self._redone = self._model.undo_scope.undo_name
            self._model.record_again(take)

    def _remove(self, take_id: str) -> Take | None:
        """Move a take to the trash, from where undo brings it back; None where it cannot be."""
        project = self._session.project
        take = next((one for one in project.takes if one.id == take_id), None) if project else None
        if take is None or self._session.rolling:
            return None
        self._model.player.stop()
        try:
            self._session.remove_take(take_id, TAB)
        except StudioError as error:
            messages.show_error(self._card, error)
            return None
        undo.tell_change(self._card, self._model.undo_scope, self.tr("{0} is in the trash.").format(take_id))
        return take

    def _on_redo_cancelled(self) -> None:
        """Give up the countdown of a take that takes another's place: the old one comes back."""
        redone, self._redone = self._redone, ""
        # Only where that is still the last thing done: undo must take nothing else back.
        if redone and self._model.undo_scope.undo_name == redone:
            undo.undo(self._card, self._model.undo_scope)

    def _forget_redo(self) -> None:
        self._redone = ""


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
    from studio.take.check import check_take, proof_of

    report = check_take(take)
    return Verdict(report.grade, report.reason if report.findings else "", proof_of(take, report))


def _unchecked(error: BaseException) -> Verdict:
    """What is said of a take whose check itself failed."""
    from studio.take.check import Proof

    what = say("The take could not be read again: {error}.", error=error)
    if isinstance(error, StudioError):
        return Verdict("?", "", Proof(False, error.what, error.in_window, ""))
    return Verdict("?", "", Proof(False, what, "Open it in Curate and look it over.", ""))
