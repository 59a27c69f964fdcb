"""Going through a take by keys: frames, ends, what is selected on the way, and what is repeated."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Signal

from studio.ui.curate.view import CurateView
from studio.ui.widgets.timeline_content import Span

if TYPE_CHECKING:
    from studio.ui.curate.playing import Playing

UNKNOWN_FPS = 60.0
"""Frames a second where a take has no motion to step through."""


class Moving(QObject):
    """Moves the playhead of the take shown.

    Signals:
        span_changed: what is selected is another stretch now.
    """

    span_changed = Signal()

    def __init__(self, view: CurateView, playing: Playing, parent: QObject) -> None:
        super().__init__(parent)
        self._bench, self._playing = view.bench, playing
        view.step_requested.connect(self._on_step)
        view.edge_requested.connect(self._on_edge)
        view.bench.start.clicked.connect(lambda: self._on_edge(-1, False))
        view.bench.loop_requested.connect(self.set_loop)

    def set_loop(self) -> None:
        """Repeat the selected span, or what is used of the take, where repeating is on."""
        loop: Span | None = None
        if self._bench.loop.isChecked():
            loop = self._bench.timeline.span or self._bench.timeline.in_out
        self._bench.timeline.set_loop(loop)
        self._playing.set_loop(loop)

    def _on_step(self, frames: int, select: bool) -> None:
        loaded = self._playing.take
        fps = loaded.motion.fps if loaded is not None and loaded.motion is not None else 0.0
        self._go(self._playing.position + frames / (fps or UNKNOWN_FPS), select)

    def _on_edge(self, side: int, select: bool) -> None:
        start, end = self._bench.timeline.in_out
        at = self._playing.position
        # The first press goes to the in or out point, the next to the very end of the take.
        if side < 0:
            self._go(start if at > start + 1e-6 else 0.0, select)
        else:
            self._go(end if at < end - 1e-6 else self._playing.duration, select)

    def _go(self, t: float, select: bool) -> None:
        timeline = self._bench.timeline
        t = min(max(t, 0.0), self._playing.duration)
        if select:
            a, b = timeline.span or (timeline.playhead, timeline.playhead)
            fixed = a if abs(timeline.playhead - b) <= abs(timeline.playhead - a) else b
            timeline.set_span((min(fixed, t), max(fixed, t)) if t != fixed else None)
            self.span_changed.emit()
        self._playing.seek(t)
        timeline.set_playhead(t, follow=True)
