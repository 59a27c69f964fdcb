"""Real disks that are small, for what happens when one is full or goes away."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest


@contextmanager
def small_disk(folder: Path, size: str) -> Iterator[Path]:
    """A disk of so many bytes ("6m") mounted on a new folder; skips the test where that is not permitted."""
    folder.mkdir()
    mount(folder, size)
    try:
        yield folder
    finally:
        subprocess.run(["umount", "--lazy", str(folder)], capture_output=True, check=False)


def mount(folder: Path, size: str) -> None:
    if sys.platform != "linux":
        pytest.skip("disks in memory are mounted on Linux alone")
    words = ["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(folder)]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    if done.returncode:
        pytest.skip(f"no disk may be mounted here: {done.stderr.strip()}")


def fill(disk: Path, leave: int = 0) -> Path:
    """Write a file that leaves so many bytes free; gives it, for making room again."""
    import shutil

    filler = disk / "filler"
    with filler.open("wb", buffering=0) as file:
        try:
            while (room := shutil.disk_usage(disk).free - leave) > 0:
                file.write(bytes(min(room, 1 << 20)))
        except OSError:
            pass
    return filler
