"""Whether a microphone is set well, from a few seconds of speaking as loud as it will get. Pure."""

from __future__ import annotations

from dataclasses import dataclass, replace

LISTEN_S = 5.0
LOUD_DBFS, QUIET_DBFS, SILENT_DBFS = -3.0, -20.0, -50.0
"""Speech that peaks between the first two is as loud as it may be; below the last there is none."""
AIM_DBFS = -9.0
_NEAR_DB = 20.0
"""Less than this between voice and room is a noisy room."""


@dataclass(frozen=True)
class Heard:
    """What a level meter told over some seconds.

    Args:
        peak_dbfs: the highest. floor_dbfs: the quietest loudness, which is the room. clipped: it clipped.
    """

    peak_dbfs: float = -90.0
    floor_dbfs: float = 0.0
    clipped: bool = False

    def with_look(self, peak_dbfs: float, rms_dbfs: float, clipped: bool) -> Heard:
        """With one more look at the meter."""
        return replace(
            self,
            peak_dbfs=max(self.peak_dbfs, peak_dbfs),
            floor_dbfs=min(self.floor_dbfs, rms_dbfs),
            clipped=self.clipped or clipped,
        )

    @property
    def verdict(self) -> str:
        """ "clipped", "loud", "silent", "quiet", "noisy" or "good"."""
        if self.clipped:
            return "clipped"
        if self.peak_dbfs > LOUD_DBFS:
            return "loud"
        if self.peak_dbfs < SILENT_DBFS:
            return "silent"
        if self.peak_dbfs < QUIET_DBFS:
            return "quiet"
        return "noisy" if self.peak_dbfs - self.floor_dbfs < _NEAR_DB else "good"

    @property
    def change_db(self) -> float:
        """By how much the microphone should be turned up, negative down."""
        return AIM_DBFS - self.peak_dbfs
