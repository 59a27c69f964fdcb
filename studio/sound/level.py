"""A level meter: peak, loudness, hold and a clip latch in dBFS. Pure."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FLOOR_DBFS = -90.0
CLIP_LEVEL = 0.999
# Full-scale samples in a row that mean clipping; one alone is a loud moment.
_CLIP_RUN = 3
_FALL_DB_PER_S = 20.0
_HOLD_S = 1.5
_RMS_WINDOW_S = 0.3


def dbfs(amplitude: float) -> float:
    """A linear amplitude in dBFS, never below FLOOR_DBFS."""
    return max(20.0 * float(np.log10(amplitude)), FLOOR_DBFS) if amplitude > 0 else FLOOR_DBFS


def clips(samples: NDArray[np.float32]) -> bool:
    """Whether any channel stays at full scale for several samples.

    Args:
        samples: (N,) or (N, C), full scale +-1.
    """
    full = np.abs(samples).reshape(len(samples), -1) >= CLIP_LEVEL
    if len(full) < _CLIP_RUN or not full.any():
        return False
    run = full[: len(full) - _CLIP_RUN + 1].copy()
    for step in range(1, _CLIP_RUN):
        run &= full[step : len(full) - _CLIP_RUN + 1 + step]
    return bool(run.any())


class LevelMeter:
    """What a performer's level looks like on a display.

    Args:
        sample_rate: of the samples fed.

    Attributes:
        peak_dbfs: highest recent sample, falling 20 dB a second.
        rms_dbfs: loudness over about 0.3 s.
        hold_dbfs: the peak of the last 1.5 s.
        clipped: latched by clipping until `reset`.
    """

    def __init__(self, sample_rate: int = 48_000) -> None:
        self.sample_rate = sample_rate
        self.reset()

    def reset(self) -> None:
        """Forget everything, the clip latch too."""
        self.peak_dbfs = self.rms_dbfs = self.hold_dbfs = FLOOR_DBFS
        self.clipped = False
        self._mean_square = 0.0
        self._held_for = 0.0

    def feed(self, samples: NDArray[np.float32]) -> None:
        """Take one block in.

        Args:
            samples: float32 (N,) or (N, C), full scale +-1; NaN counts as silence.
        """
        if not samples.size:
            return
        good = np.isfinite(samples).all()
        safe = samples if good else np.nan_to_num(samples, posinf=1.0, neginf=-1.0)
        duration = len(safe) / self.sample_rate
        largest = float(np.abs(safe).max())
        peak = dbfs(largest)
        self.peak_dbfs = max(peak, self.peak_dbfs - _FALL_DB_PER_S * duration, FLOOR_DBFS)
        self._held_for += duration
        if peak >= self.hold_dbfs or self._held_for > _HOLD_S:
            self.hold_dbfs, self._held_for = peak, 0.0
        keep = float(np.exp(-duration / _RMS_WINDOW_S))
        square = float(np.mean(np.square(safe, dtype=np.float64)))
        self._mean_square = keep * self._mean_square + (1 - keep) * square
        self.rms_dbfs = dbfs(self._mean_square**0.5)
        self.clipped = self.clipped or (largest >= CLIP_LEVEL and clips(safe))
