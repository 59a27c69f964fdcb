"""Presenter of remote control: what other programs press is done here, and they are told how Live is."""

from __future__ import annotations

from PySide6.QtCore import QObject, Qt, Signal
from PySide6.QtGui import QGuiApplication

from studio.errors import StudioError
from studio.ipc.commands import Command
from studio.ipc.events import KeptEvent
from studio.remote.server import SWITCHES, RemoteRequest, RemoteServer, RemoteState
from studio.ui import messages
from studio.ui.language import sentences
from studio.ui.live.model import LiveModel
from studio.ui.live.stream_view import StreamCard
from studio.ui.live.task import Phase
from studio.ui.session import Session


class RemotePresenter(QObject):
    """Listens while the setting is on, and presses what it is asked to."""

    _pressed = Signal(object)

    def __init__(self, card: StreamCard, model: LiveModel, session: Session) -> None:
        super().__init__(card)
        self._card, self._model, self._session = card, model, session
        # The server's threads ask; the window's thread does it.
        self._pressed.connect(self._on_pressed, Qt.ConnectionType.QueuedConnection)
        self._server = RemoteServer(self._pressed.emit)
        self._listening: tuple[bool, int] | None = None
        card.remote_switched.connect(lambda on: session.change_settings(remote=on))
        card.copy_requested.connect(self._on_copy)
        card.keep_requested.connect(self._keep)
        model.kept.connect(self._on_kept)
        session.settings_changed.connect(self._listen)
        model.state_changed.connect(self._tell)
        model.task.phase_changed.connect(self._on_phase)
        self._listen()

    @property
    def port(self) -> int:
        """The port listened on, 0 for none."""
        return self._server.port

    def close(self) -> None:
        """The window closes."""
        self._server.stop()

    def _listen(self) -> None:
        settings = self._session.settings
        wanted, problem = (settings.remote, settings.remote_port), ""
        if wanted == self._listening:
            return
        self._listening = wanted
        try:
            if settings.remote:
                self._server.start(settings.remote_port)
            else:
                self._server.stop()
        except StudioError as error:
            problem = sentences(error.what, error.in_window)
        self._card.show_remote(settings.remote, settings.remote_port, problem)

    def _on_phase(self) -> None:
        self._card.show_live(self._model.task.phase == Phase.LIVE)
        self._tell()

    def _tell(self) -> None:
        """What is answered from now on to whoever asks how Live is."""
        state, live = self._model.state, self._model.task.phase == Phase.LIVE
        self._server.state = RemoteState(live)
        if state is not None and live:
            self._server.state = RemoteState(
                live, state.muted, state.frozen, state.neutral, state.mood, round(state.latency_ms, 1)
            )

    def _on_pressed(self, request: RemoteRequest) -> None:
        model, state = self._model, self._model.state
        if request.action == "start_live":
            model.start_requested.emit()
        elif request.action == "stop_live":
            model.task.stop()
        elif model.task.phase != Phase.LIVE or state is None:
            return
        elif request.action == "keep_live":
            self._keep()
        elif request.action in SWITCHES:
            now = {"mute": state.muted, "freeze": state.frozen, "neutral": state.neutral}[request.action]
            on = not model.switches.shown(request.action, now) if request.on is None else request.on
            model.switch(request.action, on)
        elif model.run is not None:
            # As the chips are numbered: 0 is none.
            number = int(request.action.rpartition("_")[2])
            names = ("", *model.run.facts.moods)
            if number < len(names):
                model.choose_mood(names[number])

    def _keep(self) -> None:
        self._model.task.keeping = True
        self._model.task.tell(Command("keep"))

    def _on_kept(self, event: KeptEvent) -> None:
        """The take is there already, not used for training; show it where that is wanted."""
        self._model.task.keeping = False
        session = self._session
        session.refresh_takes()
        minutes, seconds = divmod(round(event.seconds), 60)
        text = self.tr("Kept the last {0}:{1} as {2}.").format(minutes, f"{seconds:02d}", event.take)
        show = (self.tr("Show in Curate"), lambda: session.take_requested.emit(event.take))
        messages.show_note(self._card, text, action=show)

    def _on_copy(self, url: str) -> None:
        QGuiApplication.clipboard().setText(url)
        messages.show_note(self._card, self.tr("Copied {0}").format(url))
