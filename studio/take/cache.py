"""A folder of files that can be made again, kept from growing without end."""

from __future__ import annotations

import os
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

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
    found = sorted(_files(folder))
    weight, removed = sum(size for _, size, _ in found), 0
    for _, size, path in found:
        if weight - removed <= most_bytes:
            break
        try:
            path.unlink()
        except FileNotFoundError:
            pass  # another process was quicker
        except OSError:  # in use on Windows, or not ours to remove
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
            if entry.is_dir(follow_symlinks=False):
                yield from _files(Path(entry.path))
                continue
            stat = entry.stat(follow_symlinks=False)
            last = max(stat.st_mtime, stat.st_atime)
            if entry.name.endswith(UNFINISHED) and now - last < _LEFT_BEHIND_AFTER_SECONDS:
                continue
            yield last, stat.st_size, Path(entry.path)
