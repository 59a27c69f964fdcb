"""The process that hears motion, so that nothing the window does can make it miss a packet.

A window that draws keeps Python's lock for tens of milliseconds at a time; an unbundled body at 120 Hz is
13,000 packets a second. Here they meet a process that does nothing else. It ends with its parent.

Spoken on stdin: one pickled list of sockets, then nothing; its end is the wish to end.
Spoken on stdout: pickled (rows as batches, Heard), one at a time.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import signal
import socket
import sys
import threading
from typing import Any, BinaryIO

from studio.capture import clock
from studio.capture.receiver import Receiver, batches
from studio.capture.rows import Names

WORD = "_listen"
"""The command line that leads here."""
_TURN_S = 0.004
_TELL_S = 0.05


def main() -> int:
    """Listen until the parent is gone or wishes no more. Runs as the whole of a process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl+C is for the parent, which ends the take well
    if hasattr(os, "nice"):
        with contextlib.suppress(OSError):  # before everything else, where this user may
            os.nice(-10)
    given: list[Any] = pickle.load(sys.stdin.buffer)
    sockets = [_opened(one) for one in given]
    told = os.fdopen(os.dup(sys.stdout.fileno()), "wb", buffering=0)
    sys.setswitchinterval(0.0005)  # decoding must never make the threads that stamp wait
    ended = threading.Event()
    threading.Thread(target=_wait_for_end, args=(ended,), daemon=True).start()
    receiver = Receiver(sockets)
    with contextlib.suppress(OSError, KeyboardInterrupt):
        _tell(receiver, told, ended)
    receiver.close()
    return 0


def _tell(receiver: Receiver, told: BinaryIO, ended: threading.Event) -> None:
    names: Names | None = None
    told_at = 0.0
    while not ended.wait(_TURN_S):
        now = clock.now()
        rows = receiver.take_in(now)
        if not rows and now - told_at < _TELL_S:
            continue
        told_at = now
        said = batches(rows, names)
        names = rows[-1].names if rows else names
        write(told, (said, receiver.heard(now)))


def _wait_for_end(ended: threading.Event) -> None:
    with contextlib.suppress(OSError):
        while sys.stdin.buffer.read(1):
            pass
    ended.set()


def _opened(given: Any) -> socket.socket:
    """A socket of the parent's, which it passed on as a file descriptor, or as Windows shares one."""
    if isinstance(given, int):
        return socket.socket(fileno=given)
    shared: socket.socket = socket.fromshare(given)  # type: ignore[attr-defined,unused-ignore]
    return shared


def write(pipe: BinaryIO, content: object) -> None:
    """Pickle something into an unbuffered pipe, which may take it in parts."""
    left = memoryview(pickle.dumps(content, protocol=pickle.HIGHEST_PROTOCOL))
    while left:
        left = left[pipe.write(left) or 0 :]


if __name__ == "__main__":
    sys.exit(main())
