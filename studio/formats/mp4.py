"""A film of the figure or the avatar with its sound, as every program plays it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from studio.formats._film import Codecs, FilmKind, write_film
from studio.motion import Motion
from studio.render.drawing import Drawing

TITLE = "Film"
SUFFIX = ".mp4"
NOTE = "A video with sound, for watching and sharing. It contains no motion data."
DRAWS = True

CODECS: Codecs = (
    ("libx264", {"preset": "veryfast", "crf": "20"}),
    ("libopenh264", {"b": "6M"}),
    ("mpeg4", {"q:v": "3"}),
)
"""Encoders in the order of our liking; none of them asks for a graphics card."""
# It begins to play before all of it is loaded.
KIND = FilmKind(SUFFIX, "mp4", CODECS, "aac", options={"movflags": "+faststart"})


def write(
    path: Path,
    motion: Motion,
    audio: Path | None = None,
    drawing: Drawing | None = None,
    *,
    codecs: Codecs = CODECS,
) -> tuple[Path, ...]:
    """Draw and encode a film.

    Args:
        path: where to.
        motion: what is drawn, from 0 on.
        audio: the sound; the film is as long as the longer of the two.
        drawing: how.
        codecs: encoders to try, the best first.

    Returns:
        The file, read back: its length, its size, its sound and its first picture.

    Raises:
        StudioError: it cannot be drawn or written; nothing is left of it then.
    """
    return write_film(replace(KIND, codecs=codecs), path, motion, audio, drawing)
