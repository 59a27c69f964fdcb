"""Files that are whole or absent: written beside, flushed to the disk, then renamed."""

from __future__ import annotations

import errno
import json
import os
import shutil
import unicodedata
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from studio.errors import StudioError

_FULL = (errno.ENOSPC, getattr(errno, "EDQUOT", errno.ENOSPC))  # Windows knows no quota
UNREADABLE_ZIP = (zipfile.BadZipFile, zlib.error, NotImplementedError, RuntimeError, EOFError, ValueError)
"""What reading a zip raises where it is damaged, has a password (RuntimeError) or odd packing."""
_RESERVED = {"con", "prn", "aux", "nul", *(f"com{i}" for i in range(10)), *(f"lpt{i}" for i in range(10))}


@contextmanager
def written(path: Path) -> Iterator[Path]:
    """A path beside `path` to write to; it takes the place of `path` when the block ends well.

    Raises:
        StudioError: the disk is full or the folder cannot be written; the old file is untouched.
    """
    beside = path.with_name(f".{path.name}.{os.getpid()}.new")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield beside
        with beside.open("rb+") as file:
            os.fsync(file.fileno())
        beside.replace(path)
    except OSError as error:
        raise cannot_write(path, error) from error
    finally:
        with suppress(OSError):
            beside.unlink(missing_ok=True)


def sweep(folder: Path, pid: int) -> None:
    """Remove what a process that was killed left half-written in a folder and in those directly within."""
    for pattern in (f".*.{pid}.new", f"*/.*.{pid}.new"):
        for beside in folder.glob(pattern):
            with suppress(OSError):
                beside.unlink(missing_ok=True)


def write_json(path: Path, content: Any) -> None:
    """Write a JSON file in one piece, readable by people."""
    text = json.dumps(content, ensure_ascii=False, indent=1)
    with written(path) as beside:
        beside.write_text(text + "\n", encoding="utf-8")


def read_json(path: Path) -> dict[str, Any]:
    """The object in a JSON file.

    Raises:
        StudioError: the file is damaged (not UTF-8, not JSON, not an object).
        FileNotFoundError: there is none.
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8-sig"))
    except (ValueError, RecursionError) as error:
        raise damaged(path) from error
    if not isinstance(content, dict):
        raise damaged(path)
    return content


def check_version(path: Path, content: dict[str, Any], newest: int) -> None:
    """Raise NewerVersionError for a later version, StudioError where the version makes no sense."""
    version = content.get("version", 1)
    if isinstance(version, bool) or not isinstance(version, int):
        raise damaged(path)
    if version > newest:
        raise newer(path)


def damaged(path: Path) -> StudioError:
    """What to say of a file that cannot be understood."""
    return StudioError(f"{path.name} in {path.parent.name} is damaged.", "Restore it from a backup.")


class NewerVersionError(StudioError):
    """A file of a later version: not damaged, and left as it is."""


def newer(path: Path) -> NewerVersionError:
    """What to say of a file written by a later version."""
    return NewerVersionError(
        f"{path.name} in {path.parent.name} was written by a newer Saia Studio.",
        "Update Saia Studio to open it.",
    )


def cannot_write(path: Path, error: OSError) -> StudioError:
    """What to say of a file that could not be written."""
    reason = error.strerror or type(error).__name__
    if error.errno in _FULL:
        reason = os.strerror(error.errno or errno.ENOSPC)  # a library may have put its own words around it
        remedy = f"Free some space on the disk of {path.parent}."
    elif error.errno in (errno.EACCES, errno.EPERM, errno.EROFS):
        remedy = f"Allow writing in {path.parent}, or choose another folder."
    elif error.errno in (errno.ENOTDIR, errno.EEXIST, errno.ENAMETOOLONG, errno.ENOENT):
        remedy = f"Choose another place than {path.parent}."
    else:
        remedy = f"Free some space or check the folder {path.parent}."
    return StudioError(f"{path.name} could not be written: {reason}.", remedy)


def set_aside(path: Path) -> Path:
    """Rename a damaged file so that nothing in it is lost; gives its new path, `<name>.damaged-N`."""
    number = 1
    while (kept := path.with_name(f"{path.name}.damaged-{number}")).exists():
        number += 1
    path.rename(kept)
    return kept


def safe_name(name: str) -> str:
    """A file or folder name that every system accepts, close to what was asked; Japanese and spaces stay."""
    text = unicodedata.normalize("NFC", name)
    text = "".join("_" if c in '<>:"/\\|?*' or unicodedata.category(c).startswith("C") else c for c in text)
    text = text.strip(" .")[:80].rstrip(" .")
    if text.startswith("-"):  # a command would take it for one of its options
        text = f"_{text[1:]}"
    if not text or text.split(".")[0].lower() in _RESERVED:
        text = f"take_{text}".rstrip("_")
    return text


def copied(source: Path, target: Path) -> None:
    """Copy a file, byte for byte, in one piece."""
    with written(target) as beside:
        shutil.copyfile(source, beside)
