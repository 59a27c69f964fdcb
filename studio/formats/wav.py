"""Plain sound: a take without motion, for generating from or for testing on."""

from __future__ import annotations

from pathlib import Path

from studio.errors import StudioError, say
from studio.formats import Imported, _writing
from studio.formats._table import check_suffix
from studio.formats._writing import checked
from studio.motion import Motion
from studio.sound.sound_file import sound_info

TITLE = "Sound"
SUFFIX = ".wav"
NOTE = "Only the sound; nothing of the motion."


def read(path: Path, audio: Path | None = None) -> Imported:
    """A take without motion from a sound file of any kind.

    Raises:
        StudioError: no sound can be found in it, or it is empty.
    """
    source = audio or path
    info = sound_info(source)
    if info.duration <= 0:
        raise StudioError(say("The sound file {name} is empty.", name=source.name), "Choose another file.")
    return Imported(path.stem, None, source)


def write(path: Path, motion: Motion, audio: Path | None = None) -> tuple[Path, ...]:
    """Write the sound that belongs to a motion: the same bytes where it is a WAV, else decoded to one."""
    check_suffix(path, SUFFIX)
    if audio is None:
        raise StudioError(
            say("There is no sound to write to {name}.", name=path.name), "Choose a take with sound."
        )
    return checked(
        path, lambda beside: _writing.put(beside, audio), lambda beside: _writing.fits(beside, audio)
    )
