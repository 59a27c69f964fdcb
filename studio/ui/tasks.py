"""Work off the GUI thread: a pool for what takes seconds, child processes for all that takes longer."""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeVar

import shiboken6
from PySide6.QtCore import QObject, QRunnable, Qt, QThreadPool, Signal, Slot

from studio import launch
from studio.files import leftovers
from studio.ipc.commands import STOP, Command
from studio.ipc.events import DoneEvent
from studio.ui.child_process import ChildProcess

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
        pool: QThreadPool | None = None,
    ) -> None:
        """As `run` of this module, in place of what was asked for before.

        Args:
            work, on_done, on_error, pool: as there; on_done and on_error are not called once a newer request
                came.
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

        run(work, done, failed, owner=self._owner, pool=pool)


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
        self._child: ChildProcess | None = None
        self._dropped: set[ChildProcess] = set()
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

    def _new_child(self, scratch: Path | None) -> ChildProcess:
        self.drop()
        child = self._child = ChildProcess(self, self._command, scratch, self._hears_terminate)
        # Methods, since Qt would hold a lambda, and with it this object, until the child is deleted: then the
        # child's end would delete its own parent.
        child.told.connect(self._on_told)
        child.ended.connect(self._on_ended)
        return child

    def _on_told(self, child: ChildProcess, event: object) -> None:
        if child is self._child:
            self.told.emit(event)

    def _on_ended(self, child: ChildProcess, outcome: object) -> None:
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
