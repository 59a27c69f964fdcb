"""One child process of the window: what it says and is told, and how it ends."""

from __future__ import annotations

import shutil
from collections import deque
from collections.abc import Callable, Sequence
from pathlib import Path

import shiboken6
from PySide6.QtCore import QObject, QProcess, QProcessEnvironment, QTimer, Signal

from studio import launch
from studio.errors import FileThereError, StudioError
from studio.ipc.commands import STOP, Command
from studio.ipc.events import FOR_WINDOW, DoneEvent, ErrorEvent, MessageError, decode

KILL_AFTER_MS = 5_000
CLOSE_MS = 2_000
LOG_LINES = 200


class ChildProcess(QObject):
    """One child process, from its preparing to its end.

    Args:
        parent: as everywhere in Qt.
        command: the program and its arguments, for arguments of `saia`.
        scratch: a folder that is being prepared for it, removed with its end; None where nothing is.
        hears_terminate: it hears when it is to end; else it is told on its standard input.

    Signals:
        told: (this child, an event).
        ended: once; (this child, a DoneEvent, the exception why not, or None where it was cancelled).
    """

    told = Signal(object, object)
    ended = Signal(object, object)

    def __init__(
        self,
        parent: QObject,
        command: Callable[[list[str]], Sequence[str]],
        scratch: Path | None,
        hears_terminate: bool,
    ) -> None:
        super().__init__(parent)
        self._command = command
        self._hears_terminate = hears_terminate
        self._process = QProcess(self)
        self._process.readyReadStandardOutput.connect(self._on_output)
        self._process.readyReadStandardError.connect(self._on_stderr)
        self._process.finished.connect(self._on_finished)
        self._process.errorOccurred.connect(self._on_process_error)
        self._kill_timer = QTimer(self)
        self._kill_timer.setSingleShot(True)
        self._kill_timer.setInterval(KILL_AFTER_MS)
        self._kill_timer.timeout.connect(self._process.kill)
        self._scratch = scratch
        self._preparing = scratch is not None
        self._partial, self._verb = b"", ""
        self._lines: deque[str] = deque(maxlen=LOG_LINES)
        self._done: DoneEvent | None = None
        self._error: ErrorEvent | None = None
        self._misread: MessageError | None = None
        self._ended = False
        self.cancelling = False

    @property
    def pid(self) -> int:
        """Its process number, 0 while it is not alive."""
        return int(self._process.processId())

    @property
    def log(self) -> str:
        """The last lines it wrote that were no event."""
        return "\n".join(self._lines)

    def start(self, arguments: list[str]) -> None:
        """Run `saia ARGUMENTS --json`, unless it was cancelled while that was prepared."""
        self._preparing = False
        if self._ended or not shiboken6.isValid(self):  # the latter: the window is gone
            self._remove_scratch()
            return
        self._verb = arguments[0]
        environment = QProcessEnvironment.systemEnvironment()
        environment.insert("PYTHONUTF8", "1")
        environment.insert("PYTHONUNBUFFERED", "1")
        environment.insert(FOR_WINDOW, "1")
        for name, value in launch.import_variables().items():
            environment.insert(name, value)
        self._process.setProcessEnvironment(environment)
        program, *words = self._command(arguments)
        self._process.start(program, words)

    def give_up(self, error: BaseException) -> None:
        """Preparing it failed."""
        self._preparing = False
        self._remove_scratch()
        if shiboken6.isValid(self):  # else the window went meanwhile, and nobody is there to be told
            self._end(error)

    def tell(self, command: Command) -> None:
        """Say something to it, one line on its standard input."""
        if self._alive():
            self._process.write(command.line.encode() + b"\n")

    def cancel(self) -> None:
        """End it now: ask it to, then kill it."""
        self.cancelling = True
        if self._alive():
            if not self._hears_terminate:
                self.tell(STOP)
            self._process.terminate()
            self._kill_timer.start()
        else:
            self._end(None)

    def kill(self) -> None:
        """End it at once."""
        self.cancelling = True
        if self._alive():
            self._process.kill()
        else:
            self._end(None)

    def close(self) -> None:
        """Wait for its end a moment; then it is killed."""
        if self._alive() and not self._process.waitForFinished(CLOSE_MS):
            self._process.kill()
            self._process.waitForFinished(CLOSE_MS)

    def _alive(self) -> bool:
        return self._process.state() != QProcess.ProcessState.NotRunning

    def _end(self, outcome: object) -> None:
        if self._ended:
            return
        self._ended = True
        if not self._preparing:  # else the pool still writes into it; `start` or `give_up` removes it then
            self._remove_scratch()
        self.ended.emit(self, outcome)

    def _remove_scratch(self) -> None:
        folder, self._scratch = self._scratch, None
        if folder is not None:
            shutil.rmtree(folder, ignore_errors=True)

    def _on_output(self) -> None:
        data = self._partial + bytes(self._process.readAllStandardOutput().data())
        *lines, self._partial = data.split(b"\n")
        for line in lines:
            self._read_line(line.decode("utf-8", errors="replace").strip())

    def _read_line(self, line: str) -> None:
        if not line:
            return
        try:
            event = decode(line, self._verb)
        except MessageError as error:
            # Hours of work are not ended for one line of progress; for the last line it is the failure.
            self._lines.append(str(error))
            self._misread = error
            return
        if event is None:
            self._lines.append(line)  # a library printed something; keep it, it may explain a failure
        elif isinstance(event, DoneEvent):
            self._done = event
        elif isinstance(event, ErrorEvent):
            self._error = event
        else:
            self.told.emit(self, event)

    def _on_stderr(self) -> None:
        text = bytes(self._process.readAllStandardError().data()).decode("utf-8", errors="replace")
        self._lines.extend(line for line in text.splitlines() if line.strip())

    def _on_process_error(self, error: QProcess.ProcessError) -> None:
        # Every other error is followed by `finished`.
        if error == QProcess.ProcessError.FailedToStart:
            self._end(StudioError(self.tr("This task could not be started."), self._process.errorString()))

    def _on_finished(self, code: int, status: QProcess.ExitStatus) -> None:
        self._kill_timer.stop()
        self._on_output()
        self._read_line(self._partial.decode("utf-8", errors="replace").strip())
        self._partial = b""
        self._on_stderr()
        crashed = status == QProcess.ExitStatus.CrashExit
        if self._done is not None and code == 0 and not crashed:
            self._end(self._done)
        elif self.cancelling:
            self._end(None)
        elif self._error is not None:
            self._end(_as_error(self._error))
        elif self._misread is not None and code == 0:
            self._end(self._misread)
        else:
            last = " / ".join(list(self._lines)[-3:]) or self.tr("No error message was given.")
            self._end(StudioError(self.tr("This task ended unexpectedly (code {0}).").format(code), last))


def _as_error(event: ErrorEvent) -> StudioError:
    """What the child raised, with the remedy that holds in the window."""
    remedy = event.in_window or event.remedy
    if event.there:
        return FileThereError(event.what, remedy, event.there)
    return StudioError(event.what, remedy, code=event.code)
