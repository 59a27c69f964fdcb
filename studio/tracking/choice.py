"""Which of several faces is the one: chosen once, then followed through the pictures, to both sides."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from studio.tracking.raw import RawFaces

# A face that jumps farther than this many of its sizes is another one's.
_REACH = 1.5
_LONG = 30
"""Pictures without the face after which it is chosen anew."""


@dataclass(frozen=True)
class Place:
    """A face as a person pointed at it in one picture.

    Args:
        t: of the picture, seconds of the file.
        x, y, size: its middle and its size there, pixels.
        rank: how many faces are left of it there.
        faces: how many there are.
    """

    t: float
    x: float
    y: float
    size: float
    rank: int = 0
    faces: int = 1


class FaceChoice:
    """Follows one face from picture to picture.

    Args:
        place: whose, and where it is in the first picture; None is the largest.
    """

    def __init__(self, place: Place | None = None) -> None:
        self._place = place
        self._pointed = None if place is None else np.array([place.x, place.y, place.size])
        self._before = self._pointed
        self._missed = 0

    def pick(self, faces: NDArray[np.floating], cut: bool = False) -> int | None:
        """Which of the faces of this picture it is, None where it is not in it.

        Args:
            faces: middle and size of each, pixels, (K, 3).
            cut: whether one lies between the picture before and this.
        """
        if cut or self._missed > _LONG:
            self._before = None
        found = self._found(faces) if len(faces) else None
        self._missed = self._missed + 1 if found is None else 0
        if found is not None:
            self._before = faces[found]
        return found

    def _found(self, faces: NDArray[np.floating]) -> int | None:
        if self._before is not None:
            return _nearest(faces, self._before)
        if self._place is None or self._pointed is None:
            return int(faces[:, 2].argmax())
        # People keep their seats; a close-up of somebody else is not this person.
        if len(faces) == self._place.faces:
            return int(np.argsort(faces[:, 0])[self._place.rank])
        return _nearest(faces, self._pointed)


def _nearest(faces: NDArray[np.floating], before: NDArray[np.floating]) -> int | None:
    apart = np.hypot(*(faces[:, :2] - before[:2]).T)
    nearest = int(apart.argmin())
    return nearest if apart[nearest] <= _REACH * before[2] else None


def picked(found: RawFaces, place: Place | None) -> RawFaces:
    """One row a picture: the chosen face's, or one that says that it was not seen.

    The face is followed from the picture it was pointed at, on to the end and back to the beginning.

    Args:
        found: all faces, rows of one picture sharing its time.
        place: None is the largest of the first picture with a face.
    """
    times, firsts = np.unique(found.times, return_index=True)
    ends = np.append(firsts[1:], len(found.times))
    cuts = found.cuts[firsts]
    places, seen = found.places, found.seen
    start = 0 if place is None else int(np.abs(times - place.t).argmin()) if len(times) else 0
    onward, back = FaceChoice(place), FaceChoice(place)
    # A cut lies before its picture: going back it is passed on the way to the one before.
    steps = chain(
        ((onward, i, i > start and bool(cuts[i])) for i in range(start, len(times))),
        ((back, i, bool(cuts[i + 1])) for i in range(start - 1, -1, -1)),
    )
    rows, there = firsts.copy(), np.zeros(len(times), dtype=bool)
    for choice, i, cut in steps:
        group = np.flatnonzero(seen[firsts[i] : ends[i]]) + firsts[i]
        index = choice.pick(places[group], cut)
        if index is not None:
            rows[i], there[i] = group[index], True
    return found.only(rows, there)
