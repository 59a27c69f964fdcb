"""Keeps one VMC target per row of the Send panel running, and its light right."""

from __future__ import annotations

import time
from collections.abc import Callable

from PySide6.QtCore import QObject, QThreadPool, QTimer

from studio.errors import StudioError
from studio.motion.neutral import WAVE_SECONDS
from studio.ui import messages, tasks
from studio.ui.session import Session
from studio.ui.widgets.send_panel import SendPanel, TargetRow, kept_targets
from studio.vmc.sender import PoseSource, TargetState, VmcTarget

STATE_MS = 400
CLOSING_MS = 1000


class SendPresenter(QObject):
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
        self._pools: dict[TargetRow, QThreadPool] = {}
        self._leaving: list[tuple[VmcTarget, QThreadPool]] = []  # removed, and may still fade to rest
        self._counts: dict[TargetRow, tuple[float, int]] = {}
        self._timer = QTimer(self)
        self._timer.setInterval(STATE_MS)
        self._timer.timeout.connect(self._show_states)
        panel.row_added.connect(self._on_added)
        panel.row_removed.connect(self._on_removed)
        panel.options_changed.connect(self._on_options)
        self._listening = self._filled = False
        session.status_changed.connect(self._on_status)
        session.settings_changed.connect(self.look)
        settings = session.settings
        panel.set_options(settings.send_fps, settings.send_names)
        for address in kept_targets(settings):
            panel.add_target(address)
        panel.add.clicked.connect(self._save)
        self._filled = True

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
        for pool in (*self._pools.values(), *(pool for _, pool in self._leaving)):
            pool.clear()
            pool.waitForDone(CLOSING_MS)
        targets = [*self._targets.values(), *(target for target, _ in self._leaving)]
        for target in targets:
            target.stop(wait=False)
        for target in targets:
            target.stop()

    def _on_added(self, row: TargetRow) -> None:
        self._targets[row] = VmcTarget()
        pool = self._pools[row] = QThreadPool(self)  # one thread: what is asked last of a target holds
        pool.setMaxThreadCount(1)
        row.send_toggled.connect(lambda on: self._on_send(row, on))
        row.wave_requested.connect(lambda: self._on_wave(row))
        row.address_changed.connect(lambda: self._on_address(row))
        row.preset.currentIndexChanged.connect(lambda _: self._save())
        self._show(row, self._targets[row].state, 0.0)

    def _on_removed(self, row: TargetRow) -> None:
        self._stop(row)
        self._leaving.append((self._targets.pop(row), self._pools.pop(row)))
        self._counts.pop(row, None)
        self._save()
        self.look()

    def _on_send(self, row: TargetRow, on: bool) -> None:
        if on:
            self._start(row)
            self._save()
        else:
            self._stop(row)

    def _stop(self, row: TargetRow) -> None:
        """Fade the avatar to rest, after a start that may still look for the target's name."""
        target = self._targets[row]
        tasks.run(lambda: target.stop(wait=False), lambda _: None, pool=self._pools[row])

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
        pool = self._pools[row]
        tasks.run(lambda: target.start(destination, source), started, failed, owner=row, pool=pool)

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
        if row in self._targets and not row.send.isChecked():
            self._stop(row)

    def _on_address(self, row: TargetRow) -> None:
        if row.send.isChecked():
            self._start(row)
        self._save()
        self.look()

    def _on_options(self) -> None:
        for row in self._targets:
            if row.send.isChecked():
                self._start(row)
        names, fps = str(self._panel.names.currentData()), float(self._panel.fps.currentData())
        self._session.change_settings(send_names=names, send_fps=fps)

    def _save(self) -> None:
        """Remember all targets for the next time."""
        if self._filled:
            self._session.change_settings(**self._panel.kept)

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
        row.warn(warning if own else self._doubled(row))
        row.show_state(state, rate)

    def _doubled(self, row: TargetRow) -> StudioError | None:
        """What to say of a target that another row sends to already."""
        here = row.address
        rows = self._panel.rows
        before = rows[: rows.index(row)] if row in rows else []
        if not any((one.address.host, one.address.port) == (here.host, here.port) for one in before):
            return None
        return StudioError(
            self.tr("{0} port {1} is in the list twice.").format(here.host, here.port),
            self.tr("Remove one, or give the other program a port of its own and set it here."),
        )

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
