"""Raises the scheduling priority of this process, as far as its user is allowed to."""

from __future__ import annotations

import contextlib
import os
import sys

_HIGH_PRIORITY = 0x80
_NICER = -10


def raise_priority(before_all: bool = False) -> None:
    """Let this process run before others.

    Args:
        before_all: in real time where the system allows it; for one that mostly waits.
    """
    if sys.platform == "win32":
        import ctypes

        kernel = ctypes.windll.kernel32
        kernel.SetPriorityClass(kernel.GetCurrentProcess(), _HIGH_PRIORITY)
        return
    with contextlib.suppress(OSError):
        os.nice(_NICER)
    if before_all and hasattr(os, "sched_setscheduler"):
        with contextlib.suppress(OSError):
            os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(1))
