"""A picture for every frame, numbered, in a folder of their own: what editing programs read with alpha."""

from __future__ import annotations

import re
import shutil
from collections import deque
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path

import numpy as np

from studio.errors import RequestError, say
from studio.files import atomic, leftovers
from studio.formats._film import frames_of
from studio.formats._table import check_suffix
from studio.formats._writing import not_read_back, painter_of, reading_back
from studio.motion import Motion
from studio.render.drawing import Drawing, Pixels

TITLE = "PNG sequence"
SUFFIX = ".frames"
NOTE = "A folder with a picture for every frame, for editors; it can be transparent. It has no sound."
DRAWS = True
THREADS, WAITING = 2, 4
"""Threads that write pictures, and pictures drawn ahead of them."""


def targets(path: Path) -> tuple[Path, ...]:
    """The first of the pictures, by which a sequence that is there already is known."""
    return (path / _name(path, 0),)


def write(
    path: Path, motion: Motion, audio: Path | None = None, drawing: Drawing | None = None
) -> tuple[Path, ...]:
    """Draw a picture for every frame.

    Args:
        path: the folder; a sequence that is there already is replaced.
        motion: what is drawn, from 0 on.
        audio: no part of it, but the sequence is as long as the longer of the two.
        drawing: how.

    Returns:
        The pictures, each read back and compared point by point.

    Raises:
        StudioError: they cannot be drawn or written; nothing is left of them then.
    """
    check_suffix(path, SUFFIX)
    drawing = drawing or Drawing()
    fps, count, _ = frames_of(path, motion, audio, drawing)
    _check_folder(path)
    beside = leftovers.beside(path)
    try:
        with painter_of(motion, drawing) as painter, ThreadPoolExecutor(THREADS, "frames") as pool:
            beside.mkdir(parents=True)
            waiting: deque[Future[None]] = deque()
            for number in range(count):
                picture = painter.picture(float(number / fps))
                if not drawing.background.is_clear:
                    picture = np.ascontiguousarray(picture[..., :3])
                waiting.append(pool.submit(_put, beside / _name(path, number), picture))
                while len(waiting) > WAITING:
                    waiting.popleft().result()
                drawing.on_progress(0.99 * (number + 1) / count)
            while waiting:
                waiting.popleft().result()
        _take_place(beside, path)
    except OSError as error:
        raise atomic.cannot_write(path, error) from error
    finally:
        shutil.rmtree(beside, ignore_errors=True)
    drawing.on_progress(1.0)
    return tuple(path / _name(path, number) for number in range(count))


def _name(path: Path, number: int) -> str:
    return f"{path.name.removesuffix(SUFFIX)}_{number + 1:05d}.png"


def _check_folder(path: Path) -> None:
    """Refuse to replace a folder that holds anything but such pictures."""
    if not path.exists():
        return
    known = re.compile(re.escape(path.name.removesuffix(SUFFIX)) + r"_\d{5,}\.png")
    if not path.is_dir() or any(known.fullmatch(one.name) is None for one in path.iterdir()):
        raise RequestError(
            say("{name} holds other files.", name=path.name), "Move them away, or choose another name."
        )


def _put(path: Path, picture: Pixels) -> None:
    """Write one picture and read it back. Runs on a thread of the pool."""
    from PIL import Image

    # Packed quickly: a tenth larger, in a third of the time.
    Image.fromarray(picture).save(path, format="PNG", compress_level=1)
    with reading_back(path.name), Image.open(path) as back:
        if not np.array_equal(np.asarray(back), picture):
            raise not_read_back(path.name)


def _take_place(beside: Path, path: Path) -> None:
    """Give the finished folder its name; the one before goes only then."""
    old = leftovers.beside(path)
    with suppress(FileNotFoundError):
        path.rename(old)
    try:
        beside.rename(path)
    except OSError:
        with suppress(OSError):
            old.rename(path)
        raise
    shutil.rmtree(old, ignore_errors=True)
