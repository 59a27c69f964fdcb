"""The child process that performs: started, told what changes, and ended, by force where that is needed."""

from __future__ import annotations

from enum import StrEnum

from PySide6.QtCore import QObject, QTimer, Signal

from studio.ipc.commands import Command
from studio.ipc.events import ChildEvent, ReadyEvent
from studio.ui.tasks import ChildTask

FORCE_MS = 5_000
"""How long a performance may take to end before it is ended."""
KEEPING_MS = 30_000
"""The same while it makes a take of its last minutes, which would be lost with it."""
SILENT_MS = 4_000
"""How long a performance may say nothing, which sends its state ten times a second."""


class Phase(StrEnum):
    """How far a performance is."""

    IDLE = "idle"
    STARTING = "starting"
    LIVE = "live"
    STOPPING = "stopping"


class LiveTask(QObject):
    """One performance at a time.

    Args:
        parent: as everywhere in Qt.
        child: runs it; tests give one that starts nothing.

    Signals:
        phase_changed: it is in another phase.
        told: an event of the child, of studio.ipc.
        silent: the child has said nothing for SILENT_MS.
        failed: a StudioError.
        forced: the child did not end by itself, and was ended.
        ended: it is over, whatever came before.
    """

    phase_changed = Signal()
    told = Signal(object)
    silent = Signal()
    failed = Signal(object)
    forced = Signal()
    ended = Signal()

    def __init__(self, parent: QObject, child: ChildTask | None = None) -> None:
        super().__init__(parent)
        self.phase = Phase.IDLE
        self.keeping = False
        """Whether it was asked to make a take, and has not said yet that there is one."""
        self._child = child or ChildTask(self)
        self._child.told.connect(self._on_event)
        self._child.failed.connect(self.failed)
        self._child.ended.connect(self._on_ended)
        self._force, self._silence = QTimer(self), QTimer(self)
        for timer, after, then in (
            (self._force, FORCE_MS, self.force),
            (self._silence, SILENT_MS, self.silent),
        ):
            timer.setSingleShot(True)
            timer.setInterval(after)
            timer.timeout.connect(then)

    @property
    def running(self) -> bool:
        """Whether there is a performance, in whatever phase."""
        return self._child.running

    @property
    def pid(self) -> int:
        """The child's process number, 0 where none is alive."""
        return self._child.pid

    def start(self, args: list[str]) -> None:
        """Begin `saia live ARGS`."""
        self.keeping = False
        self._enter(Phase.STARTING)
        self._child.start(["live", *args])

    def tell(self, command: Command) -> None:
        """Say something to the child; nothing where there is none."""
        self._child.tell(command)

    def stop(self) -> None:
        """Let it end: while it is getting ready at once, else as it does by itself, for a while."""
        if not self.running or self.phase == Phase.STOPPING:
            return
        starting = self.phase == Phase.STARTING
        self._silence.stop()
        self._enter(Phase.STOPPING)
        if starting:
            # Nothing is sent before it is ready, so that nothing has to be ended well.
            self._child.cancel()
        else:
            # The avatar fades to its rest pose.
            self._child.stop()
            self._force.start(KEEPING_MS if self.keeping else FORCE_MS)

    def force(self) -> None:
        """End a child that does not answer."""
        if self.running:
            self.forced.emit()
            self._child.kill()

    def close(self) -> None:
        """The window closes: end it now."""
        self._force.stop()
        self._silence.stop()
        self._child.close()

    def _on_event(self, event: ChildEvent) -> None:
        if isinstance(event, ReadyEvent) and self.phase == Phase.STARTING:
            self._enter(Phase.LIVE)
        if self.phase == Phase.LIVE:
            # Started anew by each event: it fires where none came for so long.
            self._silence.start()
        self.told.emit(event)

    def _on_ended(self) -> None:
        self._force.stop()
        self._silence.stop()
        self._enter(Phase.IDLE)
        self.ended.emit()

    def _enter(self, phase: Phase) -> None:
        self.phase = phase
        self.phase_changed.emit()
