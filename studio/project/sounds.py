"""Sounds of a project that are no takes: dropped on Review, copied into it, kept until they are removed."""

from __future__ import annotations

import filecmp
import shutil
from pathlib import Path

from studio.files import atomic
from studio.project import Project
from studio.sound.sound_file import sound_info

FOLDER = "sounds"
"""Dropped sounds are copied here, so that a project that moves takes them along."""
TRASH = ".trash"


def saved_sounds(project: Project) -> tuple[Path, ...]:
    """The sounds of a project, the newest first."""
    folder = project.folder / FOLDER
    try:
        found = [path for path in folder.iterdir() if path.is_file() and not path.name.startswith(".")]
        return tuple(sorted(found, key=lambda path: path.stat().st_mtime_ns, reverse=True))
    except OSError:
        return ()


def add_sound(project: Project, sound: Path) -> Path:
    """Copy a sound into the project; where it is known already, the copy of then.

    A project that may only be looked at gets no copy: its sound is reviewed where it lies.

    Raises:
        StudioError: the file is missing, holds no sound, or the disk is full.
    """
    sound_info(sound)
    folder = project.folder / FOLDER
    if project.read_only or sound.parent == folder:
        return sound
    target, number = folder / sound.name, 1
    try:
        folder.mkdir(exist_ok=True)
        while target.exists():
            if filecmp.cmp(sound, target, shallow=False):
                target.touch()
                return target
            number += 1
            target = folder / f"{sound.stem}_{number}{sound.suffix}"
        with atomic.written(target) as beside:
            shutil.copyfile(sound, beside)
    except OSError as error:
        raise atomic.cannot_write(target, error) from error
    return target


def trash_sound(project: Project, sound: Path) -> Path:
    """Move a kept sound to the project's trash; gives where it lies there.

    Raises:
        StudioError: it cannot be moved.
    """
    trash, number = project.folder / TRASH / FOLDER, 1
    target = trash / sound.name
    try:
        trash.mkdir(parents=True, exist_ok=True)
        while target.exists():
            number += 1
            target = trash / f"{sound.stem}_{number}{sound.suffix}"
        sound.replace(target)
    except OSError as error:
        raise atomic.cannot_write(target, error) from error
    return target


def restore_sound(project: Project, removed: Path, name: str) -> Path:
    """Move a sound out of the trash under its name, or one like it where that is taken by now.

    Raises:
        StudioError: it cannot be moved.
    """
    target, number = project.folder / FOLDER / name, 1
    try:
        while target.exists():
            number += 1
            target = target.with_name(f"{Path(name).stem}_{number}{target.suffix}")
        removed.rename(target)
    except OSError as error:
        raise atomic.cannot_write(target, error) from error
    return target
