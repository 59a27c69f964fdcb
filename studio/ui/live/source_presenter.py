"""Presenter of the performer card: the run, its layers and options, a preset of Review, and Start."""

from __future__ import annotations

import json

from PySide6.QtCore import QObject

from studio.ipc.commands import Command
from studio.ipc.events import LiveStateEvent, PoseEvent
from studio.playback.layers import presets
from studio.training.run_choice import run_choice
from studio.ui import tasks
from studio.ui.live.model import LiveModel
from studio.ui.live.source_view import LiveSourceCard
from studio.ui.session import Session


class LiveSourcePresenter(QObject):
    """Starts and stops the performance with what the card has chosen."""

    def __init__(self, card: LiveSourceCard, model: LiveModel, session: Session) -> None:
        super().__init__(card)
        self._card, self._model, self._session = card, model, session
        card.start_toggled.connect(self.toggle)
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
        for on, option in ((card.gain.isChecked(), "--no-gain"), (card.gate.isChecked(), "--no-gate")):
            args += [] if on else [option]
        return args + (["--suppress-noise"] if card.suppress else [])

    def toggle(self) -> None:
        """Go live, or end it."""
        project, run, task = self._session.project, self._model.run, self._model.task
        if task.running:
            task.stop()
        elif project is not None and run is not None:
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
        for name, on in (("gain", state.gain_on), ("gate", state.idles)):
            self._card.show_option(name, shown(name, on))

    def _on_pose(self, event: PoseEvent) -> None:
        clipped = self._model.state is not None and self._model.state.clipped
        self._card.meter.show_level(event.peak_dbfs, event.rms_dbfs, event.peak_dbfs, clipped)

    def _on_option(self, name: str, on: bool) -> None:
        if name != "noise":  # that one takes effect with the next start
            self._model.switch(name, on)


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
