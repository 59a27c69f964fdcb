"""Datagrams over real UDP on this machine."""

import socket
import time
from collections.abc import Iterator

import pytest

from studio.capture import clock
from studio.capture.osc import BUFFER_BYTES, Datagram, DatagramInput
from studio.errors import StudioError


@pytest.fixture
def port() -> Iterator[DatagramInput]:
    opened = DatagramInput(0)
    opened.start()
    yield opened
    opened.stop()


def drained(port: DatagramInput, count: int) -> list[Datagram]:
    """So many datagrams, waited for."""
    found: list[Datagram] = []
    until = time.monotonic() + 10
    while len(found) < count and time.monotonic() < until:
        found += port.drain()
        time.sleep(0.002)
    return found


def test_datagrams_come_in_order_with_stamps_and_sender(port: DatagramInput) -> None:
    before = clock.now()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        out.bind(("127.0.0.1", 0))
        for i in range(100):
            out.sendto(b"/%d" % i, ("127.0.0.1", port.port))
        me = "{}:{}".format(*out.getsockname())
    found = drained(port, 100)
    assert [d.data for d in found] == [b"/%d" % i for i in range(100)]
    assert {d.sender for d in found} == {me}
    stamps = [d.arrival for d in found]
    assert stamps == sorted(stamps)
    assert before - 0.001 <= stamps[0] <= stamps[-1] <= clock.now()
    assert (port.received, port.dropped) == (100, 0)


def test_a_stamp_is_the_arrival_not_the_reading(port: DatagramInput) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        sent = clock.now()
        out.sendto(b"/x", ("127.0.0.1", port.port))
    time.sleep(0.2)
    (datagram,) = drained(port, 1)
    assert datagram.arrival - sent < 0.1


def test_the_largest_datagram_comes_whole(port: DatagramInput) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        out.sendto(bytes(60_000), ("127.0.0.1", port.port))
        out.sendto(b"", ("127.0.0.1", port.port))
        out.sendto(b"/after", ("127.0.0.1", port.port))
    assert [len(d.data) for d in drained(port, 3)] == [60_000, 0, 6]


def test_the_kernel_has_room_while_nobody_reads() -> None:
    """Asked for in full; Linux grants what its limit allows and reports it doubled."""
    opened = DatagramInput(0)
    opened.start()
    assert opened._socket is not None
    granted = opened._socket.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF)
    opened.stop()
    plain = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    usual = plain.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF)
    plain.close()
    assert granted >= min(BUFFER_BYTES, usual)


def test_a_queue_nobody_drains_counts_its_losses(port: DatagramInput) -> None:
    port._queue = type(port._queue)(maxlen=50_000)
    for _ in range(50_000):
        port._queue.append(Datagram(0.0, b"", ""))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        for _ in range(10):
            out.sendto(b"/x", ("127.0.0.1", port.port))
    until = time.monotonic() + 5
    while port.received < 10 and time.monotonic() < until:
        time.sleep(0.002)
    assert port.dropped == 10
    assert len(port.drain()) == 50_000


def test_a_taken_port_is_a_sentence(port: DatagramInput) -> None:
    with pytest.raises(StudioError) as caught:
        DatagramInput(port.port).start()
    assert caught.value.what == f"Port {port.port} is already in use."
    assert caught.value.remedy == "Close the other receiver or choose another port in Settings."


def test_a_foreign_address_is_a_sentence() -> None:
    with pytest.raises(StudioError) as caught:
        DatagramInput(0, "192.0.2.1").start()
    assert caught.value.what == "192.0.2.1 is not an address of this computer."
    assert caught.value.remedy == (
        "Use 127.0.0.1 for programs on this computer, or 0.0.0.0 for the whole network."
    )


def test_a_number_that_is_no_port_is_a_sentence() -> None:
    with pytest.raises(StudioError) as caught:
        DatagramInput(70_000).start()
    assert caught.value.what == "70000 is not a port."
    assert caught.value.remedy == "Choose a port from 1024 to 65535."


def test_a_closed_port_is_free_again() -> None:
    first = DatagramInput(0)
    first.start()
    first.stop()
    first.stop()
    second = DatagramInput(first.port)
    second.start()
    second.stop()
    assert second.port == first.port
