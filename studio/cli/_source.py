"""What a command reads: looked at before the work begins."""

from __future__ import annotations

from pathlib import Path

from studio.cli._run import as_request
from studio.errors import RequestError


def check_sound(path: Path) -> None:
    """Whether there is sound in a file.

    Raises:
        RequestError: it is missing, a folder, or holds no sound.
    """
    from studio.take.sound import sound_info

    if path.is_dir():
        raise RequestError(f"{path} is a folder.", "Name a sound file.")
    if not path.exists():
        raise RequestError(f"There is no sound file at {path}.", "Check how the path is written.")
    with as_request():
        sound_info(path)
