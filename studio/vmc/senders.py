"""Fair queues of datagrams, one for each sender, so that none can starve another. Pure.

Deficit round robin by time: a sender whose datagrams cost much waits for those whose cost little. While all
is well nobody waits, and datagrams leave in the order in which they arrived, whoever sent them.

Source: Shreedhar and Varghese, Efficient Fair Queuing using Deficit Round Robin, 1995.
"""

from __future__ import annotations

import heapq
import math
from collections import deque
from itertools import count
from typing import NamedTuple

from studio.vmc import decode
from studio.vmc.osc import BUNDLE_MARK, LEAST_BYTES, MOST_BYTES
from studio.vmc.udp import Datagram
from studio.vmc.watch import RateWatch

MOST_WAITING, MOST_WAITING_BYTES = 60_000, 16 * 1024 * 1024
"""Kept for a decoder that is held up: seconds of several whole bodies."""
MOST_SENDERS = 64
"""Senders with a queue of their own; further ones share one."""
ABSURD_PER_S = 200
"""Datagrams a second that make no sense, where they are a good part of all: that is no motion program."""
# One datagram in eight: clumsy programs send some that make no sense among those that do.
_A_GOOD_PART = 8
SHUT_OUT_S, LONGEST_SHUT_OUT_S = 1.0, 8.0
"""Seconds for which nothing more of such a sender is looked at; then it may show again what it is."""
FLOOD_PER_S = 100.0
"""Datagrams thrown away a second from which on a person is told."""
# Seconds of decoding that a sender may use before others have their turn: dozens of messages at 15 us each
# (bench_capture).
_QUANTUM_S = 0.001
# Seconds after which a queue may be given to another sender.
_SILENT_S = 1.0
_LOOK_S = 0.1


class Flood(NamedTuple):
    """What is being thrown away: datagrams a second, and who sends most of them ("" where it is many)."""

    per_s: float = 0.0
    sender: str = ""


NO_FLOOD = Flood()


class SenderQueue:
    """One sender's datagrams, and what is known of it.

    Attributes:
        waiting: datagrams with the port each came in at.
        credit: seconds of decoding that it has left in this round.
        refused, dropped: datagrams thrown away because they made no sense, and for want of room.
        last: when it was heard last.
        shut_until: nothing of it is looked at before.
    """

    __slots__ = (
        "absurd", "arrivals", "bytes", "credit", "dropped", "last", "listed", "port", "refused", "second",
        "sender", "shut_for", "shut_until", "thrown", "thrown_before", "waiting",
    )  # fmt: skip

    def __init__(self, sender: str, port: int) -> None:
        self.sender, self.port = sender, port
        self.waiting: deque[tuple[Datagram, int]] = deque()
        self.bytes = self.refused = self.dropped = 0
        self.credit = 0.0
        self.shut_for = SHUT_OUT_S
        self.last = self.shut_until = -math.inf
        self.listed = False
        self.second = self.arrivals = self.absurd = self.thrown = self.thrown_before = 0

    def note_arrival(self, arrival: float) -> None:
        """Note that something came."""
        self.last = arrival
        if int(arrival) != self.second:
            self.thrown_before = self.thrown if int(arrival) == self.second + 1 else 0
            self.second, self.arrivals, self.absurd, self.thrown = int(arrival), 0, 0, 0
        self.arrivals += 1

    @property
    def floods(self) -> bool:
        """Whether much of what it sends makes no sense.

        Not whether most does: what still waits is not judged yet.
        """
        return self.absurd >= ABSURD_PER_S and _A_GOOD_PART * self.absurd > self.arrivals

    @property
    def is_thrown_away(self) -> bool:
        """Whether so much of it is thrown away that nobody should wait for the rest."""
        return max(self.thrown, self.thrown_before) > FLOOD_PER_S

    def shut_out(self) -> None:
        """Look at nothing of it for a time, and for a longer one where that is nothing new."""
        again = self.last < self.shut_until + self.shut_for
        self.shut_for = min(2 * self.shut_for, LONGEST_SHUT_OUT_S) if again else SHUT_OUT_S
        self.shut_until = self.last + self.shut_for


class SenderQueues:
    """Datagrams in, one at a time out, fairly.

    Attributes:
        count: datagrams that wait.
        refused, dropped: of all senders; see SenderQueue.
    """

    def __init__(self) -> None:
        self.count = self.refused = self.dropped = 0
        self._bytes = 0
        self._queues: dict[tuple[str, int], SenderQueue] = {}
        self._shared = SenderQueue("", 0)
        self._due: list[tuple[float, int, SenderQueue]] = []
        """By the arrival of what is their first, those that have credit."""
        self._spent: list[SenderQueue] = []
        self._turns = count()
        self._looked_at = -math.inf
        self._shut: list[SenderQueue] = []
        self._rate = RateWatch()

    @property
    def oldest(self) -> float:
        """Everything that arrived before has left, but for what floods; infinite where nothing waits."""
        heads = (q.waiting[0][0].arrival for q in self._all() if q.waiting and not q.is_thrown_away)
        return min(heads, default=math.inf)

    @property
    def senders(self) -> frozenset[tuple[str, int]]:
        """Senders with a queue of their own, and the port each sends to."""
        return frozenset(self._queues)

    def push(self, datagram: Datagram, port: int) -> None:
        """Have a datagram wait; what cannot be motion is refused at once, and unread."""
        arrival, data, sender = datagram
        plausible = _is_plausible(data)
        queue = self._queues.get((sender, port))
        if queue is None:
            # So that junk of a thousand senders leaves places to those that may be motion.
            few = len(self._queues) < MOST_SENDERS // 2
            queue = self._admitted(sender, port, arrival) if plausible or few else self._shared
        queue.note_arrival(arrival)
        if not plausible:
            self._refuse(queue)
            self.note_absurd(queue)
        elif arrival < queue.shut_until:
            self._refuse(queue)
        else:
            queue.waiting.append((datagram, port))
            queue.bytes += len(data)
            self._bytes += len(data)
            self.count += 1
            if not queue.listed:
                queue.listed = True
                # Debts stay, savings do not: who was silent must not flood for as long as it was.
                queue.credit = min(queue.credit, 0.0) + _QUANTUM_S
                self._list(queue)
            if self.count > MOST_WAITING or self._bytes > MOST_WAITING_BYTES:
                self._make_room(queue)

    def pop(self) -> tuple[SenderQueue, Datagram, int] | None:
        """The next to be decoded, its queue, and the port it came in at; `charge` must follow."""
        while self._due or self._new_round():
            queue = heapq.heappop(self._due)[2]
            if queue.waiting:
                return queue, *self._leave(queue)
            queue.listed = False
        return None

    def charge(self, queue: SenderQueue, seconds: float) -> None:
        """What decoding the datagram popped last took."""
        queue.credit -= seconds
        if queue.waiting:
            self._list(queue)
        else:
            queue.listed = False

    def note_absurd(self, queue: SenderQueue) -> None:
        """A datagram of a sender made no sense; who sends many of that kind is shut out."""
        queue.absurd += 1
        # Who shares a queue with a flood is not shut out with it.
        if queue is self._shared or not queue.floods or queue.last < queue.shut_until:
            return
        queue.shut_out()
        if queue not in self._shut:
            self._shut.append(queue)
        while queue.waiting:
            self._leave(queue)
            self._refuse(queue)

    def shut_out(self, now: float) -> list[SenderQueue]:
        """Senders of whom nothing is wanted now."""
        if self._shut:
            self._shut = [queue for queue in self._shut if queue.shut_until > now]
        return self._shut

    def flood(self, now: float, refused_elsewhere: int = 0) -> Flood:
        """What is thrown away at the moment.

        Args:
            refused_elsewhere: what never came here since its senders are shut out.
        """
        per_s = self._rate.rate(now, self.refused + self.dropped + refused_elsewhere)
        if per_s < FLOOD_PER_S:
            return NO_FLOOD
        if shut := self.shut_out(now):
            return Flood(per_s, shut[0].sender if len(shut) == 1 else "")
        lately = [q for q in self._all() if max(q.last, q.shut_until) > now - 2 * _SILENT_S]
        thrown = {q.sender: max(q.thrown, q.thrown_before) for q in lately}
        most = max(thrown, key=lambda sender: thrown[sender], default="")
        return Flood(per_s, most if thrown and 2 * thrown[most] > sum(thrown.values()) else "")

    def _all(self) -> tuple[SenderQueue, ...]:
        return *self._queues.values(), self._shared

    def _admitted(self, sender: str, port: int, arrival: float) -> SenderQueue:
        """A queue for a new sender: its own, one of who is silent, or where there are too many the shared."""
        if len(self._queues) >= MOST_SENDERS:
            # A flood of ever new senders asks each time.
            if arrival < self._looked_at + _LOOK_S:
                return self._shared
            self._looked_at = arrival
            silent = [q for q in self._queues.values() if q.last < arrival - _SILENT_S and not q.listed]
            for gone in silent:
                del self._queues[gone.sender, gone.port]
            if not silent:
                return self._shared
        queue = self._queues[sender, port] = SenderQueue(sender, port)
        return queue

    def _list(self, queue: SenderQueue) -> None:
        if queue.credit > 0:
            # The counter breaks ties: queues themselves cannot be compared.
            heapq.heappush(self._due, (queue.waiting[0][0].arrival, next(self._turns), queue))
        else:
            self._spent.append(queue)

    def _new_round(self) -> bool:
        """Credit for all that wait, so much that one of them has some; whether any waits."""
        spent, self._spent = self._spent, []
        for queue in spent:
            queue.listed = bool(queue.waiting)
        spent = [queue for queue in spent if queue.listed]
        # So much that the least indebted has a quantum: rounds in which nobody may go would cost time.
        more = _QUANTUM_S - max((queue.credit for queue in spent), default=0.0)
        for queue in spent:
            queue.credit += more
            self._list(queue)
        return bool(spent)

    def _leave(self, queue: SenderQueue) -> tuple[Datagram, int]:
        first = queue.waiting.popleft()
        size = len(first[0].data)
        queue.bytes -= size
        self._bytes -= size
        self.count -= 1
        return first

    def _make_room(self, pushed: SenderQueue) -> None:
        """Throw away the oldest of whoever has most waiting, which is never a usual sender beside a flood."""
        while self.count > MOST_WAITING or self._bytes > MOST_WAITING_BYTES:
            # By bytes where bytes are short, else by count: few large datagrams take as much room as many
            # small ones.
            if self._bytes > MOST_WAITING_BYTES:
                # Who has more than half is the largest without a look at all the others, as under a flood.
                most = pushed if 2 * pushed.bytes > self._bytes else max(self._all(), key=lambda q: q.bytes)
            else:
                own = 2 * len(pushed.waiting) > self.count
                most = pushed if own else max(self._all(), key=lambda q: len(q.waiting))
            self._leave(most)
            most.dropped += 1
            most.thrown += 1
            self.dropped += 1

    def _refuse(self, queue: SenderQueue) -> None:
        queue.refused += 1
        queue.thrown += 1
        self.refused += 1


def _is_plausible(data: bytes) -> bool:
    """Whether a datagram may be motion, at a glance."""
    if not LEAST_BYTES <= len(data) <= MOST_BYTES:
        return False
    return data.startswith((b"/", BUNDLE_MARK)) or bool(decode.face_app(data))
