"""What a killed process leaves behind: half-written files and scratch folders, and how they are removed.

Their names tell their owner: computer, process, and when that process began. Whoever writes into the same
folder next removes those whose owner is dead. Nothing else is ever touched: not what a living process writes,
not what another user or another computer left lately, and no file of another program.
"""

from __future__ import annotations

import hashlib
import itertools
import os
import platform
import re
import shutil
import sys
import tempfile
import time
from contextlib import suppress
from functools import lru_cache
from pathlib import Path

from studio.files import lock

_OWNER = r"([0-9a-f]{6})-(\d{1,10})-(\d{1,20})"
_NAME = re.compile(rf"\..+\.{_OWNER}-\d+\.new|\.?saia-[a-z]+-{_OWNER}-\w+", re.DOTALL)
_LONGEST = 40
"""Characters kept of a name, so that with its owner it stays below the 255 bytes a file system takes."""
_FOREIGN_S = 7 * 24 * 3600.0
"""A week without a change, after which what another computer began in a shared folder counts as left."""
_numbers = itertools.count(1)
_swept: set[Path] = set()


def beside(path: Path) -> Path:
    """A new hidden path beside another, to write to and rename; sweeps the folder when first asked there."""
    _sweep_once(path.parent)
    return path.with_name(f".{path.name[:_LONGEST]}.{_owner(os.getpid())}-{next(_numbers)}.new")


def scratch_prefix(kind: str, folder: Path | None = None) -> str:
    """What a scratch folder's name begins with, for `tempfile`; sweeps where it goes when first asked there.

    Args:
        kind: what it is for, in small letters.
        folder: where it goes; the system's temporary folder where None.
    """
    _sweep_once(folder or Path(tempfile.gettempdir()))
    return f"saia-{kind}-{_owner(os.getpid())}-"


def sweep(folder: Path, *, within: bool = False) -> None:
    """Remove what dead processes left in a folder; what cannot be removed stays, and nothing is raised.

    Args:
        folder: it need not exist.
        within: in the folders directly within, too.
    """
    for entry in _entries(folder):
        found = _NAME.fullmatch(entry.name)
        if found is None:
            if within and entry.is_dir(follow_symlinks=False):
                sweep(Path(entry.path))
            continue
        with suppress(OSError):
            if not _is_left(entry, *(value for value in found.groups() if value is not None)):
                continue
            if entry.is_dir(follow_symlinks=False):
                shutil.rmtree(entry.path, ignore_errors=True)
            else:
                Path(entry.path).unlink(missing_ok=True)


def sweep_killed(target: Path) -> None:
    """Remove what a child that wrote into a folder, and those directly within, had no time to remove."""
    sweep(target, within=True)
    sweep(Path(tempfile.gettempdir()))


def _sweep_once(folder: Path) -> None:
    """Once per process: a folder may hold a hundred thousand files, and is written to as often."""
    if folder not in _swept:
        _swept.add(folder)
        sweep(folder)


def _entries(folder: Path) -> list[os.DirEntry[str]]:
    try:
        with os.scandir(folder) as found:
            return list(found)
    except OSError:
        return []


def _is_left(entry: os.DirEntry[str], host: str, pid: str, began: str) -> bool:
    """Whether what a name says is dead, and what it wrote is ours to remove."""
    facts = entry.stat(follow_symlinks=False)
    if sys.platform != "win32" and facts.st_uid != os.getuid():
        return False
    if host != _host():
        return time.time() - facts.st_mtime > _FOREIGN_S
    if not lock.is_alive(int(pid)):
        return True
    now = lock.began(int(pid))
    return bool(now and int(began) and now != int(began))  # the number was given again


@lru_cache(maxsize=2)
def _owner(pid: int) -> str:
    """This process in a name; asked for by its number, since a fork has another one."""
    return f"{_host()}-{pid}-{lock.began(pid)}"


@lru_cache(maxsize=1)
def _host() -> str:
    """This computer in six letters; a container counts processes for itself, so it is one of its own."""
    with suppress(OSError):
        return _short(f"{platform.node()} {os.stat('/proc/self/ns/pid').st_ino}")  # noqa: PTH116
    return _short(platform.node())


def _short(text: str) -> str:
    return hashlib.blake2b(text.encode("utf-8", "replace"), digest_size=3).hexdigest()
