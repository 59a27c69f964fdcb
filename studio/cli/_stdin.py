"""Commands on standard input of a running command, and the signals that end it: one reader for all verbs."""

from __future__ import annotations

import os
import signal
import stat
import sys
import threading
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

from studio.ipc import commands
from studio.ipc.commands import STOP

_PARENT_POLL_SECONDS = 1.0


class StdinReader:
    """Reads standard input line by line on a thread of its own.

    Args:
        on_line: called with each line on that thread.
        on_alone: called there once the input has ended and our parent is gone, until `close`. Its end alone
            says nothing: a script that gives us no input (cron, CI) is still our parent.
    """

    def __init__(self, on_line: Callable[[str], None], on_alone: Callable[[], None] | None = None) -> None:
        self._on_line, self._on_alone = on_line, on_alone
        self._parent = os.getppid()  # asked for while it surely lives
        self._closed, self._is_pipe_closed = threading.Event(), False
        self._thread = threading.Thread(target=self._read, name="stdin", daemon=True)
        if sys.stdin is not None:  # None under pythonw and in a bundle without a console
            self._thread.start()

    @property
    def pipe_closed(self) -> bool:
        """Whether somebody held the other end of a pipe and closed it."""
        return self._is_pipe_closed

    def close(self) -> None:
        """Nobody needs to know any more whether the parent is gone."""
        self._closed.set()

    def join(self, timeout: float) -> bool:
        """Wait for the end of the input, and of the parent where that matters; whether it came in time."""
        self._thread.join(timeout)
        return not self._thread.is_alive()

    def _read(self) -> None:
        try:
            for line in iter(sys.stdin.readline, ""):
                self._on_line(line)
            self._is_pipe_closed = _is_pipe()
        except (OSError, ValueError):
            pass  # closed under us; Ctrl+C remains, and the parent is watched as after its end
        if self._on_alone is not None and self._wait_until_alone():
            self._on_alone()

    def _wait_until_alone(self) -> bool:
        # On Windows the parent's number stays when it is gone; there the end of the pipe must do.
        while os.name != "nt" and os.getppid() == self._parent:
            if self._closed.wait(_PARENT_POLL_SECONDS):
                return False
        return True


def _is_pipe() -> bool:
    """Whether somebody held the other end; an empty file or /dev/null ends at once and means nothing."""
    try:
        mode = os.fstat(sys.stdin.fileno()).st_mode
    except (OSError, ValueError):
        return False
    return stat.S_ISFIFO(mode) or stat.S_ISSOCK(mode)


def _is_terminal() -> bool:
    return sys.stdin is not None and sys.stdin.isatty()


class LiveCommands:
    """The lines of standard input as they come, for a command that asks for them in its own time."""

    def __init__(self) -> None:
        self._lines: deque[str] = deque()
        self._arrived = threading.Event()
        self._reader = StdinReader(self._on_line)

    @property
    def parent_gone(self) -> bool:
        """Whether the pipe was closed and all that came through it was polled: nobody is there any more."""
        return self._reader.pipe_closed and not self._lines

    def wait(self, seconds: float) -> None:
        """Return as soon as a line comes, or after so many seconds."""
        self._arrived.wait(seconds)
        self._arrived.clear()

    def poll(self) -> list[str]:
        """The lines since the last call."""
        lines = []
        while self._lines:
            lines.append(self._lines.popleft())
        return lines

    def _on_line(self, line: str) -> None:
        self._lines.append(line)
        self._arrived.set()


class CancelRequests:
    """What of a queue is no longer requested: `skip N` leaves out an entry, `stop` all that is left.

    Args:
        watched: a window waits for what is made, and its end stops everything. What a person began at a
            terminal goes on when that is closed under nohup.
    """

    def __init__(self, watched: bool = False) -> None:
        self._stopped, self._skipped = threading.Event(), set[int]()
        self.reader: StdinReader | None = None
        if sys.stdin is not None and not _is_terminal():
            self.reader = StdinReader(self.process, self._stopped.set if watched else None)

    def close(self) -> None:
        """The queue is over."""
        if self.reader is not None:
            self.reader.close()

    def is_cancelled(self, index: int) -> bool:
        """Whether an entry is to be left out."""
        return self._stopped.is_set() or index in self._skipped

    def process(self, line: str) -> None:
        """Read one line."""
        match commands.read(line):
            case ("stop", _):
                self._stopped.set()
            case ("skip", index) if index.isdecimal():
                self._skipped.add(int(index))


class StopRequest:
    """Whether a good end was requested: by a line `stop`, or because the parent is gone.

    Args:
        read: standard input is read at all.
        watched: a window waits for us. What was begun at a terminal goes on when that closes under nohup.
    """

    def __init__(self, read: bool, watched: bool = False) -> None:
        self._requests = 0
        if read:
            StdinReader(self._on_line, self.request if watched else None)

    def is_set(self) -> bool:
        """Whether to stop now."""
        return self._requests > 0

    def request(self) -> None:
        """Stop as soon as it can end well."""
        self._requests += 1

    def requested_again(self) -> Callable[[], bool]:
        """Whether a stop is requested from now on: what follows a stopped training can be stopped as well."""
        before = self._requests
        return lambda: self._requests > before

    def _on_line(self, line: str) -> None:
        if commands.read(line.lower()) == STOP:
            self.request()


@contextmanager
def stop_requests() -> Iterator[threading.Event]:
    """Set by Ctrl+C, by SIGTERM, and by the line `stop` on stdin."""
    with stop_signals() as event:

        def on_line(line: str) -> None:
            if commands.read(line) == STOP:
                event.set()

        if sys.stdin is not None and not _is_terminal():
            StdinReader(on_line)
        yield event


@contextmanager
def stop_signals() -> Iterator[threading.Event]:
    """Set by Ctrl+C and by SIGTERM."""
    event = threading.Event()
    with _handled((signal.SIGINT, signal.SIGTERM), event.set):
        yield event


@contextmanager
def ends_clean(*more: str) -> Iterator[None]:
    """Within it SIGTERM ends the command as Ctrl+C does, so that nothing half-written stays behind.

    Args:
        more: names of further signals that do the same, where this system has them and heeds them.
    """

    def interrupt() -> None:
        raise KeyboardInterrupt

    found = [getattr(signal, name) for name in more if hasattr(signal, name)]
    # Under nohup a closed terminal is to end nothing.
    heeded = [number for number in found if signal.getsignal(number) is not signal.SIG_IGN]
    with _handled((signal.SIGTERM, *heeded), interrupt):
        yield


@contextmanager
def _handled(numbers: tuple[signal.Signals, ...], act: Callable[[], None]) -> Iterator[None]:
    """Within it some signals do something else; off the main thread nothing changes, as Python has it."""

    def on_signal(_number: int, _frame: FrameType | None) -> None:
        act()

    in_main = threading.current_thread() is threading.main_thread()
    before = {number: signal.signal(number, on_signal) for number in numbers if in_main}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
