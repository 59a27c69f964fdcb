"""A port of several sockets is one port: nobody else can join, what comes is in the order it came, and a
flood takes nothing from whoever sends motion."""

import socket
import sys
import time
from collections.abc import Iterator
from itertools import islice

import numpy as np
import pytest

from studio import clock
from studio.capture.receiver import Receiver
from studio.errors import StudioError
from studio.vmc import udp
from studio.vmc.decode import MAX_SHAPES
from studio.vmc.encode import message
from studio.vmc.rows import RowBlock
from studio.vmc.senders import ABSURD_PER_S
from studio.vmc.udp import DatagramInput
from tests.capture import floods

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="elsewhere one socket is given room enough")
WIDE = 10**12
"""More room than any system grants a socket."""


@pytest.fixture
def sockets() -> Iterator[list[socket.socket]]:
    opened = udp.bind_wide(0, room=WIDE)
    yield opened
    for one in opened:
        one.close()


def received(receiver: Receiver, count: int) -> list[RowBlock]:
    blocks: list[RowBlock] = []
    until = time.monotonic() + 30
    while sum(map(len, blocks)) < count:
        assert time.monotonic() < until, "waited in vain"
        blocks += receiver.poll(clock.now())
        time.sleep(0.002)
    return blocks


def test_room_enough_is_one_socket() -> None:
    (only,) = udp.bind_wide(0, room=1)
    only.close()


def test_a_taken_port_is_taken_and_a_wide_one_too(sockets: list[socket.socket]) -> None:
    assert len(sockets) == 32
    number = sockets[0].getsockname()[1]
    assert {one.getsockname() for one in sockets} == {("127.0.0.1", number)}
    for bind in (udp.bind, udp.bind_wide):
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
    inputs = [DatagramInput(one.dup()) for one in sockets]
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
    blocks: list[RowBlock] = []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        for k in range(200):
            for name in names:
                out.sendto(message("/VMC/Ext/Blend/Val", name, k / 200), ("127.0.0.1", number))
            out.sendto(message("/VMC/Ext/Blend/Apply"), ("127.0.0.1", number))
            blocks += receiver.poll(clock.now())
    blocks += received(receiver, 200 - sum(map(len, blocks)))
    values = np.concatenate([block.values[:, :20] for block in blocks if len(block.names.shapes) == 20])
    assert (np.diff(values, axis=0) >= 0).all()  # any two that changed places would go back
    assert values[-1] == pytest.approx(199 / 200, abs=1e-6)
    stamps = [float(t) for block in blocks for t in block.arrivals]
    assert stamps == sorted(stamps)
    heard = receiver.stats(clock.now())
    assert (heard.packets, heard.packets_bad, heard.packets_lost) == (4200, 0, 0)


@pytest.mark.parametrize("kind", floods.KINDS)
def test_a_valid_sender_beside_a_flood_keeps_every_frame_and_its_channels(
    receiver: Receiver, kind: str
) -> None:
    frames, packets_between = 40, 50
    flood = floods.KINDS[kind](1)
    blocks: list[RowBlock] = []
    to = ("127.0.0.1", receiver.ports[0])
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as valid,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other,
    ):
        for k in range(frames):
            for datagram in floods.frame(k):
                valid.sendto(datagram, to)
            for packet in islice(flood, packets_between if k > 3 else 0):
                other.sendto(packet, to)
            blocks += receiver.poll(clock.now())
    blocks += received(receiver, frames - sum(map(len, blocks)))
    numbers = [floods.number(block.names.shapes, row) for block in blocks for row in block.values]
    assert numbers == list(range(frames))
    assert {(len(block.names.shapes), len(block.names.bones)) for block in blocks} == {(52, 54)}
    heard = receiver.stats(clock.now())
    flooded = packets_between * (frames - 4)
    assert heard.packets == flooded + frames * len(floods.frame(0))
    assert (heard.packets_lost, heard.frames_lost) == (0, 0)
    assert 0.3 * flooded < heard.packets_bad <= flooded
    assert heard.packets_refused <= heard.packets_bad
    # What was spent on it is bounded, whatever came: as many names as any face has, and then no more.
    assert flooded - heard.packets_refused < MAX_SHAPES + 2 * ABSURD_PER_S
