"""Patience for tests of real devices: a machine that is busy, or stopped for a moment, is no failure."""

from __future__ import annotations

import math
import struct
import time
from collections.abc import Callable, Sequence

PATIENCE = 60.0
"""Seconds such a machine may need for what takes it milliseconds."""


def until(condition: Callable[[], object], seconds: float = PATIENCE) -> None:
    """Wait for a condition."""
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.005)


def nearest(measure: Callable[[], float], wanted: float, good: float, tries: int = 5) -> float:
    """One thing measured again and again: the first figure within `good` of the one wanted, else the nearest.

    A machine that stumbles spoils some of the tries, a fault of ours spoils all of them. A try that came to
    nothing gives NaN.
    """
    found = math.nan
    for _ in range(tries):
        figure = measure()
        if not abs(found - wanted) <= abs(figure - wanted):
            found = figure
        if abs(found - wanted) <= good:
            break
    return found


def in_one(datagrams: Sequence[bytes]) -> bytes:
    """The datagrams of a frame as one, so that no pause can come between them."""
    parts = b"".join(struct.pack(">i", len(one)) + one for one in datagrams)
    return b"#bundle\x00" + struct.pack(">Q", 1) + parts
