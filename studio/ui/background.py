"""Short work off the GUI thread: a thread pool for what takes less than about five seconds."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

import shiboken6
from PySide6.QtCore import QObject, QRunnable, Qt, QThreadPool, Signal, Slot

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
