"""Files that are written beside, read back, and only then given their name."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from studio.errors import StudioError
from studio.take import safe_file

_UNREADABLE = (
    StudioError, OSError, LookupError, TypeError, AttributeError, struct.error, *safe_file.UNREADABLE_ZIP
)  # fmt: skip
"""What reading raises of a file that the disk did not keep as it was written."""


def checked(path: Path, put: Callable[[Path], object], fits: Callable[[Path], bool]) -> tuple[Path, ...]:
    """Write a file, and let it take its name once it reads back as it was meant.

    Args:
        path: where to.
        put: writes to the path it is given.
        fits: whether what lies there is what was to be written.

    Raises:
        StudioError: it could not be written, or reads otherwise; a file that was there is untouched.
    """
    with safe_file.written(path) as beside:
        put(beside)
        with reading_back(path.name):
            if not fits(beside):
                raise not_read_back(path.name)
    return (path,)


@contextmanager
def reading_back(name: str) -> Iterator[None]:
    """Within it a file that cannot be read is one that did not keep what was written."""
    try:
        yield
    except _UNREADABLE as error:
        raise not_read_back(name) from error


def not_read_back(name: str) -> StudioError:
    """What to say of a file that reads otherwise than it was written."""
    return StudioError(f"{name} did not read back as it was written.", "Export it again to another disk.")
