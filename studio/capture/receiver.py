"""Ports to rows: what one or several senders say, put together, counted and watched."""

from __future__ import annotations

import math
import socket
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.capture.assembler import FrameAssembler, Source
from studio.capture.osc import DatagramInput
from studio.capture.rows import Names, Packer, Row
from studio.capture.watch import FrameWatch, RateWatch

_FLUSH_LAG = 0.015
"""A datagram may wait this long in the kernel while its thread is not run, so silence is judged later."""
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


Batch = tuple[Names | None, NDArray[np.float64], NDArray[np.float32]]
"""Rows for another process: names where they changed, (arrival, sender's time) (T, 2), values (T, width)."""


class Receiver:
    """Listens on sockets that are bound already.

    Args:
        sockets: at least one.
    """

    def __init__(self, sockets: Sequence[socket.socket]) -> None:
        self._inputs = [DatagramInput(0, opened=opened) for opened in sockets]
        self._assembler = FrameAssembler()
        self._watch = FrameWatch()
        self._packer = Packer()
        self._rate = RateWatch()
        self._packets_per_s = 0.0
        self._sender = ""
        self._second, self._in_second, self._thinned = 0, 0, 0
        self._present = -math.inf
        self._quiet_turns = 0
        for port in self._inputs:
            port.start()

    def take_in(self, now: float) -> list[Row]:
        """Whatever came, as rows.

        Args:
            now: the present, from before this call.
        """
        frames = []
        come = [(datagram, port.port) for port in self._inputs for datagram in port.drain()]
        if len(self._inputs) > 1:
            come.sort(key=lambda one: one[0].arrival)
        for datagram, port_number in come:
            frames += self._assembler.feed(*datagram, port_number)
        if come:
            self._sender = come[-1][0].sender
        self._catch_up(now, come[-1][0].arrival if come else None)
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

    def heard(self, now: float) -> Heard:
        """How it stands."""
        watch, assembler = self._watch, self._assembler
        return Heard(
            self._present - 2 * _FLUSH_LAG,
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
        )

    def close(self) -> None:
        """Let the ports go."""
        for port in self._inputs:
            port.stop()

    def _catch_up(self, now: float, last_arrival: float | None) -> None:
        """Move the moment that silence is judged at: while packets of a backlog still come in, that is the
        last one's arrival, or frames would be cut in two for being old; the clock's when all is quiet."""
        self._quiet_turns = 0 if last_arrival is not None else self._quiet_turns + 1
        present = last_arrival if last_arrival is not None else self._present
        if self._quiet_turns > 1:
            present = now - _FLUSH_LAG
        self._present = max(self._present, present)

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
