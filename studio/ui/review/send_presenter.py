"""Presenter of Review's Send panel: one VMC target per row, and how each one is."""

from __future__ import annotations

import time
from collections.abc import Callable

from PySide6.QtCore import QObject, QThreadPool, QTimer

from studio.errors import StudioError
from studio.motion.neutral import WAVE_SECONDS
from studio.ui import messages, tasks
from studio.ui.review.model import ReviewModel
from studio.ui.session import Session
from studio.ui.widgets.send_panel import OwnPorts, SendPanel, TargetRow
from studio.vmc.sender import TargetState, VmcTarget

STATE_MS = 400
CLOSING_MS = 1000


class RowTarget:
    """What one row sends to, with a thread of its own: what was asked of it last is what holds.

    Args:
        parent: owns the thread.

    Attributes:
        shown: frames sent when the row was shown last while sending.
    """

    def __init__(self, parent: QObject) -> None:
        self.target = VmcTarget()
        self.pool = QThreadPool(parent)
        self.pool.setMaxThreadCount(1)
        self.shown = 0
        self._shown_at: float | None = None

    def rate(self, state: TargetState) -> float:
        """Frames a second since it was asked before; 0 the first time."""
        now, before, sent = time.monotonic(), self._shown_at, state.sent - self.shown
        self._shown_at, self.shown = now, state.sent
        return max(sent / (now - before), 0.0) if before is not None and now > before else 0.0


class SendPresenter(QObject):
    """Presenter of the Send panel: keeps a sender per row, and shows how each one is.

    Args:
        panel: its layout.
        model: what is sent.
        session: for the saved preferences.

    Attributes:
        targets: where each row of the panel sends to.
    """

    def __init__(self, panel: SendPanel, model: ReviewModel, session: Session) -> None:
        super().__init__(panel)
        self._panel, self._model, self._session = panel, model, session
        self.targets: dict[TargetRow, RowTarget] = {}
        # Removed, and may still fade to rest.
        self._leaving: list[RowTarget] = []
        self._timer = QTimer(self)
        self._timer.setInterval(STATE_MS)
        self._timer.timeout.connect(self._show_states)
        panel.row_added.connect(self._on_added)
        panel.row_removed.connect(self._on_removed)
        panel.options_changed.connect(self._on_options)
        self._own_ports = OwnPorts(session, self)
        self._own_ports.changed.connect(self.update_states)
        session.settings_changed.connect(self._on_settings)
        model.motion_changed.connect(self.refresh)
        panel.show_settings(session.settings)
        panel.targets_changed.connect(self._save)

    @property
    def sending(self) -> bool:
        """Whether any target is being sent to."""
        return any(one.target.running for one in self.targets.values())

    def refresh(self) -> None:
        """Send what the source gives now."""
        for one in self.targets.values():
            one.target.show(self._model.pose_source())

    def update_states(self) -> None:
        """Show anew how each target is: Record may listen elsewhere by now."""
        for row, one in self.targets.items():
            # The timer shows those that run.
            if not one.target.running:
                self._show(row, one.target.state, 0.0)

    def close(self) -> None:
        """Fade all avatars to rest and stop."""
        self._timer.stop()
        everyone = [*self.targets.values(), *self._leaving]
        for one in everyone:
            one.pool.clear()
            one.pool.waitForDone(CLOSING_MS)
        # All begin to fade before any is waited for: together they take as long as one.
        for one in everyone:
            one.target.stop(wait=False)
        for one in everyone:
            one.target.stop()

    def _on_added(self, row: TargetRow) -> None:
        one = self.targets[row] = RowTarget(self)
        row.send_toggled.connect(lambda on: self._on_send(row, on))
        row.wave_requested.connect(lambda: self._on_wave(row))
        row.address_changed.connect(lambda: self._on_address(row))
        self._show(row, one.target.state, 0.0)

    def _on_removed(self, row: TargetRow) -> None:
        self._stop(row)
        self._leaving.append(self.targets.pop(row))
        self.update_states()

    def _on_send(self, row: TargetRow, on: bool) -> None:
        if on:
            self._start(row)
        else:
            self._stop(row)

    def _stop(self, row: TargetRow) -> None:
        """Fade the avatar to rest, after a start that may still look for the target's name."""
        one = self.targets[row]
        tasks.run(lambda: one.target.stop(wait=False), lambda _: None, pool=one.pool)

    def _start(self, row: TargetRow, then: Callable[[], None] | None = None) -> None:
        one, destination = self.targets[row], self._panel.destination(row)
        source = self._model.pose_source()

        def failed(error: BaseException) -> None:
            row.set_sending(False)
            messages.show_error(self._panel, error)

        def started(_: None) -> None:
            if then is not None:
                then()
            self._timer.start()

        # A name may have to be looked up on the network: not on the GUI thread.
        tasks.run(lambda: one.target.start(destination, source), started, failed, owner=row, pool=one.pool)

    def _on_wave(self, row: TargetRow) -> None:
        target = self.targets[row].target
        if target.running and row.send.isChecked():
            target.wave()
            return

        def wave() -> None:
            target.wave()
            # Switched on for the wave alone, it goes off again after it.
            QTimer.singleShot(round(WAVE_SECONDS * 1000) + 100, row, lambda: self._end_wave(row))

        self._start(row, wave)

    def _end_wave(self, row: TargetRow) -> None:
        if row in self.targets and not row.send.isChecked():
            self._stop(row)

    def _on_address(self, row: TargetRow) -> None:
        if row.send.isChecked():
            self._start(row)
        self.update_states()

    def _on_options(self) -> None:
        for row in self.targets:
            if row.send.isChecked():
                self._start(row)
        self._save()

    def _on_settings(self) -> None:
        """Changed in Live, in the dialog or here: all show the same."""
        self._panel.show_settings(self._session.settings)
        self.update_states()

    def _save(self) -> None:
        """Remember all targets for the next time."""
        self._session.change_settings(**self._panel.kept)

    def _show_states(self) -> None:
        for row, one in self.targets.items():
            state = one.target.state
            self._show(row, state, one.rate(state))
        if not self.sending:
            self._timer.stop()

    def _show(self, row: TargetRow, state: TargetState, rate: float) -> None:
        """The row's light, and a warning where the studio would only talk to itself."""
        row.warn(self._own_ports.warning(row.address) or self._duplicate(row))
        row.show_state(state, rate)

    def _duplicate(self, row: TargetRow) -> StudioError | None:
        """A warning of a target that another row sends to already."""
        here = row.address
        rows = self._panel.rows
        before = rows[: rows.index(row)] if row in rows else []
        if not any((one.address.host, one.address.port) == (here.host, here.port) for one in before):
            return None
        return StudioError(
            self.tr("{0} port {1} is in the list twice.").format(here.host, here.port),
            self.tr("Remove one, or give the other program a port of its own and set it here."),
        )
