"""Parts of the studio as tests need them: small, and under the test's command."""

from __future__ import annotations

from typing import Any

from studio.ipc.commands import STOP, Command
from studio.ui.tasks import ChildTask


class FakeChildTask(ChildTask):
    """A child that is never started: it records what it is asked, and says what the test makes it say.

    Attributes:
        started: the arguments of each start.
        commands: what it was told on its standard input.
        cancels: how often it was cancelled.
    """

    def __init__(self, parent: Any = None) -> None:
        super().__init__(parent)
        self.started: list[list[str]] = []
        self.commands: list[Command] = []
        self.cancels = 0

    def start(self, arguments: list[str]) -> None:
        self.started.append(arguments)

    def tell(self, command: Command) -> None:
        self.commands.append(command)

    def cancel(self) -> None:
        self.cancels += 1

    @property
    def stops(self) -> int:
        """How often it was asked to end well."""
        return self.commands.count(STOP)

    def end(self, signal: Any, *values: Any) -> None:
        """Come to an end by one of its signals: done, failed or cancelled."""
        signal.emit(*values)
        self.ended.emit()
