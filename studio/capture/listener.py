"""The process that receives motion, so that nothing the window does can make it miss a packet.

A window that draws keeps Python's lock for tens of milliseconds at a time; an unbundled body at 120 Hz is
13,000 packets a second. Here they meet a process that does nothing else. It ends with its parent.

Spoken on stdin: one pickled list of sockets, then nothing; its end is the request to end.
Spoken on stdout: pickled (sent blocks, rows of pictures, ReceiverStats), one at a time; see `SentBlock`.
"""

from __future__ import annotations

import contextlib
import gc
import os
import pickle
import signal
import socket
import sys
import threading
from collections import deque
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from studio import clock
from studio.capture.receiver import Receiver, ReceiverStats
from studio.vmc.rows import ChannelLayout, RowBlock

_NICER = -10


def raise_priority(before_all: bool = False) -> None:
    """Let this process run before others.

    Args:
        before_all: in real time where the system allows it; for one that mostly waits.
    """
    if sys.platform == "win32":
        import psutil

        with contextlib.suppress(psutil.Error):
            psutil.Process().nice(psutil.HIGH_PRIORITY_CLASS)
        return
    with contextlib.suppress(OSError):
        # Negative values need a right that most users lack; where it is refused, all goes on as before.
        os.nice(_NICER)
    if before_all and hasattr(os, "sched_setscheduler"):
        with contextlib.suppress(OSError):
            # Real time is safe only for a process that mostly waits: one that computes would starve the rest.
            os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(1))


WORD = "_listen"
"""The command line that leads here."""
_TURN_S = 0.004
_SEND_S = 0.05
# Turns kept for a parent that is held up: minutes.
_MOST_WAITING = 20_000


def main() -> int:
    """Listen until the parent is gone or asks it to stop. Runs as the whole of a process."""
    # Ctrl+C reaches every process of a terminal; the parent decides, and ends the take properly.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    raise_priority(before_all=True)
    given: list[Any] = pickle.load(sys.stdin.buffer)
    sockets = [_opened(one) for one in given]
    writer = PipeWriter(os.fdopen(os.dup(sys.stdout.fileno()), "wb", buffering=0))
    ended = threading.Event()
    # The pipe's end is the only message: it also comes when the parent is killed, on every system.
    threading.Thread(target=_wait_for_end, args=(ended,), daemon=True).start()
    receiver = Receiver(sockets)
    # What is loaded by now stays for good: the garbage collector need not walk through it in mid-stream.
    gc.freeze()
    with contextlib.suppress(OSError, KeyboardInterrupt):
        _listen(receiver, writer, ended)
    receiver.close()
    return 0


def _listen(receiver: Receiver, writer: PipeWriter, ended: threading.Event) -> None:
    names: ChannelLayout | None = None
    sent_at = 0.0
    while not ended.is_set() and not writer.broken:
        receiver.wait(_SEND_S)
        if receiver.stamped:
            # Let some datagrams gather, which costs less than reading each. Without the kernel's stamps the
            # moment of reading is the arrival, so then it is read at once.
            ended.wait(_TURN_S)
        now = clock.now()
        blocks = receiver.poll(now)
        if not blocks and now - sent_at < _SEND_S:
            continue
        # Never wait for the parent here, or the kernel's buffer overflows and datagrams of everybody are
        # lost.
        if writer.full:
            receiver.count_unsent(sum(map(len, blocks)))
            continue
        sent_at = now
        # The parent keeps the names it was told last, as this loop does; the pipe loses nothing in between.
        sent: list[SentBlock] = []
        for block in blocks:
            sent.append((block.names if block.names is not names else None, block.stamps, block.values))
            names = block.names
        writer.send((sent, receiver.poll_pictures(), receiver.stats(now)))


SentBlock = tuple[ChannelLayout | None, NDArray[np.float64], NDArray[np.float32]]
"""A RowBlock's parts on their way to the recorder; names, as large as a row, only where they change."""
Report = tuple[list[SentBlock], list[tuple[float, ...]], ReceiverStats]


def received(sent: list[SentBlock], names: ChannelLayout | None) -> list[RowBlock]:
    """The blocks that were sent.

    Args:
        names: those of the last block that was received before.
    """
    blocks = []
    for changed, stamps, values in sent:
        names = changed if changed is not None else names
        assert names is not None
        blocks.append(RowBlock(names, stamps, values))
    return blocks


class PipeWriter:
    """Writes into the pipe on a thread of its own: a parent that is held up must not stop the listening.

    Attributes:
        broken: the parent is gone.
    """

    def __init__(self, pipe: BinaryIO) -> None:
        self.broken = False
        self._pipe = pipe
        self._waiting: deque[object] = deque()
        self._more = threading.Event()
        threading.Thread(target=self._write, daemon=True).start()

    @property
    def full(self) -> bool:
        """Whether nothing more is kept until the parent reads on."""
        return len(self._waiting) >= _MOST_WAITING

    def send(self, content: object) -> None:
        """Have something written."""
        self._waiting.append(content)
        self._more.set()

    def _write(self) -> None:
        """Runs on a thread of its own."""
        try:
            while True:
                self._more.wait()
                self._more.clear()
                # popleft is atomic, where asking for the length first would race with `send`.
                with contextlib.suppress(IndexError):
                    while True:
                        write(self._pipe, self._waiting.popleft())
        except OSError:
            self.broken = True


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
