"""Parts of the studio as tests need them: small, and under the test's command."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from studio.ipc.commands import STOP, Command
from studio.ipc.events import ChildEvent, DoneEvent
from studio.ui.tasks import ChildTask


class FakeChildTask(ChildTask):
    """A child task that starts nothing: a test says what the child says, and how it ends.

    Args:
        scratch: the folder that preparing work is given.

    Attributes:
        started: the arguments of each child, in order.
        commands: what was said to the children.
        cancels: how often one was cancelled; it ends slowly, `end` says when.
        dropped: how many requests were given up.
        closed: the window has closed.
    """

    def __init__(self, scratch: Path | None = None) -> None:
        super().__init__()
        self._scratch = scratch
        self._running = False
        self.started: list[list[str]] = []
        self.commands: list[Command] = []
        self.cancels = 0
        self.dropped = 0
        self.closed = False

    @property
    def running(self) -> bool:
        return self._running

    @property
    def stops(self) -> int:
        """How often it was asked to end well."""
        return self.commands.count(STOP)

    def start(self, arguments: list[str]) -> None:
        self.started.append(arguments)
        self._running = True

    def prepare_and_start(self, prepare: Callable[[Path], list[str]], purpose: str = "child") -> None:
        assert self._scratch is not None
        self.start(prepare(self._scratch))

    def tell(self, command: Command) -> None:
        self.commands.append(command)

    def cancel(self) -> None:
        self.cancels += 1

    def drop(self) -> None:
        self.dropped += self._running
        self._running = False

    def close(self) -> None:
        self.drop()
        self.closed = True

    def say(self, event: ChildEvent) -> None:
        """The child prints a line."""
        if self._running:
            self.told.emit(event)

    def end(self, outcome: DoneEvent | BaseException | None) -> None:
        """The child ends: well, by an error, or cancelled where None."""
        if not self._running:
            return
        self._running = False
        if isinstance(outcome, DoneEvent):
            self.done.emit(outcome)
        elif outcome is not None:
            self.failed.emit(outcome)
        else:
            self.cancelled.emit()
        self.ended.emit()
