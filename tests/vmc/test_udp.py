"""Datagrams over real UDP on this machine."""

import errno
import socket
import struct
import sys
import time
from collections.abc import Iterator

import pytest

from studio import clock
from studio.errors import StudioError
from studio.vmc import udp
from studio.vmc.osc import MOST_BYTES
from studio.vmc.udp import BUFFER_BYTES, BYTES_AT_ONCE, Datagram, DatagramInput


@pytest.fixture
def listening() -> Iterator[DatagramInput]:
    opened = DatagramInput(udp.bind(0))
    yield opened
    opened.stop()


def drained(listening: DatagramInput, count: int) -> list[Datagram]:
    """So many datagrams, waited for."""
    found: list[Datagram] = []
    wall = clock.WallClock()
    until = time.monotonic() + 30
    while len(found) < count and time.monotonic() < until:
        found += listening.read(wall.ahead())
        time.sleep(0.002)
    return found


def test_datagrams_come_in_order_with_stamps_and_sender(listening: DatagramInput) -> None:
    before = clock.now()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        out.bind(("127.0.0.1", 0))
        for i in range(100):
            out.sendto(b"/%d" % i, ("127.0.0.1", listening.port))
        me = "{}:{}".format(*out.getsockname())
    found = drained(listening, 100)
    assert [d.data for d in found] == [b"/%d" % i for i in range(100)]
    assert {d.sender for d in found} == {me}
    stamps = [d.arrival for d in found]
    assert stamps == sorted(stamps)
    assert before - 0.001 <= stamps[0] <= stamps[-1] <= clock.now()
    assert (listening.received, listening.dropped, listening.emptied) == (100, 0, True)


class OneDatagram:
    """A socket with one datagram in it, stamped by the kernel some time ago."""

    def __init__(self, stamp: float) -> None:
        seconds = int(stamp)
        nanoseconds = int((stamp - seconds) * 1e9)
        self._extras = [(1, 35, struct.pack("=qq", seconds, nanoseconds))]
        self._left = 1

    def recvmsg(self, *_: int) -> tuple[bytes, list[tuple[int, int, bytes]], int, tuple[str, int]]:
        if not self._left:
            raise BlockingIOError
        self._left -= 1
        return b"/x", self._extras, 0, ("127.0.0.1", 5)


def read_from(other: OneDatagram) -> tuple[DatagramInput, Datagram]:
    opened = DatagramInput(udp.bind(0))
    opened.stop()
    opened.socket, opened.stamped = other, True  # type: ignore[assignment]
    (datagram,) = opened.read(clock.WallClock().ahead())
    return opened, datagram


def test_a_stamp_is_the_arrival_not_the_reading() -> None:
    now = clock.now()
    _, datagram = read_from(OneDatagram(time.time() - 7.0))
    assert datagram.arrival <= now - 6.5
    assert datagram.sender == "127.0.0.1:5"


@pytest.mark.parametrize("off", [3600.0, -3600.0])
def test_a_wall_clock_that_was_set_throws_no_frame_away(off: float) -> None:
    before = clock.now()
    _, datagram = read_from(OneDatagram(time.time() + off))
    assert before <= datagram.arrival <= clock.now()


def test_no_stamp_is_before_the_one_before_it() -> None:
    opened, first = read_from(OneDatagram(time.time() - 1.0))
    opened.socket = OneDatagram(time.time() - 2.0)  # type: ignore[assignment]
    (second,) = opened.read(clock.WallClock().ahead())
    assert second.arrival == first.arrival


def test_the_largest_datagram_comes_whole_and_a_larger_one_is_cut(listening: DatagramInput) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        for size in (MOST_BYTES, MOST_BYTES + 1, 65_000, 0):
            out.sendto(bytes(size), ("127.0.0.1", listening.port))
        out.sendto(b"/after", ("127.0.0.1", listening.port))
    sizes = [len(d.data) for d in drained(listening, 5)]
    assert (sizes[0], *sizes[3:]) == (MOST_BYTES, 0, 6)
    if sys.platform == "linux":  # by the kernel, so that what waits takes no room from motion
        assert max(sizes[1:3]) < 8
    else:
        assert min(sizes[1:3]) > MOST_BYTES


def test_no_more_bytes_are_read_at_once_than_can_be_worked_off(listening: DatagramInput) -> None:
    count = BYTES_AT_ONCE // MOST_BYTES + 20
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        read: list[Datagram] = []
        largest = 0
        for _ in range(count):
            out.sendto(bytes(MOST_BYTES), ("127.0.0.1", listening.port))
        while part := listening.read():
            largest = max(largest, sum(len(d.data) for d in part))
            read += part
    assert largest <= BYTES_AT_ONCE + MOST_BYTES
    assert 0 < len(read) <= count


def test_the_kernel_has_room_while_nobody_reads() -> None:
    """Asked for in full; Linux grants what its limit allows and reports it doubled."""
    opened = DatagramInput(udp.bind(0))
    assert opened.socket is not None
    granted = opened.socket.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF)
    opened.stop()
    plain = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    usual = plain.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF)
    plain.close()
    assert granted >= min(BUFFER_BYTES, usual)


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux counts what it had no room for")
def test_what_the_kernel_had_no_room_for_is_counted() -> None:
    small = udp.bind(0)
    small.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    opened = DatagramInput(small)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        for _ in range(200):
            out.sendto(b"/x", ("127.0.0.1", opened.port))
        came = len(drained(opened, 1))
        assert 0 < came < 200
        opened.count()
    opened.stop()
    assert (came, opened.dropped, opened.refused) == (opened.received, 200 - came, 0)


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux refuses for us")
def test_what_a_sender_that_is_shut_out_sends_is_refused_by_the_kernel_and_counted(
    listening: DatagramInput,
) -> None:
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as flood,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as valid,
    ):
        for out in (flood, valid):
            out.bind(("127.0.0.1", 0))
        for shut_out in (frozenset({"{}:{}".format(*flood.getsockname()), "127.0.0.1:9"}), frozenset[str]()):
            listening.shut_out(shut_out)
            for out in (flood, valid) * 50:
                out.sendto(b"/x", ("127.0.0.1", listening.port))
        came = drained(listening, 150)
        me = "{}:{}".format(*valid.getsockname())
    assert sum(datagram.sender == me for datagram in came) == 100
    assert (len(came), listening.refused, listening.dropped) == (150, 50, 0)


def test_what_is_not_read_stays_in_the_kernel(listening: DatagramInput) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        for _ in range(30):
            out.sendto(b"/x", ("127.0.0.1", listening.port))
    assert len(listening.read(0.0, 10)) == 10
    assert not listening.emptied
    assert listening.read(0.0, 0) == []
    assert not listening.emptied
    assert len(drained(listening, 20)) == 20
    assert (listening.received, listening.dropped) == (30, 0)


def test_an_error_of_the_system_ends_nothing(listening: DatagramInput) -> None:
    class Reset(OneDatagram):
        def recvmsg(self, *_: int) -> tuple[bytes, list[tuple[int, int, bytes]], int, tuple[str, int]]:
            raise OSError(errno.ECONNRESET, "reset by our own vanished receiver")

    mine, listening.socket = listening.socket, Reset(0.0)  # type: ignore[assignment]
    listening.stamped = True
    assert listening.read() == []
    listening.socket = mine


def test_a_taken_port_is_a_sentence(listening: DatagramInput) -> None:
    with pytest.raises(StudioError) as caught:
        udp.bind(listening.port)
    assert (
        caught.value.what
        == f"Port {listening.port} is used by another program, such as VSeeFace or a second studio."
    )
    assert caught.value.remedy == "Close it, or choose another port in Record (or with --port)."


def test_a_foreign_address_is_a_sentence() -> None:
    with pytest.raises(StudioError) as caught:
        udp.bind(0, "192.0.2.1")
    assert caught.value.what == "192.0.2.1 is not an address of this computer."
    assert caught.value.remedy == (
        "Use 127.0.0.1 for programs on this computer, or 0.0.0.0 for the whole network."
    )


def test_a_number_that_is_no_port_is_a_sentence() -> None:
    with pytest.raises(StudioError) as caught:
        udp.bind(70_000)
    assert caught.value.what == "70000 is not a port."
    assert caught.value.remedy == "Choose a port from 1024 to 65535."


def test_a_closed_port_is_free_again() -> None:
    first = DatagramInput(udp.bind(0))
    first.stop()
    first.stop()
    assert first.read() == []
    second = DatagramInput(udp.bind(first.port))
    second.stop()
    assert second.port == first.port
