"""Removed takes and runs: moved aside into the project's trash, and back again."""

from __future__ import annotations

import shutil
from contextlib import suppress
from itertools import count
from pathlib import Path

from studio.files import atomic
from studio.project.run import new_run_folder
from studio.take.folder import TRASH_FOLDER
from studio.take.take import Take

FOLDER = "runs"
MOST_KEPT = 10
"""Runs weigh megabytes each: the trash keeps the newest."""


def put_run_away(run: Path) -> Path:
    """Move a run's folder into the trash of its project; gives where it lies now.

    Raises:
        StudioError: it cannot be moved.
    """
    trash = run.parent.parent / TRASH_FOLDER / FOLDER
    names = (trash / (run.name if number == 1 else f"{run.name}.{number}") for number in count(1))
    target = next(path for path in names if not path.exists())
    try:
        trash.mkdir(parents=True, exist_ok=True)
        run.rename(target)
        # When it was removed, for `thin_out`.
        target.touch()
    except OSError as error:
        raise atomic.cannot_write(run, error) from error
    return target


def bring_run_back(kept: Path, runs: Path) -> Path:
    """Move a run out of the trash among the runs; under a new number where its own is taken by now.

    Raises:
        StudioError: it cannot be moved.
    """
    name = kept.name.partition(".")[0]
    target = runs / name
    try:
        if target.exists():
            target = new_run_folder(runs, name.rpartition("_")[0] or name)
            target.rmdir()
        kept.rename(target)
    except OSError as error:
        raise atomic.cannot_write(target, error) from error
    return target


def thin_out(project: Path, most: int = MOST_KEPT) -> None:
    """Remove all but the newest runs of a project's trash; takes there are left alone."""
    trash = project / TRASH_FOLDER / FOLDER
    try:
        kept = sorted(trash.iterdir(), key=lambda path: path.stat().st_mtime, reverse=True)
    except OSError:
        return
    for old in kept[most:]:
        shutil.rmtree(old, ignore_errors=True)


def put_away(take: Take, trash: Path) -> None:
    """Move a take to the trash under its own name; an older one of that name makes room.

    Raises:
        StudioError: it cannot be moved.
    """
    target = trash / take.id
    try:
        trash.mkdir(exist_ok=True)
        if target.exists():
            numbers = (trash / f"{take.id}.{number}" for number in count(2))
            target.rename(next(path for path in numbers if not path.exists()))
        take.folder.rename(target)
    except OSError as error:
        raise atomic.cannot_write(take.folder, error) from error


def bring_back(names: set[str], trash: Path, takes_folder: Path) -> bool:
    """Move takes of these names back where they are in the trash; whether there were any."""
    found = [trash / name for name in names if (trash / name).is_dir()]
    for folder in found:
        with suppress(OSError):
            folder.rename(takes_folder / folder.name)
    return bool(found)
