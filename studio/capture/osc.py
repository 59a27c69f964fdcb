"""UDP datagrams with their arrival times. A thread that only stamps and appends; decoding is elsewhere."""

from __future__ import annotations

import contextlib
import errno
import socket
import struct
import sys
import threading
import time
from collections import deque
from typing import NamedTuple

from studio.capture import clock
from studio.errors import StudioError

BUFFER_BYTES = 4 * 1024 * 1024
"""Room in the kernel for seconds of motion, should this process be held up."""
QUEUE_LENGTH = 50_000
MOST_PER_S = 40_000
"""Datagrams a second that are taken: three whole bodies at 120 Hz, unbundled. More is no motion."""
ALLOWED_AT_ONCE = 100_000
_BURST = 2_000
_MAX_DATAGRAM = 65_535
_LINUX = sys.platform == "linux"
# Python names none of these; the numbers are Linux's ABI for x86-64 and arm64.
_SO_TIMESTAMPNS, _SO_RXQ_OVFL, _SO_RCVBUFFORCE = 35, 40, 33
_TIMESPEC, _UINT32 = struct.Struct("=qq"), struct.Struct("=I")


class Datagram(NamedTuple):
    """What came in: when (seconds of `clock.now()`), what, and from whom ("127.0.0.1:53211")."""

    arrival: float
    data: bytes
    sender: str


def bind(port: int, host: str = "127.0.0.1") -> socket.socket:
    """A UDP socket bound to a port, with all the room the system grants.

    Args:
        port: 0 asks for any free one.
        host: the address to bind; "0.0.0.0" opens it to the network.

    Raises:
        StudioError: the port is taken, forbidden or no port, or the address is not this machine's.
    """
    if not 0 <= port <= 65_535:
        raise StudioError(f"{port} is not a port.", "Choose a port from 1024 to 65535.")
    opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        opened.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, BUFFER_BYTES)
        if _LINUX:
            with contextlib.suppress(OSError):  # past the system's limit, where this user may
                opened.setsockopt(socket.SOL_SOCKET, _SO_RCVBUFFORCE, 4 * BUFFER_BYTES)
        opened.bind((host, port))
        opened.settimeout(0.25)
    except OSError as error:
        opened.close()
        raise _explained(error, port, host) from error
    return opened


def _explained(error: OSError, port: int, host: str) -> StudioError:
    if error.errno == errno.EADDRINUSE:
        return StudioError(
            f"Port {port} is already in use.",
            "Close the other receiver or choose another port in Settings.",
        )
    if error.errno in (errno.EACCES, errno.EPERM):
        return StudioError(
            f"Port {port} may not be opened.",
            "Choose a port above 1024, or allow it in the firewall.",
        )
    return StudioError(
        f"{host} is not an address of this computer.",
        "Use 127.0.0.1 for programs on this computer, or 0.0.0.0 for the whole network.",
    )


class DatagramInput:
    """A UDP port that is listened to.

    Args:
        port, host: see `bind`.
        opened: a socket that is bound already; port and host are read from it.

    Attributes:
        port: the port bound.
        received: datagrams that came.
        dropped: datagrams lost because nobody drained the queue, or the kernel's buffer was full.
    """

    def __init__(self, port: int, host: str = "127.0.0.1", *, opened: socket.socket | None = None) -> None:
        self.port = port
        self.host = host
        self._given = opened
        self.received = 0
        self._queue: deque[Datagram] = deque(maxlen=QUEUE_LENGTH)
        self._socket: socket.socket | None = None
        self._thread: threading.Thread | None = None
        self._overrun = 0
        self._kernel_drops = 0
        self._kernel_stamps = False
        self._allowed, self._allowed_at = float(ALLOWED_AT_ONCE), 0.0

    @property
    def dropped(self) -> int:
        """Datagrams lost on this machine."""
        return self._overrun + self._kernel_drops

    def start(self) -> None:
        """Bind and listen.

        Raises:
            StudioError: the port is taken, forbidden or no port, or the address is not this machine's.
        """
        assert self._thread is None, "started once"
        self._socket = self._given if self._given is not None else bind(self.port, self.host)
        self._socket.settimeout(0.25)
        self._stamp_arrivals(self._socket)
        self.host, self.port = self._socket.getsockname()[:2]
        self._thread = threading.Thread(
            target=self._listen, args=(self._socket,), name="motion input", daemon=True
        )
        self._thread.start()

    def stop(self) -> None:
        """Close the port; safe to call twice."""
        listening, self._socket = self._socket, None
        if listening is None:
            return
        # Closing alone does not wake a thread that waits in recvmsg, a shutdown or a datagram does.
        with contextlib.suppress(OSError):
            listening.shutdown(socket.SHUT_RDWR)
        if self._thread is not None:
            self._thread.join(2.0)
            self._thread = None
        listening.close()

    def drain(self) -> list[Datagram]:
        """Everything that came since the last call, oldest first."""
        taken = []
        with contextlib.suppress(IndexError):
            while True:
                taken.append(self._queue.popleft())
        return taken

    def _stamp_arrivals(self, opened: socket.socket) -> None:
        """Ask Linux to stamp each datagram when it arrives, and to count what it had no room for."""
        if _LINUX:
            with contextlib.suppress(OSError):
                opened.setsockopt(socket.SOL_SOCKET, _SO_RXQ_OVFL, 1)
                opened.setsockopt(socket.SOL_SOCKET, _SO_TIMESTAMPNS, 1)
                self._kernel_stamps = True

    def _listen(self, listening: socket.socket) -> None:
        """Runs on the motion thread."""
        receive = self._receive_stamped if self._kernel_stamps else self._receive_plain
        while self._socket is listening:
            try:
                datagram = receive(listening)
            except TimeoutError:
                continue
            except OSError:
                # Windows reports a vanished receiver of our own as an error here; the port lives on.
                if self._socket is listening:
                    time.sleep(0.01)
                continue
            if not datagram.data and self._socket is not listening:
                return
            self.received += 1
            self._overrun += len(self._queue) == QUEUE_LENGTH
            self._queue.append(datagram)
            if self.received % _BURST == 0:
                self._rest_in_flood()

    def _rest_in_flood(self) -> None:
        """Let a flood pile up in the kernel, which throws away what it has no room for at no cost to us.

        A sender that was held up for seconds and makes up for it is none: it has that much ahead of it.
        """
        now = time.monotonic()
        self._allowed = min(self._allowed + (now - self._allowed_at) * MOST_PER_S, ALLOWED_AT_ONCE) - _BURST
        self._allowed_at = now
        if self._allowed < 0:
            time.sleep(-self._allowed / MOST_PER_S)

    def _receive_plain(self, listening: socket.socket) -> Datagram:
        data, sender = listening.recvfrom(_MAX_DATAGRAM)
        return Datagram(clock.now(), data, f"{sender[0]}:{sender[1]}")

    def _receive_stamped(self, listening: socket.socket) -> Datagram:
        """With the kernel's stamp: waiting for this thread to run then costs no precision."""
        data, extras, _, sender = listening.recvmsg(_MAX_DATAGRAM, 64)
        arrived = clock.now()
        arrival = arrived
        for _, kind, payload in extras:
            if kind == _SO_TIMESTAMPNS and len(payload) >= _TIMESPEC.size:
                seconds, nanoseconds = _TIMESPEC.unpack_from(payload)
                arrival = clock.from_realtime(seconds + nanoseconds * 1e-9)
            elif kind == _SO_RXQ_OVFL and len(payload) >= _UINT32.size:
                (self._kernel_drops,) = _UINT32.unpack_from(payload)
        name = f"{sender[0]}:{sender[1]}" if sender else ""
        # A wall clock set back or forth between stamp and reading must not throw one frame out of the take.
        sane = arrived - 5.0 < arrival <= arrived
        return Datagram(arrival if sane else arrived, data, name)
