"""Live: thought, no layout. A child process performs; this starts it, talks to it, shows what it says."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, QTimer

from studio.ipc.commands import Command, switch
from studio.ipc.events import (
    ChannelsEvent,
    ChildEvent,
    LiveStateEvent,
    LookAheadEvent,
    NoticeEvent,
    PoseEvent,
    ReadyEvent,
    VoiceEvent,
)
from studio.render.world_pose import WorldPose
from studio.training.styles import RunSelection, newest, run_choice
from studio.ui import messages
from studio.ui.avatar_store import Avatars
from studio.ui.live.performing import LiveTask, Phase
from studio.ui.live.sounds import MicrophonePresenter
from studio.ui.live.standing import StatusPresenter
from studio.ui.live.state import LookAheadOption, Ready, look_aheads_of, target_state
from studio.ui.live.targets import LiveTargets
from studio.ui.live.tunings import LiveTuningPresenter
from studio.ui.live.view import LiveView
from studio.ui.live.voice import DelayedVoicePresenter
from studio.ui.live.wishes import PendingSwitches
from studio.ui.session import Session
from studio.ui.undo import UndoScope

if TYPE_CHECKING:
    from studio.project import Run

WARM_UP_MS = 300
USUAL_MS = 100
"""The look-ahead that `saia live` takes where none is chosen."""


class LivePresenter(QObject):
    """Thought of the Live tab."""

    def __init__(self, view: LiveView, session: Session) -> None:
        super().__init__(view)
        self._view, self._session = view, session
        self.undo_scope = UndoScope(self)
        self._performing, self._wishes = LiveTask(self), PendingSwitches()
        self._ready: Ready | None = None
        self._state: LiveStateEvent | None = None
        self._wanted = RunSelection()
        self._look_ahead_ms: int | None = None
        self._active = False
        self._targets = LiveTargets(view.send, session, self._performing.tell)
        self._tunings = LiveTuningPresenter(view.source, session, self._performing.tell)
        self._sounds = MicrophonePresenter(view.source, session)
        self._standing = StatusPresenter(view, self._performing)
        self._voice = DelayedVoicePresenter(view.latency.voice, session, self._performing.tell)
        self._avatars = Avatars(view.stage, session)
        self._connect()
        self._on_project()

    @property
    def running(self) -> bool:
        """Whether it is live, or about to be."""
        return self._performing.running

    # What the window asks

    def activate(self) -> None:
        """The tab is shown: poses are drawn."""
        self._active = True
        self._show_runs()
        self._tunings.read()
        self._sounds.look(refresh=False)
        self._voice.look()
        self._performing.tell(switch("poses", True))
        QTimer.singleShot(WARM_UP_MS, self, self._warm_up)

    def deactivate(self) -> None:
        """Another tab is shown; the performance goes on, only its picture rests."""
        self._active = False
        self._performing.tell(switch("poses", False))

    def may_close(self) -> bool:
        """Whether the window may close; while live it asks, for the avatar stops with it."""
        if not self.running:
            return True
        question, details = self.tr("You are live."), self.tr("The avatar stops when the window closes.")
        return messages.ask(self._view, question, details, self.tr("End and close"), self.tr("Stay live"))

    def close(self) -> None:
        """The window closes."""
        self._standing.close()
        self._performing.close()
        self._targets.close()
        self._view.stage.figure.dispose()

    # Start and stop

    def toggle(self) -> None:
        """Go live, or end it."""
        project, run = self._session.project, self._run()
        if self.running:
            self._performing.stop()
        elif project is not None and run is not None:
            messages.dismiss_error(self._view)
            self._sounds.keep()
            words = [str(project.folder), run.id, "--to", "none", "--poses", *self._options()]
            self._performing.start(words)

    def _options(self) -> list[str]:
        card, words = self._view.source, [*self._wanted.words, *self._sounds.options]
        if self._look_ahead_ms is not None:
            words += ["--look-ahead", str(self._look_ahead_ms)]
        for on, word in ((card.gain.isChecked(), "--no-gain"), (card.gate.isChecked(), "--no-gate")):
            words += [] if on else [word]
        return words + (["--suppress-noise"] if card.suppress else [])

    # What the child says

    def _on_event(self, event: ChildEvent) -> None:
        match event:
            case PoseEvent():
                self._on_pose(event)
            case LiveStateEvent():
                self._on_state(event)
            case NoticeEvent():
                self._standing.note(f"{event.what} {event.remedy}")
            case ReadyEvent():
                self._on_ready(Ready.of(event))
            case ChannelsEvent() if self._ready is not None:
                self._ready = self._ready.of_channels(event)
            case VoiceEvent():
                self._voice.told(event.to)
            case LookAheadEvent():
                self._show_look_aheads(event.look_ahead_ms)

    def _on_ready(self, ready: Ready) -> None:
        self._ready = ready
        self._targets.begin()
        self._tunings.send()
        self._voice.begin(self._view.source.file is not None)
        self._show_look_aheads(ready.look_ahead_ms)
        if not self._active:
            self._performing.tell(switch("poses", False))
        other = self._sounds.stands_in(ready.source)
        if other is not None:
            messages.show_warning(self._view, other.what, other.remedy)

    def _on_state(self, state: LiveStateEvent) -> None:
        self._state = state
        view, shown = self._view, self._wishes.shown
        self._show_latency(state)
        for name, on in (("mute", state.muted), ("freeze", state.frozen), ("neutral", state.neutral)):
            view.controls.show_switch(name, shown(name, on))
        for name, on in (("gain", state.gain_on), ("gate", state.idles)):
            view.source.show_option(name, shown(name, on))
        self._targets.show_states({one.to: target_state(one) for one in state.targets})
        self._standing.show(self._ready, state)
        held = self.tr("Live, neutral") if state.neutral else self.tr("Live, frozen") if state.frozen else ""
        held = held or (self.tr("Live, muted") if state.muted else "")
        light = "warn" if held or state.lost else "good"
        self._session.status_changed.emit("live", held or self.tr("Live"), light)

    def _show_latency(self, state: LiveStateEvent) -> None:
        card = self._view.latency
        if state.latency_ms > 0:
            card.show_latency(state.latency_ms, state.seen, state.sound_delay_ms)
        elif self._view.source.file is not None:
            card.show_none(self.tr("A file is known ahead: voice and lips come together."))
        else:
            card.show_none()

    def _on_pose(self, event: PoseEvent) -> None:
        view, ready = self._view, self._ready
        clipped = self._state is not None and self._state.clipped
        view.source.meter.show_level(event.peak_dbfs, event.rms_dbfs, event.peak_dbfs, clipped)
        pose = ready.pose(event) if ready is not None else None
        if ready is None or pose is None:
            return
        shapes = dict(zip(ready.shape_names, map(float, pose.shapes), strict=True))
        view.meters.show_values(shapes)
        view.stage.show_stance(WorldPose.of_pose(ready.skeleton, pose, shapes))

    def _on_moved(self) -> None:
        """Starting, live, stopping or idle: the controls follow."""
        view, phase = self._view, self._performing.phase
        view.source.show_running(phase)
        view.controls.show_live(phase == Phase.LIVE)

    def _on_failed(self, what: str, remedy: str) -> None:
        messages.show_failure(self._view, what, self._sounds.remedy(what, remedy))

    def _on_forced(self) -> None:
        what = self.tr("The performance did not end by itself, so it was ended for you.")
        messages.show_warning(self._view, what, self.tr("Nothing is lost: you can go live again."))

    def _on_ended(self) -> None:
        view = self._view
        self._ready = self._state = None
        self._wishes.forget()
        self._targets.end()
        self._voice.over()
        view.source.meter.clear()
        view.latency.show_none()
        view.stage.show_nobody()
        view.meters.clear()
        self._session.status_changed.emit("live", "", "")
        self._standing.show(None, None)
        self._show_runs()

    def _show_voice(self) -> None:
        self._view.latency.voice.show_file(self._view.source.file is not None)

    # Choices

    def _connect(self) -> None:
        view, session, card = self._view, self._session, self._view.source
        performing = self._performing
        performing.told.connect(self._on_event)
        performing.moved.connect(self._on_moved)
        performing.failed.connect(self._on_failed)
        performing.forced.connect(self._on_forced)
        performing.ended.connect(self._on_ended)
        view.train_requested.connect(lambda: session.tab_requested.emit("train"))
        card.start_toggled.connect(self.toggle)
        card.run_chosen.connect(self._on_run)
        card.clip_reset_requested.connect(lambda: performing.tell(Command("clip")))
        card.option_changed.connect(self._on_option)
        self._sounds.checked.connect(self._show_ready)
        self._sounds.checked.connect(self._show_voice)
        card.source_chosen.connect(self._show_voice)
        view.controls.switched.connect(self._on_switched)
        view.latency.look_ahead_chosen.connect(self._on_look_ahead)
        session.project_opened.connect(self._on_project)
        session.runs_changed.connect(self._show_runs)
        session.performance_dropped.connect(self._on_dropped)

    def _on_project(self) -> None:
        self._performing.stop()
        self._wanted, self._look_ahead_ms = RunSelection(), None
        self._show_runs()

    def _runs(self) -> list[Run]:
        project = self._session.project
        return [run for run in project.runs if run.has_weights] if project is not None else []

    def _run(self) -> Run | None:
        return next((run for run in self._runs() if run.id == self._wanted.run), None)

    def _show_runs(self) -> None:
        runs = self._runs()
        self._view.show_empty(not runs)
        if runs and self._run() is None and not self.running:
            self._wanted, self._look_ahead_ms = RunSelection(newest(runs).id), None
        self._view.source.show_runs([run_choice(run) for run in runs], self._wanted)
        if not self.running:
            self._show_ready()
            self._show_look_aheads(self._look_ahead_ms)

    def _show_ready(self) -> None:
        """Start may be pressed where there is something to start."""
        if not self.running:
            self._view.source.show_ready(self._run() is not None and not self._sounds.checking)

    def _on_run(self, wanted: RunSelection) -> None:
        if wanted.run != self._wanted.run:
            self._look_ahead_ms = None
        self._wanted = wanted
        self._show_ready()
        self._show_look_aheads(self._look_ahead_ms)

    def _show_look_aheads(self, chosen_ms: int | None) -> None:
        run, ready = self._run(), self._ready
        known = {one.ms: one for one in look_aheads_of(run)} if run is not None else {}
        offered = list(known.values())
        if ready is not None:
            plain = {ready.look_ahead_ms: LookAheadOption(ready.look_ahead_ms, ready.reach_ms)}
            offered = [known.get(ms) or plain.get(ms) or LookAheadOption(ms, ms) for ms in ready.look_aheads]
        self._view.latency.show_look_aheads(offered, USUAL_MS if chosen_ms is None else chosen_ms)

    def _on_look_ahead(self, ms: int) -> None:
        self._look_ahead_ms = ms
        self._performing.tell(Command("look-ahead", str(ms)))

    def _on_switched(self, name: str, on: bool) -> None:
        self._wishes.wish(name, on)
        self._performing.tell(switch(name, on))

    def _on_option(self, name: str, on: bool) -> None:
        if name != "noise":  # that one takes effect with the next start
            self._on_switched(name, on)

    def _on_dropped(self, paths: Sequence[Path]) -> None:
        """Sounds were dropped: the first is performed next, at a press of Go live."""
        path = paths[0]
        if self.running:
            messages.show_note(self._view, self.tr("Stop first, then drop {0} again.").format(path.name))
        elif self._run() is None:
            messages.show_note(
                self._view, self.tr("Train a run first: it can perform {0}.").format(path.name)
            )
        else:
            self._sounds.offer(path)
            if len(paths) > 1:
                one = self.tr("One sound is performed at a time: {0} is chosen.")
                messages.show_note(self._view, one.format(path.name))

    def _warm_up(self) -> None:
        if self._active and not self._session.rolling:
            self._view.stage.figure.warm_up()
