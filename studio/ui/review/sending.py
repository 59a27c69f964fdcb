"""Keeps one VMC target per row of the Send panel running, and its light right."""

from __future__ import annotations

import time
from collections.abc import Callable

from PySide6.QtCore import QObject, QTimer

from studio.errors import StudioError
from studio.playback.neutral import WAVE_SECONDS
from studio.playback.vmc_target import PoseSource, TargetState, VmcTarget
from studio.ui import background, messages
from studio.ui.review.send_panel import Address, SendPanel, TargetRow
from studio.ui.session import Session

STATE_MS = 400


class Sending(QObject):
    """The Send panel's thought.

    Args:
        panel: its layout.
        session: for the saved preferences.
        source: gives what to send now, None for nothing.
    """

    def __init__(self, panel: SendPanel, session: Session, source: Callable[[], PoseSource | None]) -> None:
        super().__init__(panel)
        self._panel, self._session, self._source = panel, session, source
        self._targets: dict[TargetRow, VmcTarget] = {}
        self._counts: dict[TargetRow, tuple[float, int]] = {}
        self._timer = QTimer(self)
        self._timer.setInterval(STATE_MS)
        self._timer.timeout.connect(self._show_states)
        panel.row_added.connect(self._on_added)
        panel.row_removed.connect(self._on_removed)
        panel.options_changed.connect(self._on_options)
        self._listening = False
        session.status_changed.connect(self._on_status)
        session.settings_changed.connect(self.look)
        settings = session.settings
        panel.set_options(settings.send_fps, settings.send_names)
        panel.add_target(Address(_title(settings.send_port), settings.send_host, settings.send_port))

    @property
    def sending(self) -> bool:
        """Whether any target is being sent to."""
        return any(target.running for target in self._targets.values())

    def refresh(self) -> None:
        """Send what the source gives now."""
        for target in self._targets.values():
            target.show(self._source())

    def look(self) -> None:
        """Say anew of each target how it is: Record may listen elsewhere by now."""
        for row, target in self._targets.items():
            if not target.running:  # the timer shows those that run
                self._show(row, target.state, 0.0)

    def close(self) -> None:
        """Fade all avatars to rest and stop."""
        self._timer.stop()
        for target in self._targets.values():
            target.stop(wait=False)
        for target in self._targets.values():
            target.stop()

    def _on_added(self, row: TargetRow) -> None:
        self._targets[row] = VmcTarget()
        row.send_toggled.connect(lambda on: self._on_send(row, on))
        row.wave_requested.connect(lambda: self._on_wave(row))
        row.address_changed.connect(lambda: self._on_address(row))
        self._show(row, self._targets[row].state, 0.0)

    def _on_removed(self, row: TargetRow) -> None:
        self._targets.pop(row).stop(wait=False)
        self._counts.pop(row, None)

    def _on_send(self, row: TargetRow, on: bool) -> None:
        if on:
            self._start(row)
            self._save(row)
        else:
            self._targets[row].stop(wait=False)

    def _start(self, row: TargetRow, then: Callable[[], None] | None = None) -> None:
        target, destination = self._targets[row], self._panel.destination(row)
        source = self._source()

        def failed(error: BaseException) -> None:
            row.set_sending(False)
            messages.show_error(self._panel, error)

        def started(_: None) -> None:
            if then is not None:
                then()
            self._timer.start()

        # A name may have to be looked up on the network: not on the GUI thread.
        background.run(lambda: target.start(destination, source), started, failed, owner=row)

    def _on_wave(self, row: TargetRow) -> None:
        target = self._targets[row]
        if target.running and row.send.isChecked():
            target.wave()
            return

        def wave() -> None:
            target.wave()
            QTimer.singleShot(round(WAVE_SECONDS * 1000) + 100, row, lambda: self._end_wave(row))

        self._start(row, wave)

    def _end_wave(self, row: TargetRow) -> None:
        target = self._targets.get(row)
        if target is not None and not row.send.isChecked():
            target.stop(wait=False)

    def _on_address(self, row: TargetRow) -> None:
        if row.send.isChecked():
            self._start(row)
        self._save(row)
        self.look()

    def _on_options(self) -> None:
        for row in self._targets:
            if row.send.isChecked():
                self._start(row)
        names, fps = str(self._panel.names.currentData()), float(self._panel.fps.currentData())
        self._session.change_settings(send_names=names, send_fps=fps)

    def _save(self, row: TargetRow) -> None:
        """Remember the first target for the next time."""
        if self._panel.rows and row is self._panel.rows[0]:
            address = row.address
            self._session.change_settings(send_host=address.host, send_port=address.port)

    def _show_states(self) -> None:
        now = time.monotonic()
        for row, target in self._targets.items():
            state = target.state
            before, sent = self._counts.get(row, (now, state.sent))
            rate = (state.sent - sent) / (now - before) if now > before else 0.0
            self._counts[row] = (now, state.sent)
            self._show(row, state, max(rate, 0.0))
        if not self.sending:
            self._timer.stop()

    def _show(self, row: TargetRow, state: TargetState, rate: float) -> None:
        """The row's light, and a warning where the studio would only talk to itself."""
        address = row.address
        own = _is_here(address.host) and self._hears(address.port)
        warning = StudioError(
            self.tr("Port {0} is where this studio itself listens.").format(address.port),
            self.tr("Choose another port in Record, or give the other program its own port and set it here."),
        )
        row.warn(warning if own else None)
        row.show_state(state, rate)

    def _hears(self, port: int) -> bool:
        """Whether Record has this port open; where another program was first, it has not."""
        settings = self._session.settings
        return self._listening and str(port) in (str(settings.vmc_port), *settings.more_ports)

    def _on_status(self, key: str, _text: str, health: str) -> None:
        """Record says whether its ports are open; it does so several times a second."""
        if key == "motion" and (health != "warn") != self._listening:
            self._listening = health != "warn"
            self.look()


def _is_here(host: str) -> bool:
    return host.lower() == "localhost" or host.startswith("127.") or host == "::1"


def _title(port: int) -> str:
    from studio.playback.vmc_target import PRESETS

    return next((preset.title for preset in PRESETS if preset.port == port), "")
