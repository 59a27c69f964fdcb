"""What of a take is used: in and out points, and spans left out."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Signal

from studio.dataset import edits
from studio.ui.curate.view import CurateView
from studio.ui.widgets.timeline_content import Span

if TYPE_CHECKING:
    from studio.ui.curate.presenter import CuratePresenter


class Trimming(QObject):
    """Trims and excludes on the selection shown; each is one named step of undo.

    Signals:
        span_changed: what is selected on the timeline is another stretch now.
    """

    span_changed = Signal()

    def __init__(self, view: CurateView, room: CuratePresenter) -> None:
        super().__init__(room)
        self._timeline, self._room = view.bench.timeline, room
        view.mark_requested.connect(self._on_mark)
        view.delete_requested.connect(self._on_delete)
        view.bench.trim_requested.connect(self._on_trim_to_span)
        view.bench.untrim_requested.connect(self._on_use_all)
        view.bench.exclude_requested.connect(lambda: self.exclude(self._timeline.span))
        view.bench.timeline.in_out_changed.connect(self.trim)

    def trim(self, span: Span) -> None:
        """Use only this stretch, in seconds of the take."""
        row = self._room.row
        if row is None or row.take is None:
            return
        start, end = span
        out = None if end >= row.take.info.duration - 1e-6 else end
        name = self.tr("Trim {0}").format(row.id)
        self._room.edit(name, lambda data: edits.trim(data, row.id, start, out))

    def exclude(self, span: Span | None) -> None:
        """Leave a stretch out; use it again where it is left out already."""
        row = self._room.row
        if row is None or span is None or span[1] <= span[0]:
            return
        inside = any(a <= span[0] + 1e-6 and span[1] - 1e-6 <= b for a, b in row.selection.excluded)
        if inside:
            name = self.tr("Use a span of {0}").format(row.id)
            self._room.edit(name, lambda data: edits.include(data, row.id, *span))
        else:
            name = self.tr("Exclude a span of {0}").format(row.id)
            self._room.edit(name, lambda data: edits.exclude(data, row.id, *span))

    def _on_mark(self, which: str) -> None:
        start, end = self._timeline.in_out
        t = self._timeline.playhead
        if not self._room.editable:
            return
        if which == "in" and t < end - edits.SHORTEST:
            self.trim((t, end))
        elif which == "out" and t > start + edits.SHORTEST:
            self.trim((start, t))
        else:
            self._room.say(self.tr("The in point must come before the out point."))

    def _on_trim_to_span(self) -> None:
        if self._timeline.span is not None:
            self.trim(self._timeline.span)
            self._timeline.set_span(None)
            self.span_changed.emit()

    def _on_use_all(self) -> None:
        row = self._room.row
        if row is None or row.take is None:
            return
        end = row.take.info.duration
        name = self.tr("Use all of {0}").format(row.id)
        self._room.edit(
            name, lambda data: edits.include(edits.trim(data, row.id, 0.0, None), row.id, 0.0, end)
        )

    def _on_delete(self) -> None:
        label = self._timeline.chosen_label
        if label is not None and self._room.row is not None:
            self._room.remove_label(label)
        elif self._timeline.span is not None and self._room.editable:
            self.exclude(self._timeline.span)
