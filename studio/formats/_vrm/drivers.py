"""What a person has said of the blend shapes that move an avatar's faces: a small file beside its own.

Where an avatar is copied to, this goes along; without it, faces are found by their names.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from studio.errors import StudioError
from studio.files import atomic

SUFFIX = ".faces.json"
UNREADABLE = "What you chose for its faces cannot be read; they move by their names."
_VERSION = 1
_MOST, _LONGEST = 2000, 200


def place(avatar: Path) -> Path:
    """Where it lies for an avatar's file."""
    return avatar.with_name(avatar.name + SUFFIX)


def read(avatar: Path) -> dict[str, str] | None:
    """The blend shape by the name of each expression, "" for none; None where it is damaged or newer."""
    try:
        return _kept(place(avatar))
    except (OSError, StudioError):
        return None


def _kept(path: Path) -> dict[str, str]:
    """What a file of them says; NewerVersionError or StudioError where it says nothing to us."""
    if not path.is_file():
        return {}
    content = atomic.read_json(path)
    atomic.check_version(path, content, _VERSION)
    found = content.get("drivers")
    if not isinstance(found, dict) or len(found) > _MOST:
        raise atomic.damaged(path)
    return {str(name): str(driver)[:_LONGEST] for name, driver in found.items()}


def write(avatar: Path, drivers: Mapping[str, str]) -> None:
    """Keep it; nothing is left of it where there is nothing to say, and a damaged file is set aside.

    Raises:
        NewerVersionError: a newer studio wrote the file, which stays as it is.
        StudioError: the folder cannot be written.
    """
    path = place(avatar)
    try:
        try:
            _kept(path)
        except atomic.NewerVersionError:
            raise
        except StudioError:
            atomic.set_aside(path)
        if drivers:
            atomic.write_json(path, {"version": _VERSION, "drivers": dict(drivers)})
        else:
            path.unlink(missing_ok=True)
    except OSError as error:
        raise atomic.cannot_write(path, error) from error
