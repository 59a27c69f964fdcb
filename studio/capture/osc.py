"""UDP datagrams with their arrival times: the kernel stamps and keeps them, whoever decodes fetches them."""

from __future__ import annotations

import math
import socket
import struct
from typing import NamedTuple

from studio.capture import clock
from studio.capture.port import SO_RXQ_OVFL, SO_TIMESTAMPNS, bind, stamp_arrivals

AT_ONCE = 20_000
"""Datagrams read in one go, at most."""
MOST_PER_S = 60_000
"""Datagrams a second that a port gives: four whole bodies at 120 Hz, unbundled. More is no motion."""
ALLOWED_AT_ONCE = 100_000
_OLDEST_S = 60.0
_MAX_DATAGRAM = 65_535
_ROOM_FOR_STAMPS = 64
_NAMES = 256
_TIMESPEC, _UINT32 = struct.Struct("=qq"), struct.Struct("=I")


class Datagram(NamedTuple):
    """What came in: when (seconds of `clock.now()`), what, and from whom ("127.0.0.1:53211")."""

    arrival: float
    data: bytes
    sender: str


class Allowance:
    """How much of what waits on a port may be read: all, but a flood.

    Attributes:
        most_per_s: what is more is left in the kernel.
    """

    def __init__(self) -> None:
        self.most_per_s = float(MOST_PER_S)
        self.left = float(ALLOWED_AT_ONCE)
        self._at = 0.0

    def share(self, now: float, sockets: int = 1) -> int:
        """Datagrams that each of a port's sockets may give now.

        A sender that was held up for seconds and makes up for it is no flood: so much is ahead of it.
        """
        self.left = min(self.left + (now - self._at) * self.most_per_s, ALLOWED_AT_ONCE)
        self._at = now
        return min(math.ceil(max(self.left, 0.0) / sockets), AT_ONCE)


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
    """

    def __init__(self, port: int, host: str = "127.0.0.1", *, opened: socket.socket | None = None) -> None:
        self.port = port
        self.host = host
        self._given = opened
        self.received = self.dropped = 0
        self.stamped = False
        self.emptied = True
        self.socket: socket.socket | None = None
        self._last = clock.now() - _OLDEST_S
        self._names: dict[tuple[str, int], str] = {}

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

    def read(self, ahead: float = 0.0, most: int = AT_ONCE) -> list[Datagram]:
        """What came since the last call, oldest first.

        Args:
            ahead: how far the wall clock is ahead of `clock.now()`, for the kernel's stamps.
            most: datagrams that are taken; the rest stays in the kernel, which throws away what it has no
                room for at no cost to us.
        """
        listening = self.socket
        if listening is None:
            return []
        found: list[Datagram] = []
        self.emptied = True
        try:
            if self.stamped:
                self._receive_stamped(listening, found, most, ahead)
            else:
                self._receive_plain(listening, found, most)
            self.emptied = False
        except BlockingIOError:
            pass
        except OSError:
            # Windows reports a vanished receiver of our own as an error here; the port lives on.
            self.emptied = bool(found)
        self.received += len(found)
        return found

    def _receive_plain(self, listening: socket.socket, found: list[Datagram], most: int) -> None:
        for _ in range(most):
            data, sender = listening.recvfrom(_MAX_DATAGRAM)
            found.append(Datagram(clock.now(), data, f"{sender[0]}:{sender[1]}"))

    def _receive_stamped(
        self, listening: socket.socket, found: list[Datagram], most: int, ahead: float
    ) -> None:
        """With the kernel's stamps: waiting for this process to run then costs no precision."""
        # Called 13,000 times a second: what can be known before is looked up before.
        receive, unpack, names = listening.recvmsg, _TIMESPEC.unpack_from, self._names
        begun = clock.now()
        for _ in range(most):
            data, extras, _, sender = receive(_MAX_DATAGRAM, _ROOM_FOR_STAMPS)
            arrival = math.inf
            for _, kind, payload in extras:
                if kind == SO_TIMESTAMPNS:
                    seconds, nanoseconds = unpack(payload)
                    arrival = seconds + nanoseconds * 1e-9 - ahead
                elif kind == SO_RXQ_OVFL:
                    (self.dropped,) = _UINT32.unpack_from(payload)
            if not self._last <= arrival <= begun:
                arrival = max(self._sane(arrival), self._last)
            self._last = arrival
            found.append(Datagram(arrival, data, names.get(sender) or self._name(sender)))

    def _sane(self, arrival: float) -> float:
        """A wall clock set between stamp and reading must not throw a frame out of the take."""
        now = clock.now()
        return arrival if now - _OLDEST_S < arrival <= now else now

    def _name(self, sender: tuple[str, int]) -> str:
        if len(self._names) >= _NAMES:
            self._names.clear()
        name = self._names[sender] = f"{sender[0]}:{sender[1]}" if sender else ""
        return name
