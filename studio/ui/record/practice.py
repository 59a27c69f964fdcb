"""The practice performer in the window: a child process, steady whatever the window does."""

from __future__ import annotations

from PySide6.QtCore import QObject, QTimer, Signal

from studio.errors import StudioError
from studio.ipc.events import ChildEvent, LineEvent, ProblemEvent
from studio.ui.tasks import Job

PERFORMER_NAME = "Mia"
"""As in the sample project, which is not asked: loading it takes too long while a take is saved."""
PATIENCE_MS = 3_000
"""How long it may take to end after it was asked to."""


class Practice(QObject):
    """A practice performer that sends to this computer and speaks through its loudspeaker.

    Signals:
        failed: it could not start, or ended by itself; carries a StudioError.
    """

    failed = Signal(object)

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._job = Job(self)
        self._wanted = False
        self._port = 0
        self._again: tuple[int, str] | None = None
        self.speaking = ""
        """The sentence it is saying, or said last."""
        self.problem = ""
        """Why its voice can't be heard, "" where it can."""
        self._impatience = QTimer(self)
        self._impatience.setSingleShot(True)
        self._impatience.setInterval(PATIENCE_MS)
        self._impatience.timeout.connect(self._job.cancel)
        self._job.told.connect(self._on_event)
        self._job.failed.connect(self._on_failed)
        self._job.ended.connect(self._on_ended)

    @property
    def on(self) -> bool:
        """Whether it performs or is about to."""
        return self._wanted

    @property
    def busy(self) -> bool:
        """Whether it was asked for and is still getting ready."""
        return self._wanted and not self.speaking

    def set_on(self, on: bool, port: int = 0, device: str = "") -> None:
        """Start sending to a port of this computer and speaking on a sound device, or stop."""
        if on == self._wanted:
            return
        self._wanted = on
        self._port = port
        if not on:
            self._again = None
            self._job.stop()
            self._impatience.start()
        elif self._job.running:
            self._again = (port, device)  # the one before is still leaving
        else:
            self._start(port, device)

    def redirect(self, port: int, device: str = "") -> None:
        """Begin anew, sending to another port; nothing is done where it sends there already."""
        if self._wanted and port != self._port:
            self.set_on(False)
            self.set_on(True, port, device)

    def close(self) -> None:
        """Stop, and wait for it."""
        self._wanted, self._again = False, None
        self._impatience.stop()
        self._job.close()

    def _start(self, port: int, device: str) -> None:
        self.speaking = self.problem = ""
        voice = ["--device", device] if device else []
        self._job.start(["performer", "--to", f"127.0.0.1:{port}", *voice])

    def _on_event(self, event: ChildEvent) -> None:
        if isinstance(event, LineEvent):
            self.speaking = event.text
        elif isinstance(event, ProblemEvent):
            self.problem = event.what

    def _on_failed(self, what: str, remedy: str) -> None:
        if self._wanted:
            self.failed.emit(StudioError(what, remedy))

    def _on_ended(self) -> None:
        self._impatience.stop()
        self.speaking = self.problem = ""
        again, self._again = self._again, None
        if again is not None:
            self._start(*again)
        else:
            self._wanted = False
