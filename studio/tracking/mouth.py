"""Whether a mouth can be seen, or a hand, a microphone or a scarf is before it.

The landmarker finds a mouth wherever there is a face, and says nothing of how much of it was seen. But lips
are redder than the skin around them, open or closed, turned or in another light; what is held before them
hardly ever is, and not by as much as this person's lips usually are. Lips pressed together or rolled in hide
themselves, and the landmarker tells that.
"""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import percentile_filter

from studio.motion.channels import ARKIT_SHAPES
from studio.tracking.landmarker import Face, Picture

LEAST_REDNESS = 0.03
"""How much redder lips must usually be to be told from a hand; of others' nothing is said."""
HIDDEN_SHARE = 0.35
"""Lips that are less than this share as red as usual are not lips."""
# Outer and inner edges of the lips, point by point, and skin around them. Source: MediaPipe's face mesh.
_OUTER = np.array([61, 146, 91, 181, 84, 17, 314, 405, 321, 375, 291, 409, 270, 269, 267, 0, 37, 39, 40, 185])
_INNER = np.array([78, 95, 88, 178, 87, 14, 317, 402, 318, 324, 308, 415, 310, 311, 312, 13, 82, 81, 80, 191])
_SKIN = np.array(
    [164, 167, 393, 165, 391, 92, 322, 186, 410, 57, 287, 43, 273, 106, 335, 182, 406, 83, 313, 18]
)
_PRESSING = [ARKIT_SHAPES.index(name) for name in (
    "MouthRollLower", "MouthRollUpper", "MouthPressLeft", "MouthPressRight")]  # fmt: skip
_PRESSED = 0.6
# So that a dark pixel's noise is not taken for a colour.
_BLACK = 6.0
_USUAL_S, _USUAL = 60.0, 75.0
_FEWEST = 30
_SMOOTH = 5


def redness(picture: Picture, face: Face) -> float:
    """How much redder the lips are than the skin around them: log of red to green, NaN for pressed lips."""
    if face.weights[_PRESSING].max() > _PRESSED:
        return float("nan")
    lips = (face.points[_OUTER, :2] + face.points[_INNER, :2]) / 2
    return _red(picture, lips) - _red(picture, face.points[_SKIN, :2])


def _red(picture: Picture, points: NDArray[np.floating]) -> float:
    height, width = picture.shape[:2]
    x = np.clip(points[:, 0].round().astype(int), 1, width - 2)
    y = np.clip(points[:, 1].round().astype(int), 1, height - 2)
    # Means of nine pixels: one alone is noise, and colours of films are coarse.
    colour = sum(
        picture[y + down, x + across, :2].astype(np.float64) for down in (-1, 0, 1) for across in (-1, 0, 1)
    )
    red, green = (np.asarray(colour) / 9 + _BLACK).T
    return float(np.median(np.log(red / green)))


def hidden(times: NDArray[np.floating], redness: NDArray[np.floating]) -> NDArray[np.bool_]:
    """In which pictures of a video the mouth is hidden, (T,).

    Args:
        times: of the pictures with a face, rising seconds, (T,).
        redness: in each, NaN where nothing is told of, (T,).
    """
    known = np.flatnonzero(np.isfinite(redness))
    found = np.zeros(len(times), dtype=bool)
    if len(known) < _FEWEST:
        return found
    values = _calm(redness[known])
    # What is usual is that of the minutes around, second by second: light changes in the course of hours.
    second = (times[known] - times[known[0]]).astype(int)
    seconds, first = np.unique(second, return_index=True)
    levels = np.array([np.percentile(part, _USUAL) for part in np.split(values, first[1:])])
    size = min(2 * round(_USUAL_S) + 1, 2 * len(levels) + 1)
    usual = percentile_filter(levels, _USUAL, size=size, mode="nearest")[np.searchsorted(seconds, second)]
    found[known] = (usual >= LEAST_REDNESS) & (values < HIDDEN_SHARE * usual)
    return found


def _calm(values: NDArray[np.floating]) -> NDArray[np.floating]:
    """Medians of some pictures, so that one that is smeared says nothing."""
    padded = np.pad(values, _SMOOTH // 2, mode="edge")
    return np.asarray(np.median(np.lib.stride_tricks.sliding_window_view(padded, _SMOOTH), axis=1))


class MouthWatch:
    """Tells whether a mouth is hidden, picture by picture as they come."""

    def __init__(self) -> None:
        self._seen: deque[tuple[float, float]] = deque()
        self._usual = 0.0
        self._usual_at = -np.inf

    def push(self, t: float, redness: float) -> bool:
        """Whether it is hidden now; seconds, and NaN where nothing is told of."""
        if not np.isfinite(redness):
            return False
        self._seen.append((t, redness))
        while self._seen[0][0] < t - _USUAL_S:
            self._seen.popleft()
        if len(self._seen) < _FEWEST:
            return False
        if t - self._usual_at > 1.0:
            self._usual_at, self._usual = t, float(np.percentile([r for _, r in self._seen], _USUAL))
        now = float(np.median([self._seen[-i][1] for i in range(1, _SMOOTH + 1)]))
        return self._usual >= LEAST_REDNESS and now < HIDDEN_SHARE * self._usual
