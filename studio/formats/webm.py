"""A film with its sound that may be transparent: VP9 and Opus, as editors, OBS and browsers play it."""

from __future__ import annotations

from pathlib import Path

from studio.formats._film import FilmKind, write_film
from studio.motion import Motion
from studio.render.drawing import Drawing

TITLE = "Film, may be transparent"
SUFFIX = ".webm"
NOTE = "A video with sound for editors, OBS and browsers; it can be transparent. It contains no motion data."
DRAWS = True

# The quickest that still looks good: at its best VP9 takes a minute for a second.
_SPEED = {"deadline": "realtime", "cpu-used": "8", "lag-in-frames": "0", "row-mt": "1", "crf": "20", "b": "0"}
KIND = FilmKind(SUFFIX, "webm", (("libvpx-vp9", _SPEED),), "libopus", clear="libvpx-vp9")


def write(
    path: Path, motion: Motion, audio: Path | None = None, drawing: Drawing | None = None
) -> tuple[Path, ...]:
    """Draw and encode a film.

    Args:
        path: where to.
        motion: what is drawn, from 0 on.
        audio: the sound; the film is as long as the longer of the two.
        drawing: how.

    Returns:
        The file, read back: its length, its size, its sound and its first picture, with what shows through.

    Raises:
        StudioError: it cannot be drawn or written; nothing is left of it then.
    """
    return write_film(KIND, path, motion, audio, drawing)
