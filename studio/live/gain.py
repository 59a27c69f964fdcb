"""The microphone brought to the level the model has learnt from, slowly and while somebody speaks."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.errors import StudioError
from studio.take.sound import sound_blocks

USUAL_DBFS = -26.0
"""Of speech, where nothing is known of the training takes."""
LOWEST_DB, HIGHEST_DB = -18.0, 24.0
_LEARNT_S, _FOLLOWS_S = 1.5, 6.0
"""Seconds of speech until the gain is believed, and over which the level is a mean."""
_FASTEST_DB_S = 6.0
_SWITCHED_DB_S = 48.0
"""How fast the level moves as it learns, and to where it belongs when it is switched on or off."""
_LOUD_SHARE, _BELOW_LOUD_DB = 95, 25.0
_FRAME_S, _MOST_S = 0.02, 60.0

Floats = NDArray[np.float32]


def speech_level(samples: Floats, rate: int) -> float | None:
    """The level of speech in a sound (N,), dBFS: the power of its loud moments; None for silence.

    Source: the idea of ITU-T P.56's active speech level, with a threshold 25 dB under the loud frames.
    """
    power = _frame_power(samples, rate)
    if not len(power) or power.max() < 1e-9:
        return None
    threshold = np.percentile(power, _LOUD_SHARE) / 10 ** (_BELOW_LOUD_DB / 10)
    return float(10 * np.log10(power[power >= threshold].mean()))


def level_of_takes(sounds: Iterable[Path], rate: int = 16_000) -> float:
    """The level of speech in some recordings, from a minute of them; USUAL_DBFS where none can be read."""
    parts: list[Floats] = []
    for sound in sounds:
        try:
            parts += [block for block, _ in zip(sound_blocks(sound, rate, 10.0), range(2), strict=False)]
        except (StudioError, OSError):
            continue
        if sum(map(len, parts)) > _MOST_S * rate:
            break
    level = speech_level(np.concatenate(parts), rate) if parts else None
    return USUAL_DBFS if level is None else level


class Gain:
    """An automatic gain that knows where it is going.

    Args:
        target_dbfs: the level of speech in the training takes.
        rate: samples a second.
        on: whether it does anything.
    """

    def __init__(self, target_dbfs: float, rate: int, on: bool = True) -> None:
        self.target_dbfs, self.on = target_dbfs, on
        self._rate = rate
        self._power, self._weight = 0.0, 0.0
        self._db = self._given_db = 0.0

    @property
    def db(self) -> float:
        """The gain now, or where it is going after a switch."""
        return self._db if self.on else 0.0

    def feed(self, block: Floats, speaking: bool) -> Floats:
        """A block of mono sound (N,) with the gain as it moves; it learns only from speech."""
        if not len(block):
            return block
        before = self._given_db
        seconds = len(block) / self._rate
        if speaking:
            self._learn(block, seconds)
        self._move(seconds)
        most = _SWITCHED_DB_S * seconds
        after = self._given_db = before + float(np.clip(self.db - before, -most, most))
        if before == after == 0.0:
            return block
        ramp = 10 ** (np.linspace(before, after, len(block), dtype=np.float32) / 20)
        louder: Floats = (block * ramp).astype(np.float32)
        return np.clip(louder, -1.0, 1.0)

    def _learn(self, block: Floats, seconds: float) -> None:
        keep = float(np.exp(-seconds / _FOLLOWS_S))
        self._power = keep * self._power + (1 - keep) * float(np.mean(np.square(block)))
        self._weight = keep * self._weight + (1 - keep)

    def _move(self, seconds: float) -> None:
        if self._weight < 1 - np.exp(-_LEARNT_S / _FOLLOWS_S) or self._power <= 1e-9:
            return
        level = 10 * np.log10(self._power / self._weight)
        wanted = float(np.clip(self.target_dbfs - level, LOWEST_DB, HIGHEST_DB))
        most = _FASTEST_DB_S * seconds
        self._db += float(np.clip(wanted - self._db, -most, most))


def _frame_power(samples: Floats, rate: int) -> NDArray[np.float64]:
    size = max(1, round(_FRAME_S * rate))
    whole = len(samples) // size * size
    power: NDArray[np.float64] = np.square(samples[:whole].astype(np.float64)).reshape(-1, size).mean(axis=1)
    return power
