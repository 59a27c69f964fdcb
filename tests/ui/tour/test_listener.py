"""What stands for the avatar counts what really arrives."""

import socket
from collections.abc import Iterator

import numpy as np
import pytest

from studio.capture.vmc import encode_frame
from studio.motion import Motion
from studio.motion.channels import BONES, VRM0_SHAPES
from studio.ui.tour.listener import Listener


@pytest.fixture
def listener() -> Iterator[Listener]:
    listener = Listener()
    yield listener
    listener.close()


def test_nothing_sent_is_nothing_heard(listener: Listener) -> None:
    listener.read()
    assert (listener.packets, listener.frames, listener.moving) == (0, 0, set())


def test_frames_are_counted_and_moving_shapes_named(listener: Listener) -> None:
    shapes = np.zeros((10, len(VRM0_SHAPES)))
    shapes[:, VRM0_SHAPES.index("A")] = np.linspace(0, 1, 10)
    motion = Motion.build(np.arange(10) / 60, VRM0_SHAPES, shapes, BONES)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for t in motion.times:
            for datagram in encode_frame(motion.pose(t), VRM0_SHAPES, BONES, float(t)):
                sender.sendto(datagram, ("127.0.0.1", listener.port))
    for _ in range(100):
        listener.read()
        if listener.frames >= 9:
            break
    assert listener.frames >= 9
    assert listener.moving == {"A"}


def test_noise_is_no_frame(listener: Listener) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.sendto(b"\xff\x00noise", ("127.0.0.1", listener.port))
    for _ in range(1000):
        listener.read()
        if listener.packets:
            break
    assert (listener.packets, listener.frames) == (1, 0)
