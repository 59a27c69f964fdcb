"""What a picture tells besides its faces: light, sharpness, cuts, and hints for a better one."""

from __future__ import annotations

import base64
import io
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.motion import rotation
from studio.motion.filmed import PictureFlag
from studio.tracking.landmarker import Face, Picture

DARK = 55.0
"""Mean brightness of a face (0..255) below which its features drown in noise."""
BLURRED = 0.055
"""Sharpness below which lips and lids run into what is around them."""
SMALL = 72.0
"""Pixels of a face below which lips are some pixels high; the model looks at 256."""
TURNED_YAW, TURNED_PITCH = math.radians(40.0), math.radians(32.0)
"""Turns beyond which half of the mouth is hidden."""
SLOW_FPS = 20.0
UNCLEAR = PictureFlag.TURNED | PictureFlag.DARK | PictureFlag.SMALL
"""Of such pictures it cannot be told whether the mouth is hidden: they are of little use anyway."""
FACTS_EVERY = 4
"""Pictures from one measuring of light and sharpness to the next."""
_THUMB = 48
_CUT, _CUT_FACTOR = 24.0, 5.0
_SAME = 0.05
_CROP = 64
_DOT = (90, 220, 255)


@dataclass(frozen=True)
class PictureFacts:
    """What one picture says of how well a face can be tracked in it.

    Args:
        light: mean brightness of the face, 0..255; of the picture without one.
        sharpness: fine detail against coarse, about .03 (blurred) to .3.
        size: of the face, pixels; 0 without one.
        redness: of its lips, as mouth.redness has it; NaN where that was not measured.
    """

    light: float
    sharpness: float
    size: float
    redness: float = math.nan


def facts_of(picture: Picture, face: Face | None) -> PictureFacts:
    """Light, sharpness and size; (H, W, 3)."""
    if face is None:
        return PictureFacts(float(picture[::8, ::8].mean()), 0.0, 0.0)
    height, width = picture.shape[:2]
    (left, top), (right, bottom) = face.points[:, :2].min(axis=0), face.points[:, :2].max(axis=0)
    x0, x1 = int(np.clip(left, 0, width - 1)), int(np.clip(right, 1, width))
    y0, y1 = int(np.clip(top, 0, height - 1)), int(np.clip(bottom, 1, height))
    crop = picture[y0 : max(y1, y0 + 1), x0 : max(x1, x0 + 1), 1].astype(np.float32)
    return PictureFacts(float(crop.mean()), _sharpness(crop), face.size)


def _sharpness(crop: NDArray[np.float32]) -> float:
    """Mean step between neighbours in the middle of a face against its contrast.

    On means of small squares, so that a large face is not called blurred for having more pixels.
    """
    step = max(min(crop.shape) // _CROP, 1)
    rows, columns = (size // step * step for size in crop.shape)
    small = crop[:rows, :columns].reshape(rows // step, step, columns // step, step).mean(axis=(1, 3))
    if min(small.shape) < 8:
        return 0.0
    steps = np.abs(np.diff(small, axis=0)).mean() + np.abs(np.diff(small, axis=1)).mean()
    return float(steps / 2 / max(float(small.std()), 1.0))


def overlay(picture: Picture, face: Face | None, width: int) -> Picture:
    """A picture made about so many pixels wide, with a face's points drawn into it."""
    step = max(picture.shape[1] // width, 1)
    small = picture[::step, ::step].copy()
    if face is not None:
        x, y = (face.points[:, :2] / step).astype(int).T
        inside = (x >= 0) & (x < small.shape[1] - 1) & (y >= 0) & (y < small.shape[0] - 1)
        x, y = x[inside], y[inside]
        # Two pixels wide and high, or JPEG wipes them out.
        for across, down in ((0, 0), (0, 1), (1, 0), (1, 1)):
            small[y + down, x + across] = _DOT
    return small


def jpeg_of(picture: Picture) -> str:
    """A picture as a JPEG in Base64."""
    from PIL import Image

    file = io.BytesIO()
    Image.fromarray(picture).save(file, "JPEG", quality=75)
    return base64.b64encode(file.getvalue()).decode()


def thumbnail(picture: Picture) -> NDArray[np.int16]:
    """Some hundred of its pixels, for `change`."""
    height, width = picture.shape[:2]
    return picture[:: max(height // _THUMB, 1), :: max(width // _THUMB, 1), 1].astype(np.int16)


class CutDetector:
    """Tells cuts and stills by how much a picture differs from the one before."""

    def __init__(self) -> None:
        self._before: NDArray[np.int16] | None = None
        self._usual = 2.0

    def push(self, picture: Picture) -> tuple[bool, bool]:
        """Whether a cut lies right before this picture, and whether it is the very one before."""
        small = thumbnail(picture)
        before, self._before = self._before, small
        if before is None or before.shape != small.shape:
            return False, False
        change = float(np.abs(small - before).mean())
        cut = change > max(_CUT, _CUT_FACTOR * self._usual)
        if not cut:
            self._usual += 0.1 * (change - self._usual)
        return cut, change < _SAME


def is_turned(turns: NDArray[np.floating]) -> NDArray[np.bool_]:
    """Whether heads (..., 4) are turned so far from the camera that the mouth is half hidden."""
    yaw, pitch, _ = rotation.to_euler_yxz(turns)
    return np.asarray((np.abs(yaw) > TURNED_YAW) | (np.abs(pitch) > TURNED_PITCH))


def flags_of(facts: PictureFacts, turn: NDArray[np.floating] | None) -> PictureFlag:
    """What a take keeps of a picture but whether its mouth is hidden; `turn` is the head's, None without."""
    if turn is None:
        return PictureFlag(0)
    light, sharpness, size = (np.array(one) for one in (facts.light, facts.sharpness, facts.size))
    return PictureFlag(int(picture_flags(light, sharpness, size, turn)))


def picture_flags(
    light: NDArray[np.floating],
    sharpness: NDArray[np.floating],
    size: NDArray[np.floating],
    turns: NDArray[np.floating],
) -> NDArray[np.integer]:
    """What a take keeps of pictures with a face, as PictureFlag, but whether its mouth is hidden, (...).

    Args:
        light, sharpness, size: as PictureFacts has them, (...).
        turns: of the head, (..., 4).
    """
    holds = {
        PictureFlag.BLURRED: sharpness < BLURRED,
        PictureFlag.TURNED: is_turned(turns),
        PictureFlag.DARK: light < DARK,
        PictureFlag.SMALL: size < SMALL,
    }
    found = sum((int(flag) * held for flag, held in holds.items()), np.array(int(PictureFlag.FACE)))
    return np.asarray(found)


HINTS = {
    "not_calibrated": "I saw no face to calibrate by. Look into the camera and press Calibrate again.",
    "no_face": "I see no face. Sit in front of the camera.",
    "dark": "Too dark. Turn a lamp towards your face.",
    "small": "Your face is too small. Come closer.",
    "turned": "You are turned away. Look towards the camera.",
    "hidden": "I cannot see your mouth. Take away what is before it.",
    "blurred": "The picture is blurred. Clean the lens, or add light.",
    "slow": "Only {fps:.0f} frames a second. Add light, or close other programs.",
}
"""What a performer can do for a better picture, by code; the gravest first."""
_FLAGS = {
    "dark": PictureFlag.DARK,
    "small": PictureFlag.SMALL,
    "turned": PictureFlag.TURNED,
    "hidden": PictureFlag.HIDDEN,
    "blurred": PictureFlag.BLURRED,
}


def hints(
    facts: PictureFacts, turn: NDArray[np.floating] | None, fps: float, hidden: bool = False
) -> tuple[str, ...]:
    """Codes of HINTS that hold now.

    Args:
        facts, turn: as `flags_of` has them.
        hidden: whether the mouth is.
        fps: pictures a second, 0 where unknown.
    """
    if turn is None:
        return ("no_face", *(("dark",) if facts.light < DARK else ()))
    flags = flags_of(facts, turn) | (PictureFlag.HIDDEN if hidden else PictureFlag(0))
    found = [code for code, flag in _FLAGS.items() if flag in flags]
    return (*found, *(("slow",) if 0 < fps < SLOW_FPS else ()))
