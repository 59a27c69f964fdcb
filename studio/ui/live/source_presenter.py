"""Presenters of the performer card: run, options and Start; microphones and files; presets of Review."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject
from PySide6.QtWidgets import QFileDialog

from studio.errors import StudioError
from studio.ipc.commands import Command
from studio.ipc.events import LiveStateEvent, PoseEvent
from studio.playback.layers import presets
from studio.settings import NO_MICROPHONE
from studio.sound.sound_file import SoundInfo, sound_info
from studio.training.styles import run_choice
from studio.ui import messages, tasks
from studio.ui.live.model import LiveModel
from studio.ui.live.source_view import LiveSourceCard
from studio.ui.session import MicrophoneRequest, Session

if TYPE_CHECKING:
    from studio.capture.microphone import AudioDevice


class LiveSourcePresenter(QObject):
    """Starts and stops the performance with what the card has chosen."""

    def __init__(self, card: LiveSourceCard, model: LiveModel, session: Session) -> None:
        super().__init__(card)
        self._card, self._model, self._session = card, model, session
        card.start_toggled.connect(self.toggle)
        model.start_requested.connect(self.start)
        card.run_chosen.connect(model.choose_run)
        card.clip_reset_requested.connect(lambda: model.task.tell(Command("clip")))
        card.option_changed.connect(self._on_option)
        model.runs_changed.connect(self._show_runs)
        model.run_chosen.connect(self._show_ready)
        model.source_changed.connect(self._show_ready)
        model.state_changed.connect(self._on_state)
        model.posed.connect(self._on_pose)
        model.task.phase_changed.connect(lambda: card.show_running(model.task.phase))
        model.ended.connect(card.meter.clear)

    @property
    def args(self) -> list[str]:
        """Arguments of `saia live` for what is chosen, besides project, run and targets."""
        card, output = self._card, self._session.settings.audio_output
        args = list(self._model.selection.words)
        if card.file is not None:
            args += ["--file", str(card.file), *(["--output", output] if output else [])]
        elif card.device:
            args += ["--device", card.device]
        if self._model.look_ahead_ms is not None:
            args += ["--look-ahead", str(self._model.look_ahead_ms)]
        checks = ((card.gain, "--no-gain"), (card.gate, "--no-gate"), (card.early, "--no-early"))
        args += [option for check, option in checks if not check.isChecked()]
        return args + (["--suppress-noise"] if card.suppress else [])

    def toggle(self) -> None:
        """Go live, or end it."""
        if self._model.task.running:
            self._model.task.stop()
        else:
            self.start()

    def start(self) -> None:
        """Go live, where nothing is and a run is chosen."""
        project, run, task = self._session.project, self._model.run, self._model.task
        if not task.running and not self._model.checking and project is not None and run is not None:
            self._model.about_to_start.emit()
            # No target yet: the send card adds those that are switched on once the child is ready.
            task.start([str(project.folder), run.id, "--to", "none", "--poses", *self.args])

    def _show_runs(self) -> None:
        model = self._model
        self._card.show_runs([run_choice(run) for run in model.runs], model.selection)
        self._show_ready()

    def _show_ready(self) -> None:
        """Start may be pressed where there is something to start."""
        if not self._model.task.running:
            self._card.show_ready(self._model.run is not None and not self._model.checking)

    def _on_state(self, state: LiveStateEvent) -> None:
        shown = self._model.switches.shown
        for name, on in (("gain", state.gain_on), ("gate", state.idles), ("early", state.opens_early)):
            self._card.show_option(name, shown(name, on))

    def _on_pose(self, event: PoseEvent) -> None:
        clipped = self._model.state is not None and self._model.state.clipped
        self._card.meter.show_level(event.peak_dbfs, event.rms_dbfs, event.peak_dbfs, clipped)

    def _on_option(self, name: str, on: bool) -> None:
        if name != "noise":
            # That one takes effect with the next start.
            self._model.switch(name, on)


class MicrophonePresenter(QObject):
    """Fills the list of sources, and opens the file that is offered."""

    def __init__(self, card: LiveSourceCard, model: LiveModel, session: Session) -> None:
        super().__init__(card)
        self._card, self._model, self._session = card, model, session
        self._devices: tuple[AudioDevice, ...] | None = None
        self._default = ""
        self._opening = tasks.LatestTask(self)
        card.refresh_requested.connect(self._on_refresh)
        card.file_requested.connect(self._on_file)
        card.source_chosen.connect(self._on_chosen)
        session.microphones_listed.connect(lambda: self.refresh())
        session.performance_dropped.connect(self._on_dropped)
        model.about_to_start.connect(self.save)
        model.ready_changed.connect(self._on_ready)
        self._show()

    def save(self) -> None:
        """Remember the microphone: Record may choose another one later."""
        if self._card.file is None:
            self._session.change_settings(live_device=(self._card.device,))

    def explained(self, error: BaseException) -> BaseException:
        """A failure with what to do about it: where Record holds the same microphone, that is likely why."""
        if not isinstance(error, StudioError) or error.code != "device_unavailable":
            return error
        if self._card.file is not None or self._session.settings.audio_device != self._card.device:
            return error
        remedy = self.tr(
            "Record holds it, and it serves one at a time: choose No microphone in Record, then go live."
        )
        return StudioError(error.what, remedy, code=error.code)

    def _on_ready(self) -> None:
        """Say where a microphone is heard that is not the one chosen."""
        card, ready = self._card, self._model.ready
        if ready is None or card.file is not None or not card.device or ready.source == card.device:
            return
        what = self.tr("{0} is not connected; using {1} instead.").format(card.device, ready.source)
        messages.show_warning(card, what, self.tr("To change it, stop and choose another microphone."))

    def refresh(self, anew: bool = False) -> None:
        """List the microphones; anew, where something was plugged in since, which takes a moment."""
        from studio.capture.device_names import default_title
        from studio.capture.microphone import input_devices

        def found(listed: tuple[tuple[AudioDevice, ...], str]) -> None:
            self._default = listed[1]
            self.show_devices(listed[0])

        tasks.run(
            lambda: (input_devices(anew), default_title("source")),
            found,
            # Record says what is wrong with the sound system.
            lambda _: self.show_devices(()),
            owner=self,
        )

    def _on_refresh(self) -> None:
        """List them anew: Record does it where it has one open, which it closes for that moment."""
        request = MicrophoneRequest()
        self._session.microphones_requested.emit(request)
        if not request.accepted:
            self.refresh(anew=True)

    def offer(self, path: Path) -> None:
        """Choose a file, once it turns out to be a sound."""

        def good(info: SoundInfo) -> None:
            if info.duration > 0:
                self._choose(path)
            else:
                what = self.tr("{0} contains no sound.").format(path.name)
                bad(StudioError(what, self.tr("Choose another file.")))

        def bad(error: BaseException) -> None:
            self._choose(None)
            messages.show_error(self._card, error)

        self._model.show_checking(True)
        self._card.show_opening(path)
        self._opening.run(lambda: sound_info(path), good, bad)

    def _on_chosen(self) -> None:
        """Somebody chose from the list: a file that is still being opened is not chosen any more."""
        self._opening.drop()
        self.save()
        self._model.use_file(self._card.file)

    def _choose(self, path: Path | None) -> None:
        if path is not None:
            # Of a file offered before.
            messages.dismiss_error(self._card)
        self._card.show_file(path)
        self._model.use_file(self._card.file)

    def show_devices(self, devices: tuple[AudioDevice, ...]) -> None:
        """List these microphones."""
        self._devices = devices
        self._show()

    def _show(self) -> None:
        names = [device.name for device in self._devices or ()]
        known = self._devices is not None
        self._card.show_devices(names, self._chosen, known=known, default=self._default)

    @property
    def _chosen(self) -> str:
        """The microphone chosen here, else the one that Record uses."""
        settings = self._session.settings
        chosen = settings.live_device[0] if settings.live_device else settings.audio_device
        return "" if chosen == NO_MICROPHONE else chosen

    def _on_dropped(self, paths: Sequence[Path]) -> None:
        """Sounds were dropped: the first is performed next, when Go live is pressed."""
        path = paths[0]
        if self._model.task.running:
            messages.show_note(self._card, self.tr("Stop first, then drop {0} again.").format(path.name))
        else:
            self.offer(path)
            if len(paths) > 1:
                one = self.tr("Live performs one sound at a time: {0} was chosen.")
                messages.show_note(self._card, one.format(path.name))

    def _on_file(self) -> None:
        kinds = self.tr("Sound (*.wav *.mp3 *.flac *.ogg *.m4a *.mp4 *.mov);;All files (*)")
        before = self._card.file
        start = str(before.parent if before is not None else Path.home())
        chosen, _ = QFileDialog.getOpenFileName(self._card, self.tr("Perform a file"), start, kinds)
        if chosen:
            self.offer(Path(chosen))
        else:
            # The list goes back to what was chosen before.
            self._card.show_file(None)


class LiveTuningPresenter(QObject):
    """The presets of Review's Tune panel that can be laid over the live motion."""

    def __init__(self, card: LiveSourceCard, model: LiveModel, session: Session) -> None:
        super().__init__(card)
        self._card, self._model, self._session = card, model, session
        self._presets: dict[str, presets.Preset] = {}
        self._chosen = ""
        card.tuning_chosen.connect(self._on_chosen)
        model.ready_changed.connect(self._send)

    def refresh(self) -> None:
        """List the presets there are, which Review may have changed."""
        project = self._session.project
        folder = project.folder / presets.FOLDER if project is not None else None

        def read() -> dict[str, presets.Preset]:
            own = presets.saved(folder)[0] if folder is not None else ()
            found = (one for one in (*presets.shipped(), *own) if not one.tuning.neutral)
            return {one.title: one for one in found}

        tasks.run(read, self._show, owner=self)

    def _send(self) -> None:
        preset = self._presets.get(self._chosen)
        plain = presets.to_plain(preset.tuning) if preset is not None else {}
        self._model.task.tell(Command("tune", json.dumps(plain, ensure_ascii=False)))

    def _show(self, found: dict[str, presets.Preset]) -> None:
        self._presets = found
        self._card.show_tunings(list(found), self._chosen)

    def _on_chosen(self, title: str) -> None:
        self._chosen = title
        self._send()
