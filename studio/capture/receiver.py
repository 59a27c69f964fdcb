"""Ports to rows: what one or several senders say, put together, counted and watched."""

from __future__ import annotations

import bisect
import math
import select
import socket
from collections import Counter, deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.capture import clock
from studio.capture.assembler import FrameAssembler, Source
from studio.capture.osc import Allowance, Datagram, DatagramInput
from studio.capture.rows import Names, Packer, Row
from studio.capture.watch import FrameWatch, RateWatch

_ON_THE_WAY = 0.005
"""A datagram that is stamped may take this long to where it can be read, so silence is judged later."""
_PORTION, _MOST_A_TURN = 1_000, 20_000
"""Datagrams decoded between two readings, and before what they said is told."""
_BACKLOG = 60_000
"""Datagrams kept undecoded; past that, the kernel keeps what it has room for and counts the rest."""
MOST_FRAMES_PER_S = 500
"""Frames beyond this are no motion but a flood: they are counted, and not kept."""


@dataclass(frozen=True)
class Heard:
    """Counters and names of a receiver at one moment.

    Args:
        until: everything that arrived before this moment is in the rows given so far.
        packets, packets_bad, packets_lost: datagrams received, refused, dropped for want of room.
        packets_per_s, frames_per_s, jitter_ms: of the last second.
        frames, frames_lost, late, last_arrival, last_moved: see FrameWatch.
        sender: who sent last. senders: everyone heard lately. sources: who gives what.
        ok, avatar: the last of their messages.
        missing: bones that a sender has left out lately. lost_lately: frames lost in the last seconds.
    """

    until: float = -math.inf
    packets: int = 0
    packets_bad: int = 0
    packets_lost: int = 0
    packets_per_s: float = 0.0
    frames: int = 0
    frames_per_s: float = 0.0
    frames_lost: int = 0
    late: int = 0
    jitter_ms: float = 0.0
    last_arrival: float = -math.inf
    last_moved: float = -math.inf
    sender: str = ""
    senders: tuple[str, ...] = ()
    sources: tuple[Source, ...] = ()
    ok: tuple[int, ...] = ()
    avatar: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()
    lost_lately: int = 0


Batch = tuple[Names | None, NDArray[np.float64], NDArray[np.float32]]
"""Rows for another process: names where they changed, (arrival, sender's time) (T, 2), values (T, width)."""


class Receiver:
    """Listens on sockets that are bound already.

    Args:
        sockets: at least one.
    """

    def __init__(self, sockets: Sequence[socket.socket]) -> None:
        self._inputs = [DatagramInput(0, opened=opened) for opened in sockets]
        self._wall = clock.WallClock()
        self._assembler = FrameAssembler()
        self._watch = FrameWatch()
        self._packer = Packer()
        self._rate = RateWatch()
        self._packets_per_s = 0.0
        self._sender = ""
        self._second, self._in_second, self._thinned = 0, 0, 0
        self._backlog: deque[tuple[Datagram, int]] = deque()
        self._present = self._read_until = -math.inf
        for port in self._inputs:
            port.start()
        self._sockets_of = Counter(port.port for port in self._inputs)
        self._allowances = {port: Allowance() for port in self._sockets_of}
        self._early: list[tuple[Datagram, int]] = []

    @property
    def stamped(self) -> bool:
        """Whether what comes in is stamped by the kernel, so that it may wait to be read."""
        return all(port.stamped for port in self._inputs)

    def wait(self, seconds: float) -> None:
        """Sleep until something comes in, or that long."""
        opened = [port.socket for port in self._inputs if port.socket is not None]
        select.select(opened, (), (), seconds)

    def take_in(self, now: float) -> list[Row]:
        """Whatever came, as rows.

        Args:
            now: the present, from before this call.
        """
        frames = []
        decoded = 0
        while decoded < _MOST_A_TURN:
            # All that waits is read before any of it is decoded: memory has more room than the kernel.
            self._read()
            portion = [self._backlog.popleft() for _ in range(min(_PORTION, len(self._backlog)))]
            for datagram, port_number in portion:
                frames += self._assembler.feed(*datagram, port_number)
            if portion:
                self._sender = portion[-1][0].sender
            decoded += len(portion)
            if not self._backlog:
                break
        until = self._backlog[0][0].arrival if self._backlog else self._read_until
        self._present = max(self._present, until)
        frames += self._assembler.flush(self._present)
        rows = []
        for frame in frames:
            if not self._in_time(frame.arrival):
                continue
            row = self._packer.pack(frame)
            self._watch.feed(row, frame.fresh_bones + frame.fresh_shapes)
            rows.append(row)
        self._packets_per_s = self._rate.rate(now, sum(port.received for port in self._inputs))
        return rows

    def leave_out(self, rows: int) -> None:
        """Count rows that came in and could not be told."""
        self._thinned += rows

    def heard(self, now: float) -> Heard:
        """How it stands."""
        watch, assembler = self._watch, self._assembler
        return Heard(
            self._assembler.whole_until(self._present),
            sum(port.received for port in self._inputs),
            assembler.packets_bad,
            sum(port.dropped for port in self._inputs),
            self._packets_per_s,
            watch.frames,
            watch.frames_per_s(now),
            watch.lost + self._thinned,
            watch.late,
            watch.jitter_ms(),
            watch.last_arrival,
            watch.last_moved,
            self._sender,
            assembler.senders,
            assembler.sources,
            assembler.ok,
            assembler.avatar,
            assembler.missing(self._present),
            watch.lost_lately(now),
        )

    def close(self) -> None:
        """Let the ports go."""
        for port in self._inputs:
            port.stop()

    def _read(self) -> None:
        """Fetch what waits, in the order of its arrival.

        Silence is judged at the moment before which all that arrived is in: while a port has more than is
        read at once, that is its last datagram's arrival.
        """
        if len(self._backlog) >= _BACKLOG:
            return
        begun = clock.now()
        ahead = self._wall.ahead()
        shares = {port: one.share(begun, self._sockets_of[port]) for port, one in self._allowances.items()}
        come = self._early
        known_until = begun
        for port in self._inputs:
            found = port.read(ahead, shares[port.port])
            self._allowances[port.port].left -= len(found)
            if not port.emptied:
                known_until = min(known_until, found[-1].arrival if found else self._present + _ON_THE_WAY)
            come += [(datagram, port.port) for datagram in found]
        self._read_until = known_until - _ON_THE_WAY
        self._early = []
        if len(self._inputs) > 1:
            come = self._in_order(come)
        self._backlog.extend(come)

    def _in_order(self, come: list[tuple[Datagram, int]]) -> list[tuple[Datagram, int]]:
        """Those of several sockets by their arrival; what another socket may still precede waits a turn."""
        come.sort(key=lambda one: one[0].arrival)
        if not self.stamped:
            return come
        at = bisect.bisect_right(come, self._read_until, key=lambda one: one[0].arrival)
        self._early = come[at:]
        return come[:at]

    def _in_time(self, arrival: float) -> bool:
        """Whether a frame is one of those a second that may be kept."""
        if int(arrival) != self._second:
            self._second, self._in_second = int(arrival), 0
        self._in_second += 1
        self._thinned += self._in_second > MOST_FRAMES_PER_S
        return self._in_second <= MOST_FRAMES_PER_S


def batches(rows: Sequence[Row], known: Names | None) -> list[Batch]:
    """Rows put together by their names.

    Args:
        known: the names told last.
    """
    found: list[Batch] = []
    first = 0
    for at in range(1, len(rows) + 1):
        if at < len(rows) and rows[at].names is rows[first].names:
            continue
        part = rows[first:at]
        stamps = np.array([(row.arrival, row.sender_time) for row in part])
        values = np.stack([row.values for row in part])
        found.append((part[0].names if part[0].names is not known else None, stamps, values))
        known, first = part[0].names, at
    return found


def unpacked(batch: Batch, known: Names | None) -> tuple[list[Row], Names | None]:
    """The rows of a batch, and the names that hold from it on."""
    names, stamps, values = batch
    names = names if names is not None else known
    assert names is not None
    pairs = zip(stamps.tolist(), values, strict=True)
    return [Row(arrival, sender_time, names, row) for (arrival, sender_time), row in pairs], names
