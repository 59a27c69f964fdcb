"""The child process that performs: begun, spoken to, and ended, by force where it does not end by itself."""

from __future__ import annotations

from enum import StrEnum

from PySide6.QtCore import QObject, QTimer, Signal

from studio.ipc.commands import Command
from studio.ipc.events import ChildEvent, ReadyEvent
from studio.ui.tasks import Job

FORCE_MS = 5_000
"""How long a performance may take to end before it is ended."""
SILENT_MS = 4_000
"""How long a performance may say nothing, which tells how it stands ten times a second."""


class Phase(StrEnum):
    """How far a performance is."""

    IDLE = "idle"
    STARTING = "starting"
    LIVE = "live"
    STOPPING = "stopping"


class LiveTask(QObject):
    """One performance at a time.

    Signals:
        moved: it is in another phase.
        told: an event of the child, of studio.ipc.
        silent: the child has said nothing for SILENT_MS.
        failed: what happened and what to do.
        forced: the child did not end by itself, and was ended.
        ended: it is over, whatever came before.
    """

    moved = Signal()
    told = Signal(object)
    silent = Signal()
    failed = Signal(str, str)
    forced = Signal()
    ended = Signal()

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self._job: Job | None = None
        self.phase = Phase.IDLE
        self._force, self._silence = QTimer(self), QTimer(self)
        for timer, after, then in (
            (self._force, FORCE_MS, self._on_force),
            (self._silence, SILENT_MS, self.silent),
        ):
            timer.setSingleShot(True)
            timer.setInterval(after)
            timer.timeout.connect(then)

    @property
    def running(self) -> bool:
        """Whether there is a performance, however far it is."""
        return self._job is not None

    def start(self, words: list[str]) -> None:
        """Begin `saia live WORDS`."""
        job = self._job = Job(self)
        job.told.connect(self._on_event)
        job.failed.connect(self.failed)
        job.ended.connect(self._on_ended)
        self._go(Phase.STARTING)
        job.start(["live", *words])

    def tell(self, command: Command) -> None:
        """Say something to the child; nothing where there is none."""
        if self._job is not None:
            self._job.tell(command)

    def stop(self) -> None:
        """Let it end: while it is getting ready at once, else as it does by itself, for a while."""
        if self._job is None or self.phase == Phase.STOPPING:
            return
        starting = self.phase == Phase.STARTING
        self._silence.stop()
        self._go(Phase.STOPPING)
        if starting:
            self._job.cancel()
        else:
            self._job.stop()
            self._force.start()

    def close(self) -> None:
        """The window closes: end it now."""
        self._force.stop()
        self._silence.stop()
        job, self._job = self._job, None
        if job is not None:
            job.close()

    def _on_event(self, event: ChildEvent) -> None:
        if isinstance(event, ReadyEvent) and self.phase == Phase.STARTING:
            self._go(Phase.LIVE)
        if self.phase == Phase.LIVE:
            self._silence.start()
        self.told.emit(event)

    def _on_force(self) -> None:
        if self._job is not None:
            self.forced.emit()
            self._job.kill()

    def _on_ended(self) -> None:
        self._force.stop()
        self._silence.stop()
        job, self._job = self._job, None
        if job is not None:
            job.deleteLater()
        self._go(Phase.IDLE)
        self.ended.emit()

    def _go(self, phase: Phase) -> None:
        self.phase = phase
        self.moved.emit()
