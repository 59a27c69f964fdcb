"""Presenter of the latency card: what was measured, the look-aheads of the run, and the delayed voice."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import QObject

from studio.evaluation.learning_curve import error_of, number_of
from studio.ipc.commands import Command
from studio.ipc.events import LiveStateEvent
from studio.ui import tasks
from studio.ui.live.latency_view import NOBODY, SYSTEM, LatencyCard, LookAheadOption, VoiceRow
from studio.ui.live.model import LiveModel
from studio.ui.session import Session

if TYPE_CHECKING:
    from studio.project import Run

USUAL_REACH_MS = 60
"""As in inference/live/steps.py, which needs torch."""


class LatencyPresenter(QObject):
    """Shows how late the avatar is, and what the run offers to change that."""

    def __init__(self, card: LatencyCard, model: LiveModel) -> None:
        super().__init__(card)
        self._card, self._model = card, model
        card.look_ahead_chosen.connect(model.choose_look_ahead)
        model.runs_changed.connect(self._show_chosen)
        model.run_chosen.connect(self._show_chosen)
        model.ready_changed.connect(self._on_ready)
        model.look_ahead_changed.connect(self._show_look_aheads)
        model.state_changed.connect(self._on_state)
        model.ended.connect(self._show_none)
        model.source_changed.connect(self._on_source)

    def _on_ready(self) -> None:
        if self._model.ready is not None:
            self._show_look_aheads(self._model.ready.look_ahead_ms)

    def _on_state(self, state: LiveStateEvent) -> None:
        if state.latency_ms > 0:
            settled = state.settled
            self._card.show_latency(state.latency_ms, state.seen, state.sound_delay_ms, settled)
        else:
            self._show_none()

    def _show_none(self) -> None:
        file = self.tr("A file is read ahead, so voice and lips are in sync.")
        self._card.show_none(file if self._model.file is not None else "")

    def _on_source(self) -> None:
        if not self._model.task.running:
            self._show_none()

    def _show_chosen(self) -> None:
        if not self._model.task.running:
            self._show_look_aheads(self._model.look_ahead_ms)

    def _show_look_aheads(self, chosen_ms: int | None) -> None:
        run, ready = self._model.run, self._model.ready
        measured = {one.ms: one for one in look_aheads_of(run)} if run is not None else {}
        offered = list(measured.values())
        if ready is not None:
            # The child knows best what it offers; the report knows how good each of them is.
            in_use = {ready.look_ahead_ms: LookAheadOption(ready.look_ahead_ms, ready.reach_ms)}
            offered = [
                measured.get(ms) or in_use.get(ms) or LookAheadOption(ms, ms) for ms in ready.look_aheads
            ]
        usual = min(offered, key=lambda one: abs(one.reach_ms - USUAL_REACH_MS), default=None)
        usual_ms = usual.ms if usual is not None else USUAL_REACH_MS
        speaks = run is not None and run.facts.form == "speech"
        self._card.show_look_aheads(offered, usual_ms if chosen_ms is None else chosen_ms, speaks)


class DelayedVoicePresenter(QObject):
    """Sends the voice where it was chosen to go, and shows where it goes."""

    def __init__(self, row: VoiceRow, model: LiveModel, session: Session) -> None:
        super().__init__(row)
        self._row, self._model, self._session = row, model, session
        # Where the performance says the voice goes, "" before it does.
        self._in_use = ""
        self._names: tuple[str, ...] = ()
        row.chosen.connect(self._on_chosen)
        session.microphones_listed.connect(self.refresh)
        model.source_changed.connect(lambda: row.show_file(model.file is not None))
        model.ready_changed.connect(self._on_ready)
        model.voice_changed.connect(self._on_voice)
        model.ended.connect(self._on_ended)
        row.show_outputs((), self._chosen)

    def refresh(self) -> None:
        """List the outputs there are."""
        from studio.capture.microphone import output_names

        # Without a sound system the list stays as it is: Record says what is wrong with it.
        tasks.run(output_names, self.show_outputs, lambda _: None, owner=self)

    def show_outputs(self, names: tuple[str, ...]) -> None:
        """List outputs, and the one in use."""
        self._names = names
        self._row.show_outputs(names, self._in_use or self._chosen)

    @property
    def _chosen(self) -> str:
        return self._session.settings.live_voice or NOBODY

    def _on_ready(self) -> None:
        if self._model.ready is not None and self._model.file is None and self._chosen != NOBODY:
            self._model.task.tell(Command("voice-to", self._chosen))

    def _on_voice(self, output: str | None) -> None:
        """The performance says where the voice goes; what was chosen and cannot be is off."""
        self._in_use = NOBODY if output is None else output or SYSTEM
        self.show_outputs(self._names)

    def _on_ended(self) -> None:
        self._in_use = ""
        self.show_outputs(self._names)

    def _on_chosen(self, value: str) -> None:
        self._session.change_settings(live_voice="" if value == NOBODY else value)
        self._model.task.tell(Command("voice-to", value))


def look_aheads_of(run: Run) -> tuple[LookAheadOption, ...]:
    """The look-aheads a run's report tells of, the shortest first; empty where it tells of none."""
    made = []
    for one in run.facts.look_aheads:
        try:
            figures = error_of(one), number_of(one.get("pearson_mouth"))
            made.append(LookAheadOption(int(one["ms"]), float(one["reach_ms"]), *figures))
        except (AttributeError, KeyError, TypeError, ValueError):
            continue
    return tuple(sorted(made, key=lambda one: one.ms))
