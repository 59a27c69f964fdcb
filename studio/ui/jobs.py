"""Long work: a child process running the same command a person would type.

A crash in training cannot take a recording with it, and closing the window ends the child: it reads
the end of its standard input as "the parent is gone".
"""

from __future__ import annotations

import json
import sys
from collections import deque
from typing import Any

from PySide6.QtCore import QObject, QProcess, QProcessEnvironment, QTimer, Signal

KILL_AFTER_MS = 5_000
KEPT_LINES = 200


class Job(QObject):
    """One `saia` command in a child process.

    Signals:
        event_received: one JSON line as a dict, while it runs.
        done: the facts of its last line, when it ended well.
        failed: what happened and what to do, when it did not.
        cancelled: it was cancelled; that is no failure.
        ended: after any of the three.
    """

    event_received = Signal(object)
    done = Signal(object)
    failed = Signal(str, str)
    cancelled = Signal()
    ended = Signal()

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._process = QProcess(self)
        self._process.readyReadStandardOutput.connect(self._on_output)
        self._process.readyReadStandardError.connect(self._on_stderr)
        self._process.finished.connect(self._on_finished)
        self._process.errorOccurred.connect(self._on_process_error)
        self._kill_timer = QTimer(self)
        self._kill_timer.setSingleShot(True)
        self._kill_timer.setInterval(KILL_AFTER_MS)
        self._kill_timer.timeout.connect(self._process.kill)
        self._partial = b""
        self._log: deque[str] = deque(maxlen=KEPT_LINES)
        self._done: dict[str, Any] | None = None
        self._error: dict[str, Any] | None = None
        self._cancelling = False
        self._reported = False

    @property
    def running(self) -> bool:
        """Whether the child is alive or starting."""
        return self._process.state() != QProcess.ProcessState.NotRunning

    @property
    def cancelling(self) -> bool:
        """Whether it was told to end at once; a child at its very end may report `done` all the same."""
        return self._cancelling

    @property
    def pid(self) -> int:
        """The child's process number, 0 where none is alive."""
        return int(self._process.processId())

    @property
    def log(self) -> str:
        """The last lines the child wrote to stderr, for a log drawer or a report."""
        return "\n".join(self._log)

    @property
    def there(self) -> str:
        """The file that the command would have written over, "" where that is not why it failed."""
        return str((self._error or {}).get("there") or "")

    def start(self, arguments: list[str]) -> None:
        """Run `saia ARGUMENTS --json`, e.g. start(["train", folder, "--recipe", "saia"])."""
        assert not self.running, "one job, one child"
        self._partial, self._done, self._error = b"", None, None
        self._cancelling = self._reported = False
        self._log.clear()
        environment = QProcessEnvironment.systemEnvironment()
        environment.insert("PYTHONUTF8", "1")
        environment.insert("PYTHONUNBUFFERED", "1")
        self._process.setProcessEnvironment(environment)
        # A bundled studio is its own interpreter; a checkout runs the package.
        before = [] if getattr(sys, "frozen", False) else ["-m", "studio"]
        self._process.start(sys.executable, [*before, *arguments, "--json"])

    def stop(self) -> None:
        """Ask the child to end well, keeping what it has."""
        if self.running:
            self._process.write(b"stop\n")

    def tell(self, line: str) -> None:
        """Say something to the child, one line on its standard input."""
        if self.running:
            self._process.write(line.encode() + b"\n")

    def cancel(self) -> None:
        """End the child now: terminate, then kill."""
        if not self.running:
            return
        self._cancelling = True
        self._process.terminate()
        self._kill_timer.start()

    def kill(self) -> None:
        """End a child that does not answer, at once; like `cancel` that is no failure."""
        if self.running:
            self._cancelling = True
            self._process.kill()

    def close(self) -> None:
        """End the child because the window closes, and wait for it a moment."""
        if not self.running:
            return
        self.blockSignals(True)
        self.cancel()
        if not self._process.waitForFinished(2_000):
            self._process.kill()
            self._process.waitForFinished(2_000)
        self.blockSignals(False)

    def _on_output(self) -> None:
        data = self._partial + bytes(self._process.readAllStandardOutput().data())
        *lines, self._partial = data.split(b"\n")
        for line in lines:
            self._take_line(line.decode("utf-8", errors="replace").strip())

    def _take_line(self, line: str) -> None:
        if not line:
            return
        try:
            event = json.loads(line)
        except ValueError:
            event = None
        if not isinstance(event, dict) or "event" not in event:
            self._log.append(line)  # a library printed something; keep it, it may explain a failure
        elif event["event"] == "done":
            self._done = event
        elif event["event"] == "error":
            self._error = event
        else:
            self.event_received.emit(event)

    def _on_stderr(self) -> None:
        text = bytes(self._process.readAllStandardError().data()).decode("utf-8", errors="replace")
        self._log.extend(line for line in text.splitlines() if line.strip())

    def _on_process_error(self, error: QProcess.ProcessError) -> None:
        if error == QProcess.ProcessError.FailedToStart:
            self._report_failure(self.tr("The work could not be started."), self._process.errorString())

    def _on_finished(self, code: int, status: QProcess.ExitStatus) -> None:
        self._kill_timer.stop()
        self._on_output()
        if self._partial:
            self._take_line(self._partial.decode("utf-8", errors="replace").strip())
            self._partial = b""
        self._on_stderr()
        crashed = status == QProcess.ExitStatus.CrashExit
        if self._done is not None and code == 0 and not crashed:
            self._reported = True
            self.done.emit(self._done)
            self.ended.emit()
        elif self._cancelling:
            self._reported = True
            self.cancelled.emit()
            self.ended.emit()
        elif self._error is not None:
            remedy = self._error.get("in_window") or self._error.get("remedy", "")
            self._report_failure(str(self._error.get("what", "")), str(remedy))
        else:
            last = " / ".join(list(self._log)[-3:]) or self.tr("It left no message.")
            self._report_failure(self.tr("The work ended unexpectedly (code {0}).").format(code), last)

    def _report_failure(self, what: str, remedy: str) -> None:
        if self._reported:
            return
        self._reported = True
        self.failed.emit(what, remedy)
        self.ended.emit()
