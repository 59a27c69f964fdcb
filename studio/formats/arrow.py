"""The studio's own motion file, as in a take: everything, exactly."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from studio.errors import say
from studio.formats import Imported
from studio.formats._table import check_suffix, sanitized_note
from studio.formats._writing import checked
from studio.formats.saia_csv import find_audio
from studio.motion import Motion
from studio.motion.sanitize import sanitized
from studio.take.motion_file import put_motion, read_motion

TITLE = "Saia motion (Apache Arrow)"
SUFFIX = ".arrow"
NOTE = "Everything, lossless; opens in Python, R and other tools that read Apache Arrow."


def read(path: Path, audio: Path | None = None) -> Imported:
    """A motion file and the sound of the same name beside it."""
    motion, bad = sanitized(read_motion(path))
    audio = audio or find_audio(path)
    notes: list[str] = [] if audio else [say("No sound was found for {name}.", name=path.stem)]
    if bad:
        notes.append(sanitized_note(path, bad))
    return Imported(path.stem, motion, audio, tuple(notes))


def write(path: Path, motion: Motion, audio: Path | None = None) -> tuple[Path, ...]:
    """Write a motion file; the sound is not part of it."""
    check_suffix(path, SUFFIX)
    return checked(
        path, lambda beside: put_motion(beside, motion), lambda beside: _alike(read_motion(beside), motion)
    )


def _alike(back: Motion, motion: Motion) -> bool:
    pairs = (
        (back.times, motion.times), (back.shapes, motion.shapes), (back.positions, motion.positions),
        (back.rotations, motion.rotations), (back.root_position, motion.root_position),
        (back.root_rotation, motion.root_rotation),
    )  # fmt: skip
    names = (back.shape_names, back.bone_names) == (motion.shape_names, motion.bone_names)
    return names and all(np.array_equal(got, expected) for got, expected in pairs)
