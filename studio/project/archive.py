"""A project as one zip file: everything in it but what can be computed again, opened anywhere else."""

from __future__ import annotations

import errno
import io
import os
import shutil
import stat
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path, PurePosixPath, PureWindowsPath

from studio.errors import RequestError, StudioError, say
from studio.files import atomic, leftovers
from studio.files.atomic import size_text
from studio.project import PROJECT_FILE, is_project
from studio.project.contents import is_known

_OTHER = "Choose a zip that Saia Studio packed."
MOST_FILES = 50_000
_LONGEST_LISTING = 16 << 20
"""Bytes of a zip's list of files: it is read whole before anybody can count what is in it."""
_LONGEST_NAME = 255
"""Bytes of a file's name; letters on Windows."""
_BLOCK = 4096
"""Bytes of the disk that even the smallest file takes."""


@dataclass(frozen=True)
class Unpacked:
    """Result of unpacking.

    Args:
        folder: the project.
        left_out: how many files of the zip are none that a project is made of.
    """

    folder: Path
    left_out: int = 0


def pack(project: Path, target: Path) -> Path:
    """Write a project's files into a zip; hidden files (caches, the trash, the lock) stay behind.

    Args:
        project: the project's folder.
        target: the zip, replaced in one piece; must not lie in the project.

    Raises:
        RequestError: there is no project, or the zip would lie inside it.
        StudioError: it cannot be written or a file cannot be read.
    """
    project, target = project.absolute(), target.absolute()
    if not is_project(project):
        raise RequestError(
            say("There is no project at {project}.", project=project), "Choose a project's folder."
        )
    if target.resolve().is_relative_to(project.resolve()):
        raise RequestError(
            say("{target} would lie inside the project.", target=target.name), "Choose a place outside of it."
        )
    with (
        # Fast rather than small: a project is mostly sound, of which little can be packed away.
        atomic.written(target) as beside,
        zipfile.ZipFile(beside, "w", zipfile.ZIP_DEFLATED, compresslevel=1, strict_timestamps=False) as file,
    ):
        for path in sorted(project.rglob("*")):
            inside = path.relative_to(project)
            # A link may lead to anything on this computer, which is not to travel.
            if path.is_file() and not path.is_symlink() and not any(p.startswith(".") for p in inside.parts):
                file.write(path, inside.as_posix())
    return target


def unpack(source: Path, folder: Path) -> Unpacked:
    """Make a project folder of a packed project; nothing is left behind where that fails.

    Only what a project is made of is written, whatever else the zip holds.

    Args:
        source: the zip.
        folder: where the project goes; must be missing or empty.

    Raises:
        RequestError: the folder holds something, or the zip is missing, damaged, not a project, made to fill
            the disk, or has paths that lead out of it.
        StudioError: the folder cannot be written.
    """
    folder = folder.absolute()
    # Never into a folder with files: unpacking must not mix with a person's own.
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise RequestError(
            say("{folder} is not an empty folder.", folder=folder.name), "Choose an empty or a new folder."
        )
    packed = open_packed(source)
    try:
        with packed, zipfile.ZipFile(packed) as file:
            members, left_out = _members(file, source, atomic.room(folder))
            with _in_one_piece(folder) as beside:
                for member in members:
                    _write(file, member, beside, source)
    except atomic.UNREADABLE_ZIP as error:
        raise RequestError(say("{name} is damaged or no zip.", name=source.name), _OTHER) from error
    except OSError as error:
        raise atomic.cannot_write(folder, error) from error
    return Unpacked(folder, left_out)


class _NoSuchPlaceError(zipfile.BadZipFile, OSError):
    """Both, since zipfile itself looks behind a file's beginning and then goes on."""


class PackedFile(io.BufferedReader):
    """A zip of which no more is read at once than a sound one asks for; what fails is its own fault."""

    def read(self, size: int | None = -1, /) -> bytes:
        """Bytes; BadZipFile where more are asked for than any list has, RequestError on a disk fault."""
        if size is not None and size > _LONGEST_LISTING:
            raise zipfile.BadZipFile("its list of files is too long")
        try:
            return super().read(size)
        except OSError as error:
            raise _unreadable(Path(self.raw.name), error) from error  # type: ignore[attr-defined]

    def seek(self, target: int, whence: int = io.SEEK_SET, /) -> int:
        """Go to a place; BadZipFile where there is none."""
        try:
            return super().seek(target, whence)
        except OSError as error:
            # A place before the beginning, or behind what any file can have.
            raise _NoSuchPlaceError(*error.args) from error


def open_packed(source: Path) -> PackedFile:
    """A zip from elsewhere, for zipfile to read.

    Raises:
        RequestError: it is missing or cannot be read.
    """
    try:
        return PackedFile(source.open("rb", buffering=0))
    except FileNotFoundError as error:
        raise RequestError(
            say("There is no file at {source}.", source=source), "Check how the path is written."
        ) from error
    except OSError as error:
        raise _unreadable(source, error) from error


@contextmanager
def _in_one_piece(folder: Path) -> Iterator[Path]:
    """A hidden folder that takes the place of a missing or empty one when the block ends well."""
    made = [parent for parent in folder.parents if not parent.exists()]
    beside = leftovers.beside(folder)
    try:
        beside.mkdir(parents=True)
        yield beside
        if folder.exists():
            folder.rmdir()
        beside.rename(folder)
    except BaseException:
        shutil.rmtree(beside, ignore_errors=True)
        for parent in made:
            with suppress(OSError):
                parent.rmdir()
        raise


def _members(file: zipfile.ZipFile, source: Path, room: int) -> tuple[list[zipfile.ZipInfo], int]:
    """What of a zip a project is made of, and how many files that leaves out.

    RequestError unless they are a project's, lie inside of it, and fit into the room. Nothing is written yet.
    """
    listed = [member for member in file.infolist() if not member.is_dir()]
    # Before any loop over them: a list of names must not keep anybody waiting.
    if len(file.infolist()) > MOST_FILES:
        raise RequestError(
            say("{name} holds more than {most} files.", name=source.name, most=f"{MOST_FILES:,}"),
            _OTHER,
        )
    for member in listed:
        plain, windows = PurePosixPath(member.filename), PureWindowsPath(member.filename)
        if plain.is_absolute() or windows.drive or windows.root or ".." in windows.parts or not plain.parts:
            raise RequestError(
                say("{name} contains a path that leads outside the project.", name=source.name), _OTHER
            )
    members = [member for member in listed if _is_plain(member) and is_known(PurePosixPath(member.filename))]
    if PROJECT_FILE not in {member.filename for member in members}:
        raise RequestError(say("There is no project in {name}.", name=source.name), _OTHER)
    _must_not_clash(members, source)
    needed = sum(member.file_size for member in members)
    # By what it announces, before a byte is unpacked.
    if atomic.is_bomb(needed, source.stat().st_size):
        raise RequestError(say("{name} is made to fill the disk.", name=source.name), _OTHER)
    if needed > room - len(members) * _BLOCK:
        what = say(
            "{name} needs {needed}, and there is room for {room}.",
            name=source.name,
            needed=size_text(needed),
            room=size_text(room),
        )
        raise RequestError(what, "Free some space, or choose a folder on another disk.")
    return members, len(listed) - len(members)


def _is_plain(member: zipfile.ZipInfo) -> bool:
    """Whether an entry is a file with a name that every system can have; no link, no device."""
    kind = stat.S_IFMT(member.external_attr >> 16)
    return kind in (0, stat.S_IFREG) and all(map(atomic.is_possible_name, member.orig_filename.split("/")))


def _must_not_clash(members: list[zipfile.ZipInfo], source: Path) -> None:
    """RequestError where two entries cannot both be written, or one has too long a name."""
    names = [str(PurePosixPath(member.filename)) for member in members]
    seen = set(names)
    if len(seen) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise RequestError(say("{name} holds {twice} twice.", name=source.name, twice=twice), _OTHER)
    for name in names:
        if both := seen.intersection(map(str, PurePosixPath(name).parents)):
            raise RequestError(
                say("In {name}, {both} is both a file and a folder.", name=source.name, both=both.pop()),
                _OTHER,
            )
        if any(_length(part) > _LONGEST_NAME for part in name.split("/")):
            raise _too_long(source, name)


def _write(file: zipfile.ZipFile, member: zipfile.ZipInfo, folder: Path, source: Path) -> None:
    """One entry into the folder; RequestError where this disk cannot hold it beside the others."""
    target = folder / PurePosixPath(member.filename)
    if member.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        raise NotImplementedError("others may ask for any amount of memory")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        plain = target.open("xb")
    except (FileExistsError, NotADirectoryError) as error:
        # Names that differ in upper and lower case alone.
        what = say(
            "{name} holds two files that this disk takes for one: {file}.",
            name=source.name,
            file=member.filename,
        )
        raise RequestError(what, "Unpack it where it was packed, and rename one of them.") from error
    except OSError as error:
        if error.errno in (errno.ENAMETOOLONG, errno.ENOENT, errno.EINVAL):
            raise _too_long(source, member.filename) from error
        raise
    with plain, file.open(member) as packed:
        shutil.copyfileobj(packed, plain, 1 << 20)


def _unreadable(source: Path, error: OSError) -> RequestError:
    what = say(
        "{name} cannot be read: {reason}.", name=source.name, reason=error.strerror or type(error).__name__
    )
    return RequestError(what, "Choose another file, or allow reading it.")


def _length(name: str) -> int:
    """Of a file's name, as this system counts."""
    return len(name) if os.name == "nt" else len(os.fsencode(name))


def _too_long(source: Path, name: str) -> StudioError:
    shown = name if len(name) <= 60 else f"{name[:60]}..."
    remedy = (
        "Choose a folder nearer to the top of the disk, or give the file a shorter name and pack it again."
    )
    return RequestError(
        say("{name} holds a name that is too long for this disk: {shown}.", name=source.name, shown=shown),
        remedy,
    )
