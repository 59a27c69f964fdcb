"""Work off the GUI thread: a pool for what takes seconds, child processes for all that takes longer."""

from __future__ import annotations

import shutil
import sys
import tempfile
from collections import deque
from collections.abc import Callable, Sequence
from pathlib import Path
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
from studio.errors import FileThereError, StudioError
from studio.files import leftovers
from studio.ipc.commands import STOP, Command
from studio.ipc.events import DoneEvent, ErrorEvent, MessageError, decode

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
CLOSE_MS = 2_000
LOG_LINES = 200


def _studio(arguments: list[str]) -> Sequence[str]:
    return launch.studio(*arguments, "--json")


class ChildTask(QObject):
    """The newest of several requests for a `saia` command, each in a child process of its own.

    Starting again drops what was started before: that child is ended in the background and reports nothing
    any more. A request may begin with work on the thread pool that prepares files for the child; its scratch
    folder goes once its child has ended, however it ended.

    Args:
        parent: as everywhere in Qt.
        command: the program and its arguments, for arguments of `saia`; tests give one of their own.
        hears_terminate: children hear when they are to end; on Windows they do not, and are told on their
            standard input.

    Signals:
        told: what the child says while it runs, an event of studio.ipc.
        done: its last line, a DoneEvent of the command, when it ended well.
        failed: a StudioError, or what the preparing work raised.
        cancelled: it was cancelled; that is no failure.
        ended: after any of the three.
    """

    told = Signal(object)
    done = Signal(object)
    failed = Signal(object)
    cancelled = Signal()
    ended = Signal()

    def __init__(
        self,
        parent: QObject | None = None,
        command: Callable[[list[str]], Sequence[str]] = _studio,
        hears_terminate: bool = sys.platform != "win32",
    ) -> None:
        super().__init__(parent)
        self._command = command
        self._hears_terminate = hears_terminate
        self._child: _Child | None = None
        self._dropped: set[_Child] = set()
        self._log = ""

    @property
    def running(self) -> bool:
        """Whether a request is being prepared or its child is alive."""
        return self._child is not None

    @property
    def cancelling(self) -> bool:
        """Whether it was told to end at once; a child at its very end may report `done` all the same."""
        return self._child is not None and self._child.cancelling

    @property
    def pid(self) -> int:
        """The child's process number, 0 where none is alive."""
        return self._child.pid if self._child is not None else 0

    @property
    def log(self) -> str:
        """The last lines the newest child wrote to stderr, for a log drawer or a report."""
        return self._child.log if self._child is not None else self._log

    def start(self, arguments: list[str]) -> None:
        """Run `saia ARGUMENTS --json`, e.g. start(["train", folder, "--recipe", "saia"])."""
        self._new_child(None).start(arguments)

    def prepare_and_start(self, prepare: Callable[[Path], list[str]], purpose: str = "child") -> None:
        """Write files for a child on the thread pool, then start it.

        Args:
            prepare: gives the arguments; called on a pool thread with a scratch folder of this request's own.
            purpose: a word in small letters for the folder's name.
        """
        try:
            scratch = Path(tempfile.mkdtemp(prefix=leftovers.scratch_prefix(purpose)))
        except OSError as error:
            self.drop()
            self.failed.emit(error)
            self.ended.emit()
            return
        child = self._new_child(scratch)
        # No owner: the scratch folder of a request that was dropped meanwhile has to go all the same.
        run(lambda: prepare(scratch), child.start, child.give_up)

    def stop(self) -> None:
        """Ask the child to end well, keeping what it has."""
        self.tell(STOP)

    def tell(self, command: Command) -> None:
        """Say something to the child, one line on its standard input."""
        if self._child is not None:
            self._child.tell(command)

    def cancel(self) -> None:
        """End the child now: ask it to, then kill it."""
        if self._child is not None:
            self._child.cancel()

    def kill(self) -> None:
        """End a child that does not answer, at once; like `cancel` that is no failure."""
        if self._child is not None:
            self._child.kill()

    def drop(self) -> None:
        """What was asked for is wanted no more: end it in the background, without a word."""
        child, self._child = self._child, None
        if child is not None:
            self._dropped.add(child)
            child.cancel()

    def close(self) -> None:
        """End every child because the window closes, and wait for them a moment."""
        self.drop()
        # A copy: a child that ends takes itself out.
        for child in list(self._dropped):
            child.close()

    def _new_child(self, scratch: Path | None) -> _Child:
        self.drop()
        child = self._child = _Child(self, self._command, scratch, self._hears_terminate)
        # Methods, since Qt would hold a lambda, and with it this object, until the child is deleted: then the
        # child's end would delete its own parent.
        child.told.connect(self._on_told)
        child.ended.connect(self._on_ended)
        return child

    def _on_told(self, child: _Child, event: object) -> None:
        if child is self._child:
            self.told.emit(event)

    def _on_ended(self, child: _Child, outcome: object) -> None:
        self._dropped.discard(child)
        child.deleteLater()
        if child is not self._child:
            return
        # Free before anybody is told: a slot may ask for the next at once.
        self._child, self._log = None, child.log
        if isinstance(outcome, DoneEvent):
            self.done.emit(outcome)
        elif isinstance(outcome, BaseException):
            self.failed.emit(outcome)
        else:
            self.cancelled.emit()
        self.ended.emit()


class _Child(QObject):
    """One child process, from its preparing to its end.

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
        return int(self._process.processId())

    @property
    def log(self) -> str:
        return "\n".join(self._lines)

    def start(self, arguments: list[str]) -> None:
        self._preparing = False
        if self._ended or not shiboken6.isValid(self):  # cancelled, or the window gone, while it was prepared
            self._remove_scratch()
            return
        self._verb = arguments[0]
        environment = QProcessEnvironment.systemEnvironment()
        environment.insert("PYTHONUTF8", "1")
        environment.insert("PYTHONUNBUFFERED", "1")
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
        if self._alive():
            self._process.write(command.line.encode() + b"\n")

    def cancel(self) -> None:
        self.cancelling = True
        if self._alive():
            if not self._hears_terminate:
                self.tell(STOP)
            self._process.terminate()
            self._kill_timer.start()
        else:
            self._end(None)

    def kill(self) -> None:
        self.cancelling = True
        if self._alive():
            self._process.kill()
        else:
            self._end(None)

    def close(self) -> None:
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
            self._end(StudioError(self.tr("The work could not be started."), self._process.errorString()))

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
            last = " / ".join(list(self._lines)[-3:]) or self.tr("It left no message.")
            self._end(StudioError(self.tr("The work ended unexpectedly (code {0}).").format(code), last))


def _as_error(event: ErrorEvent) -> StudioError:
    """What the child raised, with the remedy that holds in the window."""
    remedy = event.in_window or event.remedy
    if event.there:
        return FileThereError(event.what, remedy, event.there)
    return StudioError(event.what, remedy, code=event.code)
