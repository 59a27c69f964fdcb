"""Receives motion on UDP ports: datagrams of all senders decoded into rows, with statistics."""

from __future__ import annotations

import bisect
import math
import select
import socket
from collections.abc import Sequence
from dataclasses import dataclass

from studio import clock
from studio.vmc.assemble import Frame, FrameAssembler
from studio.vmc.rows import Packer, RowBlock
from studio.vmc.senders import NO_FLOOD, Flood, SenderQueues
from studio.vmc.stream import Sender
from studio.vmc.udp import AT_ONCE, Datagram, DatagramInput
from studio.vmc.watch import FrameLimit, FrameWatch, RateWatch

# A datagram that is stamped may take this long to where it can be read, so silence is judged later.
_ON_THE_WAY = 0.005
# Decoding goes on for so long between two readings, and a turn before what was said is told.
#
# By time, since a datagram takes from a microsecond to some milliseconds. No thread reads beside the
# decoding: it would wait for Python's lock after every datagram.
_SLICE_S, _TURN_S = 0.002, 0.02
# What decoding takes at most: the costliest, a new name in 48 bytes, some 15 us.
_MOST_COST_S, _MOST_COST_S_A_BYTE = 20e-6, 0.5e-6


@dataclass(frozen=True)
class ReceiverStats:
    """Counters and names of a receiver at one moment.

    Args:
        until: everything that arrived before this moment is in the rows given so far.
        packets, packets_bad, packets_lost: datagrams received, refused in part or whole, dropped for want
            of room here or in the kernel.
        packets_refused: those of packets_bad that were thrown away unread.
        flood: what is being thrown away at the moment, and whose it is.
        packets_per_s, frames_per_s, jitter_ms: of the last second.
        frames, frames_lost, late, last_arrival, last_moved: see FrameWatch.
        frames_thinned: frames that came in and were left out, because they were more than MOST_FRAMES_PER_S.
        sender: who leads the motion. senders: everyone heard lately. sources: who gives what.
        ok, avatar: the last of their messages.
        values_unknown: values of faces that were left out, because no face has anything of their name.
        no_face: when a camera or a phone said last that it sees nobody, seconds of `clock.now()`.
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
    sources: tuple[Sender, ...] = ()
    ok: tuple[int, ...] = ()
    avatar: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()
    lost_lately: int = 0
    packets_refused: int = 0
    flood: Flood = NO_FLOOD
    frames_thinned: int = 0
    no_face: float = -math.inf
    values_unknown: int = 0


class Receiver:
    """Listens on sockets that are bound already.

    Args:
        sockets: at least one.
    """

    def __init__(self, sockets: Sequence[socket.socket]) -> None:
        self._inputs = [DatagramInput(opened) for opened in sockets]
        self._wall = clock.WallClock()
        self._assembler = FrameAssembler()
        self._watch = FrameWatch()
        self._packer = Packer()
        self._rate = RateWatch()
        self._packets_per_s = 0.0
        self._limit = FrameLimit()
        self._unsent = 0
        self._queues = SenderQueues()
        self._present = self._read_until = -math.inf
        # Datagrams of one socket that another socket may still have something before.
        self._early: list[tuple[Datagram, int]] = []

    @property
    def ports(self) -> tuple[int, ...]:
        """Those listened to."""
        return tuple(dict.fromkeys(port.port for port in self._inputs))

    @property
    def stamped(self) -> bool:
        """Whether what comes in is stamped by the kernel, so that it may wait to be read."""
        return all(port.stamped for port in self._inputs)

    def wait(self, seconds: float) -> None:
        """Sleep until something comes in, or that long."""
        # select wakes up for whichever socket has something, and costs nothing while none has.
        opened = [port.socket for port in self._inputs if port.socket is not None]
        select.select(opened, (), (), seconds)

    def poll(self, now: float) -> list[RowBlock]:
        """Read, decode and put together what has arrived; gives the rows of the frames that are whole.

        Args:
            now: the present, from before this call.
        """
        frames: list[Frame] = []
        # A turn ends even under a flood, so that what was decoded is told 50 times a second.
        ends = clock.now() + _TURN_S
        while True:
            self._read()
            self._decode(frames)
            if not self._queues.count or clock.now() > ends:
                break
        # After decoding, which is what tells a flood from motion.
        self._shut_out(clock.now())
        # Never backwards: frames up to there were flushed already.
        self._present = max(self._present, min(self._read_until, self._queues.oldest))
        frames += self._assembler.flush(self._present)
        # Counted before any is left out: thinning out must not look like frames that were lost.
        for frame in frames:
            self._watch.count(frame.arrival, frame.sender_time, frame.fresh_bones + frame.fresh_shapes)
        blocks = self._packer.pack([frame for frame in frames if self._limit.keeps(frame.arrival)])
        for block in blocks:
            self._watch.compare(block)
        self._packets_per_s = self._rate.rate(now, sum(port.received for port in self._inputs))
        return blocks

    def poll_pictures(self) -> list[tuple[float, ...]]:
        """Rows of motion.filmed, of what cameras have said since the last call."""
        return self._assembler.poll_pictures()

    def count_unsent(self, rows: int) -> None:
        """Count rows that arrived and were not sent on, as lost frames."""
        self._unsent += rows

    def stats(self, now: float) -> ReceiverStats:
        """Counters and names at this moment.

        Args:
            now: seconds of `clock.now()`; rates and losses are those of the seconds before it.
        """
        watch, assembler, queues = self._watch, self._assembler, self._queues
        for port in self._inputs:
            port.count()
        # The kernel refuses what senders that are shut out send: it is counted, though nobody read it.
        unread = sum(port.refused for port in self._inputs)
        return ReceiverStats(
            self._assembler.whole_until(self._present),
            sum(port.received for port in self._inputs) - queues.dropped + unread,
            assembler.packets_bad + queues.refused + unread,
            sum(port.dropped for port in self._inputs) + queues.dropped,
            self._packets_per_s,
            watch.frames - self._limit.left_out,
            watch.frames_per_s(now),
            watch.lost + self._unsent,
            watch.late,
            watch.jitter_ms(),
            watch.last_arrival,
            watch.last_moved,
            assembler.leader,
            assembler.senders,
            assembler.sources,
            assembler.ok,
            assembler.avatar,
            assembler.missing(self._present),
            watch.lost_lately(now),
            queues.refused + unread,
            queues.flood(now, unread),
            self._limit.left_out,
            assembler.no_face,
            assembler.unknown,
        )

    def close(self) -> None:
        """Close the ports."""
        for port in self._inputs:
            port.stop()

    def _read(self) -> None:
        """Fetch what waits, in the order of its arrival.

        Silence is judged at the moment before which all that arrived is in: while a port has more than is
        read at once, that is its last datagram's arrival.
        """
        begun = clock.now()
        # The kernel stamps with the wall clock, which may be set in mid-take; the difference is measured anew
        # each time.
        ahead = self._wall.ahead()
        # Shared among the sockets, so that a wide port reads no more in one go than a narrow one.
        most = max(AT_ONCE // len(self._inputs), 1)
        come = self._early
        known_until = begun
        for port in self._inputs:
            found = port.read(ahead, most)
            if not port.emptied:
                known_until = min(known_until, found[-1].arrival if found else self._present + _ON_THE_WAY)
            come += [(datagram, port.port) for datagram in found]
        self._read_until = known_until - _ON_THE_WAY
        self._early = []
        # One socket is in order by itself, and sorting costs time under a flood.
        if len(self._inputs) > 1:
            come = self._in_order(come)
        for datagram, number in come:
            self._queues.push(datagram, number)

    def _decode(self, frames: list[Frame]) -> None:
        """Decode what waits, fairly, until the slice of time is over; frames that became whole are added."""
        queues, assembler = self._queues, self._assembler
        left, at = _SLICE_S, clock.now()
        while left > 0 and (popped := queues.pop()) is not None:
            queue, datagram, port = popped
            absurd = assembler.absurd
            frames += assembler.feed(*datagram, port)
            before, at = at, clock.now()
            # What is beyond, this process was held up for: that is nobody's, and must not end the slice.
            cost = min(at - before, _MOST_COST_S + _MOST_COST_S_A_BYTE * len(datagram.data))
            left -= cost
            queues.charge(queue, cost)
            if assembler.absurd > absurd:
                queues.note_absurd(queue)

    def _shut_out(self, now: float) -> None:
        """Keep those out who turned out to be no senders of motion, and what they gave so far."""
        shut = self._queues.shut_out(now)
        for queue in shut:
            self._assembler.shut_out(queue.sender, queue.port)
        for port in self._inputs:
            port.shut_out(frozenset(queue.sender for queue in shut if queue.port == port.port))

    def _in_order(self, come: list[tuple[Datagram, int]]) -> list[tuple[Datagram, int]]:
        """Those of several sockets by their arrival; what another socket may still precede waits a turn."""
        come.sort(key=lambda one: one[0].arrival)
        if not self.stamped:
            return come
        at = bisect.bisect_right(come, self._read_until, key=lambda one: one[0].arrival)
        self._early = come[at:]
        return come[:at]
