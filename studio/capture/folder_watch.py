"""Tracks the open files of a take being recorded, even if their folder is moved or deleted."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

_PIECE = 1 << 20


class FolderWatch:
    """Notices that a folder with open files was moved or removed, and still reads what they held.

    It holds them open for reading: the content of a removed file stays until the last one lets go of it. On
    Windows the system refuses to move or remove a folder with open files, and only a disk that went away is
    noticed.

    Args:
        folder: with the files.
        names: of the files; those that are not there are passed over.
    """

    def __init__(self, folder: Path, names: Sequence[str]) -> None:
        self._folder = folder
        self._files: dict[str, int | None] = {}
        for name in names:
            if (folder / name).is_file():
                self._files[name] = None
                with suppress(OSError):
                    self._files[name] = os.open(folder / name, os.O_RDONLY) if os.name == "posix" else None
        # Some network drives number a file anew at every look; there only its absence tells anything.
        self._numbered = True
        self._numbered = self._lie_in(folder)

    def is_there(self) -> bool:
        """Whether the files are where they were begun."""
        return self._lie_in(self._folder)

    def moved_to(self) -> Path | None:
        """The folder they lie in now; None where they were removed, or the system does not tell."""
        descriptor = next((one for one in self._files.values() if one is not None), None)
        path = _path_of(descriptor) if descriptor is not None else None
        if path is None or not path.is_absolute() or _is_trash(path) or not self._lie_in(path.parent):
            return None
        return path.parent

    def copy(self, folder: Path) -> None:
        """Write what the files hold into another folder, as far as it can still be read.

        Raises:
            OSError: it cannot be written there.
        """
        for name, descriptor in self._files.items():
            if descriptor is None:
                continue
            with (folder / name).open("xb") as copy:
                while piece := _read(descriptor, copy.tell()):
                    copy.write(piece)
                copy.flush()
                os.fsync(copy.fileno())

    def close(self) -> None:
        """Let go of the files; whether they are there is all it tells from now on."""
        for name, descriptor in self._files.items():
            self._files[name] = None
            if descriptor is not None:
                os.close(descriptor)

    def _lie_in(self, folder: Path) -> bool:
        return all(self._is_same(folder / name, descriptor) for name, descriptor in self._files.items())

    def _is_same(self, path: Path, descriptor: int | None) -> bool:
        try:
            there = path.stat()
            if descriptor is None or not self._numbered:
                return True
            return os.path.samestat(there, os.fstat(descriptor))
        except (FileNotFoundError, NotADirectoryError):
            return False
        except OSError:
            return True  # a network that stumbles says nothing of the folder; what cannot be written does


def _path_of(descriptor: int) -> Path | None:
    """The path of an open file as the system knows it now; it need not be right."""
    try:
        if sys.platform == "darwin":
            import fcntl

            return Path(os.fsdecode(fcntl.fcntl(descriptor, fcntl.F_GETPATH, bytes(1024)).rstrip(b"\0")))
        return Path(f"/proc/self/fd/{descriptor}").readlink()
    except OSError:
        return None


def _is_trash(path: Path) -> bool:
    """Whether a path leads into a desktop's trash, where nobody looks before it is emptied."""
    return any(part.lower().lstrip(".").startswith("trash") for part in path.parts)


def _read(descriptor: int, at: int) -> bytes:
    """The next piece; empty at the end, and where a disk that went away gives no more."""
    try:
        return os.pread(descriptor, _PIECE, at)
    except OSError:
        return b""
