"""Takes of what a program that was killed left behind."""

from __future__ import annotations

import logging
import shutil
from pathlib import Path

from studio.capture import journal, roll
from studio.errors import StudioError
from studio.take.safe_file import cannot_write
from studio.take.take import Take

_log = logging.getLogger(__name__)


def recover(takes_folder: Path) -> tuple[Take, ...]:
    """Make takes of what a program that was killed left; journals still being written are let be.

    Returns:
        The takes, each with a note that says so. Folders that hold nothing are removed.

    Raises:
        StudioError: takes were left but none could be written (disk full); their journals stay.
    """
    found: list[Take] = []
    failed: StudioError | None = None
    for folder in sorted(takes_folder.iterdir()) if takes_folder.is_dir() else ():
        try:
            take = _recovered(folder)
        except StudioError as error:
            _log.warning("%s was not recovered: %s", folder, error)
            failed = error
        else:
            found += [take] if take is not None else []
    if failed is not None and not found:
        raise failed
    return tuple(found)


def _recovered(folder: Path) -> Take | None:
    """The take of one folder, None where there is nothing to recover or nothing may be touched."""
    try:
        if not folder.is_dir() or not journal.abandoned(folder):
            return None
        if roll.is_take(folder):
            roll.forget(folder)
            return None
        if not roll.holds_anything(folder):
            shutil.rmtree(folder, ignore_errors=True)
            return None
    except OSError as error:
        raise cannot_write(folder, error) from error
    return roll.complete(folder, "The studio ended while this was recorded; it was recovered.")
