"""Work off the GUI thread: a pool for what takes seconds, child processes for all that takes longer."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Any, TypeVar

import shiboken6
from PySide6.QtCore import (
    QObject,
    QProcess,
    QProcessEnvironment,
    QRunnable,
    Qt,
    QThreadPool,
    QTimer,
    Signal,
    Slot,
)

from studio import launch
from studio.ipc.commands import STOP, Command
from studio.ipc.events import DoneEvent, ErrorEvent
from studio.ipc.messages import MessageError, decode

T = TypeVar("T")


class Task(QObject):
    """One piece of work in flight; `forget` drops its result."""

    _finished = Signal(object)

    def __init__(
        self,
        owner: QObject | None,
        on_done: Callable[[Any], None],
        on_error: Callable[[BaseException], None] | None,
    ) -> None:
        super().__init__()
        self._owned = owner is not None
        self._owner = owner
        self._on_done = on_done
        self._on_error = on_error
        self._forgotten = False
        self._finished.connect(self._on_finished, Qt.ConnectionType.QueuedConnection)

    def forget(self) -> None:
        """Let the work end on its own; nobody is told."""
        self._forgotten = True

    def deliver(self, outcome: object) -> None:
        """Hand the result over to the GUI thread. Runs on a pool thread."""
        self._finished.emit(outcome)

    @Slot(object)
    def _on_finished(self, outcome: object) -> None:
        _in_flight.discard(self)
        if self._forgotten or (self._owned and not shiboken6.isValid(self._owner)):
            return
        assert isinstance(outcome, _Outcome)
        if outcome.error is None:
            self._on_done(outcome.value)
        elif self._on_error is not None:
            self._on_error(outcome.error)
        else:
            from studio.ui import messages

            messages.show_error(None, outcome.error)


class _Outcome:
    """What came of the work; an object of its own, since a signal may not carry None safely."""

    def __init__(self, value: Any = None, error: BaseException | None = None) -> None:
        self.value = value
        self.error = error


class _Work(QRunnable):
    def __init__(self, work: Callable[[], Any], task: Task) -> None:
        super().__init__()
        self._work = work
        self._task = task

    def run(self) -> None:
        try:
            outcome = _Outcome(self._work())
        except Exception as error:  # noqa: BLE001 - whatever went wrong is shown on the GUI thread
            outcome = _Outcome(error=error)
        if shiboken6.isValid(self._task):
            self._task.deliver(outcome)


_in_flight: set[Task] = set()


def run(
    work: Callable[[], T],
    on_done: Callable[[T], None],
    on_error: Callable[[BaseException], None] | None = None,
    owner: QObject | None = None,
    pool: QThreadPool | None = None,
) -> Task:
    """Do some work on the thread pool and report back on the GUI thread.

    Args:
        work: called on a pool thread; must not touch widgets.
        on_done: called with its result on the GUI thread.
        on_error: called with what it raised; shown as a message where None.
        owner: results are dropped once this object is gone.
        pool: another one than everybody's, e.g. of one thread, for work that must keep its order.
    """
    task = Task(owner, on_done, on_error)
    _in_flight.add(task)
    (pool or QThreadPool.globalInstance()).start(_Work(work, task))
    return task


def wait(timeout_ms: int = 10_000) -> bool:
    """Wait for all work on the pool, for closing down; whether it ended in time."""
    return QThreadPool.globalInstance().waitForDone(timeout_ms)


class LatestTask:
    """The newest of several requests of one kind: what an older one would bring is dropped.

    Args:
        owner: results are dropped once this object is gone.
    """

    def __init__(self, owner: QObject) -> None:
        self._owner = owner
        self._newest = 0

    def drop(self) -> None:
        """What was asked for is wanted no more."""
        self._newest += 1

    def run(
        self,
        work: Callable[[], T],
        on_done: Callable[[T], None],
        on_error: Callable[[BaseException], None] | None = None,
        unwanted: Callable[[T], None] | None = None,
    ) -> None:
        """As `run` of this module, in place of what was asked for before.

        Args:
            work, on_done, on_error: as there; neither of the last two is called once a newer request came.
            unwanted: called instead of on_done then, where a result holds something that has to be closed.
        """
        self._newest += 1
        number = self._newest

        def done(result: T) -> None:
            if number == self._newest:
                on_done(result)
            elif unwanted is not None:
                unwanted(result)

        def failed(error: BaseException) -> None:
            if number != self._newest:
                return
            if on_error is None:
                from studio.ui import messages

                messages.show_error(None, error)
            else:
                on_error(error)

        run(work, done, failed, owner=self._owner)


KILL_AFTER_MS = 5_000
KEPT_LINES = 200


class Job(QObject):
    """One `saia` command in a child process.

    Signals:
        told: what it says while it runs, an event of studio.ipc.
        done: its last line, a DoneEvent of the command, when it ended well.
        failed: what happened and what to do, when it did not.
        cancelled: it was cancelled; that is no failure.
        ended: after any of the three.
    """

    told = Signal(object)
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
        self._partial, self._verb = b"", ""
        self._log: deque[str] = deque(maxlen=KEPT_LINES)
        self._done: DoneEvent | None = None
        self._error: ErrorEvent | None = None
        self._misread: MessageError | None = None
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
        return self._error.there if self._error is not None else ""

    def start(self, arguments: list[str]) -> None:
        """Run `saia ARGUMENTS --json`, e.g. start(["train", folder, "--recipe", "saia"])."""
        assert not self.running, "one job, one child"
        self._partial, self._done, self._error, self._misread = b"", None, None, None
        self._cancelling = self._reported = False
        self._log.clear()
        self._verb = arguments[0]
        environment = QProcessEnvironment.systemEnvironment()
        environment.insert("PYTHONUTF8", "1")
        environment.insert("PYTHONUNBUFFERED", "1")
        for name, value in launch.import_variables().items():
            environment.insert(name, value)
        self._process.setProcessEnvironment(environment)
        program, *words = launch.studio(*arguments, "--json")
        self._process.start(program, words)

    def stop(self) -> None:
        """Ask the child to end well, keeping what it has."""
        self.tell(STOP)

    def tell(self, command: Command) -> None:
        """Say something to the child, one line on its standard input."""
        if self.running:
            self._process.write(command.line.encode() + b"\n")

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
            event = decode(line, self._verb)
        except MessageError as error:
            # Hours of work are not ended for one line of progress; for the last line it is the failure.
            self._log.append(str(error))
            self._misread = error
            return
        if event is None:
            self._log.append(line)  # a library printed something; keep it, it may explain a failure
        elif isinstance(event, DoneEvent):
            self._done = event
        elif isinstance(event, ErrorEvent):
            self._error = event
        else:
            self.told.emit(event)

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
            self._report_failure(self._error.what, self._error.in_window or self._error.remedy)
        elif self._misread is not None and code == 0:
            self._report_failure(self._misread.what, self._misread.remedy)
        else:
            last = " / ".join(list(self._log)[-3:]) or self.tr("It left no message.")
            self._report_failure(self.tr("The work ended unexpectedly (code {0}).").format(code), last)

    def _report_failure(self, what: str, remedy: str) -> None:
        if self._reported:
            return
        self._reported = True
        self.failed.emit(what, remedy)
        self.ended.emit()
