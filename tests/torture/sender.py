"""A sender of motion for recordings: a whole body, sixty times a second, from whoever waits anyway."""

from __future__ import annotations

import socket
import time
from contextlib import suppress

FPS = 60.0


class Sender:
    """Sends the frames that are due each time it is asked."""

    def __init__(self, port: int) -> None:
        self._to = ("127.0.0.1", port)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._begun = time.monotonic()
        self.sent = 0

    def close(self) -> None:
        """Let the port go."""
        self._socket.close()

    def send_due(self) -> None:
        """Send what is due now; what was held up is left out, as a camera does."""
        if self._begun + self.sent / FPS > time.monotonic():
            return
        with suppress(OSError):  # nobody listens yet, or any more
            self._socket.sendto(frame(self.sent), self._to)
        self.sent = max(self.sent + 1, int((time.monotonic() - self._begun) * FPS))


def frame(number: int) -> bytes:
    """One frame as one datagram, so that no pause can come between its parts."""
    import numpy as np

    from studio.motion import Pose, Skeleton
    from studio.motion.channels import BONES, VRM0_SHAPES
    from studio.vmc.encode import encode_frame
    from tests.patience import in_one

    rest = Skeleton.humanoid(BONES).rest_positions.astype(np.float32)
    identity = np.array([0, 0, 0, 1], dtype=np.float32)
    weights = np.full(len(VRM0_SHAPES), number % 50 / 50, dtype=np.float32)
    pose = Pose(weights, rest, np.tile(identity, (len(BONES), 1)), np.zeros(3, np.float32), identity)
    return in_one(encode_frame(pose, VRM0_SHAPES, BONES, number / FPS))
