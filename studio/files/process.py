"""Whether a process lives, and when it began, which tells it from a later one of the same number."""

from __future__ import annotations

import os
import sys
from pathlib import Path

if sys.platform == "win32":

    def is_alive(pid: int) -> bool:
        """Whether a process of this computer lives."""
        import ctypes

        # os.kill would end it here. 0x100000 is SYNCHRONIZE, 258 WAIT_TIMEOUT: still going on.
        kernel = ctypes.windll.kernel32
        process = kernel.OpenProcess(0x100000, False, pid)
        if not process:
            return False
        waiting = bool(kernel.WaitForSingleObject(process, 0) == 258)
        kernel.CloseHandle(process)
        return waiting

else:

    def is_alive(pid: int) -> bool:
        """Whether a process of this computer lives."""
        try:
            os.kill(pid, 0)
        except ProcessLookupError:
            return False
        except OverflowError:  # no number of a process
            return False
        except PermissionError:  # somebody else's
            return True
        return True


def began(pid: int) -> int:
    """When a process began, in ticks since the computer did; 0 where the system does not tell.

    Ticks and no time of day: a clock that is set right meanwhile must not turn a process into another one.
    Only Linux tells it without further libraries; elsewhere a number that was given again counts as alive.
    """
    try:
        # The name, second and in brackets, may hold spaces and brackets itself; field 22 is the start.
        facts = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8", errors="replace")
        return int(facts.rpartition(")")[2].split()[19])
    except (OSError, ValueError, IndexError):
        return 0
