"""How a command that runs on is asked to end well."""

from __future__ import annotations

import os
import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

_PARENT_POLL_SECONDS = 1.0


@contextmanager
def stop_signals() -> Iterator[threading.Event]:
    """Set by Ctrl+C and by SIGTERM."""
    wish = threading.Event()

    def on_signal(_number: int, _frame: FrameType | None) -> None:
        wish.set()

    in_main = threading.current_thread() is threading.main_thread()
    before = {n: signal.signal(n, on_signal) for n in (signal.SIGINT, signal.SIGTERM) if in_main}
    try:
        yield wish
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def stop_wishes() -> Iterator[threading.Event]:
    """Set by Ctrl+C, by SIGTERM, and by the line `stop` on stdin."""
    with stop_signals() as wish:
        if sys.stdin is not None and not sys.stdin.isatty():
            threading.Thread(target=_read_wishes, args=(wish,), name="stdin", daemon=True).start()
        yield wish


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


def _read_wishes(wish: threading.Event) -> None:
    try:
        if any(line.strip() == "stop" for line in sys.stdin):
            wish.set()
    except (OSError, ValueError):
        return  # stdin is closed; the other ways remain
