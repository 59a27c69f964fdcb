"""Presenter of the Send panel in the Live tab: which targets the child sends to, and the status of each."""

from __future__ import annotations

import json
import time

from PySide6.QtCore import QObject, QTimer
from PySide6.QtWidgets import QWidget

from studio.ipc.commands import Command
from studio.ipc.events import LiveStateEvent
from studio.motion.neutral import WAVE_SECONDS
from studio.ui import messages, tasks, theme
from studio.ui.live.model import LiveModel, target_state
from studio.ui.session import Session
from studio.ui.widgets.send_panel import OwnPorts, SendPanel, TargetRow
from studio.vmc.address import Address
from studio.vmc.sender import Destination, TargetState, TargetStatus, VmcTarget

OFF = TargetState(TargetStatus.OFF, 0, 0)


class LiveSendPresenter(QObject):
    """Tells the child what to send to, from the start of a performance on."""

    def __init__(self, panel: SendPanel, model: LiveModel, session: Session) -> None:
        super().__init__(panel)
        self._panel, self._task, self._session = panel, model.task, session
        self._live = False
        self._names: dict[TargetRow, str] = {}
        self._counts: dict[str, tuple[float, int]] = {}
        self._waves: list[VmcTarget] = []
        self._own_ports = OwnPorts(session, self)
        self._own_ports.changed.connect(self._warn)
        panel.row_added.connect(self._on_added)
        panel.row_removed.connect(self._on_removed)
        panel.options_changed.connect(self._on_options)
        panel.show_settings(session.settings)
        # Going live is meant for an avatar.
        panel.rows[0].set_sending(True)
        self._label(panel.rows[0], True)
        _rename(panel)
        panel.targets_changed.connect(self._save)
        session.settings_changed.connect(self._on_settings)
        model.ready_changed.connect(self._on_ready)
        model.state_changed.connect(self._on_state)
        model.ended.connect(self._on_ended)

    def close(self) -> None:
        """The window closes: end test waves."""
        for target in self._waves:
            target.stop(fade=False)

    def _on_ready(self) -> None:
        self._live = True
        for row in self._panel.rows:
            if row.send.isChecked():
                self._send(row)

    def _on_ended(self) -> None:
        self._live = False
        self._names.clear()
        self._counts.clear()
        for row in self._panel.rows:
            row.show_state(OFF, 0.0)

    def _on_state(self, event: LiveStateEvent) -> None:
        states = {one.to: target_state(one) for one in event.targets}
        now = time.monotonic()
        for row, name in self._names.items():
            state = states.get(name)
            if state is None:
                continue
            before, sent = self._counts.get(name, (now, state.sent))
            # States come ten times a second: over less than a second a rate would flicker.
            if now - before > 0.9 or name not in self._counts:
                self._counts[name] = (now, state.sent)
            rate = (state.sent - sent) / (now - before) if now > before else 0.0
            row.warn(self._own_ports.warning(row.address))
            row.show_state(state, rate)

    def _warn(self) -> None:
        """Before going live too: a row says so as soon as Record has its port."""
        for row in self._panel.rows:
            row.warn(self._own_ports.warning(row.address))
            if row not in self._names:
                row.show_state(OFF, 0.0)

    def _on_added(self, row: TargetRow) -> None:
        row.send_toggled.connect(lambda on: self._on_send(row, on))
        row.wave_requested.connect(lambda: self._on_wave(row))
        row.address_changed.connect(lambda: self._on_address(row))
        row.send.toggled.connect(lambda on: self._label(row, on))
        row.show_state(OFF, 0.0)
        self._label(row, row.send.isChecked())
        _rename(row)

    def _on_removed(self, row: TargetRow) -> None:
        self._unsend(row)

    def _on_send(self, row: TargetRow, on: bool) -> None:
        if on and self._live:
            self._send(row)
        elif not on:
            self._unsend(row)
            row.show_state(OFF, 0.0)

    def _on_address(self, row: TargetRow) -> None:
        self._warn()
        if self._live and row.send.isChecked():
            self._unsend(row)
            self._send(row)

    def _on_options(self) -> None:
        panel = self._panel
        if self._live:
            for row in panel.rows:
                if row.send.isChecked():
                    self._send(row)
        self._save()

    def _on_settings(self) -> None:
        """Changed in Review, in the dialog or here: all show the same."""
        self._panel.show_settings(self._session.settings)

    def _label(self, row: TargetRow, on: bool) -> None:
        """Sending begins and ends with the performance: the button chooses who takes part."""
        row.send.setText(self.tr("Send while live"))
        theme.set_icon(row.send, "mdi6.check" if on else "mdi6.broadcast", "muted", "accent")

    def _send(self, row: TargetRow) -> None:
        where = self._panel.destination(row)
        name = _name(where)
        self._names[row] = name
        options = where.options
        facts = {
            "to": name, "fps": where.fps, "names": options.names, "bundle": options.bundle,
            "rotations_only": options.rotations_only,
        }  # fmt: skip
        self._task.tell(Command("send", json.dumps(facts)))

    def _unsend(self, row: TargetRow) -> None:
        name = self._names.pop(row, None)
        # Two rows may name one target: it goes on for the other.
        if name is not None and name not in self._names.values():
            self._counts.pop(name, None)
            self._task.tell(Command("unsend", name))

    def _on_wave(self, row: TargetRow) -> None:
        if row in self._names:
            self._task.tell(Command("wave", self._names[row]))
            return
        # Nothing is live: a target of its own waves, and is stopped when it has.
        target, where = VmcTarget(), self._panel.destination(row)
        self._waves.append(target)

        def done() -> None:
            target.stop(wait=False)
            self._waves.remove(target)

        def begin() -> None:
            target.start(where)
            target.wave()

        tasks.run(
            begin,
            lambda _: QTimer.singleShot(round(WAVE_SECONDS * 1000) + 100, self, done),
            lambda error: messages.show_error(self._panel, error),
            owner=self,
        )

    def _save(self) -> None:
        """Remember all targets for the next time."""
        self._session.change_settings(**self._panel.kept)


def _name(where: Destination) -> str:
    return Address("", where.host, where.port).where


def _rename(part: QWidget) -> None:
    """Review has the same controls: these get names of their own."""
    for one in part.findChildren(QWidget):
        name = one.objectName()
        if name and not name.startswith(("live_", "qt_", "scrolled")):
            one.setObjectName(f"live_{name}")
