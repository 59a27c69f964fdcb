"""Commands on standard input of a running command: stop, and the switches of a live performance."""

from __future__ import annotations

import os
import signal
import stat
import sys
import threading
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from studio.ipc import commands
from studio.ipc.commands import STOP


class LiveCommands:
    """Lines of stdin as they come."""

    def __init__(self) -> None:
        self._lines: deque[str] = deque()
        self._came = threading.Event()
        self._closed = False
        if sys.stdin is not None:
            threading.Thread(target=self._read, name="stdin", daemon=True).start()

    @property
    def parent_gone(self) -> bool:
        """Whether the pipe was closed and all that came through it is taken: nobody is there any more."""
        return self._closed and not self._lines

    def wait(self, seconds: float) -> None:
        """Return as soon as a line comes, or after so many seconds."""
        self._came.wait(seconds)
        self._came.clear()

    def poll(self) -> list[str]:
        """The lines since the last call."""
        lines = []
        while self._lines:
            lines.append(self._lines.popleft())
        return lines

    def _read(self) -> None:
        try:
            for line in sys.stdin:
                self._lines.append(line)
                self._came.set()
        except (OSError, ValueError):
            return  # stdin is closed; Ctrl+C remains
        self._closed = _is_pipe()


def _is_pipe() -> bool:
    """Whether somebody held the other end; an empty file or /dev/null ends at once and means nothing."""
    try:
        mode = os.fstat(sys.stdin.fileno()).st_mode
    except (OSError, ValueError):
        return False
    return stat.S_ISFIFO(mode) or stat.S_ISSOCK(mode)


_PARENT_POLL_SECONDS = 1.0


@contextmanager
def stop_signals() -> Iterator[threading.Event]:
    """Set by Ctrl+C and by SIGTERM."""
    command = threading.Event()

    def on_signal(_number: int, _frame: FrameType | None) -> None:
        command.set()

    in_main = threading.current_thread() is threading.main_thread()
    before = {n: signal.signal(n, on_signal) for n in (signal.SIGINT, signal.SIGTERM) if in_main}
    try:
        yield command
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def stop_requests() -> Iterator[threading.Event]:
    """Set by Ctrl+C, by SIGTERM, and by the line `stop` on stdin."""
    with stop_signals() as command:
        if sys.stdin is not None and not sys.stdin.isatty():
            threading.Thread(target=_read_wishes, args=(command,), name="stdin", daemon=True).start()
        yield command


@contextmanager
def ends_clean() -> Iterator[None]:
    """Within it SIGTERM ends the command as Ctrl+C does, so that nothing half-written stays behind."""

    def on_signal(_number: int, _frame: FrameType | None) -> None:
        raise KeyboardInterrupt

    in_main = threading.current_thread() is threading.main_thread()
    before = signal.signal(signal.SIGTERM, on_signal) if in_main else None
    try:
        yield
    finally:
        if in_main:
            signal.signal(signal.SIGTERM, before)


def wait_until_alone(parent: int, over: threading.Event) -> bool:
    """True once our parent is gone; False where `over` is set before. Waits on a thread of its own.

    For after the end of standard input: a window that died ends it; a script that gives us none (cron, CI)
    is still our parent.

    Args:
        parent: its process number, asked for while it lived.
        over: nobody needs to know any more.
    """
    # On Windows the parent's number stays when it is gone; there the end of the pipe must do.
    while os.name != "nt" and os.getppid() == parent:
        if over.wait(_PARENT_POLL_SECONDS):
            return False
    return True


def _read_wishes(command: threading.Event) -> None:
    try:
        if any(commands.read(line) == STOP for line in sys.stdin):
            command.set()
    except (OSError, ValueError):
        return  # stdin is closed; the other ways remain
