"""The Send panel in the Live tab: which targets the child sends to, and how each does."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping

from PySide6.QtCore import QObject, QTimer
from PySide6.QtWidgets import QWidget

from studio.ipc.commands import Command
from studio.motion.neutral import WAVE_SECONDS
from studio.ui import messages, tasks, theme
from studio.ui.session import Session
from studio.ui.widgets.send_panel import SendPanel, TargetRow, kept_targets
from studio.vmc.sender import Destination, TargetState, TargetStatus, VmcTarget

OFF = TargetState(TargetStatus.OFF, 0, 0)


class LiveTargets(QObject):
    """The panel's thought.

    Args:
        panel: its layout.
        session: for the saved preferences.
        tell: says a line to the child; does nothing where there is none.
    """

    def __init__(self, panel: SendPanel, session: Session, tell: Callable[[Command], None]) -> None:
        super().__init__(panel)
        self._panel, self._session, self._tell = panel, session, tell
        self._live = False
        self._names: dict[TargetRow, str] = {}
        self._counts: dict[str, tuple[float, int]] = {}
        self._waves: list[VmcTarget] = []
        panel.row_added.connect(self._on_added)
        panel.row_removed.connect(self._on_removed)
        panel.options_changed.connect(self._on_options)
        settings = session.settings
        panel.set_options(settings.send_fps, settings.send_names)
        for address in kept_targets(settings):
            panel.add_target(address)
        panel.rows[0].set_sending(True)  # going live is meant for an avatar
        self._label(panel.rows[0], True)
        _rename(panel)

    def begin(self) -> None:
        """The child is ready: send to all that are switched on."""
        self._live = True
        for row in self._panel.rows:
            if row.send.isChecked():
                self._send(row)

    def end(self) -> None:
        """The child is gone."""
        self._live = False
        self._names.clear()
        self._counts.clear()
        for row in self._panel.rows:
            row.show_state(OFF, 0.0)

    def show_states(self, states: Mapping[str, TargetState]) -> None:
        """Show how each target does."""
        now = time.monotonic()
        for row, name in self._names.items():
            state = states.get(name)
            if state is None:
                continue
            before, sent = self._counts.get(name, (now, state.sent))
            if now - before > 0.9 or name not in self._counts:
                self._counts[name] = (now, state.sent)
            rate = (state.sent - sent) / (now - before) if now > before else 0.0
            row.show_state(state, rate)

    def close(self) -> None:
        """Let go of what waves."""
        for target in self._waves:
            target.stop(fade=False)

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
        self._save()

    def _on_address(self, row: TargetRow) -> None:
        if self._live and row.send.isChecked():
            self._unsend(row)
            self._send(row)
        self._save()

    def _on_options(self) -> None:
        panel = self._panel
        if self._live:
            for row in panel.rows:
                if row.send.isChecked():
                    self._send(row)
        names, fps = str(panel.names.currentData()), float(panel.fps.currentData())
        self._session.change_settings(send_names=names, send_fps=fps)

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
        self._tell(Command("send", json.dumps(facts)))

    def _unsend(self, row: TargetRow) -> None:
        name = self._names.pop(row, None)
        if name is not None and name not in self._names.values():
            self._counts.pop(name, None)
            self._tell(Command("unsend", name))

    def _on_wave(self, row: TargetRow) -> None:
        if row in self._names:
            self._tell(Command("wave", self._names[row]))
            return
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
    host = f"[{where.host}]" if ":" in where.host else where.host
    return f"{host}:{where.port}"


def _rename(part: QWidget) -> None:
    """Review has the same controls: these get names of their own."""
    for one in part.findChildren(QWidget):
        name = one.objectName()
        if name and not name.startswith(("live_", "qt_", "scrolled")):
            one.setObjectName(f"live_{name}")
