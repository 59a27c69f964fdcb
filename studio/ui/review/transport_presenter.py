"""Review's transport: plays, seeks, steps and loops, and brings the picture to where the sound is."""

from __future__ import annotations

from PySide6.QtCore import QObject, Qt, QTimer, Signal

from studio.ui.language import native
from studio.ui.review.model import ReviewModel
from studio.ui.review.view import ReviewView

FRAME_MS = 16
AT_END_S = 0.05
"""So near to the end of what is used, Play begins anew."""


class TransportPresenter(QObject):
    """Presenter of the transport: brings sound and picture to where a person wants them.

    Args:
        view: the tab.
        model: what is on the stage; its player leads.

    Signals:
        played: somebody watches what a network made.
    """

    played = Signal()

    def __init__(self, view: ReviewView, model: ReviewModel) -> None:
        super().__init__(view)
        self._view, self._model = view, model
        self._speed = 1.0
        # Where the picture before was.
        self._last = 0.0
        # The picture is to be drawn again although nothing plays.
        self._dirty = True
        # The run to be played once its motion is there, "" for none.
        self._waiting = ""
        self._frames = QTimer(self)
        self._frames.setTimerType(Qt.TimerType.PreciseTimer)
        self._frames.setInterval(FRAME_MS)
        self._frames.timeout.connect(self._show_frame)
        model.loaded.connect(self._begin)
        model.motion_changed.connect(self._play_waiting)
        model.failed.connect(lambda _: self._stop_waiting())
        model.redraw_requested.connect(self._on_redraw)
        view.play_toggled.connect(self._on_play)
        view.seek_requested.connect(self.seek)
        view.step_requested.connect(self._on_step)
        view.loop_toggled.connect(self._on_loop)
        view.speed_chosen.connect(self._on_speed)
        view.timeline.span_selected.connect(self._on_span)

    def activate(self) -> None:
        """The tab is shown."""
        self._frames.start()

    def deactivate(self) -> None:
        """Another tab is shown."""
        self._stop_waiting()
        self._frames.stop()

    def close(self) -> None:
        """The window closes."""
        self._frames.stop()

    def play_from_start(self, run: str) -> None:
        """Play what is on the stage from its start, as soon as all of a run's motion is there."""
        self._waiting = run

    def seek(self, t: float) -> None:
        """Go to a moment."""
        if self._model.player is not None:
            self._model.player.seek(min(t, self._model.player.duration))
            self._last = t
            self._dirty = True

    def _begin(self) -> None:
        """Another recording is on the stage: go to the start of what is used of it."""
        self._model.set_span(None)
        self._view.timeline.set_span(None)
        # Slow motion holds for the next recording, too: its button still shows it.
        self._on_speed(self._speed)
        start, _ = self._model.used
        if start > 0:
            self.seek(start)
        self._on_loop(self._view.loop.isChecked())

    def _on_redraw(self) -> None:
        self._dirty = True

    def _stop_waiting(self) -> None:
        self._waiting = ""

    def _play_waiting(self) -> None:
        model = self._model
        ready = model.active and model.player is not None and model.predicted is not None and model.complete
        if not self._waiting or not ready or model.side.selection.run != self._waiting:
            return
        self._stop_waiting()
        self.seek(model.used[0])
        if model.player is not None and not model.player.playing:
            self._on_play()

    def _on_play(self) -> None:
        self._stop_waiting()
        player = self._model.player
        if player is not None:
            start, end = self._model.used
            # Pressed at the end, Play is meant from the beginning.
            if not player.playing and abs(player.position - end) < AT_END_S:
                self.seek(start)
            self._last = player.position
            player.toggle()
            self._show_problem()
            if player.playing and self._model.predicted is not None:
                self.played.emit()

    def _on_step(self, frames: int) -> None:
        if self._model.player is not None:
            motion = self._model.tuned
            # A sound without motion steps as most motion would.
            fps = motion.fps if motion is not None and motion.fps > 0 else 60.0
            self.seek(self._model.player.position + frames / fps)

    def _on_speed(self, speed: float) -> None:
        self._speed = speed
        if self._model.player is not None:
            self._model.player.set_speed(speed)

    def _on_span(self, span: tuple[float, float] | None) -> None:
        self._model.set_span(span)
        self._view.timeline.set_span(span)
        self._on_loop(self._view.loop.isChecked())

    def _on_loop(self, on: bool) -> None:
        player = self._model.player
        if player is None:
            return
        loop = (self._model.span or self._model.used) if on else None
        player.set_loop(loop)
        self._view.timeline.set_loop(player.loop)
        # Outside of what is repeated it would play on to the end first.
        if loop is not None and not loop[0] <= player.position < loop[1]:
            self.seek(loop[0])

    def _show_frame(self) -> None:
        """Bring the stage to where the sound is. Runs at the display's pace while the tab is shown."""
        player = self._model.player
        if player is None:
            if self._dirty:
                self._dirty = False
                self._view.show_transport(False, 0.0, 0.0)
            return
        playing = player.playing
        # The timer goes on while nothing moves, but then it draws nothing.
        if not playing and not self._dirty:
            return
        # One more picture after the last moving one.
        self._dirty = playing
        t = player.position
        if self._reaches_end(t):
            return
        self._view.show_transport(playing, t, player.duration)
        self._view.timeline.set_playhead(t, follow=playing)
        self._model.playhead_moved.emit(t)
        # A device may be unplugged while it plays; the picture goes on without it.
        if player.problem is not None and playing:
            self._show_problem()

    def _show_problem(self) -> None:
        problem = self._model.player.problem if self._model.player is not None else None
        self._view.show_notice(
            native(problem.what) if problem else "", native(problem.in_window) if problem else ""
        )

    def _reaches_end(self, t: float) -> bool:
        """Rest at the end of what is used; who begins behind it hears what was trimmed away."""
        before, self._last = self._last, t
        player, (start, end) = self._model.player, self._model.used
        crosses = start <= before < end <= t
        if player is None or player.loop is not None or end >= player.duration or not crosses:
            return False
        player.pause()
        self.seek(end)
        return True
