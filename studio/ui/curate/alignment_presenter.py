"""Presenter of the offset between sound and motion: measured with a confidence, or nudged by hand."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, QPoint, QTimer

from studio.dataset import edits
from studio.errors import StudioError
from studio.take.take import Take
from studio.ui import tasks
from studio.ui.curate.alignment_view import AlignReport, Answer, CurvePopup, judged
from studio.ui.curate.bench_view import Bench
from studio.ui.curate.model import CurateModel
from studio.ui.language import native
from studio.ui.session import Session
from studio.ui.widgets.plots import role_of

if TYPE_CHECKING:
    from studio.motion.lag import Alignment
    from studio.take.alignment import By

NUDGE_WAIT_MS = 400
"""Nudges in quick succession become one step of undo."""


@dataclass(frozen=True)
class AlignmentResult:
    """What was found for a take, and by what."""

    found: Alignment
    by: By


class AlignmentPresenter(QObject):
    """The offset of the selection shown, and of many at once."""

    def __init__(self, bench: Bench, model: CurateModel, session: Session) -> None:
        super().__init__(bench)
        self._bench, self._model = bench, model
        self._results: dict[str, AlignmentResult] = {}
        self._waiting: list[Take] = []
        self._answers: list[Answer] = []
        self._count = 0
        self._listening = tasks.LatestTask(self)
        self._by: By = "mouth"
        self._nudge = QTimer(self)
        self._nudge.setSingleShot(True)
        self._nudge.setInterval(NUDGE_WAIT_MS)
        self._nudge.timeout.connect(self._save_nudge)
        bench.offset_changed.connect(self._on_offset)
        bench.align_requested.connect(lambda: self.start())
        bench.curve.clicked.connect(self._show_closer)
        model.project_changed.connect(self.clear)
        model.leaving.connect(self._save_waiting)
        model.undo_scope.about_to_step.connect(self._save_waiting)
        model.choices_changed.connect(self._show_offset)
        model.align_requested.connect(self.start)

    def _show_offset(self) -> None:
        """Show the shown selection's offset, unless it is just being nudged."""
        row = self._model.row
        # A nudge that still waits would jump back to the offset that was there before it.
        if row is None or row.take is None or self._nudge.isActive():
            return
        result = self._results.get(row.selection.take)
        sentence, role = (judged(result.found), role_of(result.found.confidence)) if result else ("", "muted")
        if self._count:
            sentence, role = self._working(), "muted"
        self._bench.show_offset(round(row.selection.offset * 1000), sentence, role)
        self._bench.curve.show_found(result.found if result and not self._count else None)

    def _save_waiting(self) -> None:
        """Another take is to be shown, or undo is asked for: a nudge that still waits is this one's."""
        if self._nudge.isActive():
            self._nudge.stop()
            self._save_nudge()

    def clear(self) -> None:
        """Another project is shown: nothing found before is about its takes."""
        self._nudge.stop()
        self._listening.drop()
        self._results.clear()
        self._waiting.clear()
        self._count = 0
        self._bench.show_aligning(False)

    def start(self, by: By = "mouth") -> None:
        """Find the offsets of all selected takes, and use those that are sure; again to stop."""
        if self._count:
            self._waiting.clear()
            return
        rows = self._model.chosen_rows or tuple(row for row in (self._model.row,) if row is not None)
        takes = {row.take.id: row.take for row in rows if row.take is not None}
        self._waiting = [take for take in takes.values() if take.audio_path and take.motion_path]
        if not self._waiting:
            self._model.show_message(self.tr("Aligning needs a take with both sound and motion."))
            return
        self._answers, self._by, self._count = [], by, len(self._waiting)
        self._bench.show_aligning(self._count > 1)
        self._next()

    def use(self, take: str) -> None:
        """Take over what was found for a take, sure or not."""
        self.use_all((take,))

    def use_all(self, takes: tuple[str, ...]) -> None:
        """Take over what was found for some takes, as one step of undo."""
        from studio.dataset.edits import align_takes

        found = [(take, self._results[take].found) for take in takes if take in self._results]
        if found:
            who = takes[0] if len(takes) == 1 else self.tr("{0} takes").format(len(takes))
            name = self.tr("Align {0}").format(who)
            self._model.edit(name, lambda data: align_takes(data, found, sure=0.0)[0])

    def _next(self) -> None:
        """Listen to the next take, or tell what was found."""
        if not self._waiting:
            self._finish()
            return
        take = self._waiting.pop(0)
        self._bench.certainty.setText(self._working())
        found, failed = partial(self._on_found, take), partial(self._on_failed, take)
        self._listening.run(partial(_find, take, self._by), found, failed)

    def _working(self) -> str:
        if self._count < 2:
            return self.tr("Listening…")
        return self.tr("Listening, {0} of {1}…").format(len(self._answers) + 1, self._count)

    def _on_found(self, take: Take, found: Alignment | None) -> None:
        from studio.motion.lag import SURE

        if found is not None:
            self._results[take.id] = AlignmentResult(found, self._by)
            self._answers.append(Answer(take.id, found, found.confidence >= SURE))
        self._next()

    def _on_failed(self, take: Take, error: BaseException) -> None:
        what = native(error.what) if isinstance(error, StudioError) else str(error)
        self._answers.append(Answer(take.id, None, False, what))
        if self._count == 1:
            self._model.fail(error)
        self._next()

    def _finish(self) -> None:
        many, self._count = self._count > 1, 0
        self._bench.show_aligning(False)
        self.use_all(tuple(one.take for one in self._answers if one.used))
        self._show_offset()
        if many and self._answers:
            report = AlignReport(self._answers, self._bench.window())
            report.take_chosen.connect(self._model.show_take)
            report.use_requested.connect(self.use_all)
            report.show()

    def _show_closer(self) -> None:
        row = self._model.row
        result = self._results.get(row.selection.take) if row else None
        if row is None or result is None:
            return
        used = abs(row.selection.offset - result.found.offset) < 1e-3
        popup = CurvePopup(result.found, result.by, used or not self._model.editable, self._bench.window())
        popup.claps_requested.connect(lambda: self.start("clap"))
        popup.used.connect(partial(self.use, row.selection.take))
        popup.adjustSize()
        corner = self._bench.curve.mapToGlobal(QPoint(self._bench.curve.width(), -8))
        popup.move(corner - QPoint(popup.width(), popup.height()))
        popup.show()

    def _on_offset(self, _milliseconds: int) -> None:
        self._model.set_offset(self._bench.offset.value() / 1000)
        self._nudge.start()

    def _save_nudge(self) -> None:
        row = self._model.row
        if row is not None:
            offset = self._bench.offset.value() / 1000
            name = self.tr("Move the motion of {0}").format(row.id)
            self._model.edit(name, lambda data: edits.set_offset(data, [row.id], offset))


def _find(take: Take, by: By) -> Alignment | None:
    """Runs on the thread pool."""
    from studio.take.alignment import take_offset

    return take_offset(take, by)
