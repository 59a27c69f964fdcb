"""A project as one zip file: everything in it but what can be computed again, opened anywhere else."""

from __future__ import annotations

import shutil
import zipfile
from pathlib import Path, PurePosixPath, PureWindowsPath
from uuid import uuid4

from studio.errors import RequestError
from studio.project import PROJECT_FILE, is_project
from studio.take import safe_file

_OTHER = "Choose a zip that Saia Studio packed."


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
        raise RequestError(f"There is no project at {project}.", "Choose a project's folder.")
    if target.resolve().is_relative_to(project.resolve()):
        raise RequestError(f"{target.name} would lie inside the project.", "Choose a place outside of it.")
    with (
        safe_file.written(target) as beside,
        zipfile.ZipFile(beside, "w", zipfile.ZIP_DEFLATED, compresslevel=1, strict_timestamps=False) as file,
    ):
        for path in sorted(project.rglob("*")):
            inside = path.relative_to(project)
            if path.is_file() and not path.is_symlink() and not any(p.startswith(".") for p in inside.parts):
                file.write(path, inside.as_posix())
    return target


def unpack(source: Path, folder: Path) -> Path:
    """Make a project folder of a packed project; nothing is left behind where that fails.

    Args:
        source: the zip.
        folder: where the project goes; must be missing or empty.

    Raises:
        RequestError: the folder holds something, or the zip is missing, damaged, not a project, or has paths
            that lead out of it.
        StudioError: the folder cannot be written.
    """
    folder = folder.absolute()
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise RequestError(f"{folder.name} is not an empty folder.", "Choose an empty or a new folder.")
    beside = folder.with_name(f".{folder.name}.{uuid4().hex[:8]}.new")
    try:
        with zipfile.ZipFile(source) as file:
            members = _members(file, source, _room(folder))
            beside.mkdir(parents=True)
            for member in members:
                target = beside.joinpath(*PurePosixPath(member.filename).parts)
                target.parent.mkdir(parents=True, exist_ok=True)
                with file.open(member) as packed, target.open("wb") as plain:
                    shutil.copyfileobj(packed, plain, 1 << 20)
        if folder.exists():
            folder.rmdir()
        beside.rename(folder)
    except FileNotFoundError as error:
        if source.exists():
            raise safe_file.cannot_write(folder, error) from error
        raise RequestError(f"There is no file at {source}.", "Check how the path is written.") from error
    except safe_file.UNREADABLE_ZIP as error:
        raise RequestError(f"{source.name} is damaged or no zip.", _OTHER) from error
    except OSError as error:
        raise safe_file.cannot_write(folder, error) from error
    finally:
        shutil.rmtree(beside, ignore_errors=True)
    return folder


def _room(folder: Path) -> int:
    """Bytes free where a folder is to be made; of a file no more is unpacked than the zip announces."""
    there = next(place for place in (folder, *folder.parents) if place.exists())
    return shutil.disk_usage(there).free


def _members(file: zipfile.ZipFile, source: Path, room: int) -> list[zipfile.ZipInfo]:
    """The files in it; RequestError unless they are a project's, lie inside of it, and fit into the room."""
    members = [member for member in file.infolist() if not member.is_dir()]
    for member in members:
        plain, windows = PurePosixPath(member.filename), PureWindowsPath(member.filename)
        if plain.is_absolute() or windows.drive or windows.root or ".." in windows.parts or not plain.parts:
            raise RequestError(f"{source.name} holds a path that leads out of the project.", _OTHER)
    if PROJECT_FILE not in {member.filename for member in members}:
        raise RequestError(f"There is no project in {source.name}.", _OTHER)
    if (needed := sum(member.file_size for member in members)) > room:
        what = f"{source.name} needs {needed / 1e9:.1f} GB, and there is room for {room / 1e9:.1f} GB."
        raise RequestError(what, "Make room, or choose a folder on another disk.")
    return members
