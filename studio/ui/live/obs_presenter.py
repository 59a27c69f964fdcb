"""Presenter of OBS: connects it, keeps its Sync Offset right, and goes live with the stream."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from PySide6.QtCore import QObject, Qt, QThreadPool, Signal

from studio.errors import StudioError
from studio.ipc.events import LiveStateEvent
from studio.remote.obs import USUAL_HOST, USUAL_PORT, ObsClient
from studio.ui import messages, tasks
from studio.ui.language import sentences
from studio.ui.live.model import LiveModel
from studio.ui.live.obs_view import ObsDialog, ObsPanel
from studio.ui.session import Session

LEFT_MS = 20
"""Most that may be left between voice and lips before the Sync Offset is set anew: half a frame of film."""
T = TypeVar("T")


class ObsPresenter(QObject):
    """What OBS is told, in order and off the window's thread."""

    _stream_began = Signal()
    _closed = Signal()

    def __init__(self, panel: ObsPanel, model: LiveModel, session: Session) -> None:
        super().__init__(panel)
        self._panel, self._model, self._session = panel, model, session
        for signal, slot in ((self._stream_began, self._on_stream), (self._closed, self._on_closed)):
            signal.connect(slot, Qt.ConnectionType.QueuedConnection)
        self._client = ObsClient(self._stream_began.emit, self._closed.emit)
        self._pool = QThreadPool(self)
        self._pool.setMaxThreadCount(1)
        self._dialog: ObsDialog | None = None
        self._offset: int | None = None
        self._busy = False
        panel.connect_requested.connect(self._on_button)
        panel.sound_chosen.connect(self._on_sound)
        panel.sync_switched.connect(lambda on: session.change_settings(obs_sync=on))
        panel.start_switched.connect(lambda on: session.change_settings(obs_start=on))
        session.settings_changed.connect(self._show_options)
        model.state_changed.connect(self._on_state)
        model.ended.connect(self._on_ended)
        self._show_options()

    def close(self) -> None:
        """The window closes."""
        self._client.close()
        self._pool.waitForDone()

    # -- connecting ----------------------------------------------------------------------------

    def _on_button(self) -> None:
        if self._client.connected:
            self._do(self._client.close, lambda _: self._panel.show_connected(False))
            return
        address = self._session.settings.obs_address or f"{USUAL_HOST}:{USUAL_PORT}"
        self._dialog = ObsDialog(address, self._panel.window())
        self._dialog.connect_requested.connect(self._connect)
        self._dialog.open()

    def _connect(self, host: str, port: int, password: str) -> None:
        dialog = self._dialog
        assert dialog is not None
        dialog.show_connecting(True)

        def work() -> tuple[str, ...]:
            self._client.connect(host, port, password)
            return self._client.sounds()

        def good(names: tuple[str, ...]) -> None:
            self._session.change_settings(obs_address=f"{host}:{port}")
            self._offset = None
            self._panel.show_connected(True)
            self._panel.show_sounds(names, self._guess(names))
            self._show_idle()
            dialog.accept()

        def bad(error: BaseException) -> None:
            words = sentences(error.what, error.in_window) if isinstance(error, StudioError) else str(error)
            dialog.show_connecting(False, words)

        tasks.run(work, good, bad, owner=dialog, pool=self._pool)

    def _guess(self, names: tuple[str, ...]) -> str:
        """The sound chosen last time, else what is called a microphone, else the first."""
        chosen = self._session.settings.obs_input
        microphones = [name for name in names if "mic" in name.lower()]
        return chosen if chosen in names else next(iter((*microphones, *names)), "")

    def _on_closed(self) -> None:
        self._panel.show_connected(False)
        self._panel.show_words(self.tr("OBS closed the connection."), "warn")

    # -- the stream and the Sync Offset --------------------------------------------------------

    def _on_stream(self) -> None:
        if self._session.settings.obs_start:
            self._model.start_requested.emit()

    def _on_sound(self, name: str) -> None:
        self._session.change_settings(obs_input=name)
        self._offset = None
        self._show_idle()

    def _on_state(self, state: LiveStateEvent) -> None:
        settings, name = self._session.settings, self._panel.sounds.currentText()
        if not self._client.connected or self._model.file is not None or not name:
            return
        if settings.live_voice:
            self._panel.show_words(
                self.tr("Your delayed voice already matches the lips; no Sync Offset needed.")
            )
        elif not settings.obs_sync:
            self._show_idle()
        elif self._offset is not None and abs(state.latency_ms - self._offset) <= LEFT_MS:
            left = abs(round(state.latency_ms) - self._offset)
            words = self.tr("Verified: OBS delays {0} by {1} ms; {2} ms are left.")
            self._panel.show_words(words.format(name, self._offset, left), "good")
        elif not state.settled or state.latency_ms <= 0:
            self._panel.show_words(self.tr("Settling…"))
        else:
            self._set(name, round(state.latency_ms))

    def _set(self, name: str, ms: int) -> None:
        """Set the Sync Offset; what OBS says it is now is what counts."""
        if self._busy:
            return
        self._busy = True

        def good(offset: int) -> None:
            self._busy = False
            if name == self._panel.sounds.currentText():
                self._offset = offset

        def bad(error: BaseException) -> None:
            self._busy = False
            # Once: with each state it would be tried and fail again.
            self._session.change_settings(obs_sync=False)
            messages.show_error(self._panel, error)

        self._do(lambda: self._client.set_sync_offset(name, ms), good, bad)

    def _on_ended(self) -> None:
        self._offset = None
        if self._client.connected:
            self._show_idle()

    def _show_idle(self) -> None:
        words = self.tr("Connected.")
        if self._session.settings.obs_sync:
            words = self.tr(
                "Connected. The Sync Offset is set once you are live and the latency has settled."
            )
        self._panel.show_words(words)

    def _show_options(self) -> None:
        settings = self._session.settings
        self._panel.show_options(settings.obs_sync, settings.obs_start)

    def _do(
        self,
        work: Callable[[], T],
        on_done: Callable[[T], None],
        on_error: Callable[[BaseException], None] | None = None,
    ) -> None:
        tasks.run(work, on_done, on_error, owner=self, pool=self._pool)
