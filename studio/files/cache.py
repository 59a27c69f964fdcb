"""Things computed once and kept: where they lie, and how the folder is kept from growing without end."""

from __future__ import annotations

import hashlib
import os
import time
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import lru_cache
from pathlib import Path
from tokenize import TokenError
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studio.errors import StudioError, say
from studio.files import atomic

FOLDER = ".cache"
UNFINISHED = ".new"
_LEFT_BEHIND_AFTER_SECONDS = 24 * 3600.0


def used(path: Path) -> None:
    """Remember that a file was used now; one that cannot be marked is only removed sooner."""
    with suppress(OSError):
        os.utime(path)


def trim(folder: Path, most_bytes: float) -> int:
    """Remove the files used longest ago until the rest weighs no more than a limit.

    Files are whole or absent, and whoever misses one makes it again: another process may read, write and trim
    the same folder meanwhile. What is being written is left alone.

    Args:
        folder: searched with all folders in it; it need not exist.
        most_bytes: the limit.

    Returns:
        Bytes that were removed.
    """
    # Oldest first: what is used rarely is made again most cheaply.
    found = sorted(_files(folder))
    weight, removed = sum(size for _, size, _ in found), 0
    for _, size, path in found:
        if weight - removed <= most_bytes:
            break
        try:
            path.unlink()
        except FileNotFoundError:
            # Another process was quicker.
            pass
        except OSError:
            # In use on Windows, or not ours to remove.
            continue
        removed += size
    return removed


def _files(folder: Path) -> Iterator[tuple[float, int, Path]]:
    """When it was used last, size and path of every file that may go."""
    now = time.time()
    try:
        entries = list(os.scandir(folder))
    except OSError:
        return
    for entry in entries:
        with suppress(OSError):
            # Links are not followed: what lies elsewhere is not ours to remove.
            if entry.is_dir(follow_symlinks=False):
                yield from _files(Path(entry.path))
                continue
            stat = entry.stat(follow_symlinks=False)
            # Many disks are mounted without times of access, where writing must do.
            last = max(stat.st_mtime, stat.st_atime)
            if entry.name.endswith(UNFINISHED) and now - last < _LEFT_BEHIND_AFTER_SECONDS:
                continue
            yield last, stat.st_size, Path(entry.path)


CACHE_FOLDER = ".cache"
# np.load reads its heads as Python: of a damaged one it raises what a compiler does, and MemoryError where
# the size makes no sense.
_UNREADABLE = (OSError, SyntaxError, TokenError, MemoryError, RecursionError, *atomic.UNREADABLE_ZIP)
_PROBES, _PROBE_BYTES = 16, 4096


def fingerprint(path: Path) -> str:
    """Short text that changes with a file's content: its size and bytes spread over all of it.

    Raises:
        StudioError: the file is missing.
    """
    try:
        stat = path.stat()
        return _fingerprint(path, stat.st_size, stat.st_mtime_ns)
    except OSError as error:
        raise StudioError(
            say("The sound file {name} is missing.", name=path.name),
            say("Put it back at {folder}.", folder=path.parent),
        ) from error


@lru_cache(maxsize=512)
def _fingerprint(path: Path, size: int, _changed: int) -> str:
    found = hashlib.blake2b(str(size).encode(), digest_size=8)
    with path.open("rb") as file:
        for i in range(_PROBES):
            file.seek(max(size - _PROBE_BYTES, 0) * i // (_PROBES - 1))
            found.update(file.read(_PROBE_BYTES))
    return found.hexdigest()


def find(sound: Path, name: str) -> Path | None:
    """What is kept for a sound's present content under a name ("voice.npy"), or None."""
    try:
        places = _places(sound, name)
    except StudioError:
        return None
    return next((place for place in places if place.is_file()), None)


def kept_beside(sound: Path, name: str) -> list[Path]:
    """What is kept beside a sound under a name, of any content it ever had; it may be gone itself."""
    stem, _, suffix = name.rpartition(".")
    return list((sound.parent / CACHE_FOLDER).glob(f"{stem}-*.{suffix}"))


@contextmanager
def keeping(sound: Path, name: str) -> Iterator[Path]:
    """A file to write what is to be kept under a name; it is found once the block ends well.

    Raises:
        StudioError: the sound is missing, or neither place can be written.
    """
    beside, elsewhere = _places(sound, name)
    with atomic.written(beside if _can_write(beside.parent) else elsewhere) as file:
        yield file


def read_arrays(path: Path) -> dict[str, NDArray[Any]]:
    """The arrays in a .npz by name, or that of a .npy under ""; empty where it is missing or damaged."""
    try:
        with path.open("rb") as file, warnings.catch_warnings():
            # Of heads that look like those of old versions.
            warnings.simplefilter("ignore")
            found = np.load(file, allow_pickle=False)
            if isinstance(found, np.ndarray):
                return {"": found}
            with found:
                return {name: found[name] for name in found.files}
    except _UNREADABLE:
        return {}


def _places(sound: Path, name: str) -> tuple[Path, Path]:
    from platformdirs import user_cache_path

    stem, _, suffix = name.rpartition(".")
    file = f"{stem}-{fingerprint(sound)}.{suffix}"
    return sound.parent / CACHE_FOLDER / file, user_cache_path(
        "saia-studio", appauthor=False
    ) / "sounds" / file


def _can_write(folder: Path) -> bool:
    try:
        folder.mkdir(exist_ok=True)
        # Tried for real: os.access tells nothing of network drives and full quotas.
        probe = folder / ".probe"
        probe.touch()
        probe.unlink()
    except OSError:
        return False
    return True
