"""What a process does to the disk and to other programs, told by Python itself before it happens.

An audit hook stays until the process ends: only for processes that were forked for one case.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

_WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
_CHANGES = {"os.mkdir": 1, "os.rename": 2, "os.remove": 1, "os.rmdir": 1, "os.link": 2, "os.symlink": 2,
            "os.truncate": 1, "shutil.rmtree": 1, "os.chmod": 1, "os.utime": 1}  # fmt: skip
"""Events that change the disk, and how many paths stand first in what is told of them."""
_FOREIGN = ("subprocess.Popen", "os.system", "os.exec", "os.posix_spawn", "os.spawn", "pickle.find_class")
"""What a file that was only read must never lead to."""


def writes(told: Callable[[tuple[str, ...]], None]) -> None:
    """Be told of every change of the disk just before it is made, as the paths it is made to."""

    def hook(event: str, arguments: tuple[Any, ...]) -> None:
        if paths := _changed(event, arguments):
            told(paths)

    sys.addaudithook(hook)


def outside(allowed: Sequence[Path], told: Callable[[str, str], None]) -> None:
    """Be told, as (kind, sentence), of what is written outside of some folders, and of programs started."""
    within = [str(folder.resolve()) for folder in allowed]

    def hook(event: str, arguments: tuple[Any, ...]) -> None:
        if event in _FOREIGN:
            told("foreign code", f"{event} {arguments!r:.200}")
        for path in _changed(event, arguments):
            real = os.path.realpath(path)
            if not any(real == folder or real.startswith(folder + os.sep) for folder in within):
                told("outside", f"{event} of {path}")

    sys.addaudithook(hook)


def _changed(event: str, arguments: tuple[Any, ...]) -> tuple[str, ...]:
    if event == "open":
        path, _, flags = arguments
        written = isinstance(flags, int) and flags & _WRITES and isinstance(path, str | bytes | os.PathLike)
        found = [path] if written else []
    else:
        found = list(arguments[: _CHANGES.get(event, 0)])
        # Within a folder that is held open (rmtree): its own event named the whole.
        if any(isinstance(one, int) and one > 0 for one in arguments[len(found) :] if event != "os.chmod"):
            found = found if event in ("os.mkdir", "shutil.rmtree") else []
    names = [os.fsdecode(one) for one in found if isinstance(one, str | bytes | os.PathLike)]
    return tuple(name for name in names if name != os.devnull)
