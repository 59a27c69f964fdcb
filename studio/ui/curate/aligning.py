"""Sound and motion brought into step: found by itself with a confidence, or nudged in milliseconds."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, QPoint, QTimer

from studio.dataset import edits
from studio.errors import StudioError
from studio.take.take import Take
from studio.ui import background
from studio.ui.curate.align_report import AlignReport, Answer, CurvePopup, judged
from studio.ui.curate.bench import Bench
from studio.ui.widgets.correlation_plot import role_of

if TYPE_CHECKING:
    from studio.dataset.align import Alignment, By
    from studio.ui.curate.presenter import CuratePresenter

NUDGE_WAIT_MS = 400
"""Nudges in quick succession become one step of undo."""


@dataclass(frozen=True)
class Heard:
    """What was found for a take, and by what."""

    found: Alignment
    by: By


class Aligning(QObject):
    """The offset of the selection shown, and of many at once."""

    def __init__(self, bench: Bench, room: CuratePresenter) -> None:
        super().__init__(room)
        self._bench, self._room = bench, room
        self._heard: dict[str, Heard] = {}
        self._waiting: list[Take] = []
        self._answers: list[Answer] = []
        self._count = 0
        self._task: background.Task | None = None
        self._by: By = "mouth"
        self._nudge = QTimer(self)
        self._nudge.setSingleShot(True)
        self._nudge.setInterval(NUDGE_WAIT_MS)
        self._nudge.timeout.connect(self._keep_nudge)
        bench.offset_changed.connect(self._on_offset)
        bench.align_requested.connect(lambda: self.start())
        bench.curve.clicked.connect(self._look_closer)

    def show_offset(self, offset: float) -> None:
        """Show the shown selection's offset in seconds, unless it is just being nudged."""
        if self._nudge.isActive():
            return
        row = self._room.row
        heard = self._heard.get(row.selection.take) if row else None
        sentence, role = (judged(heard.found), role_of(heard.found.confidence)) if heard else ("", "muted")
        if self._count:
            sentence, role = self._working(), "muted"
        self._bench.show_offset(round(offset * 1000), sentence, role)
        self._bench.curve.show_found(heard.found if heard and not self._count else None)

    def forget_answer(self) -> None:
        """Another take is shown: keep a nudge that is still waiting."""
        if self._nudge.isActive():
            self._nudge.stop()
            self._keep_nudge()

    def forget_all(self) -> None:
        """Another project is shown: nothing found before is about its takes."""
        self._nudge.stop()
        if self._task is not None:
            self._task.forget()
            self._task = None
        self._heard.clear()
        self._waiting.clear()
        self._count = 0
        self._bench.show_aligning(False)

    def start(self, by: By = "mouth") -> None:
        """Find the offsets of all selected takes, and use those that are sure; again to stop."""
        if self._count:
            self._waiting.clear()
            return
        rows = self._room.chosen_rows or tuple(row for row in (self._room.row,) if row is not None)
        takes = {row.take.id: row.take for row in rows if row.take is not None}
        self._waiting = [take for take in takes.values() if take.audio_path and take.motion_path]
        if not self._waiting:
            self._room.say(self.tr("Aligning needs a take with both sound and motion."))
            return
        self._answers, self._by, self._count = [], by, len(self._waiting)
        self._bench.show_aligning(self._count > 1)
        self._next()

    def use(self, take: str) -> None:
        """Take over what was found for a take, sure or not."""
        self.use_all((take,))

    def use_all(self, takes: tuple[str, ...]) -> None:
        """Take over what was found for some takes, as one step of undo."""
        from studio.dataset.align import align_takes

        found = [(take, self._heard[take].found) for take in takes if take in self._heard]
        if found:
            who = takes[0] if len(takes) == 1 else self.tr("{0} takes").format(len(takes))
            name = self.tr("Align {0}").format(who)
            self._room.edit(name, lambda data: align_takes(data, found, sure=0.0)[0])

    def _next(self) -> None:
        """Listen to the next take, or tell what was found."""
        if not self._waiting:
            self._finish()
            return
        take = self._waiting.pop(0)
        self._bench.certainty.setText(self._working())
        found, failed = partial(self._on_found, take), partial(self._on_failed, take)
        self._task = background.run(partial(_find, take, self._by), found, failed, self)

    def _working(self) -> str:
        if self._count < 2:
            return self.tr("Listening…")
        return self.tr("Listening, {0} of {1}…").format(len(self._answers) + 1, self._count)

    def _on_found(self, take: Take, found: Alignment | None) -> None:
        from studio.dataset.align import SURE

        if found is not None:
            self._heard[take.id] = Heard(found, self._by)
            self._answers.append(Answer(take.id, found, found.confidence >= SURE))
        self._next()

    def _on_failed(self, take: Take, error: BaseException) -> None:
        what = error.what if isinstance(error, StudioError) else str(error)
        self._answers.append(Answer(take.id, None, False, what))
        if self._count == 1:
            self._room.fail(error)
        self._next()

    def _finish(self) -> None:
        many, self._count = self._count > 1, 0
        self._bench.show_aligning(False)
        self.use_all(tuple(one.take for one in self._answers if one.used))
        row = self._room.row
        if row is not None and row.id in self._room.dataset:
            self.show_offset(self._room.dataset[row.id].offset)
        if many and self._answers:
            report = AlignReport(self._answers, self._bench.window())
            report.take_chosen.connect(self._room.show_take)
            report.use_requested.connect(self.use_all)
            report.show()

    def _look_closer(self) -> None:
        row = self._room.row
        heard = self._heard.get(row.selection.take) if row else None
        if row is None or heard is None:
            return
        used = abs(row.selection.offset - heard.found.offset) < 1e-3
        popup = CurvePopup(heard.found, heard.by, used or not self._room.editable, self._bench.window())
        popup.claps_requested.connect(lambda: self.start("clap"))
        popup.used.connect(partial(self.use, row.selection.take))
        popup.adjustSize()
        corner = self._bench.curve.mapToGlobal(QPoint(self._bench.curve.width(), -8))
        popup.move(corner - QPoint(popup.width(), popup.height()))
        popup.show()

    def _on_offset(self, _milliseconds: int) -> None:
        offset = self._bench.offset.value() / 1000
        self._room.curves.set_offset(offset)
        self._room.playing.set_offset(offset)
        self._nudge.start()

    def _keep_nudge(self) -> None:
        row = self._room.row
        if row is not None:
            offset = self._bench.offset.value() / 1000
            name = self.tr("Move the motion of {0}").format(row.id)
            self._room.edit(name, lambda data: edits.set_offset(data, [row.id], offset))


def _find(take: Take, by: By) -> Alignment | None:
    """Runs on the thread pool."""
    from studio.dataset.align import take_offset

    return take_offset(take, by)
