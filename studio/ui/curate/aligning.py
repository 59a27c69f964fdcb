"""Sound and motion brought into step: found by itself with a confidence, or nudged in milliseconds."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, QTimer

from studio.dataset import edits
from studio.take.take import Take
from studio.ui import background
from studio.ui.curate.bench import Bench

if TYPE_CHECKING:
    from studio.dataset.align import Alignment
    from studio.ui.curate.presenter import CuratePresenter

NUDGE_WAIT_MS = 400
"""Nudges in quick succession become one step of undo."""


class Aligning(QObject):
    """The offset of the selection shown, and of many at once."""

    def __init__(self, bench: Bench, room: CuratePresenter) -> None:
        super().__init__(room)
        self._bench, self._room = bench, room
        self._answers: dict[str, Alignment] = {}
        self._busy = False
        self._nudge = QTimer(self)
        self._nudge.setSingleShot(True)
        self._nudge.setInterval(NUDGE_WAIT_MS)
        self._nudge.timeout.connect(self._keep_nudge)
        bench.offset_changed.connect(self._on_offset)
        bench.align_requested.connect(self.start)

    def show_offset(self, offset: float) -> None:
        """Show the shown selection's offset in seconds, unless it is just being nudged."""
        if self._nudge.isActive():
            return
        row = self._room.row
        answer = self._answers.get(row.selection.take) if row else None
        sentence, role = self._judged(answer) if answer else ("", "muted")
        if self._busy:
            sentence, role = self.tr("Listening…"), "muted"
        self._bench.show_offset(round(offset * 1000), sentence, role)

    def forget_answer(self) -> None:
        """Another take is shown: keep a nudge that is still waiting."""
        if self._nudge.isActive():
            self._nudge.stop()
            self._keep_nudge()

    def start(self) -> None:
        """Find the offsets of all selected takes, and use those that are sure enough."""
        takes = {row.take.id: row.take for row in self._room.chosen_rows if row.take is not None}
        row = self._room.row
        if not takes and row is not None and row.take is not None:
            takes = {row.take.id: row.take}
        both = [take for take in takes.values() if take.audio_path and take.motion_path]
        if not both:
            self._room.say(self.tr("Aligning needs a take with both sound and motion."))
        elif not self._busy:
            self._busy = True
            self._bench.align.setEnabled(False)
            self._bench.certainty.setText(self.tr("Listening…"))
            background.run(partial(_find, both), self._on_found, self._on_failed, self)

    def _on_found(self, found: list[tuple[str, Alignment]]) -> None:
        from studio.dataset.align import align_takes

        self._busy = False
        self._bench.align.setEnabled(True)
        self._answers |= dict(found)
        dataset, unsure = align_takes(self._room.dataset, found)
        sure = [take for take, _ in found if take not in unsure]
        row = self._room.row
        if sure:
            who = sure[0] if len(sure) == 1 else self.tr("{0} takes").format(len(sure))
            self._room.edit(self.tr("Align {0}").format(who), lambda _: dataset)
        if row is not None:
            self.show_offset(self._room.dataset[row.id].offset)
        if len(found) > 1:
            self._room.say(self.tr("{0} takes aligned, {1} left as they are.").format(len(sure), len(unsure)))

    def _on_failed(self, error: BaseException) -> None:
        self._busy = False
        self._bench.align.setEnabled(True)
        self._bench.certainty.setText("")
        self._room.fail(error)

    def _judged(self, answer: Alignment) -> tuple[str, str]:
        """How sure an offset is, in words and as a role of the style sheet."""
        percent = f"{answer.confidence:.0%}"
        offset = f"{answer.offset * 1000:+.0f} ms"
        if answer.confidence >= 0.75:
            return self.tr("{0}, sure ({1})").format(offset, percent), "good"
        if answer.confidence >= 0.5:
            return self.tr("{0}, likely ({1}): listen").format(offset, percent), "warn"
        return self.tr("Not sure ({0}): nudge by ear").format(percent), "warn"

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


def _find(takes: Sequence[Take]) -> list[tuple[str, Alignment]]:
    """Runs on the thread pool."""
    from studio.dataset.align import take_offset

    found = [(take.id, take_offset(take)) for take in takes]
    return [(take_id, alignment) for take_id, alignment in found if alignment is not None]
