"""Presenter of the stage: poses and shapes, the switches, and the sentence that says how it goes."""

from __future__ import annotations

import time

from PySide6.QtCore import QObject, QTimer

from studio.capture.device_names import title_of
from studio.ipc.events import LiveStateEvent, PoseEvent
from studio.ui.language import native
from studio.ui.live.model import LiveModel
from studio.ui.live.task import Phase
from studio.ui.live.view import LiveView
from studio.ui.session import Session
from studio.ui.shortcuts import sequence
from studio.ui.view_settings import ViewSettings

NOTICE_MS = 6_000
"""How long a notice of the child is shown in the place of the status."""


class LiveStagePresenter(QObject):
    """Draws what is sent, and shows and turns the switches."""

    def __init__(self, view: LiveView, model: LiveModel, session: Session) -> None:
        super().__init__(view)
        self._view, self._model, self._session = view, model, session
        stage = view.stage
        self._seen = ViewSettings(stage, (stage.pane,), stage.backgrounds, session, "live_camera")
        view.controls.switched.connect(model.switch)
        view.controls.mood_chosen.connect(model.choose_mood)
        model.posed.connect(self._on_pose)
        model.state_changed.connect(self._on_state)
        model.task.phase_changed.connect(self._on_phase)
        model.ended.connect(self._on_ended)
        model.run_chosen.connect(self._show_moods)
        model.runs_changed.connect(self._show_moods)

    def close(self) -> None:
        """The window closes."""
        self._seen.close()

    def _show_moods(self) -> None:
        run = self._model.run
        self._view.controls.moods.show_moods(run.facts.moods if run is not None else ())

    def _on_pose(self, event: PoseEvent) -> None:
        ready = self._model.ready
        stance = ready.stance(event, time.monotonic()) if ready is not None else None
        if stance is not None:
            self._view.meters.show_values(stance.shapes)
            self._view.stage.show_stance(stance)

    def _on_state(self, state: LiveStateEvent) -> None:
        shown = self._model.switches.shown
        for name, on in (("mute", state.muted), ("freeze", state.frozen), ("neutral", state.neutral)):
            self._view.controls.show_switch(name, shown(name, on))
        self._view.controls.moods.show_mood(shown("mood", state.mood))
        # Worst first: what holds the avatar must be seen from every tab.
        held = self.tr("Live, neutral") if state.neutral else self.tr("Live, frozen") if state.frozen else ""
        held = held or (self.tr("Live, muted") if state.muted else "")
        health = "warn" if held or state.lost else "good"
        self._session.status_changed.emit("live", held or self.tr("Live"), health)
        if state.speaking and not held:
            self._session.step_done.emit("live")

    def _on_phase(self) -> None:
        self._view.controls.show_live(self._model.task.phase == Phase.LIVE)

    def _on_ended(self) -> None:
        self._view.stage.show_nobody()
        self._view.controls.moods.show_mood("")
        self._view.meters.clear()
        self._session.status_changed.emit("live", "", "")


class StatusPresenter(QObject):
    """Keeps the sentence under the avatar up to what is known, with what to do where it does not move."""

    def __init__(self, view: LiveView, model: LiveModel) -> None:
        super().__init__(view)
        self._view, self._model = view, model
        self._notice = QTimer(self)
        self._notice.setSingleShot(True)
        self._notice.setInterval(NOTICE_MS)
        self._notice.timeout.connect(self._show)
        model.task.phase_changed.connect(self._on_phase)
        model.task.silent.connect(self._on_silent)
        model.state_changed.connect(self._on_state)
        model.noticed.connect(self._on_notice)
        model.ended.connect(self._show)
        self._show()

    def close(self) -> None:
        """The window closes."""
        self._notice.stop()

    def _on_state(self) -> None:
        if not self._notice.isActive():
            self._show()

    def _on_notice(self, text: str) -> None:
        self._view.show_status(text, "warn")
        self._notice.start()

    def _on_phase(self) -> None:
        self._notice.stop()
        self._show()

    def _on_silent(self) -> None:
        text = self.tr("Live is not responding because this computer is very busy. Wait, or press Stop.")
        self._view.show_status(text, "bad")

    def _show(self) -> None:
        self._view.show_status(*self._text())

    def _text(self) -> tuple[str, str]:
        """The sentence, and "good", "warn", "bad" or ""."""
        phase, state, ready = self._model.task.phase, self._model.state, self._model.ready
        if phase == Phase.IDLE:
            return self.tr("Not live. Press Go live and speak."), ""
        if phase == Phase.STOPPING:
            return self.tr("Ending…"), ""
        if phase == Phase.STARTING or ready is None or state is None:
            return self.tr("Getting ready…"), ""
        source = title_of(ready.source, self.tr("your default microphone"))
        return self._live_text(source, state)

    def _live_text(self, source: str, state: LiveStateEvent) -> tuple[str, str]:
        mute, freeze, neutral = (sequence(one).toString() for one in ("mute", "freeze", "neutral"))
        also = " " + self.tr("Muted too ({0}).").format(mute) if state.muted else ""
        if state.neutral:
            text = self.tr("Neutral: the avatar stands still until you switch it off ({0}).").format(neutral)
            too = " " + self.tr("Frozen too ({0}).").format(freeze) if state.frozen else ""
            return text + too + also, "warn"
        if state.frozen:
            text = self.tr("Frozen: the avatar holds still until you switch it off ({0}).").format(freeze)
            return text + also, "warn"
        if state.lost:
            text = self.tr("No sound from {0}. Live resumes when sound returns.")
            return text.format(source), "bad"
        if state.muted:
            return self.tr("Muted: nothing you say is heard ({0}).").format(mute), "warn"
        if state.unheard:
            text = self.tr("Live: {0} is performed, but you can't hear it.").format(source)
            return f"{text} {native(state.unheard)}", "warn"
        if state.speaking:
            return self.tr("Live: {0} is heard.").format(source), "good"
        idles = self.tr("Live. You are silent, so the avatar idles.")
        return (idles if state.idling > 0 else self.tr("Live. You are silent.")).format(source), "good"
