"""A still picture of one moment, with or without the room behind the figure."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from studio.errors import RequestError, say
from studio.formats._table import check_suffix
from studio.formats._writing import checked, painter_of
from studio.motion import Motion
from studio.render.drawing import FINEST, Drawing

TITLE = "Still picture"
SUFFIX = ".png"
NOTE = "One moment as a picture, without motion or sound."
DRAWS = True


def write(
    path: Path, motion: Motion, audio: Path | None = None, drawing: Drawing | None = None
) -> tuple[Path, ...]:
    """Draw one moment of a motion.

    Args:
        path: where to.
        motion: what is drawn.
        audio: no part of it.
        drawing: how, and which moment.

    Returns:
        The file, read back and compared point by point.
    """
    from PIL import Image

    check_suffix(path, SUFFIX)
    drawing = drawing or Drawing()
    if not len(motion):
        raise RequestError(
            say("There is no motion to draw for {name}.", name=path.name), "Choose a take with motion."
        )
    first, last = float(motion.times[0]), float(motion.times[-1])
    at = (first + last) / 2 if drawing.at is None else min(max(drawing.at, first), last)
    with painter_of(motion, drawing, FINEST) as painter:
        picture = painter.picture(at)
    if not drawing.background.is_clear:
        picture = np.ascontiguousarray(picture[..., :3])

    def fits(beside: Path) -> bool:
        with Image.open(beside) as back:
            return np.array_equal(np.asarray(back), picture)

    files = checked(path, lambda beside: Image.fromarray(picture).save(beside, format="PNG"), fits)
    drawing.on_progress(1.0)
    return files
