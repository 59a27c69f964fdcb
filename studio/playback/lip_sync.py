"""What people notice between sound and lips, and how much to delay the sound so that nobody does.

Source: ITU-R BT.1359-1, Relative timing of sound and vision for broadcasting: viewers detect sound that is
45 ms early or 125 ms late, and mind 90 ms early or 185 ms late.
"""

from __future__ import annotations

from enum import StrEnum

EARLY_MS, LATE_MS = 45.0, 125.0
MINDED_EARLY_MS, MINDED_LATE_MS = 90.0, 185.0
_STEP_MS = 5


class SyncPerception(StrEnum):
    """What viewers make of motion that lags its sound."""

    UNSEEN = "unseen"
    SEEN = "seen"
    MINDED = "minded"


def sync_perception(motion_late_ms: float) -> SyncPerception:
    """What viewers make of motion so many milliseconds after its sound; negative where it is before it."""
    early, late = motion_late_ms, -motion_late_ms  # of the sound
    if early >= MINDED_EARLY_MS or late >= MINDED_LATE_MS:
        return SyncPerception.MINDED
    return SyncPerception.SEEN if early >= EARLY_MS or late >= LATE_MS else SyncPerception.UNSEEN


def sound_delay_ms(motion_late_ms: float) -> int:
    """How much to delay the sound so that it meets the lips; 0 where nobody notices."""
    if sync_perception(motion_late_ms) is SyncPerception.UNSEEN:
        return 0
    return max(_STEP_MS * round(motion_late_ms / _STEP_MS), 0)
