"""One take cut into many where nobody speaks: shown first, done when it is wanted."""

from __future__ import annotations

from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject

from studio.dataset import edits, silence
from studio.take.sound import sound_blocks
from studio.take.take import Take
from studio.ui import background
from studio.ui.curate.bench import Bench

if TYPE_CHECKING:
    from studio.ui.curate.presenter import CuratePresenter

LEVEL_RATE = 16_000


class Cutting(QObject):
    """Cuts in the pauses of the selection shown."""

    def __init__(self, bench: Bench, room: CuratePresenter) -> None:
        super().__init__(room)
        self._bench, self._room = bench, room
        self._moments: tuple[float, ...] = ()
        self._task: background.Task | None = None
        bench.pauses_requested.connect(self.start)
        bench.cut_requested.connect(self._cut)
        bench.cut_dropped.connect(self.drop)

    def start(self) -> None:
        """Listen for pauses and show where the cuts would be."""
        row = self._room.row
        if row is None or row.take is None or self._task is not None:
            return
        self._bench.show_question(self.tr("Listening for pauses…"))
        self._task = background.run(partial(_pauses, row.take), self._on_found, self._on_failed, self)

    def drop(self) -> None:
        """Leave the take whole."""
        if self._task is not None:
            self._task.forget()
            self._task = None
        self._moments = ()
        self._bench.timeline.set_parts(())
        self._bench.show_question("")

    def _on_found(self, moments: tuple[float, ...]) -> None:
        self._task = None
        row = self._room.row
        start, end = row.span if row else (0.0, 0.0)
        self._moments = tuple(t for t in moments if start + 1.0 < t < end - 1.0)
        edges = (start, *self._moments, end)
        self._bench.timeline.set_parts(tuple(pairwise(edges)) if self._moments else ())
        if not self._moments:
            self.drop()
            self._room.say(self.tr("There is no pause long enough to cut in."))
            return
        parts = len(self._moments) + 1
        sentence = self.tr("Cut into {0} parts at the dashed lines? The recording stays as it is.")
        self._bench.show_question(sentence.format(parts), self.tr("Cut into {0}").format(parts))

    def _on_failed(self, error: BaseException) -> None:
        self._task = None
        self.drop()
        self._room.fail(error)

    def _cut(self) -> None:
        row, moments = self._room.row, self._moments
        if row is None or row.take is None:
            return
        end = row.take.info.duration
        self.drop()
        name = self.tr("Split {0} at its pauses").format(row.id)
        self._room.edit(name, lambda data: edits.split_at(data, row.id, moments, end))


def _pauses(take: Take) -> tuple[float, ...]:
    """Runs on the thread pool."""
    assert take.audio_path is not None
    return silence.cuts(silence.levels_dbfs(sound_blocks(take.audio_path, LEVEL_RATE), LEVEL_RATE))
