"""Removed takes: moved aside into the project's trash, and back again."""

from __future__ import annotations

from contextlib import suppress
from itertools import count
from pathlib import Path

from studio.take import safe_file
from studio.take.take import Take


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
        raise safe_file.cannot_write(take.folder, error) from error


def bring_back(names: set[str], trash: Path, takes_folder: Path) -> bool:
    """Move takes of these names back where they are in the trash; whether there were any."""
    found = [trash / name for name in names if (trash / name).is_dir()]
    for folder in found:
        with suppress(OSError):
            folder.rename(takes_folder / folder.name)
    return bool(found)
