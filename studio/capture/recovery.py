"""Crash recovery: takes made from the journals that a killed program left behind."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from studio.capture import journal, journal_contents, journal_format, roll
from studio.errors import StudioError
from studio.files.atomic import cannot_write
from studio.take.take import Take

_RECOVERED = "The studio ended while this was recorded; it was recovered."
_LOCK_FILE = ".recovering"
_WAIT_S, _LOOK_S = 60.0, 0.05
_YOUNG_S = 60.0
"""A recording as young as that may be about to begin, and not have its lock yet."""
_SILENT_S = 3600.0
"""After which no recording goes on that wrote nothing; the clock of a network drive may be off by some."""
_log = logging.getLogger(__name__)


def left_behind(takes_folder: Path) -> tuple[Path, ...]:
    """Folders that are no takes yet: recordings that go on, or were cut short."""
    try:
        return tuple(sorted(path.parent for path in takes_folder.glob(f"*/{journal_format.FILE}")))
    except OSError:  # who opens the project will say what is wrong with its folder
        return ()


def recover(
    takes_folder: Path, on_problem: Callable[[Path, StudioError], object] | None = None
) -> tuple[Take, ...]:
    """Make takes of what a program that was killed left; recordings that still go on are let be.

    Where another program recovers already, it is waited for, so that both see the same takes.

    Args:
        takes_folder: it may be missing.
        on_problem: is contents of each folder that could not be recovered, and why; nothing in it is lost.

    Returns:
        The takes, each with a note that says so. Folders in which nothing was recorded are removed.
    """
    found: list[Take] = []
    if not left_behind(takes_folder):
        return ()
    with _alone(takes_folder):
        for folder in left_behind(takes_folder):
            try:
                take = _recovered(folder)
            except StudioError as error:
                if on_problem:
                    on_problem(folder, error)
                else:
                    _log.warning("%s was not recovered: %s", folder, error)
            else:
                found += [take] if take is not None else []
    return tuple(found)


@contextmanager
def _alone(takes_folder: Path) -> Iterator[None]:
    """Wait until no other program recovers here; where there are no locks, those of the journals must do."""
    path = takes_folder / _LOCK_FILE
    try:
        file = path.open("wb")
    except OSError:  # a folder to read only: why nothing is recovered is contents for each recording
        yield
        return
    with file:
        until = time.monotonic() + _WAIT_S
        while journal.is_busy(file) and time.monotonic() < until:
            time.sleep(_LOOK_S)
        yield
    with suppress(OSError):  # Windows removes no file that another program waits for
        path.unlink()


def _recovered(folder: Path) -> Take | None:
    """The take of one folder, None where there is nothing to recover or nothing may be touched.

    Raises:
        StudioError: it could not be recovered, for whatever reason.
    """
    path = folder / journal_format.FILE
    try:
        with path.open("rb+") as held:
            locked = journal.hold(held)
            changed = path.stat().st_mtime
            # A disk without locks tells by the time alone: what goes on is written to five times a second.
            if not locked and (journal.is_busy(held) or time.time() - changed < _SILENT_S):
                return None  # it goes on, or another program was faster
            contents = journal_contents.read(folder)
            take = roll.standing(folder, contents)
            recovered = roll.save(folder, contents, (_RECOVERED,)) if take is None else None
        if take or recovered:
            roll.put_away(folder, contents)
        elif roll.holds_anything(folder, contents):
            raise roll.set_unreadable_aside(folder)
        elif time.time() - changed > _YOUNG_S:
            roll.remove(folder)
    except FileNotFoundError as error:
        if path.exists():
            raise cannot_write(folder, error) from error
        return None
    except OSError as error:
        raise cannot_write(folder, error) from error
    except StudioError:
        raise
    except Exception as error:  # one odd recording must not keep anybody from the rest of the project
        what = f"Something unexpected happened: {type(error).__name__}: {error}."
        raise StudioError(what, f"It is kept in {folder}; please report this.") from error
    return recovered
