"""UDP ports, opened with all the room for waiting datagrams that the system grants."""

from __future__ import annotations

import contextlib
import ctypes
import errno
import math
import socket
import struct
import sys

from studio.capture.input_error import port_taken
from studio.errors import StudioError

BUFFER_BYTES = 4 * 1024 * 1024
"""Room in the kernel for seconds of motion, should this process be held up."""
_MOST_SOCKETS = 32
_LINUX = sys.platform == "linux"
# Python names none of these; the numbers are Linux's ABI for x86-64 and arm64.
SO_TIMESTAMPNS, SO_RXQ_OVFL = 35, 40
_SO_RCVBUFFORCE, _SO_ATTACH_REUSEPORT_CBPF = 33, 51
_LOAD_EXTRA, _MODULO, _RETURN_IT, _RANDOM = 0x20, 0x94, 0x16, 0xFFFFF000 + 56


def bind(port: int, host: str = "127.0.0.1") -> socket.socket:
    """A UDP socket bound to a port.

    Args:
        port: 0 asks for any free one.
        host: the address to bind; "0.0.0.0" opens it to the network.

    Raises:
        StudioError: the port is taken, forbidden or no port, or the address is not this machine's.
    """
    if not 0 <= port <= 65_535:
        raise StudioError(f"{port} is not a port.", "Choose a port from 1024 to 65535.")
    opened = _socket()
    try:
        opened.bind((host, port))
    except OSError as error:
        opened.close()
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
    count = min(math.ceil(room / granted(first)), _MOST_SOCKETS)
    if not _LINUX or count < 2:
        return [first]
    port = first.getsockname()[1]
    first.close()
    opened: list[socket.socket] = []
    try:
        for _ in range(count):
            opened.append(_socket())
            opened[-1].setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
            opened[-1].bind((host, port))
        _deal_out(opened[0], count)
    except OSError:
        for one in opened:
            one.close()
        return [bind(port, host)]
    return opened


def granted(opened: socket.socket) -> int:
    """Bytes of room that a socket has, as the kernel counts them."""
    return max(opened.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF), 1)


def stamp_arrivals(opened: socket.socket) -> bool:
    """Ask Linux to stamp each datagram when it arrives, and to count what it had no room for.

    Returns:
        Whether it does.
    """
    if _LINUX:
        with contextlib.suppress(OSError):
            opened.setsockopt(socket.SOL_SOCKET, SO_RXQ_OVFL, 1)
            opened.setsockopt(socket.SOL_SOCKET, SO_TIMESTAMPNS, 1)
            return True
    return False


def _socket() -> socket.socket:
    opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    opened.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, BUFFER_BYTES)
    if _LINUX:
        with contextlib.suppress(OSError):  # past the system's limit, where this user may
            opened.setsockopt(socket.SOL_SOCKET, _SO_RCVBUFFORCE, 4 * BUFFER_BYTES)
    stamp_arrivals(opened)  # before any comes: what waits while a reader gets ready has its true time too
    opened.setblocking(False)
    return opened


def _deal_out(opened: socket.socket, count: int) -> None:
    """A classic packet filter of three steps: take a random number, modulo the sockets, return it.

    Source: socket(7), SO_ATTACH_REUSEPORT_CBPF; linux/filter.h.
    """
    steps = [(_LOAD_EXTRA, 0, 0, _RANDOM), (_MODULO, 0, 0, count), (_RETURN_IT, 0, 0, 0)]
    code = b"".join(struct.pack("=HBBI", *step) for step in steps)
    kept = ctypes.create_string_buffer(code, len(code))
    program = struct.pack("@HP", len(steps), ctypes.addressof(kept))
    opened.setsockopt(socket.SOL_SOCKET, _SO_ATTACH_REUSEPORT_CBPF, program)


def _explained(error: OSError, port: int, host: str) -> StudioError:
    if error.errno == errno.EADDRINUSE:
        return port_taken(port)
    if error.errno in (errno.EACCES, errno.EPERM):
        return StudioError(
            f"Port {port} may not be opened.",
            "Choose a port above 1024, or allow it in the firewall.",
        )
    return StudioError(
        f"{host} is not an address of this computer.",
        "Use 127.0.0.1 for programs on this computer, or 0.0.0.0 for the whole network.",
    )
