"""Queues of senders: fair, bounded, and closed to what is no motion."""

import pytest

from studio.vmc.osc import MOST_BYTES
from studio.vmc.senders import (
    ABSURD_PER_S,
    MOST_SENDERS,
    MOST_WAITING,
    MOST_WAITING_BYTES,
    NO_FLOOD,
    SHUT_OUT_S,
    SenderQueues,
)
from studio.vmc.udp import Datagram
from tests.capture import floods

FLOOD, VALID = "10.0.0.9:1", "10.0.0.2:2"


def push(
    queues: SenderQueues, t: float, sender: str = FLOOD, data: bytes = b"/VMC/Ext/Blend/Apply\x00"
) -> None:
    queues.push(Datagram(t, data, sender), 39539)


def popped(queues: SenderQueues, most: int = 10**6, cost: float = 1e-6) -> list[tuple[float, str]]:
    """What leaves, with datagrams of the flood costing so much and all others next to nothing."""
    found = []
    while len(found) < most and (one := queues.pop()) is not None:
        queue, datagram, _ = one
        queues.charge(queue, cost if datagram.sender == FLOOD else 1e-6)
        found.append((datagram.arrival, datagram.sender))
    return found


def test_while_all_is_well_datagrams_leave_as_they_arrived() -> None:
    queues = SenderQueues()
    for k in range(300):
        push(queues, k * 1e-3, f"10.0.0.{k * 7 % 5}:1")
    assert queues.oldest == 0.0
    assert [t for t, _ in popped(queues)] == [k * 1e-3 for k in range(300)]
    assert (queues.count, queues.oldest, queues.flood(1.0)) == (0, float("inf"), NO_FLOOD)


@pytest.mark.parametrize("cost", [20e-6, 0.015])
def test_a_sender_waits_for_another_one_no_longer_than_a_moment(cost: float) -> None:
    """A frame of ten datagrams behind a thousand costly ones; decoded first would be 15 s of them."""
    queues = SenderQueues()
    for k in range(1000):
        push(queues, k * 1e-6)
    for k in range(10):
        push(queues, 1.0 + k * 1e-6, VALID)
    before = [sender for _, sender in popped(queues, 100, cost)]
    assert before.count(VALID) == 10
    assert before[: before.index(VALID)].count(FLOOD) * cost <= 0.001 + cost
    assert len(popped(queues)) == 910


def test_who_owes_time_is_let_off_once_nobody_else_waits() -> None:
    queues = SenderQueues()
    for k in range(50):
        push(queues, k * 1e-3)
        assert popped(queues, cost=1.0) == [(k * 1e-3, FLOOD)]


@pytest.mark.parametrize("size", [24, MOST_BYTES])
def test_what_waits_is_bounded_and_it_is_the_flood_that_pays(size: int) -> None:
    queues = SenderQueues()
    count = 2 * max(MOST_WAITING_BYTES // size if size > 1000 else MOST_WAITING, 1)
    data = b"/" + bytes(size - 1)
    for k in range(count):
        if k % (count // 50) == 0:
            push(queues, k * 1e-6, VALID)
        push(queues, k * 1e-6, FLOOD, data)
        assert queues.count <= MOST_WAITING
    assert queues.dropped == pytest.approx(count / 2, rel=0.02)
    left = popped(queues)
    assert sum(sender == VALID for _, sender in left) >= 50
    assert len(left) * size <= MOST_WAITING_BYTES + 60 * size


def test_a_sender_alone_may_have_all_the_places() -> None:
    queues = SenderQueues()
    for k in range(MOST_WAITING):
        push(queues, k * 1e-6, VALID)
    assert (queues.count, queues.dropped) == (MOST_WAITING, 0)


@pytest.mark.parametrize(
    "data",
    [b"", b"/x", b"#bundle", b"hello there", b"#bundles are no bundle", bytes(400), b"/" * (MOST_BYTES + 1)],
)
def test_what_can_be_no_motion_is_refused_unread(data: bytes) -> None:
    queues = SenderQueues()
    push(queues, 0.0, data=data)
    assert (queues.count, queues.refused, queues.pop()) == (0, 1, None)


def test_who_sends_much_that_makes_no_sense_is_shut_out_for_a_while_and_longer_the_next_time() -> None:
    queues = SenderQueues()
    t, spells = 100.0, []
    for _ in range(3):
        for k in range(ABSURD_PER_S + 1):
            push(queues, t + k * 1e-4)
            if (one := queues.pop()) is not None:
                queues.charge(one[0], 1e-6)
                queues.note_absurd(one[0])
        (queue,) = queues.shut_out(t + 0.5)
        assert queue.sender == FLOOD
        spells.append(queue.shut_until - queue.last)
        push(queues, queue.shut_until - 0.01)
        push(queues, queue.shut_until - 0.01, VALID)
        assert [sender for _, sender in popped(queues)] == [VALID]
        t = queue.shut_until + 0.1
        assert queues.shut_out(t) == []
    assert spells == pytest.approx([SHUT_OUT_S, 2 * SHUT_OUT_S, 4 * SHUT_OUT_S], abs=0.001)  # one more came


def test_a_program_whose_values_are_refused_for_a_while_is_not_shut_out() -> None:
    """A tracker that lost its performer sends NaN for each bone: damaged, but no nonsense."""
    queues = SenderQueues()
    for k in range(6600):
        push(queues, 100 + k / 6600, VALID)
        if k % 60 == 0:
            queue = queues.pop()
            assert queue is not None
            queues.charge(queue[0], 1e-6)
            queues.note_absurd(queue[0])
    assert queues.shut_out(101.0) == []


def test_a_thousand_senders_of_junk_leave_room_for_one_of_motion() -> None:
    queues = SenderQueues()
    for k in range(5000):
        push(queues, k * 1e-4, f"10.0.{k % 1000}.1:1", b"junk that is none")
    assert queues.refused == 5000
    for k in range(5000):
        push(queues, 1 + k * 1e-4, f"10.0.{k % 1000}.1:1")
    push(queues, 1.5, VALID)
    assert len(queues.senders) <= MOST_SENDERS
    assert len(popped(queues)) == 5001
    push(queues, 9.0, VALID)
    assert (VALID, 39539) in queues.senders  # who fell silent gave its place up


def test_a_flood_is_told_by_how_much_and_whose_it_is() -> None:
    queues = SenderQueues()
    junk = floods.KINDS["junk"](0)
    for k in range(4000):
        t = 50 + k / 2000
        push(queues, t, data=next(junk)[:7])
        if k % 33 == 0:
            push(queues, t, VALID)
        flood = queues.flood(t)
    assert flood.per_s == pytest.approx(2000, rel=0.05)
    assert flood.sender == FLOOD
    assert queues.flood(60.0) == NO_FLOOD
