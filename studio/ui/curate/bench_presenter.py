"""Presenter of the take shown: what plays, where the playhead goes by keys, and what is repeated."""

from __future__ import annotations

from PySide6.QtCore import QObject

from studio.render.world_pose import WorldPose
from studio.ui import undo
from studio.ui.curate.checks import placed
from studio.ui.curate.model import CurateModel
from studio.ui.curate.playback import LoadedTake
from studio.ui.curate.view import CurateView
from studio.ui.session import Session
from studio.ui.widgets.timeline.content import Mark, Span

UNKNOWN_FPS = 60.0
"""Frames a second where a take has no motion to step through."""


class BenchPresenter(QObject):
    """Transport, playhead and stage of the selection shown."""

    def __init__(self, view: CurateView, model: CurateModel, session: Session) -> None:
        super().__init__(view)
        self._view, self._bench, self._model, self._session = view, view.bench, model, session
        self._playing = model.playing
        model.rows_changed.connect(self._show_history)
        model.shown_changed.connect(self._on_shown)
        model.part_shown.connect(lambda: self._bench.timeline.set_span(None))
        model.loaded.connect(self._on_loaded)
        model.choices_changed.connect(self._show_choices)
        model.graded.connect(self._show_problems)
        model.offset_changed.connect(lambda _: self._show_pose(self._playing.position))
        model.span_changed.connect(self.set_loop)
        model.mark_requested.connect(self._go_to)
        self._playing.moved.connect(self._on_moved)
        self._playing.playing_changed.connect(self._bench.show_playing)
        self._connect_view()

    def _connect_view(self) -> None:
        view, bench, model = self._view, self._bench, self._model
        bench.play_requested.connect(self._playing.toggle)
        bench.undo_requested.connect(lambda: undo.undo(view, model.undo_scope))
        bench.redo_requested.connect(lambda: undo.redo(view, model.undo_scope))
        bench.start.clicked.connect(lambda: self._on_edge(-1, False))
        bench.loop_requested.connect(self.set_loop)
        bench.timeline.seek_requested.connect(self._playing.seek)
        bench.timeline.span_selected.connect(lambda _: model.change_span())
        bench.timeline.problem_chosen.connect(self._go_to)
        view.step_requested.connect(self._on_step)
        view.edge_requested.connect(self._on_edge)

    def close(self) -> None:
        """Let go of OpenGL."""
        self._view.stage.figure.dispose()

    def set_loop(self) -> None:
        """Repeat the selected span, or what is used of the take, where repeating is on."""
        loop: Span | None = None
        if self._bench.loop.isChecked():
            loop = self._bench.timeline.span or self._bench.timeline.in_out
        self._bench.timeline.set_loop(loop)
        self._playing.set_loop(loop)

    # -- showing -------------------------------------------------------------------------------

    def _show_history(self) -> None:
        project = self._session.project
        if project is not None:
            self._bench.show_history(project.undo_name, project.redo_name)
            self._bench.show_locked(self._session.locked_reason)

    def _on_shown(self) -> None:
        row = self._model.row
        take = row.take if row else None
        self._bench.timeline.set_duration(take.info.duration if take else 0.0)
        self._bench.show_duration(take.info.duration if take else 0.0)
        self._bench.loop.setChecked(False)
        if take is None:
            self._view.stage.show_nothing(self.tr("Select a take to see it move."))

    def _on_loaded(self, loaded: LoadedTake) -> None:
        if loaded.motion is None or not len(loaded.motion):
            self._view.stage.show_nothing(self.tr("This take has no motion."))

    def _show_choices(self) -> None:
        """What of the selection shown is used, and what can be done with it."""
        row, bench, loaded = self._model.row, self._bench, self._playing.take
        bench.set_tools_enabled(
            shown=row is not None and row.take is not None and loaded is not None,
            editable=self._model.editable,
            span=bench.timeline.span is not None,
            sound=loaded is not None and loaded.peaks is not None,
            motion=loaded is not None and loaded.motion is not None,
        )
        if row is None or row.take is None:
            return
        whole = (0.0, row.take.info.duration)
        bench.timeline.set_in_out(row.span if whole[1] > 0 else None)
        bench.timeline.set_excluded(row.selection.excluded)
        self._show_problems()
        is_cut = row.span != whole or bool(row.selection.excluded)
        bench.untrim.setEnabled(bench.untrim.isEnabled() and is_cut)

    def _show_problems(self) -> None:
        row = self._model.row
        self._bench.timeline.set_problems(placed(row.report if row else None))

    def _on_moved(self, t: float) -> None:
        self._show_pose(t)
        self._bench.timeline.set_playhead(t, follow=self._playing.playing)
        self._bench.show_time(t)

    def _show_pose(self, t: float) -> None:
        motion = self._playing.take.motion if self._playing.take else None
        if motion is None or not len(motion):
            return
        self._view.stage.show_stance(WorldPose.of(motion, t - self._model.offset))

    # -- going through a take ------------------------------------------------------------------

    def _go_to(self, mark: Mark) -> None:
        timeline = self._bench.timeline
        timeline.set_span((mark.t, mark.t + mark.duration) if mark.duration > 0 else None)
        if not timeline.view.start <= mark.t <= timeline.view.end:
            timeline.show_span(mark.t - timeline.view.span / 2, mark.t + timeline.view.span / 2)
        self._playing.seek(mark.t)
        self._model.change_span()

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
            self._model.change_span()
        self._playing.seek(t)
        timeline.set_playhead(t, follow=True)
