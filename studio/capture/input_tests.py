"""Tests before a recording: the microphone's level, and the offset between voice and motion. Pure."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from studio.motion import Motion
from studio.motion.channels import is_mouth_shape
from studio.motion.lag import RATE, Alignment, curve_offset, speech_level, voice_offset
from studio.sound.sound_file import Sound
from studio.take.alignment import hand_distance
from studio.vmc.stream import Sender

LEVEL_SECONDS = 5.0
LOUD_DBFS, QUIET_DBFS, SILENT_DBFS = -3.0, -20.0, -50.0
"""Speech that peaks between the first two is as loud as it may be; below the last there is none."""
AIM_DBFS = -9.0
# Less than this between voice and room is a noisy room.
_NEAR_DB = 20.0


@dataclass(frozen=True)
class LevelStats:
    """What a level meter told over some seconds.

    Args:
        peak_dbfs: the highest. floor_dbfs: the quietest loudness, which is the room. clipped: it clipped.
    """

    peak_dbfs: float = -90.0
    floor_dbfs: float = 0.0
    clipped: bool = False

    def with_look(self, peak_dbfs: float, rms_dbfs: float, clipped: bool) -> LevelStats:
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


LISTEN_S = 7.0
"""How long the performer claps or speaks."""
UNNOTICED_MS, ACCEPTED_MS = (-45.0, 15.0), (-125.0, 45.0)
"""Sound late (negative) or early against the picture. Source: ATSC IS-191 for what nobody notices; ITU-R
BT.1359 for what an audience begins to see."""
_SURE = 0.6
_HANDS = ("LeftHand", "RightHand")
# No tracker is later; what fits there fits by chance.
_FARTHEST_MS = 400.0
# Pairs of a microphone and a sender that are remembered.
_MOST_PAIRS = 50
# Metres that the hands' distance has to change by to count as clapping.
_LEAST_MOVE = 0.05

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Measured:
    """What the test found.

    Args:
        ms: how much earlier the sound is than the motion, negative where it is later; None where the test
            could not tell.
        by: "mouth" or "hands", what was compared with the sound; "" where it could not tell.
        why_not: "", "silent" (no sound), "still" (nothing moved), or "unsure".
        confidence: 0 to 1.
    """

    ms: float | None
    by: str = ""
    why_not: str = ""
    confidence: float = 0.0


def measure(sound: Sound, motion: Motion) -> Measured:
    """Compare sound and motion of a few seconds that are on one clock.

    Args:
        sound: from time 0. motion: times on the sound's clock.
    """
    level = speech_level(sound.mono(), sound.sample_rate)
    if not len(level) or float(np.abs(sound.samples).max(initial=0.0)) < 1e-3 or level.std() < 0.02:
        return Measured(None, why_not="silent")
    found = [("mouth", voice_offset(level, motion)), ("hands", _by_hands(level, motion))]
    by, best = max(found, key=lambda one: one[1].confidence)
    if best.confidence >= _SURE and abs(best.offset) * 1e3 <= _FARTHEST_MS:
        return Measured(round(-best.offset * 1e3, 1), by, "", best.confidence)
    moved = any(alignment.curve.any() for _, alignment in found)
    return Measured(None, why_not="unsure" if moved else "still", confidence=best.confidence)


def grade(ms: float) -> str:
    """ "good" where nobody notices, "warn" where it is accepted, "bad" beyond."""
    if UNNOTICED_MS[0] <= ms <= UNNOTICED_MS[1]:
        return "good"
    return "warn" if ACCEPTED_MS[0] <= ms <= ACCEPTED_MS[1] else "bad"


def sender_of(sources: Iterable[Sender]) -> str:
    """Which sender a measurement is of: the one with the mouth, else the one with the body; "" for none."""
    known = list(sources)
    for source in known:
        if any(is_mouth_shape(name) for name in source.shapes):
            return source.title
    return max(known, key=lambda s: len(s.bones)).title if known else ""


def remembered(kept: Iterable[str], device: str, sender: str) -> float | None:
    """The milliseconds kept for a pair, None where it was never tested.

    Args:
        kept: as `with_pair` made them.
    """
    for text in kept:
        try:
            one, other, ms = json.loads(text)
            if (one, other) == (device, sender):
                return float(ms)
        except (ValueError, TypeError):
            continue
    return None


def with_pair(kept: Iterable[str], device: str, sender: str, ms: float) -> tuple[str, ...]:
    """Pairs as texts, with this one first."""
    others = [text for text in kept if remembered([text], device, sender) is None]
    return (json.dumps([device, sender, ms], ensure_ascii=False), *others)[:_MOST_PAIRS]


def _by_hands(level: Array, motion: Motion) -> Alignment:
    """The offset of sound and motion from claps alone: the hands are nearest when they clap."""
    times = np.arange(len(level)) / RATE
    if not set(_HANDS) <= set(motion.bone_names) or len(motion) < 2:
        return curve_offset(level, np.zeros(len(level)))
    distance = hand_distance(motion)
    if distance is None or np.ptp(distance) < _LEAST_MOVE:
        return curve_offset(level, np.zeros(len(level)))
    return curve_offset(level, np.interp(times, motion.times, -distance))
