"""What every importer gives."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from studio.formats._table import counted
from studio.motion import Motion


@dataclass(frozen=True, eq=False)
class Imported:
    """A recording read from foreign files.

    Args:
        name: what it is called: the files' base name.
        motion: None without motion.
        audio: the sound file it belongs to, None without.
        notes: what was guessed or mended while reading, one sentence each.
        extra: facts kept as they came.
        joints: (joint, the bone it was taken for or "") where names of joints had to be matched.
        joints_from: the file they stand in; set by who reads many.
        guessed: whether any of that was a guess nobody has confirmed.
    """

    name: str
    motion: Motion | None
    audio: Path | None
    notes: tuple[str, ...] = ()
    extra: dict[str, str] = field(default_factory=dict)
    joints: tuple[tuple[str, str], ...] = ()
    guessed: bool = False
    joints_from: Path | None = None


def sanitized_note(path: Path, frames: int) -> str:
    """What to say of frames whose values could not be."""
    return f"{path.name}: {counted(frames, 'frame')} with values that are no numbers mended or left out."
