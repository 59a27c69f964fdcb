"""Avatars of a project: copies of .vrm files in its folder, and which of them is worn."""

from __future__ import annotations

import filecmp
from pathlib import Path

from studio.errors import StudioError
from studio.files import atomic
from studio.paths import resource

FOLDER = "avatars"
OWN = resource("avatar", "Saia.vrm")
"""The studio's own avatar, worn until another or none is chosen; it is copied only to be changed."""
SUFFIX = ".vrm"
_CHOICE = "chosen.json"
_VERSION = 1


def kept(project: Path) -> tuple[Path, ...]:
    """The avatars in a project's folder, by name."""
    try:
        found = [path for path in (project / FOLDER).iterdir() if path.suffix.lower() == SUFFIX]
        return tuple(sorted(path for path in found if path.is_file() and not path.name.startswith(".")))
    except OSError:
        # There is none, or it may not be read.
        return ()


def chosen(project: Path) -> Path | None:
    """The avatar that is worn in a project; None for the stick figure, and where the file is gone."""
    try:
        record = atomic.read_json(project / FOLDER / _CHOICE)
    except (OSError, StudioError):
        return OWN
    if "avatar" not in record:
        return OWN
    name = record["avatar"]
    return next((path for path in kept(project) if path.name == name), None)


def choose(project: Path, avatar: Path | None) -> None:
    """Remember which of its avatars a project wears; None for the stick figure.

    Raises:
        StudioError: the folder cannot be written.
    """
    # The name alone: a project has no paths that end when it is moved.
    choice = {} if avatar == OWN else {"avatar": avatar.name if avatar is not None else None}
    atomic.write_json(project / FOLDER / _CHOICE, {"version": _VERSION, **choice})


def offered(project: Path) -> tuple[Path, ...]:
    """The studio's own avatar and the project's; the project's copy of the own one takes its place."""
    found = kept(project)
    copies = [
        path for path in found if path.stem.startswith(OWN.stem) and filecmp.cmp(path, OWN, shallow=False)
    ]
    return found if copies else (OWN, *found)


def adopt(project: Path, source: Path, changed: bool = False) -> Path:
    """Copy an avatar into a project, which can then go elsewhere; one that is there is not copied twice.

    Args:
        project: its folder.
        source: the avatar's file.
        changed: something is to be kept beside it: the studio's own one is copied only then.

    Returns:
        The copy.

    Raises:
        StudioError: it cannot be read, or the folder cannot be written.
    """
    stem, number = atomic.safe_name(source.stem), 1
    # Chosen again from the project's own folder, it stays the one file.
    if (source == OWN and not changed) or source.parent == project / FOLDER:
        return source
    while (target := project / FOLDER / f"{stem}{'' if number == 1 else f' {number}'}{SUFFIX}").exists():
        # Compared by content: avatars of one name come in many versions.
        if filecmp.cmp(source, target, shallow=False):
            return target
        number += 1
    atomic.copied(source, target)
    return target
