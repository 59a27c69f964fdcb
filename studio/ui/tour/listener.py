"""What stands for the avatar at the end of the tour: a UDP socket that counts VMC messages."""

from __future__ import annotations

import socket
import time

from studio.capture.vmc import FrameAssembler


class Listener:
    """Receives VMC on a free port until it is closed."""

    def __init__(self) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 0))
        self._socket.setblocking(False)
        self.port: int = self._socket.getsockname()[1]
        self.packets = 0
        self._assembler = FrameAssembler()
        self.frames = 0
        self.moving: set[str] = set()
        self._last: dict[str, float] = {}

    def read(self) -> None:
        """Take in what has arrived; never waits."""
        while True:
            try:
                datagram = self._socket.recv(65536)
            except BlockingIOError:
                return
            self.packets += 1
            for frame in self._assembler.feed(time.monotonic(), datagram):
                self.frames += 1
                for name, value in frame.shapes.items():
                    if abs(self._last.setdefault(name, value) - value) > 0.01:
                        self.moving.add(name)

    def close(self) -> None:
        """Give the port back."""
        self._socket.close()
