"""The practice performer in the window: a child process, steady whatever the window does."""

from __future__ import annotations

import socket

from PySide6.QtCore import QObject, QTimer, Signal

from studio.ipc.events import ChildEvent, LineEvent, ProblemEvent
from studio.ui.tasks import ChildTask

PERFORMER_NAME = "Mia"
"""As in the sample project, which is not asked: loading it takes too long while a take is saved."""
LEAVING_MS = 3_000
"""How long it may take to end after it was stopped."""


class PracticeTask(QObject):
    """A practice performer that sends to this computer and speaks through its loudspeaker.

    Its voice goes to a voice line as well, so that it is recorded where nothing can be heard.

    Args:
        parent: as everywhere in Qt.
        child: runs it; tests give one with a command of their own.

    Signals:
        failed: it could not start, or ended by itself; carries a StudioError.
    """

    failed = Signal(object)

    def __init__(self, parent: QObject | None = None, child: ChildTask | None = None) -> None:
        super().__init__(parent)
        self._child = child or ChildTask(self)
        self._on = False
        self._port = 0
        self.voice_port = 0
        """Of this computer, where its voice goes while it performs."""
        # What the next one is started with, once that before has ended.
        self._next: list[str] | None = None
        self.speaking = ""
        """The sentence it is saying, or said last."""
        self.problem = ""
        """Why it can't be heard, "" where it can."""
        self._leaving = QTimer(self)
        self._leaving.setSingleShot(True)
        self._leaving.setInterval(LEAVING_MS)
        self._leaving.timeout.connect(self._child.cancel)
        self._child.told.connect(self._on_event)
        self._child.failed.connect(self._on_failed)
        self._child.ended.connect(self._on_ended)

    @property
    def on(self) -> bool:
        """Whether it performs or is about to."""
        return self._on

    @property
    def busy(self) -> bool:
        """Whether it was started and is still getting ready."""
        return self._on and not self.speaking

    @property
    def running(self) -> bool:
        """Whether its process is alive, which it is for a moment after it was stopped."""
        return self._child.running

    def set_on(self, on: bool, port: int = 0, device: str = "", same_line: bool = False) -> None:
        """Start sending to a port of this computer and speaking on a sound device, or stop.

        Args:
            on: start, or stop.
            port: where motion goes.
            device: where its voice is heard.
            same_line: its voice goes where it went before, if it went anywhere.
        """
        if on == self._on:
            return
        self._on = on
        if on:
            # A port of its own: that of a performer in a terminal may be recorded by somebody else.
            self.voice_port = self.voice_port if same_line and self.voice_port else _free_port()
            self._start(port, device)
        else:
            self._child.stop()
            self._leaving.start()

    def redirect(self, port: int, device: str = "") -> None:
        """Begin anew, sending to another port; nothing is done where it sends there already."""
        if self._on and port != self._port:
            self._start(port, device)

    def close(self) -> None:
        """Stop, and wait for it."""
        self._on = False
        self._leaving.stop()
        self._child.close()

    def _start(self, port: int, device: str) -> None:
        """Start, once one that performs elsewhere or is still leaving has ended."""
        self._leaving.stop()
        self._port = port
        self.speaking = self.problem = ""
        voice = ["--device", device] if device else []
        voice += ["--voice-to", str(self.voice_port)]
        arguments = ["performer", "--to", f"127.0.0.1:{port}", *voice]
        if self._child.running:
            # Not beside it: two would speak at once.
            self._next = arguments
            self._child.cancel()
        else:
            self._child.start(arguments)

    def _on_event(self, event: ChildEvent) -> None:
        if isinstance(event, LineEvent):
            self.speaking = event.text
        elif isinstance(event, ProblemEvent):
            self.problem = event.what

    def _on_failed(self, error: BaseException) -> None:
        if self._on and self._next is None:
            # One that was stopped may die as it likes.
            self.failed.emit(error)

    def _on_ended(self) -> None:
        self._leaving.stop()
        self.speaking = self.problem = ""
        arguments, self._next = self._next, None
        if self._on and arguments is not None:
            self._child.start(arguments)
        else:
            self._on = False


def _free_port() -> int:
    """A UDP port of this computer that nobody uses."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])
