"""UDP datagrams with their arrival times: the kernel stamps and keeps them, whoever decodes fetches them."""

from __future__ import annotations

import contextlib
import errno
import socket
import struct
import sys
from typing import NamedTuple

from studio.capture import clock
from studio.errors import StudioError

BUFFER_BYTES = 4 * 1024 * 1024
"""Room in the kernel for seconds of motion, should this process be held up."""
AT_ONCE = 20_000
"""Datagrams read in one go, at most."""
MOST_PER_S = 60_000
"""Datagrams a second that a port gives: four whole bodies at 120 Hz, unbundled. More is no motion."""
ALLOWED_AT_ONCE = 100_000
_OLDEST_S = 60.0
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
        stamp_arrivals(opened)  # before any comes: what waits while a reader gets ready has its true time too
        opened.bind((host, port))
        opened.setblocking(False)
    except OSError as error:
        opened.close()
        raise _explained(error, port, host) from error
    return opened


def stamp_arrivals(opened: socket.socket) -> bool:
    """Ask Linux to stamp each datagram when it arrives, and to count what it had no room for.

    Returns:
        Whether it does.
    """
    if _LINUX:
        with contextlib.suppress(OSError):
            opened.setsockopt(socket.SOL_SOCKET, _SO_RXQ_OVFL, 1)
            opened.setsockopt(socket.SOL_SOCKET, _SO_TIMESTAMPNS, 1)
            return True
    return False


def _explained(error: OSError, port: int, host: str) -> StudioError:
    if error.errno == errno.EADDRINUSE:
        return StudioError(
            f"Port {port} is already in use.",
            "Close the other receiver, or choose another port in Record (or with --port).",
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
    """A UDP port that is read when asked; in between, the kernel keeps what comes in.

    No thread of its own: whoever decodes reads first, all that waits, so that nothing is ever told of a
    moment before all that arrived until then has been read.

    Args:
        port, host: see `bind`.
        opened: a socket that is bound already; port and host are read from it.

    Attributes:
        port: the port bound.
        received: datagrams that came.
        dropped: datagrams the kernel had no room for, because nobody read for too long.
        stamped: the kernel stamps what comes in, so reading late costs no precision.
        emptied: the last reading left nothing behind.
        most_per_s: what is more is left in the kernel.
    """

    def __init__(self, port: int, host: str = "127.0.0.1", *, opened: socket.socket | None = None) -> None:
        self.port = port
        self.host = host
        self._given = opened
        self.received = self.dropped = 0
        self.stamped = False
        self.emptied = True
        self.socket: socket.socket | None = None
        self._last = 0.0
        self.most_per_s = MOST_PER_S
        self._allowed, self._allowed_at = float(ALLOWED_AT_ONCE), 0.0

    def start(self) -> None:
        """Bind and listen.

        Raises:
            StudioError: the port is taken, forbidden or no port, or the address is not this machine's.
        """
        assert self.socket is None, "started once"
        self.socket = self._given if self._given is not None else bind(self.port, self.host)
        self.socket.setblocking(False)
        self.stamped = stamp_arrivals(self.socket)
        self.host, self.port = self.socket.getsockname()[:2]

    def stop(self) -> None:
        """Close the port; safe to call twice."""
        listening, self.socket = self.socket, None
        if listening is not None:
            listening.close()

    def read(self) -> list[Datagram]:
        """Everything that came since the last call, oldest first; a flood is left in the kernel, which throws
        away what it has no room for at no cost to us."""
        listening = self.socket
        if listening is None:
            return []
        begun = clock.now()
        most = self._allowance(begun)
        receive = self._receive_stamped if self.stamped else self._receive_plain
        found: list[Datagram] = []
        self.emptied = True
        try:
            receive(listening, found, most)
            self.emptied = False
        except BlockingIOError:
            pass
        except OSError:
            # Windows reports a vanished receiver of our own as an error here; the port lives on.
            self.emptied = bool(found)
        self.received += len(found)
        self._allowed -= len(found)
        return found

    def _allowance(self, now: float) -> int:
        """A sender that was held up for seconds and makes up for it is no flood: so much is ahead of it."""
        self._allowed = min(self._allowed + (now - self._allowed_at) * self.most_per_s, ALLOWED_AT_ONCE)
        self._allowed_at = now
        return max(min(int(self._allowed), AT_ONCE), 0)

    def _receive_plain(self, listening: socket.socket, found: list[Datagram], most: int) -> None:
        for _ in range(most):
            data, sender = listening.recvfrom(_MAX_DATAGRAM)
            found.append(Datagram(clock.now(), data, f"{sender[0]}:{sender[1]}"))

    def _receive_stamped(self, listening: socket.socket, found: list[Datagram], most: int) -> None:
        """With the kernel's stamps: waiting for this process to run then costs no precision."""
        # One reading of both clocks serves the whole lot, so that no stamp of it overtakes another.
        ahead = clock.wall_ahead()
        oldest = clock.now() - _OLDEST_S
        for _ in range(most):
            data, extras, _, sender = listening.recvmsg(_MAX_DATAGRAM, 64)
            arrival = clock.now()
            for _, kind, payload in extras:
                if kind == _SO_TIMESTAMPNS and len(payload) >= _TIMESPEC.size:
                    seconds, nanoseconds = _TIMESPEC.unpack_from(payload)
                    stamp = seconds + nanoseconds * 1e-9 - ahead
                    # A wall clock set between stamp and reading must not throw a frame out of the take.
                    arrival = min(stamp, arrival) if stamp > oldest else arrival
                elif kind == _SO_RXQ_OVFL and len(payload) >= _UINT32.size:
                    (self.dropped,) = _UINT32.unpack_from(payload)
            self._last = arrival = max(arrival, self._last)
            found.append(Datagram(arrival, data, f"{sender[0]}:{sender[1]}" if sender else ""))
