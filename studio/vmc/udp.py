"""UDP datagrams with their arrival times: ports with room to wait in, stamped by the kernel where it can."""

from __future__ import annotations

import contextlib
import ctypes
import errno
import math
import socket
import struct
import sys
from collections.abc import Iterable
from typing import NamedTuple

from studio import clock
from studio.errors import StudioError, port_taken, say
from studio.vmc.osc import LEAST_BYTES, MOST_BYTES

AT_ONCE, BYTES_AT_ONCE = 2_000, 4 * 1024 * 1024
"""Read in one go, at most: some milliseconds' work, after which what came may be decoded."""
# A stamp older than that is a wall clock that was set: no queue holds a minute of motion.
_OLDEST_S = 60.0
# What is longer than any motion is cut: it need not be copied to be refused. Windows would give an error.
_MAX_DATAGRAM = 65_535 if sys.platform == "win32" else MOST_BYTES + 1
# Bytes of ancillary data: one timespec with its header takes 32.
_ROOM_FOR_STAMPS = 64
_NAMES = 256
_TIMESPEC = struct.Struct("=qq")


class Datagram(NamedTuple):
    """One datagram: when it arrived (seconds of `clock.now()`), what, and from whom ("127.0.0.1:53211")."""

    arrival: float
    data: bytes
    sender: str


class DatagramInput:
    """A UDP port that is read when asked; in between, the kernel keeps what comes in.

    No thread of its own: whoever decodes reads first, all that waits, so that nothing is ever told of a
    moment before all that arrived until then has been read.

    Args:
        opened: a socket that is bound already; see `bind`.

    Attributes:
        port: the port bound.
        received: datagrams that came.
        dropped: datagrams the kernel had no room for, because nobody read for too long; see `count`.
        refused: datagrams that the kernel threw away since their senders are shut out.
        stamped: the kernel stamps what comes in, so reading late costs no precision.
        emptied: the last reading left nothing behind.
    """

    def __init__(self, opened: socket.socket) -> None:
        self.socket: socket.socket | None = opened
        self.port: int = opened.getsockname()[1]
        opened.setblocking(False)
        self.stamped = stamp_arrivals(opened)
        # The filter stays on the socket: a listener that died may have shut senders out.
        refuse_early(opened)
        self.received = self.dropped = self.refused = 0
        self._shut_out: frozenset[str] = frozenset()
        self.emptied = True
        # So that the first stamps, of datagrams that waited, are not in the past.
        self._last = clock.now() - _OLDEST_S
        self._names: dict[tuple[str, int], str] = {}

    def stop(self) -> None:
        """Close the port; safe to call twice."""
        listening, self.socket = self.socket, None
        if listening is not None:
            listening.close()

    def count(self) -> None:
        """Bring `dropped` and `refused` up to date."""
        if self.socket is not None:
            # The kernel has one count for both. Who is kept from reading by a flood has most of it for that.
            new = max(dropped(self.socket) - self.dropped - self.refused, 0)
            self.dropped += 0 if self._shut_out else new
            self.refused += new if self._shut_out else 0

    def shut_out(self, senders: frozenset[str]) -> None:
        """Have the kernel refuse what these send, where it can; all others are let in again."""
        if self.socket is not None and senders != self._shut_out:
            self.count()
            split = [sender.rpartition(":") for sender in senders]
            if refuse_early(self.socket, [(address, int(port)) for address, _, port in split]):
                self._shut_out = senders

    def read(self, ahead: float = 0.0, most: int = AT_ONCE) -> list[Datagram]:
        """The datagrams that have arrived since the last call, oldest first.

        Args:
            ahead: how far the wall clock is ahead of `clock.now()`, for the kernel's stamps.
            most: datagrams that are taken, and no more than BYTES_AT_ONCE; the rest stays in the kernel,
                which counts what it has no room for.

        Returns:
            Datagrams; those longer than MOST_BYTES are cut, but stay longer than that or become shorter
            than any message.
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
            # As many as asked for were read and nothing said that there are no more.
            self.emptied = False
        except BlockingIOError:
            pass
        except OSError:
            # Windows reports a vanished receiver of our own as an error here; the port lives on.
            self.emptied = bool(found)
        self.received += len(found)
        return found

    def _receive_plain(self, listening: socket.socket, found: list[Datagram], most: int) -> None:
        names, left = self._names, BYTES_AT_ONCE
        for _ in range(most):
            data, sender = listening.recvfrom(_MAX_DATAGRAM)
            # Without stamps of the kernel, the moment of reading is all there is.
            found.append(Datagram(clock.now(), data, names.get(sender) or self._name(sender)))
            left -= len(data)
            if left < 0:
                break

    def _receive_stamped(
        self, listening: socket.socket, found: list[Datagram], most: int, ahead: float
    ) -> None:
        """With the kernel's stamps: waiting for this process to run then costs no precision."""
        # Called 13,000 times a second: what can be known before is looked up before.
        receive, unpack, names = listening.recvmsg, _TIMESPEC.unpack_from, self._names
        begun, left = clock.now(), BYTES_AT_ONCE
        for _ in range(most):
            data, extras, _, sender = receive(_MAX_DATAGRAM, _ROOM_FOR_STAMPS)
            arrival = math.inf
            for _, kind, payload in extras:
                if kind == SO_TIMESTAMPNS:
                    seconds, nanoseconds = unpack(payload)
                    arrival = seconds + nanoseconds * 1e-9 - ahead
            if not self._last <= arrival <= begun:
                # Rising within a socket, whose queue is in the order of arrival, whatever the wall clock did.
                arrival = max(self._sane(arrival), self._last)
            self._last = arrival
            found.append(Datagram(arrival, data, names.get(sender) or self._name(sender)))
            left -= len(data)
            if left < 0:
                break

    def _sane(self, arrival: float) -> float:
        """A wall clock set between stamp and reading must not throw a frame out of the take."""
        now = clock.now()
        return arrival if now - _OLDEST_S < arrival <= now else now

    def _name(self, sender: tuple[str, int]) -> str:
        # A flood from ever new ports must not let the table grow without end.
        if len(self._names) >= _NAMES:
            self._names.clear()
        name = self._names[sender] = f"{sender[0]}:{sender[1]}" if sender else ""
        return name


BUFFER_BYTES = 4 * 1024 * 1024
"""Room in the kernel for seconds of motion, should this process be held up."""
_MOST_SOCKETS = 32
_LINUX = sys.platform == "linux"
# Python names none of these; the numbers are Linux's ABI for x86-64 and arm64.
SO_TIMESTAMPNS = 35
_SO_MEMINFO, _MEMINFO = 55, struct.Struct("=9I")
_SO_ATTACH_FILTER, _SO_RCVBUFFORCE, _SO_ATTACH_REUSEPORT_CBPF = 26, 33, 51
_LOAD_EXTRA, _MODULO, _RETURN_IT, _RANDOM = 0x20, 0x94, 0x16, 0xFFFFF000 + 56
_LOAD_LENGTH, _LOAD_HALF, _LOAD_WORD, _IF_MORE, _IF_EQUAL, _RETURN = 0x80, 0x28, 0x20, 0x25, 0x15, 0x06
_SOURCE_PORT, _SOURCE_ADDRESS, _WHOLE = 0, 0xFFF00000 + 12, 0x7FFFFFFF
_UDP_HEADER = 8


def bind(port: int, host: str = "127.0.0.1") -> socket.socket:
    """A UDP socket bound to a port.

    Args:
        port: 0 asks for any free one.
        host: the address to bind; "0.0.0.0" opens it to the network.

    Raises:
        StudioError: the port is taken, forbidden or no port, or the address is not this machine's.
    """
    if not 0 <= port <= 65_535:
        raise StudioError(say("{port} is not a port.", port=port), "Choose a port from 1024 to 65535.")
    opened = _socket()
    try:
        opened.bind((host, port))
    except OSError as error:
        opened.close()
        # Closed first: a socket that is left to the garbage collector keeps its port for a while.
        raise _explained(error, port, host) from error
    return opened


def bind_wide(port: int, host: str = "127.0.0.1", room: int = 2 * BUFFER_BYTES) -> list[socket.socket]:
    """A port as one socket, or as several where the system grants one of them little room.

    Linux grants a usual user 400 KB, which is 40 ms of an unbundled body at 120 Hz: a busy machine holds a
    process up for longer. Several sockets of one port have that room each; the kernel deals datagrams out
    among them by chance, and their receive stamps put them in order again. Nobody else can join: what is
    dealt out goes to these alone.

    Args:
        port, host: see `bind`.
        room: bytes wanted, as the kernel counts them.

    Raises:
        StudioError: see `bind`.
    """
    first = bind(port, host)
    # What was granted is asked of the kernel: it grants less than was wished for without an error.
    # No more than so many: each reading asks every socket once.
    count = min(math.ceil(room / granted(first)), _MOST_SOCKETS)
    if not _LINUX or count < 2:
        return [first]
    port = first.getsockname()[1]
    # The port must be bound again with SO_REUSEPORT on every socket of it, the first one included.
    first.close()
    opened: list[socket.socket] = []
    try:
        for _ in range(count):
            opened.append(_socket())
            # Before the bind, which is when the kernel looks at it.
            opened[-1].setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
            opened[-1].bind((host, port))
        _deal_out(opened[0], count)
    except OSError:
        # Half a set would lose what is dealt out to the missing ones: rather one socket with its little room.
        for one in opened:
            one.close()
        return [bind(port, host)]
    return opened


def granted(opened: socket.socket) -> int:
    """Bytes of room that a socket has, as the kernel counts them."""
    return max(opened.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF), 1)


def stamp_arrivals(opened: socket.socket) -> bool:
    """Ask Linux to stamp each datagram when it arrives.

    Returns:
        Whether it does.
    """
    if _LINUX:
        with contextlib.suppress(OSError):
            opened.setsockopt(socket.SOL_SOCKET, SO_TIMESTAMPNS, 1)
            return True
    return False


def dropped(opened: socket.socket) -> int:
    """Datagrams that the kernel threw away so far, for want of room or as `refuse_early` told it; 0 where it
    does not tell.

    Source: socket(7); linux/sock_diag.h, SK_MEMINFO_DROPS.
    """
    if _LINUX:
        with contextlib.suppress(OSError, struct.error):
            told = opened.getsockopt(socket.SOL_SOCKET, _SO_MEMINFO, _MEMINFO.size)
            return int(_MEMINFO.unpack(told)[8])
    return 0


def refuse_early(opened: socket.socket, senders: Iterable[tuple[str, int]] = ()) -> bool:
    """Have the kernel refuse what is no motion, so that it takes neither room nor time from what is.

    Datagrams larger than any motion are cut to a few bytes that mean nothing. Of 64 KB datagrams a socket of
    a usual user holds six, and a body that comes while they wait is thrown away. Cut rather than dropped,
    they still tell who sent them.

    Args:
        senders: (address, port) of those of whom nothing is wanted; others are let in again.

    Returns:
        Whether it does, which is so on Linux alone.

    Source: socket(7), SO_ATTACH_FILTER; linux/filter.h.
    """
    if not _LINUX:
        return False
    steps = [
        (_LOAD_LENGTH, 0, 0, 0),
        (_IF_MORE, 0, 1, _UDP_HEADER + MOST_BYTES),
        (_RETURN, 0, 0, _UDP_HEADER + LEAST_BYTES - 1),
    ]
    for address, port in senders:
        steps += [
            # The port first: it differs between programs of one computer, where the address does not.
            (_LOAD_HALF, 0, 0, _SOURCE_PORT),
            (_IF_EQUAL, 0, 3, port),
            (_LOAD_WORD, 0, 0, _SOURCE_ADDRESS),
            (_IF_EQUAL, 0, 1, int.from_bytes(socket.inet_aton(address), "big")),
            (_RETURN, 0, 0, 0),
        ]
    try:
        _attach(opened, _SO_ATTACH_FILTER, [*steps, (_RETURN, 0, 0, _WHOLE)])
    except OSError:
        return False
    return True


def _socket() -> socket.socket:
    opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    opened.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, BUFFER_BYTES)
    if _LINUX:
        # SO_RCVBUFFORCE goes past the system's limit, where this user has the right to.
        with contextlib.suppress(OSError):
            opened.setsockopt(socket.SOL_SOCKET, _SO_RCVBUFFORCE, 4 * BUFFER_BYTES)
        refuse_early(opened)
    # Before any datagram comes, so that what waits while the reader gets ready has its true time too.
    stamp_arrivals(opened)
    opened.setblocking(False)
    return opened


def _deal_out(opened: socket.socket, count: int) -> None:
    """A classic packet filter of three steps: take a random number, modulo the sockets, return it.

    Source: socket(7), SO_ATTACH_REUSEPORT_CBPF; linux/filter.h.
    """
    _attach(
        opened,
        _SO_ATTACH_REUSEPORT_CBPF,
        [(_LOAD_EXTRA, 0, 0, _RANDOM), (_MODULO, 0, 0, count), (_RETURN_IT, 0, 0, 0)],
    )


def _attach(opened: socket.socket, option: int, steps: list[tuple[int, int, int, int]]) -> None:
    code = b"".join(struct.pack("=HBBI", *step) for step in steps)
    # Bound to a name: the kernel reads it through the address, so it must live until the call is over.
    kept = ctypes.create_string_buffer(code, len(code))
    program = struct.pack("@HP", len(steps), ctypes.addressof(kept))
    opened.setsockopt(socket.SOL_SOCKET, option, program)


def _explained(error: OSError, port: int, host: str) -> StudioError:
    if error.errno == errno.EADDRINUSE:
        return port_taken(port)
    if error.errno in (errno.EACCES, errno.EPERM):
        return StudioError(
            say("Port {port} may not be opened.", port=port),
            "Choose a port above 1024, or allow it in the firewall.",
        )
    return StudioError(
        say("{host} is not an address of this computer.", host=host),
        "Use 127.0.0.1 for programs on this computer, or 0.0.0.0 for the whole network.",
    )
