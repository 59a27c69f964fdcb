"""Faces of a video as they were tracked, in blocks that survive a break."""

from __future__ import annotations

import hashlib
import shutil
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.errors import StudioError
from studio.files import atomic, cache
from studio.motion.channels import ARKIT_SHAPES
from studio.tracking.landmarker import Face
from studio.tracking.pictures import PictureFacts

_VERSION = 3
_S = len(ARKIT_SHAPES)
_WIDTH = _S + 4 + 2 + 1 + 7
BLOCK = 600
"""Pictures of a block: what a break costs at most."""
_MOST_BYTES = 500e6


@dataclass(frozen=True, eq=False)
class RawFaces:
    """Pictures of a video: a row for each face, or one of zeros where none was seen.

    Args:
        times: when they are shown, seconds of the file, float64 (T,); rows of one picture share theirs.
        values: weights, the head's turn, the face's middle, how red its lips are, then light, sharpness,
            size, how many faces, and whether the face was seen, a cut lies before, the picture is the one
            before; float32 (T, 66).
    """

    times: NDArray[np.float64]
    values: NDArray[np.float32]

    @property
    def weights(self) -> NDArray[np.float32]:
        """ARKit's, (T, 52)."""
        return self.values[:, :_S]

    @property
    def turns(self) -> NDArray[np.float32]:
        """Of the head, (T, 4)."""
        return self.values[:, _S : _S + 4]

    @property
    def places(self) -> NDArray[np.float32]:
        """Middle and size of the faces, pixels, (T, 3)."""
        return self.values[:, [_S + 4, _S + 5, -5]]

    @property
    def redness(self) -> NDArray[np.float32]:
        """Of the lips, as mouth.redness has it, NaN where nothing is told of, (T,)."""
        return self.values[:, _S + 6]

    @property
    def light(self) -> NDArray[np.float32]:
        """Brightness of the face, 0..255, (T,)."""
        return self.values[:, -7]

    @property
    def sharpness(self) -> NDArray[np.float32]:
        """As PictureFacts has it, (T,)."""
        return self.values[:, -6]

    @property
    def size(self) -> NDArray[np.float32]:
        """Of the face, pixels, (T,)."""
        return self.values[:, -5]

    @property
    def faces(self) -> NDArray[np.float32]:
        """How many were seen, (T,)."""
        return self.values[:, -4]

    @property
    def seen(self) -> NDArray[np.bool_]:
        """Whether the face was, (T,)."""
        return np.asarray(self.values[:, -3] > 0)

    @property
    def cuts(self) -> NDArray[np.bool_]:
        """Whether a cut lies right before a frame, (T,)."""
        return np.asarray(self.values[:, -2] > 0)

    @property
    def same(self) -> NDArray[np.bool_]:
        """Whether a picture is the very one before, (T,)."""
        return np.asarray(self.values[:, -1] > 0)

    def only(self, rows: NDArray[np.intp], there: NDArray[np.bool_]) -> RawFaces:
        """Some of the rows, rising; where the face is not `there`, of their pictures only.

        What they are taken of is used up.
        """
        # Of one face a picture all rows stay: hours of them are not copied.
        values = self.values if len(rows) == len(self.values) else self.values[rows]
        values[~there, : _S + 7] = 0.0
        values[~there, -6:-4] = 0.0
        values[~there, -3] = 0.0
        return RawFaces(self.times[rows], values)


def row_of(
    face: Face | None, turn: NDArray[np.floating], facts: PictureFacts, faces: int, cut: bool, same: bool
) -> NDArray[np.float32]:
    """One face of a picture as a row of RawFaces.values; None is a picture without one."""
    row = np.zeros(_WIDTH, dtype=np.float32)
    if face is not None:
        row[:_S], row[_S : _S + 4], row[_S + 4 : _S + 6] = face.weights, turn, face.centre
        row[_S + 6] = facts.redness
    row[-7:] = facts.light, facts.sharpness, facts.size, faces, face is not None, cut, same
    return row


def joined(blocks: list[RawFaces]) -> RawFaces:
    """Blocks one after another, which are taken out of their list; none make no frames."""
    count = sum(len(block.times) for block in blocks)
    times, values = np.empty(count), np.empty((count, _WIDTH), np.float32)
    at = 0
    while blocks:
        # One by one, so that hours of them are not here twice.
        block = blocks.pop(0)
        end = at + len(block.times)
        times[at:end], values[at:end] = block.times, block.values
        at = end
    return RawFaces(times, values)


class BlockStore:
    """Blocks of one video on the disk, until it is imported: hours of tracking survive a break.

    Args:
        video: the file; blocks of another content are not found.
        how: whatever changes what is tracked.
    """

    def __init__(self, video: Path, how: object) -> None:
        from platformdirs import user_cache_path

        name = hashlib.blake2b(f"{_VERSION} {cache.fingerprint(video)} {how}".encode(), digest_size=8)
        home = user_cache_path("saia-studio", appauthor=False) / "videos"
        self._folder = home / name.hexdigest()
        cache.trim(home, _MOST_BYTES)

    def load(self) -> list[RawFaces]:
        """The blocks that are whole, from the first one on."""
        found: list[RawFaces] = []
        while arrays := cache.read_arrays(self._path(len(found))):
            times, values = arrays.get("times"), arrays.get("values")
            if times is None or values is None or values.shape != (len(times), _WIDTH):
                break
            found.append(RawFaces(times, values))
        return found

    def save(self, number: int, block: RawFaces) -> None:
        """Keep a block; a full disk costs only what a break would."""
        try:
            with atomic.written(self._path(number)) as beside, beside.open("wb") as file:
                np.savez(file, times=block.times, values=block.values)
        except (OSError, StudioError):
            return

    def discard(self) -> None:
        """The video is imported."""
        shutil.rmtree(self._folder, ignore_errors=True)

    def _path(self, number: int) -> Path:
        return self._folder / f"{number:05}.npz"
