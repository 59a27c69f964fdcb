"""Which process may change a project, whether a process lives, and when it began.

The lock is one that the system itself drops when its holder dies. filelock would do for that, but its lock on
Windows covers the first byte of the file, where others read which process holds it, and not the one that
earlier versions lock. psutil tells whether a process lives, but when it began by the time of day: once the
clock is set, a living process would pass for a dead one, and what it is writing be removed.
"""

from __future__ import annotations

import os
import sys
import weakref
from contextlib import suppress
from pathlib import Path

LOCK_FILE = ".lock"
# Windows locks bytes against reading too; this one is far behind the number we show.
_FAR = 1 << 30


class ProjectLock:
    """The right to change a project, shared by all who ask for it inside one process."""

    def __init__(self, descriptor: int) -> None:
        # A bare descriptor, not a file object: garbage collection may close that one first, with a warning.
        self._descriptor = descriptor

    def __del__(self) -> None:
        # Released with its last holder in this process; the system does the same when the process dies.
        with suppress(OSError):
            os.ftruncate(self._descriptor, 0)
        with suppress(OSError):
            os.close(self._descriptor)


_held: weakref.WeakValueDictionary[Path, ProjectLock] = weakref.WeakValueDictionary()


def acquire(folder: Path) -> ProjectLock | None:
    """The lock of a project, or None where another process holds it or the folder cannot be written."""
    # Through links: two ways to one folder are one project.
    folder = folder.resolve()
    # flock would refuse a second handle of the same process, which only wants to share.
    if (held := _held.get(folder)) is not None:
        return held
    try:
        descriptor = os.open(folder / LOCK_FILE, os.O_RDWR | os.O_CREAT, 0o644)
    except OSError:
        return None
    if not _lock(descriptor):
        os.close(descriptor)
        return None
    with suppress(OSError):
        os.ftruncate(descriptor, 0)
        os.lseek(descriptor, 0, os.SEEK_SET)
        os.write(descriptor, f"{os.getpid()}\n".encode())
    lock = ProjectLock(descriptor)
    _held[folder] = lock
    return lock


def is_held(folder: Path) -> bool:
    """Whether a process that lives has the lock; the number in it outlives one that was killed."""
    try:
        descriptor = os.open(folder / LOCK_FILE, os.O_RDONLY)
    except OSError:
        return False
    try:
        return not _lock(descriptor)
    finally:
        # Closing also releases what the probe itself has just locked.
        os.close(descriptor)


def holder(folder: Path) -> int | None:
    """The process that wrote its number into the lock, None where there is none."""
    try:
        return int((folder / LOCK_FILE).read_text(encoding="utf-8").strip())
    except (OSError, ValueError):
        return None


def is_alive(pid: int) -> bool:
    """Whether a process of this computer lives, whoever's it is."""
    # Loaded when asked: most commands never meet what another process left.
    import psutil

    with suppress(OverflowError):
        return bool(psutil.pid_exists(pid))
    # Larger than any process number can be.
    return False


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


if sys.platform == "win32":
    import msvcrt

    def _lock(descriptor: int) -> bool:
        os.lseek(descriptor, _FAR, os.SEEK_SET)
        try:
            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        except OSError:
            return False
        return True

else:
    import errno
    import fcntl

    def _lock(descriptor: int) -> bool:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            # A file system without locks (some network drives) must not make every project read-only.
            return error.errno not in (errno.EWOULDBLOCK, errno.EACCES, errno.EAGAIN)
        return True
