"""Live: thought, no layout. A child process performs; this starts it, talks to it, shows what it says."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from PySide6.QtCore import QObject, QTimer
from PySide6.QtWidgets import QFileDialog

from studio.picture.stance import Stance
from studio.playback.layers import presets
from studio.ui import background, messages
from studio.ui.avatars import Avatars
from studio.ui.jobs import Job
from studio.ui.live.state import LookAhead, Ready, State, look_aheads_of
from studio.ui.live.targets import LiveTargets
from studio.ui.live.view import LiveView
from studio.ui.review.clip import Wanted, run_choice
from studio.ui.session import Session

if TYPE_CHECKING:
    from studio.capture.audio import AudioDevice
    from studio.project import Run

NOTICE_MS = 6_000
"""How long a notice of the child stands in the status sentence."""
WARM_UP_MS = 300
USUAL_MS = 100
"""The look-ahead that `saia live` takes where none is chosen."""


class LivePresenter(QObject):
    """Thought of the Live tab."""

    def __init__(self, view: LiveView, session: Session) -> None:
        super().__init__(view)
        self._view, self._session = view, session
        self._job: Job | None = None
        self._ready: Ready | None = None
        self._state: State | None = None
        self._wanted, self._look_ahead_ms, self._tuning = Wanted(), 0, ""
        self._presets: dict[str, presets.Preset] = {}
        self._active = False
        self._targets = LiveTargets(view.send, session, self._tell)
        self._avatars = Avatars(view.stage, session)
        self._notice = QTimer(self)
        self._notice.setSingleShot(True)
        self._notice.setInterval(NOTICE_MS)
        self._notice.timeout.connect(self._show_status)
        self._connect()
        self._show_devices(())
        self._on_project()

    @property
    def running(self) -> bool:
        """Whether it is live, or about to be."""
        return self._job is not None

    # What the window asks

    def activate(self) -> None:
        """The tab is shown: poses are drawn."""
        self._active = True
        self._show_runs()
        self._read_presets()
        self._list_devices(refresh=False)
        self._tell("poses on")
        QTimer.singleShot(WARM_UP_MS, self, self._warm_up)

    def deactivate(self) -> None:
        """Another tab is shown; the performance goes on, only its picture rests."""
        self._active = False
        self._tell("poses off")

    def may_close(self) -> bool:
        """Whether the window may close; while live it asks, for the avatar stops with it."""
        if self._job is None:
            return True
        question, details = self.tr("You are live."), self.tr("The avatar stops when the window closes.")
        return messages.ask(self._view, question, details, self.tr("End and close"), self.tr("Stay live"))

    def close(self) -> None:
        """The window closes."""
        self._notice.stop()
        job, self._job = self._job, None
        if job is not None:
            job.close()
        self._targets.close()
        self._view.stage.figure.dispose()

    # Start and stop

    def toggle(self) -> None:
        """Go live, or end it."""
        if self._job is not None:
            self._job.stop()
            self._view.source.show_ready(False)
            return
        project, run = self._session.project, self._run()
        if project is None or run is None:
            return
        self._ready = self._state = None
        job = self._job = Job(self)
        job.event_received.connect(self._on_event)
        job.failed.connect(self._on_failed)
        job.ended.connect(self._on_ended)
        self._view.source.show_running("starting")
        self._show_status()
        job.start(["live", str(project.folder), run.id, "--to", "none", "--poses", *self._options()])

    def _options(self) -> list[str]:
        card, words = self._view.source, []
        if self._wanted.style:
            words += ["--style", self._wanted.style]
        if self._wanted.seed:
            words += ["--seed", str(self._wanted.seed)]
        if card.file is not None:
            words += ["--file", str(card.file)]
            if self._session.settings.audio_output:
                words += ["--output", self._session.settings.audio_output]
        elif card.device:
            words += ["--device", card.device]
        if self._look_ahead_ms:
            words += ["--look-ahead", str(self._look_ahead_ms)]
        for on, word in ((card.gain.isChecked(), "--no-gain"), (card.gate.isChecked(), "--no-gate")):
            words += [] if on else [word]
        return words + (["--suppress-noise"] if card.suppress else [])

    def _tell(self, line: str) -> None:
        if self._job is not None:
            self._job.tell(line)

    # What the child says

    def _on_event(self, event: dict[str, Any]) -> None:
        kind = event["event"]
        if kind == "pose":
            self._on_pose(event)
        elif kind == "state":
            self._on_state(State.of(event))
        elif kind == "notice":
            self._on_notice(str(event["what"]), str(event["remedy"]))
        elif kind == "ready":
            self._on_ready(Ready.of(event))
        elif kind == "channels" and self._ready is not None:
            self._ready = self._ready.of_channels(event)
        elif kind == "look_ahead":
            self._show_look_aheads(int(event["look_ahead_ms"]))

    def _on_ready(self, ready: Ready) -> None:
        self._ready = ready
        view = self._view
        view.source.show_running("live")
        view.controls.show_live(True)
        self._targets.begin()
        self._send_tuning()
        self._show_look_aheads(ready.look_ahead_ms)
        if not self._active:
            self._tell("poses off")

    def _on_state(self, state: State) -> None:
        self._state = state
        view = self._view
        late = state.latency_ms if state.latency_ms > 0 else None
        view.latency.show_latency(late, state.seen, state.sound_delay_ms)
        for name, on in (("mute", state.muted), ("freeze", state.frozen), ("neutral", state.neutral)):
            view.controls.show_switch(name, on)
        self._targets.show_states(state.targets)
        if not self._notice.isActive():
            self._show_status()
        self._session.status_changed.emit("live", self.tr("Live"), "warn" if state.lost else "good")

    def _on_pose(self, event: dict[str, Any]) -> None:
        view, ready = self._view, self._ready
        peak = float(event["peak_dbfs"])
        clipped = self._state is not None and self._state.clipped
        view.source.meter.show_level(peak, float(event["rms_dbfs"]), peak, clipped)
        pose = ready.pose(event) if ready is not None else None
        if ready is None or pose is None:
            return
        shapes = dict(zip(ready.shape_names, map(float, pose.shapes), strict=True))
        view.meters.show_values(shapes)
        view.stage.show_stance(Stance.of_pose(ready.skeleton, pose, shapes))

    def _on_notice(self, what: str, remedy: str) -> None:
        self._view.show_status(f"{what} {remedy}", "warn")
        self._notice.start()

    def _on_failed(self, what: str, remedy: str) -> None:
        if "could not be opened" in what and not self._view.source.file:
            own = self.tr("Record has it open too: choose another microphone, or none, there or here.")
            remedy = f"{remedy} {own}"
        messages.show_failure(self._view, what, remedy)

    def _on_ended(self) -> None:
        job, self._job = self._job, None
        if job is not None:
            job.deleteLater()
        view = self._view
        self._ready = self._state = None
        self._notice.stop()
        self._targets.end()
        view.source.show_running("idle")
        view.source.meter.clear()
        view.controls.show_live(False)
        view.latency.show_latency(None, "", 0)
        view.stage.show_nothing()
        view.meters.clear()
        self._session.status_changed.emit("live", "", "")
        self._show_runs()
        self._show_status()

    def _show_status(self) -> None:
        view, state = self._view, self._state
        if self._job is None:
            view.show_status(self.tr("Not live."))
        elif self._ready is None or state is None:
            view.show_status(self.tr("Getting ready…"))
        elif state.neutral:
            view.show_status(self.tr("Neutral: the avatar stands still until you switch it off (N)."), "warn")
        elif state.frozen:
            view.show_status(self.tr("Frozen: the avatar holds still until you switch it off (F)."), "warn")
        elif state.lost:
            told = self.tr("No sound comes from {0}: it goes on by itself as soon as some does.")
            view.show_status(told.format(self._ready.source), "bad")
        elif state.muted:
            view.show_status(self.tr("Muted: nothing you say is heard (M)."), "warn")
        elif state.speaking:
            view.show_status(self.tr("Live: {0} is heard.").format(self._ready.source), "good")
        else:
            quiet = self.tr("Live: {0} is quiet, the avatar idles.")
            told = quiet if state.idling > 0 else self.tr("Live: {0} is quiet.")
            view.show_status(told.format(self._ready.source), "good")

    # Choices

    def _connect(self) -> None:
        view, session, card = self._view, self._session, self._view.source
        view.train_requested.connect(lambda: session.tab_requested.emit("train"))
        card.start_toggled.connect(self.toggle)
        card.run_chosen.connect(self._on_run)
        card.file_requested.connect(self._on_file)
        card.refresh_requested.connect(lambda: self._list_devices(refresh=True))
        card.tuning_chosen.connect(self._on_tuning)
        card.clip_reset_requested.connect(lambda: self._tell("clip"))
        card.option_changed.connect(self._on_option)
        view.controls.switched.connect(self._on_switched)
        view.latency.look_ahead_chosen.connect(self._on_look_ahead)
        session.project_opened.connect(self._on_project)
        session.runs_changed.connect(self._show_runs)

    def _on_project(self) -> None:
        if self._job is not None:
            self._job.stop()
        self._wanted, self._look_ahead_ms = Wanted(), 0
        self._show_runs()
        self._show_status()

    def _runs(self) -> list[Run]:
        project = self._session.project
        return [run for run in project.runs if run.has_weights] if project is not None else []

    def _run(self) -> Run | None:
        return next((run for run in self._runs() if run.id == self._wanted.run), None)

    def _show_runs(self) -> None:
        runs = self._runs()
        self._view.show_empty(not runs)
        if runs and self._run() is None and self._job is None:
            self._wanted, self._look_ahead_ms = Wanted(runs[-1].id), 0
        self._view.source.show_runs([run_choice(run) for run in runs], self._wanted)
        if self._job is None:
            self._view.source.show_ready(self._run() is not None)
            self._show_look_aheads(self._look_ahead_ms)

    def _on_run(self, wanted: Wanted) -> None:
        if wanted.run != self._wanted.run:
            self._look_ahead_ms = 0
        self._wanted = wanted
        self._view.source.show_ready(self._run() is not None)
        self._show_look_aheads(self._look_ahead_ms)

    def _show_look_aheads(self, chosen_ms: int) -> None:
        run, ready = self._run(), self._ready
        known = {one.ms: one for one in look_aheads_of(run)} if run is not None else {}
        offered = list(known.values())
        if ready is not None:
            plain = {ready.look_ahead_ms: LookAhead(ready.look_ahead_ms, ready.reach_ms)}
            offered = [known.get(ms) or plain.get(ms) or LookAhead(ms, ms) for ms in ready.look_aheads]
        self._view.latency.show_look_aheads(offered, chosen_ms or USUAL_MS)

    def _on_look_ahead(self, ms: int) -> None:
        self._look_ahead_ms = ms
        self._tell(f"look-ahead {ms}")

    def _on_switched(self, name: str, on: bool) -> None:
        self._tell(f"{name} {'on' if on else 'off'}")

    def _on_option(self, name: str, on: bool) -> None:
        if name != "noise":  # that one takes effect with the next start
            self._on_switched(name, on)

    def _on_file(self) -> None:
        kinds = self.tr("Sound (*.wav *.mp3 *.flac *.ogg *.m4a *.mp4 *.mov);;All files (*)")
        chosen, _ = QFileDialog.getOpenFileName(
            self._view, self.tr("Perform a file"), str(Path.home()), kinds
        )
        self._view.source.show_file(Path(chosen) if chosen else None)

    # Presets and microphones

    def _read_presets(self) -> None:
        project = self._session.project
        folder = project.folder / presets.FOLDER if project is not None else None

        def read() -> dict[str, presets.Preset]:
            own = presets.saved(folder)[0] if folder is not None else ()
            found = (one for one in (*presets.shipped(), *own) if not one.tuning.neutral)
            return {one.title: one for one in found}

        def show(found: dict[str, presets.Preset]) -> None:
            self._presets = found
            self._view.source.show_tunings(list(found), self._tuning)

        background.run(read, show, owner=self)

    def _on_tuning(self, title: str) -> None:
        self._tuning = title
        self._send_tuning()

    def _send_tuning(self) -> None:
        import json

        preset = self._presets.get(self._tuning)
        plain = presets.to_plain(preset.tuning) if preset is not None else {}
        self._tell(f"tune {json.dumps(plain, ensure_ascii=False)}")

    def _list_devices(self, refresh: bool) -> None:
        from studio.capture.audio import input_devices

        background.run(
            lambda: input_devices(refresh),
            self._show_devices,
            lambda _: self._show_devices(()),  # Record says what is wrong with the sound system
            owner=self,
        )

    def _show_devices(self, devices: tuple[AudioDevice, ...]) -> None:
        names = [("", self.tr("System's microphone")), *((one.name, one.name) for one in devices)]
        chosen = self._view.source.device or self._session.settings.audio_device
        self._view.source.show_devices(names, chosen)

    def _warm_up(self) -> None:
        if self._active and not self._session.rolling:
            self._view.stage.figure.warm_up()
