"""Where things computed from a sound are kept, so that they are computed once.

They lie beside the sound and can be deleted at any time; a packed project leaves them out:

    takes/<slate>_<nnn>/.cache/
        spectrum1-<content>.npy         pitches, see spectrogram
        voice1-<content>.npy            where somebody speaks, see voice_activity
        clean1-<way>-<content>.flac     with less noise, see cleaned

<content> changes with the sound. Where the folder cannot be written (a read-only disk), they lie in `sounds`
of the user's own cache.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path

from studio.errors import StudioError
from studio.take import safe_file

FOLDER = ".cache"
_PROBES, _PROBE_BYTES = 16, 4096


def fingerprint(path: Path) -> str:
    """Short text that changes with a file's content: its size and bytes spread over all of it.

    Raises:
        StudioError: the file is missing.
    """
    try:
        stat = path.stat()
        return _fingerprint(path, stat.st_size, stat.st_mtime_ns)
    except OSError as error:
        raise StudioError(
            f"The sound file {path.name} is missing.", f"Put it back at {path.parent}."
        ) from error


@lru_cache(maxsize=512)
def _fingerprint(path: Path, size: int, _changed: int) -> str:
    found = hashlib.blake2b(str(size).encode(), digest_size=8)
    with path.open("rb") as file:
        for i in range(_PROBES):
            file.seek(max(size - _PROBE_BYTES, 0) * i // (_PROBES - 1))
            found.update(file.read(_PROBE_BYTES))
    return found.hexdigest()


def find(sound: Path, name: str) -> Path | None:
    """What is kept for a sound's present content under a name ("voice.npy"), or None."""
    try:
        places = _places(sound, name)
    except StudioError:
        return None
    return next((place for place in places if place.is_file()), None)


@contextmanager
def keeping(sound: Path, name: str) -> Iterator[Path]:
    """A file to write what is to be kept under a name; it is found once the block ends well.

    Raises:
        StudioError: the sound is missing, or neither place can be written.
    """
    beside, elsewhere = _places(sound, name)
    with safe_file.written(beside if _can_write(beside.parent) else elsewhere) as file:
        yield file


def _places(sound: Path, name: str) -> tuple[Path, Path]:
    from platformdirs import user_cache_path

    stem, _, suffix = name.rpartition(".")
    file = f"{stem}-{fingerprint(sound)}.{suffix}"
    return sound.parent / FOLDER / file, user_cache_path("saia-studio", appauthor=False) / "sounds" / file


def _can_write(folder: Path) -> bool:
    try:
        folder.mkdir(exist_ok=True)
        probe = folder / ".probe"
        probe.touch()
        probe.unlink()
    except OSError:
        return False
    return True
