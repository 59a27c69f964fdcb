"""Layers over a model's live poses: idle motion, freezing, the neutral pose, a tuning."""

from __future__ import annotations

import threading
from dataclasses import replace

import numpy as np

from studio.motion import Motion, Pose
from studio.motion.channels import is_mouth_shape
from studio.motion.neutral import between, neutral_pose
from studio.playback.layers import Reference, Tuner, Tuning
from studio.playback.layers.idle import smooth_step

FADE_S, WAKE_S = 0.35, 0.08
"""How long it takes from speaking to idling and back, and how long the mouth takes back: the first syllable
must not be swallowed by a body that wakes up slowly."""
PANIC_S = 0.25
IDLE = Tuning(blinks=15.0, darts=0.6, breath=1.0, sway=1.0)
"""What an avatar does while nobody speaks."""
_SAME_S = 0.003
"""Poses asked for so close together are one: several senders get the same."""


class PoseLayers:
    """The pose that is sent, given the model's; keeps what it eases from one asking to the next.

    Args:
        rest: a motion of one frame: how the avatar rests while nobody speaks.
        idles: whether silence lets it idle.
        blinks: a minute, where the tuning asks for none.
    """

    def __init__(self, rest: Motion, idles: bool = True, blinks: float = 0.0) -> None:
        self.shape_names, self.bone_names = rest.shape_names, rest.bone_names
        self.rest = self._rest_before = rest.pose(0.0)
        self._rest_share = 1.0
        self._reference = Reference.of(rest)
        self.idles, self._blinks = idles, blinks
        # Reentrant: named_pose holds it around pose, so that names and pose never belong to two tunings.
        self._lock = threading.RLock()
        self._idle_share, self._neutral_share = 1.0 if idles else 0.0, 0.0
        self._mouth_share = self._idle_share
        self._mouth = np.array([is_mouth_shape(name) for name in self.shape_names], dtype=bool)
        self._at: float | None = None
        self._begun = 0.0
        self._last: Pose | None = None
        self.frozen = False
        self.neutral = False
        self.names: tuple[tuple[str, ...], tuple[str, ...]] = (), ()
        """Shapes and bones of the poses that go out."""
        self.retune(Tuning())

    @property
    def idling(self) -> float:
        """How far it idles, 0 to 1."""
        return self._idle_share

    def set_rest(self, rest: Motion) -> None:
        """Ease over to resting like this, a motion of one frame of the same channels."""
        with self._lock:
            self._rest_before, self.rest, self._rest_share = self._resting(), rest.pose(0.0), 0.0

    def _resting(self) -> Pose:
        share = float(smooth_step(self._rest_share))
        return self.rest if share == 1 else between(self._rest_before, self.rest, share)

    def retune(self, tuning: Tuning) -> None:
        """Other layers from the next pose on."""
        with self._lock:
            tuning = replace(tuning, blinks=tuning.blinks or self._blinks)
            self._tuner = Tuner(tuning, self.shape_names, self.bone_names, self._reference)
            # What a person's own tuning does all the time, silence must not do a second time.
            own = replace(
                IDLE,
                blinks=IDLE.blinks if not tuning.blinks else 0.0,
                darts=IDLE.darts if not tuning.darts else 0.0,
                breath=IDLE.breath if not tuning.breath else 0.0,
                sway=IDLE.sway if not tuning.sway else 0.0,
            )
            self._idler = Tuner(own, self.shape_names, self.bone_names, self._reference)
            before, self.names = self.names, (self._tuner.shape_names, self._tuner.bone_names)
            if self.names != before:  # a pose of other channels must not be held on to
                self._last = None
            kept = [self.bone_names.index(name) for name in self.names[1]]
            self._neutral = neutral_pose(*self.names, self.rest.positions[kept])
            self._at = None

    def pose(self, moment: float, made: Pose | None, speaking: bool) -> Pose:
        """What to send.

        Args:
            moment: seconds of the computer's clock.
            made: the model's pose, None before the first.
            speaking: whether somebody speaks then.
        """
        with self._lock:
            # Layers move on with each pose; a second sender at the same moment must not make them run faster.
            if self._at is not None and self._last is not None and abs(moment - self._at) < _SAME_S:
                return self._last
            self._begun = self._begun or moment
            # Capped: after the computer slept, a fade would otherwise be over in one step.
            step = 0.0 if self._at is None else min(max(moment - self._at, 0.0), 0.1)
            self._at = moment
            # The neutral pose is the panic key: it goes over a frozen pose as well.
            if self.frozen and not self.neutral and self._last is not None:
                return self._last
            self._last = self._eased(moment, made, speaking, step)
            return self._last

    def named_pose(
        self, moment: float, made: Pose | None, speaking: bool
    ) -> tuple[Pose, tuple[str, ...], tuple[str, ...]]:
        """The pose to send with the names of its channels, which another tuning may just have changed.

        Arguments are those of `pose`.
        """
        with self._lock:
            return self.pose(moment, made, speaking), *self.names

    def _eased(self, moment: float, made: Pose | None, speaking: bool, step: float) -> Pose:
        # Before the first pose the avatar idles, too: a statue looks broken.
        still = made is None or (self.idles and not speaking)
        self._idle_share = _towards(self._idle_share, float(still), step / FADE_S)
        self._mouth_share = _towards(self._mouth_share, float(still), step / (FADE_S if still else WAKE_S))
        self._neutral_share = _towards(self._neutral_share, float(self.neutral), step / PANIC_S)
        self._rest_share = _towards(self._rest_share, 1.0, step / FADE_S)
        t, rest = moment - self._begun, self._resting()
        pose = made if made is not None else rest
        if self._idle_share > 0:
            idle = self._idler.pose(t, rest)
            share, mouth = float(smooth_step(self._idle_share)), float(smooth_step(self._mouth_share))
            shapes = np.where(self._mouth, (1 - mouth) * pose.shapes + mouth * idle.shapes, 0.0)
            pose = idle if share == 1 else between(pose, idle, share)
            pose = replace(pose, shapes=np.where(self._mouth, shapes, pose.shapes).astype(np.float32))
        # After idling, so that a person's own tuning holds while nobody speaks.
        pose = self._tuner.pose(t, pose)
        if self._neutral_share > 0:  # over everything: a panic key is no matter of taste
            pose = between(pose, self._neutral, float(smooth_step(self._neutral_share)))
        return pose


def _towards(value: float, goal: float, most: float) -> float:
    return min(goal, value + most) if goal > value else max(goal, value - most)
