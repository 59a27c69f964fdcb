"""A port of several sockets is one port: nobody else can join, and what comes is in the order it came."""

import socket
import time
from collections.abc import Iterator

import numpy as np
import pytest

from studio.capture import clock, port
from studio.capture.osc import DatagramInput
from studio.capture.receiver import Receiver
from studio.capture.rows import Row
from studio.capture.vmc import message
from studio.errors import StudioError

pytestmark = pytest.mark.skipif(not port._LINUX, reason="elsewhere one socket is given room enough")
WIDE = 10**12
"""More room than any system grants a socket."""


@pytest.fixture
def sockets() -> Iterator[list[socket.socket]]:
    opened = port.bind_wide(0, room=WIDE)
    yield opened
    for one in opened:
        one.close()


def taken(receiver: Receiver, count: int) -> list[Row]:
    rows: list[Row] = []
    until = time.monotonic() + 30
    while len(rows) < count:
        assert time.monotonic() < until, "waited in vain"
        rows += receiver.take_in(clock.now())
        time.sleep(0.002)
    return rows


def test_room_enough_is_one_socket() -> None:
    (only,) = port.bind_wide(0, room=1)
    only.close()


def test_a_taken_port_is_taken_and_a_wide_one_too(sockets: list[socket.socket]) -> None:
    assert len(sockets) == 32
    number = sockets[0].getsockname()[1]
    assert {one.getsockname() for one in sockets} == {("127.0.0.1", number)}
    for bind in (port.bind, port.bind_wide):
        with pytest.raises(StudioError) as caught:
            bind(number)
        assert (
            caught.value.what
            == f"Port {number} is used by another program, such as VSeeFace or a second studio."
        )


def test_who_joins_the_port_hears_nothing(sockets: list[socket.socket]) -> None:
    number = sockets[0].getsockname()[1]
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as thief,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out,
    ):
        thief.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
        thief.bind(("127.0.0.1", number))
        thief.setblocking(False)
        for _ in range(500):
            out.sendto(b"/x", ("127.0.0.1", number))
        with pytest.raises(BlockingIOError):
            thief.recv(100)
    inputs = [DatagramInput(0, opened=one.dup()) for one in sockets]
    for one in inputs:
        one.start()
    heard = [len(one.read()) for one in inputs]
    assert sum(heard) == 500
    assert sum(count > 0 for count in heard) > 20  # dealt out among all
    for one in inputs:
        one.stop()


@pytest.fixture
def receiver(sockets: list[socket.socket]) -> Iterator[Receiver]:
    made = Receiver([one.dup() for one in sockets])
    yield made
    made.close()


def test_what_is_dealt_out_among_sockets_is_in_order_again(
    receiver: Receiver, sockets: list[socket.socket]
) -> None:
    number = sockets[0].getsockname()[1]
    names = [f"Shape{i}" for i in range(20)]
    rows: list[Row] = []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        for k in range(200):
            for name in names:
                out.sendto(message("/VMC/Ext/Blend/Val", name, k / 200), ("127.0.0.1", number))
            out.sendto(message("/VMC/Ext/Blend/Apply"), ("127.0.0.1", number))
            rows += receiver.take_in(clock.now())
    rows += taken(receiver, 200 - len(rows))
    values = np.stack([row.values[:20] for row in rows if len(row.names.shapes) == 20])
    assert (np.diff(values, axis=0) >= 0).all()  # any two that changed places would go back
    assert values[-1] == pytest.approx(199 / 200, abs=1e-6)
    stamps = [row.arrival for row in rows]
    assert stamps == sorted(stamps)
    heard = receiver.heard(clock.now())
    assert (heard.packets, heard.packets_bad, heard.packets_lost) == (4200, 0, 0)
