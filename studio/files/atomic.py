"""Files that are whole or absent: written under another name, flushed, then renamed; and space on disks."""

from __future__ import annotations

import errno
import json
import math
import os
import shutil
import unicodedata
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, is_dataclass
from pathlib import Path
from typing import Any

from studio.errors import StudioError, say
from studio.files import leftovers

_PROBE_BYTES = 1 << 20
"""More than a library that gave up and removed its file can have freed by it."""
UNREADABLE_ZIP = (zipfile.BadZipFile, zlib.error, NotImplementedError, RuntimeError, EOFError, ValueError)
"""What reading a zip raises where it is damaged, has a password (RuntimeError) or odd packing."""
_MARGIN_BYTES, _MARGIN = 512 << 20, 0.05
"""What is left free of a disk at least: bytes, or a share of a small disk."""
_BOMB_BYTES, _BOMB_TIMES = 1 << 30, 100
"""Sound and motion never get so much smaller by packing; an hour of digital silence might."""
# Windows knows no quota.
_FULL = (errno.ENOSPC, getattr(errno, "EDQUOT", errno.ENOSPC))
_UNITS = ((1e12, "TB"), (1e9, "GB"), (1e6, "MB"), (1e3, "KB"))
"""Decimal, as disks are sold and as file managers show them."""
_RESERVED = {"con", "prn", "aux", "nul", *(f"com{i}" for i in range(10)), *(f"lpt{i}" for i in range(10))}


@contextmanager
def written(path: Path) -> Iterator[Path]:
    """A path beside `path` to write to; it takes the place of `path` when the block ends well.

    Raises:
        StudioError: the disk is full or the folder cannot be written; the old file is untouched.
    """
    beside = leftovers.beside(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with disk_faults(beside):
            yield beside
        # Flushed before the rename: some file systems put the new name on the disk before the bytes.
        with beside.open("rb+") as file:
            os.fsync(file.fileno())
        # The only step that others see; up to here the old file is whole.
        beside.replace(path)
    except OSError as error:
        raise cannot_write(path, error) from error
    finally:
        with suppress(OSError):
            beside.unlink(missing_ok=True)


@contextmanager
def disk_faults(path: Path) -> Iterator[None]:
    """Within it a disk that takes no more is an OSError with its number, whatever a library calls it.

    soundfile has "System error.", safetensors and FFmpeg errors of their own, NumPy an OSError without a
    number. None tells what is wrong with the disk, so the disk itself is asked; where it takes what it is
    given, the error stays what it was.

    Args:
        path: the file that the library writes.
    """
    try:
        yield
    except StudioError:
        raise
    except Exception as error:
        told = isinstance(error, OSError) and error.errno is not None
        if not told and (fault := _fault(path)):
            raise fault from error
        raise


def _fault(path: Path) -> OSError | None:
    """What the system says when more is written to a file; None where it takes it."""
    try:
        with path.open("ab") as file:
            file.write(bytes(_PROBE_BYTES))
            file.flush()
            os.fsync(file.fileno())
    except OSError as error:
        return error
    return None


def write_json(path: Path, content: Any) -> None:
    """Write a JSON file in one piece, readable by people."""
    # Indented: people mend these files by hand, and diffs of them stay readable.
    text = json.dumps(content, ensure_ascii=False, indent=1)
    with written(path) as beside:
        beside.write_text(text + "\n", encoding="utf-8")


def plain(value: Any) -> Any:
    """A value as JSON can hold it: paths and arrays as text and lists, NaN and infinity as null."""
    if is_dataclass(value) and not isinstance(value, type):
        value = asdict(value)
    # Events are structs of msgspec, whose classes are made far faster than dataclasses are.
    elif hasattr(value, "__struct_fields__") and not isinstance(value, type):
        value = {name: getattr(value, name) for name in value.__struct_fields__}
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple | set | frozenset):
        return [plain(item) for item in value]
    if isinstance(value, Path):
        return str(value)
    if hasattr(value, "item") and getattr(value, "ndim", 0) == 0:
        # Numpy and torch scalars.
        value = value.item()
    if hasattr(value, "tolist"):
        return plain(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def read_json(path: Path) -> dict[str, Any]:
    """The object in a JSON file.

    Raises:
        StudioError: the file is damaged (not UTF-8, not JSON, not an object).
        FileNotFoundError: there is none.
    """
    try:
        # -sig: Windows editors put a byte order mark before what they save.
        content = json.loads(path.read_text(encoding="utf-8-sig"))
    except (ValueError, RecursionError) as error:
        raise damaged(path) from error
    if not isinstance(content, dict):
        raise damaged(path)
    return content


def check_version(path: Path, content: dict[str, Any], newest: int) -> None:
    """Raise NewerVersionError for a later version, StudioError where the version makes no sense."""
    version = content.get("version", 1)
    # True counts as 1 in Python and is no version.
    if isinstance(version, bool) or not isinstance(version, int):
        raise damaged(path)
    if version > newest:
        raise newer(path)


def damaged(path: Path) -> StudioError:
    """What to say of a file that cannot be understood."""
    return StudioError(
        say("{name} in {folder} is damaged.", name=path.name, folder=path.parent.name),
        "Restore it from a backup.",
    )


class NewerVersionError(StudioError):
    """A file of a later version: not damaged, and left as it is."""


def newer(path: Path) -> NewerVersionError:
    """What to say of a file written by a later version."""
    return NewerVersionError(
        say(
            "{name} in {folder} was written by a newer Saia Studio.", name=path.name, folder=path.parent.name
        ),
        "Update Saia Studio to open it.",
    )


def cannot_write(path: Path, error: OSError) -> StudioError:
    """What to say of a file that could not be written."""
    reason = error.strerror or type(error).__name__
    if error.errno is not None and (is_full(error) or error.errno == errno.EFBIG):
        # A library may have put its own words around it.
        reason = os.strerror(error.errno)
    if is_full(error):
        remedy = say("Free some space on the disk of {folder}.", folder=path.parent)
    elif error.errno == errno.EFBIG:
        remedy = say(
            "Choose another disk: the disk of {folder} cannot hold a file this large.", folder=path.parent
        )
    elif error.errno in (errno.EACCES, errno.EPERM, errno.EROFS):
        remedy = say("Allow writing in {folder}, or choose another folder.", folder=path.parent)
    elif error.errno in (errno.ENOTDIR, errno.EEXIST, errno.ENAMETOOLONG, errno.ENOENT):
        remedy = say("Choose another place than {folder}.", folder=path.parent)
    else:
        remedy = say("Free some space or check the folder {folder}.", folder=path.parent)
    return StudioError(say("{name} could not be written: {reason}.", name=path.name, reason=reason), remedy)


def set_aside(path: Path) -> Path:
    """Rename a damaged file so that nothing in it is lost; gives its new path, `<name>.damaged-N`."""
    number = 1
    # Counted up: a second damaged file must not take the place of the first.
    while (kept := path.with_name(f"{path.name}.damaged-{number}")).exists():
        number += 1
    path.rename(kept)
    return kept


def safe_name(name: str) -> str:
    """A file or folder name that every system accepts, close to what was asked; Japanese and spaces stay."""
    # macOS hands out names in pieces (NFD), and one name would be two on Linux.
    text = unicodedata.normalize("NFC", name)
    text = "".join("_" if c in '<>:"/\\|?*' or unicodedata.category(c).startswith("C") else c for c in text)
    text = text.strip(" .")[:80].rstrip(" .")
    if text.startswith("-"):
        # A command would take it for one of its options.
        text = f"_{text[1:]}"
    if not text or text.split(".")[0].lower() in _RESERVED:
        text = f"take_{text}".rstrip("_")
    return text


def is_possible_name(name: str) -> bool:
    """Whether every system can have a file or folder of this name, or at least the one this runs on.

    What Windows alone refuses is refused there alone, but for its devices' names and names that it would
    silently change: what comes from elsewhere must mean the same everywhere.
    """
    if name in ("", ".", "..") or any(unicodedata.category(c) in ("Cc", "Cs") for c in name):
        return False
    if name[-1] in " ." or name.split(".")[0].rstrip().lower() in _RESERVED:
        return False
    return os.name != "nt" or not set(name) & set('<>:"|?*\\')


def room(folder: Path) -> int:
    """Bytes that may be written where a folder is or is to be made; the last of a disk are not among them."""
    there = next(place for place in (folder, *folder.parents) if place.exists())
    usage = shutil.disk_usage(there)
    return max(0, usage.free - min(_MARGIN_BYTES, int(usage.total * _MARGIN)))


def is_bomb(unpacked: int, packed: int) -> bool:
    """Whether a zip of so many bytes announces more than any of ours could hold."""
    return unpacked > _BOMB_BYTES and unpacked > _BOMB_TIMES * packed


def copied(source: Path, target: Path) -> None:
    """Copy a file, byte for byte, in one piece."""
    with written(target) as beside:
        shutil.copyfile(source, beside)


def size_text(size: float) -> str:
    """A number of bytes as people read it: "5 bytes", "740 KB", "5.9 MB", "12 GB"."""
    for scale, unit in _UNITS:
        value = size / scale
        if value >= 0.9995:
            # From here on the next smaller unit would be rounded up to 1000.
            return f"{value:.1f} {unit}" if value < 9.95 else f"{value:.0f} {unit}"
    return "1 byte" if round(size) == 1 else f"{size:.0f} bytes"


def is_full(error: OSError) -> bool:
    """Whether a write failed for want of room, on the disk or in somebody's share of it."""
    return error.errno in _FULL


def free_bytes(folder: Path) -> int | None:
    """Bytes free where a folder is or will be; None where the system does not tell."""
    while not folder.exists() and folder != folder.parent:
        folder = folder.parent
    try:
        return shutil.disk_usage(folder).free
    except OSError:
        return None
