"""The poses of the last seconds, and the one of any moment between them or shortly after."""

from __future__ import annotations

import threading
from collections import deque
from dataclasses import replace

import numpy as np

from studio.live.moments import GUESSED
from studio.motion import Pose
from studio.playback.neutral import between

STALLED_S = 0.25
"""Seconds without a pose after which the avatar goes over to idling."""


class PoseLine:
    """Poses in order; one thread adds, others ask.

    Args:
        step: seconds between two poses.
    """

    def __init__(self, step: float) -> None:
        self._step = step
        self._poses: deque[tuple[float, Pose, bool]] = deque()
        self._lock = threading.Lock()

    def __len__(self) -> int:
        return len(self._poses)

    def add(self, moment: float, pose: Pose, speaking: bool) -> None:
        """The next pose, and whether somebody speaks then; two never have the same moment."""
        with self._lock:
            if self._poses and moment <= self._poses[-1][0]:
                moment = self._poses[-1][0] + 1e-4
            self._poses.append((moment, pose, speaking))

    def forget(self, until: float) -> None:
        """Poses before a moment are not asked for any more."""
        with self._lock:
            while len(self._poses) > 2 and self._poses[1][0] <= until:
                self._poses.popleft()

    def at(self, moment: float) -> tuple[Pose | None, bool]:
        """The pose of a moment, None before the first, and whether somebody speaks then."""
        with self._lock:
            return self._at(moment)

    def _at(self, moment: float) -> tuple[Pose | None, bool]:
        poses = self._poses
        if not poses:
            return None, False
        after = next((i for i in range(len(poses) - 1, -1, -1) if poses[i][0] <= moment), -1) + 1
        if after == 0:
            return poses[0][1], poses[0][2]
        t, pose, speaking = poses[after - 1]
        if after == len(poses):
            guess = _guess((moment - t) / self._step)
            if guess and after > 1 and t - poses[-2][0] < STALLED_S:
                pose = _beyond(poses[-2][1], pose, guess)
            return pose, speaking and moment - t < STALLED_S
        later, following, _ = poses[after]
        share = (moment - t) / max(later - t, 1e-6)
        return between(pose, following, min(max(share, 0.0), 1.0)), speaking


def _guess(frames: float) -> float:
    """How much of the last step to go on with, so many frames after the newest pose; back if none comes."""
    return max(min(frames, 2 * GUESSED - frames), 0.0)


def _beyond(before: Pose, last: Pose, share: float) -> Pose:
    """The pose that follows if everything goes on as between two poses, for a share of that step."""
    pose = between(before, last, 1.0 + share)
    return replace(pose, shapes=np.clip(pose.shapes, 0.0, 1.0))
