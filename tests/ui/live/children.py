"""A child that performs nothing, and what one says, for tests that need none."""

from __future__ import annotations

from typing import Any

import msgspec
from PySide6.QtCore import QObject, Signal

from studio.ipc.commands import Command
from studio.ipc.events import LiveStateEvent, PoseEvent, ReadyEvent
from studio.ui.live.presenter import LivePresenter
from studio.ui.live.view import LiveView
from studio.ui.session import Session


class FakeChild(QObject):
    """In the place of a ChildTask: notes what it was asked, and says what a test has it say."""

    told = Signal(object)
    done = Signal(object)
    failed = Signal(object)
    cancelled = Signal()
    ended = Signal()
    pid = 0

    def __init__(self) -> None:
        super().__init__()
        self.running = False
        self.started: list[list[str]] = []
        self.commands: list[Command] = []

    def start(self, arguments: list[str]) -> None:
        self.running = True
        self.started.append(arguments)

    def tell(self, command: Command) -> None:
        if self.running:
            self.commands.append(command)

    def stop(self) -> None:
        """It takes its time: a test calls `end`."""

    def cancel(self) -> None:
        self.end()

    def kill(self) -> None:
        self.end()

    def end(self, error: BaseException | None = None) -> None:
        """It is over, by a failure where one is given."""
        self.running = False
        if error is not None:
            self.failed.emit(error)
        self.ended.emit()

    def close(self) -> None:
        self.running = False


Room = tuple[LiveView, LivePresenter, Session]


def ready(shapes: tuple[str, ...], bones: tuple[str, ...], source: str = "Mic") -> ReadyEvent:
    """It is ready, with these channels."""
    return ReadyEvent(source, (100,), 100, 92.0, shapes, bones, ((0.0, 1.0, 0.0),) * len(bones))


def pose(shapes: int, bones: int) -> PoseEvent:
    """A pose of so many channels, its shapes half open."""
    rest, turn = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)
    return PoseEvent((0.5,) * shapes, (turn,) * bones, (rest,)[:bones], rest, turn, -20.0, -30.0)


def state(**how: Any) -> LiveStateEvent:
    """Its state: all switches of the moment off, gain and idling on, but for what is said."""
    return msgspec.structs.replace(_USUAL, **how)


_USUAL = LiveStateEvent(
    speaking=False, gain_db=0.0, latency_ms=100.0, sound_delay_ms=100, seen="seen", muted=False, frozen=False,
    neutral=False, gain_on=True, idles=True, clipped=False, lost=False, idling=0.0, load=0.1,
)  # fmt: skip
