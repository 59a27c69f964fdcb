"""Motion heard by a process of its own: several ports, floods, and what happens when that process dies."""

import json
import os
import signal
import socket
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from studio import clock
from studio.capture.inputs import MotionInput
from studio.capture.recorder import Recorder
from studio.errors import StudioError
from studio.motion import Motion
from studio.motion.channels import BONES
from studio.take.motion_file import read_motion
from studio.vmc.encode import SendOptions, encode_frame, message
from studio.vmc.rows import RowBlock
from studio.vmc.udp import bind
from studio.vmc.watch import MOST_FRAMES_PER_S
from tests.patience import PATIENCE, in_one

FACE = b"jawOpen-40|eyeBlink_L-10|=head#0,0,0,0,0,0|"

_SOCKETS: dict[int, socket.socket] = {}


@pytest.fixture(autouse=True)
def sockets() -> Iterator[None]:
    yield
    for opened in _SOCKETS.values():
        opened.close()
    _SOCKETS.clear()


def wait_for(condition: Callable[[], bool], seconds: float = PATIENCE) -> None:
    until = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < until, "waited in vain"
        time.sleep(0.005)


def send(port: int, *datagrams: bytes) -> None:
    """Always from the same address, as one sender; a frame at once, so that no pause can tear it."""
    if port not in _SOCKETS:
        _SOCKETS[port] = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    out = _SOCKETS[port]
    for datagram in datagrams:
        out.sendto(datagram, ("127.0.0.1", port))


def body(k: int) -> list[bytes]:
    """A whole body in one datagram."""
    pose = Motion.build([0.0], ("Joy",), [[k % 100 / 100]], BONES).pose(0.0)
    return [in_one(encode_frame(pose, ("Joy",), BONES, k / 60, SendOptions()))]


@pytest.fixture
def motion() -> Iterator[MotionInput]:
    made = MotionInput([(0, "127.0.0.1")])
    yield made
    made.close()


def received(motion: MotionInput, enough: Callable[[int], bool]) -> list[RowBlock]:
    """What comes in until there are rows enough."""
    blocks: list[RowBlock] = []
    until = time.monotonic() + PATIENCE
    while not enough(sum(map(len, blocks))):
        assert time.monotonic() < until, "waited in vain"
        blocks += motion.poll(clock.now())
        time.sleep(0.005)
    return blocks


def test_rows_keep_their_arrival_across_the_processes(motion: MotionInput) -> None:
    for k in range(5):  # until it is known how this sender ends its frames
        send(motion.port, *body(k))
        received(motion, lambda rows: rows >= 1)
    before, after = [], []
    for k in range(50):
        before.append(clock.now())
        send(motion.port, *body(k))
        after.append(clock.now())
        time.sleep(0.01)
    blocks = received(motion, lambda rows: rows >= 50)
    stamps = np.concatenate([block.arrivals for block in blocks])
    assert len(stamps) == 50
    assert (stamps > np.array(before) - 0.005).all()
    if sys.platform == "linux":  # others have no stamp of the kernel's: it is when it was read
        assert (stamps < np.array(after) + 0.005).all()
    assert {len(block.names.bones) for block in blocks} == {54}
    assert len({id(block.names) for block in blocks}) == 1


def test_everything_up_to_a_moment_is_known_to_be_in(motion: MotionInput) -> None:
    send(motion.port, *body(0))
    now = clock.now()
    blocks = received(motion, lambda _rows: motion.received_until(now))
    assert len(blocks[-1].names.bones) == 54
    assert not motion.received_until(clock.now() + 5)


@pytest.mark.skipif(os.name != "posix", reason="kills by a signal")
def test_a_listener_that_dies_is_replaced_and_the_port_stays_open(motion: MotionInput) -> None:
    send(motion.port, *body(0))
    received(motion, lambda rows: rows == 1)
    assert motion.listener_pid is not None
    os.kill(motion.listener_pid, signal.SIGKILL)
    for k in range(20):
        send(motion.port, *body(k))
        time.sleep(0.005)
    blocks = received(motion, lambda rows: rows >= 20)
    assert len(blocks[-1].names.bones) == 54


def test_the_listener_ends_with_the_input() -> None:
    made = MotionInput([(0, "127.0.0.1")])
    pid, port = made.listener_pid, made.port
    assert pid is not None
    received(made, lambda _rows: made.received_until(made.opened))  # it is up
    made.close()
    if os.name == "posix":  # elsewhere signal 0 would end it
        with pytest.raises(ProcessLookupError):
            os.kill(pid, 0)
    bind(port).close()


def test_one_port_that_is_taken_closes_the_others() -> None:
    taken_one, free = bind(0), bind(0)
    number = free.getsockname()[1]
    free.close()
    with pytest.raises(StudioError) as caught:
        MotionInput([(number, "127.0.0.1"), (taken_one.getsockname()[1], "127.0.0.1")])
    taken = taken_one.getsockname()[1]
    assert (
        caught.value.what == f"Port {taken} is used by another program, such as VSeeFace or a second studio."
    )
    bind(number).close()
    taken_one.close()


def test_a_flood_is_thinned_and_counted(motion: MotionInput) -> None:
    apply = message("/VMC/Ext/Blend/Apply")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        out.connect(("127.0.0.1", motion.port))
        begun = clock.now()
        for k in range(4000):
            out.send(message("/VMC/Ext/Blend/Val", "A", k % 100 / 100))
            out.send(apply)
    ended = clock.now()
    blocks = received(motion, lambda _rows: motion.stats.packets + motion.stats.packets_lost >= 8000)
    blocks += received(motion, lambda _rows: motion.received_until(ended))
    rows = sum(map(len, blocks))
    assert rows <= (ended - begun + 1) * MOST_FRAMES_PER_S + 1
    # Left out by design is not lost; nor was it sent with a clock that would tell of losses.
    assert motion.stats.frames_thinned > 0 or ended - begun > 4000 / MOST_FRAMES_PER_S - 1
    assert motion.stats.frames_lost == 0
    if not motion.stats.packets_lost:
        assert rows + motion.stats.frames_thinned == 4000


@pytest.fixture
def recorder(tmp_path: Path) -> Iterator[Recorder]:
    made = Recorder(tmp_path / "takes")
    yield made
    made.close()


def test_a_body_and_a_face_become_one_take_that_keeps_who_gave_what(recorder: Recorder) -> None:
    recorder.open_motion(0, also=(0,))
    first, second = recorder.snapshot().ports
    recorder.start("Both")
    for k in range(60):
        send(second, FACE)
        send(first, *body(k))
        time.sleep(0.01)
    wait_for(lambda: len(recorder.snapshot().sources) == 2)
    snap = recorder.snapshot()
    assert {source.title for source in snap.sources} == {f"VMC :{first}", f"iFacialMocap :{second}"}
    take = recorder.stop()
    kept = json.loads(take.info.extra["sources"])
    assert len([name for name in kept[f"VMC :{first}"] if name in BONES]) == 54
    assert "JawOpen" in kept[f"iFacialMocap :{second}"]
    motion = read_motion(take.folder / "motion.arrow")
    assert set(motion.shape_names) >= {"Joy", "JawOpen", "EyeBlinkLeft"}
    assert motion.shapes[-1, motion.shape_names.index("JawOpen")] == pytest.approx(0.4)
    assert len(motion) >= 58  # until the body is known to be one, frames of the face count too


def test_a_take_begun_and_ended_before_the_listener_is_up_loses_nothing(recorder: Recorder) -> None:
    recorder.open_motion(0)
    recorder.start("Quick")
    port = recorder.snapshot().port
    assert port is not None
    for k in range(10):
        send(port, *body(k))
    take = recorder.stop()
    assert take.info.frames >= 10  # a first frame that was sent with a pause in it may count as two
