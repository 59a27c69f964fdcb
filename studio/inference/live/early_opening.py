"""Opens the mouth as soon as a voice begins, before the network can know which sound it will be."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from studio.features.audio_spec import Floats
from studio.motion import Motion, Pose
from studio.motion.channels import is_mouth_shape
from studio.playback.layers.idle import smooth_step

FRAME_S = 0.005
SUSTAINED = 5
"""Frames over which a sound has to stay: clicks and keys have decayed by then, a voice swells."""
_DECAY_DB = 3.0
"""How much quieter the last of them may be than the first."""
_OVER_FLOOR_DB, _LEAST_DBFS = 14.0, -52.0
_QUIET_S = 0.12
"""Silence that makes what follows it a beginning."""
_FLOOR_RISE_DB_S, _FLOOR_FALL_DB, _HIGHEST_FLOOR_DBFS = 6.0, 1.0, -40.0
"""How fast the room's own level is believed to rise, a second, and to fall, a frame; the most it can be."""
_CONFIRM_S = 0.045
"""How long after a beginning it must still sound."""
AMOUNT = 1.5
"""How far the mouth opens, as a share of the way from rest to its mean in the takes. Chosen of
three on two takes that were not learnt from, but thereby no longer unseen: on one of them 1 opens words 31 ms
sooner, 1.5 59 ms, and with 2.5 the jaw follows less well; on the other 1.5 costs the jaw .008 of its r."""
RISE_S, HOLD_S, FALL_S = 0.06, 0.06, 0.12
"""How long the mouth takes to open, stays so after the network's own pose is due, and takes to go back."""


class OnsetDetector:
    """Hears where sound rises out of silence and stays.

    Args:
        rate: samples a second.
    """

    def __init__(self, rate: int) -> None:
        self._size = round(FRAME_S * rate)
        self._rest = np.zeros(0, dtype=np.float32)
        self._floor_dbfs = -60.0
        self._recent: list[float] = []
        self._quiet_s = 0.0
        self._unconfirmed_s: float | None = None  # since the last beginning, until it is known what it was

    @property
    def waits(self) -> bool:
        """Whether it is so quiet that something may begin within a moment, or something did and is unsure."""
        return self._quiet_s >= _QUIET_S / 2 or self._unconfirmed_s is not None

    def feed(self, samples: Floats) -> tuple[bool, bool]:
        """Hear a block (N,): whether a sound began in it, and whether what began turned out to be none."""
        rest = np.concatenate([self._rest, samples])
        whole = len(rest) // self._size * self._size
        self._rest = rest[whole:]
        power = np.square(rest[:whole], dtype=np.float64).reshape(-1, self._size).mean(axis=1)
        heard = [self._hear(level) for level in (10 * np.log10(power + 1e-12)).tolist()]
        return any(began for began, _ in heard), any(refuted for _, refuted in heard)

    def _hear(self, level: float) -> tuple[bool, bool]:
        rise = self._floor_dbfs + _FLOOR_RISE_DB_S * FRAME_S
        # Falls gently: a moment of digital silence must not make the room's own noise a voice.
        self._floor_dbfs = min(max(level, self._floor_dbfs - _FLOOR_FALL_DB), rise, _HIGHEST_FLOOR_DBFS)
        loud = level > max(self._floor_dbfs + _OVER_FLOOR_DB, _LEAST_DBFS)
        refuted = self._refuted(loud)
        self._recent = [*self._recent, level][-SUSTAINED:] if loud else []
        stays = len(self._recent) == SUSTAINED
        swells = stays and sum(self._recent[-2:]) / 2 > sum(self._recent[:2]) / 2 - _DECAY_DB
        began = swells and self._quiet_s >= _QUIET_S
        if began:
            self._unconfirmed_s = 0.0
        # The first loud frames are no end of the silence before them yet: they may be a click.
        self._quiet_s = 0.0 if stays else self._quiet_s + (0.0 if loud else FRAME_S)
        return began, refuted

    def _refuted(self, loud: bool) -> bool:
        """Whether it is over already when a voice would go on."""
        if self._unconfirmed_s is None:
            return False
        self._unconfirmed_s += FRAME_S
        if self._unconfirmed_s < _CONFIRM_S:
            return False
        self._unconfirmed_s = None
        return not loud


class EarlyOpening:
    """Opens the mouth part of the way where a voice begins, until the network's own poses take over.

    Args:
        rest: the pose in silence, a motion of one frame.
        mean: the mean pose of the takes, a motion of one frame of the same channels.
        rate: samples a second of the sound.
        on: whether it does anything.
    """

    def __init__(self, rest: Motion, mean: Motion, rate: int, on: bool = True) -> None:
        self.on = on
        self._detector = OnsetDetector(rate)
        self._way = AMOUNT * np.clip(mean.shapes[0] - rest.shapes[0], 0.0, None)
        self._way[[not is_mouth_shape(name) for name in rest.shape_names]] = 0.0
        self._rest = rest.shapes[0]
        self._began = self._until = float("-inf")
        self._from = 0.0

    @property
    def alert(self) -> bool:
        """Whether a voice that begins now would open the mouth."""
        return self.on and self._detector.waits

    def feed(self, samples: Floats, now: float, delay: float) -> None:
        """Hear a block (N,) at a moment; poses are so many seconds late."""
        if not self.on:
            return
        began, refuted = self._detector.feed(samples)
        if began:
            self._from, self._began, self._until = self.share(now), now, now + delay + HOLD_S
        elif refuted:
            self._until = min(self._until, now)

    def share(self, now: float) -> float:
        """How far the mouth is opened early at a moment, 0 to 1."""
        if not self.on or now >= self._until + FALL_S:
            return 0.0
        risen = float(smooth_step((min(now, self._until) - self._began) / RISE_S))
        fallen = float(smooth_step((now - self._until) / FALL_S))
        return (self._from + (1 - self._from) * risen) * (1 - fallen)

    def opened(self, pose: Pose, now: float) -> Pose:
        """A pose that is shown at a moment, with the mouth at least as far open as a beginning voice asks."""
        share = self.share(now)
        if share <= 0.0:
            return pose
        least = np.where(self._way > 0, np.clip(self._rest + share * self._way, 0.0, 1.0), pose.shapes)
        return replace(pose, shapes=np.maximum(pose.shapes, least).astype(np.float32))
