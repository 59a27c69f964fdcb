"""Timing of live poses: sample clock, adaptive delay, and a buffer interpolated between poses."""

from __future__ import annotations

import threading
from bisect import bisect_left, insort
from collections import deque
from dataclasses import replace

import numpy as np

from studio.motion import Pose
from studio.motion.neutral import between

GAP_S = 0.12
"""Blocks that come from a moment further off than this follow a gap: a device came back, a computer slept."""
_PULL, _TILT = 0.02, 0.0001
"""How much of a block's error moves the line, and how much of it turns it: 100 ppm are found in seconds."""
_STEEPEST = 500e-6
REMEMBERED_S = 8.0
SPARE_S = 0.002
MOST_UNEVEN_S = 0.15
GUESSED, TRUSTED = 0.5, 0.75
"""Share of the way to the next pose that is gone by guess, so that nobody waits a whole frame to glide in,
and how much of the last step is gone on with: measured, all of it overshoots and half of it stutters."""
_NEARLY_ALL = 96
"""Per cent of the poses that are there in time; the others are shown a little late, not waited for."""
STEADY_S, STEADY_WITHIN_S = 1.5 * REMEMBERED_S, 0.01
"""A delay that stayed within so many seconds for so long has settled. Longer than it remembers, for the slow
first poses of a process hold it up, perfectly steady, until they are out of that."""
_QUICKER, _SLOWER = 0.04, 0.25
"""How fast the delay may fall and rise, seconds a second: motion runs that much faster or slower for it."""


class SampleClock:
    """The straight line from samples to moments of the computer's clock, followed as it drifts.

    Blocks carry the device's own times, which tremble by milliseconds; the line does not.

    Args:
        rate: samples a second.
    """

    def __init__(self, rate: int) -> None:
        self.rate = rate
        self._origin: float | None = None
        self._slope = 1.0
        self._at = 0

    def follow(self, sample: int, captured: float) -> bool:
        """One block's first sample was captured at a moment; whether that followed a gap."""
        # The first block cannot be wrong: there is nothing yet to hold it against.
        if self._origin is None:
            self._origin, self._at = captured, sample
            return False
        error = captured - self.moment(sample)
        gap = abs(error) > GAP_S
        if gap:
            self._origin, self._at = captured, sample
            return True
        # A loop filter of second order: a share of the error moves the line, a smaller one turns it.
        self._origin, self._at = self.moment(sample) + _PULL * error, sample
        # Held within what crystals do: a burst of late blocks must not bend the line for minutes.
        tilt = self._slope - 1.0 + _TILT * error
        self._slope = 1.0 + min(max(tilt, -_STEEPEST), _STEEPEST)
        return False

    @property
    def drift_ppm(self) -> float:
        """How much longer the device's second is than the computer's."""
        return (self._slope - 1.0) * 1e6

    def moment(self, sample: float) -> float:
        """When a sample was captured, seconds of the computer's clock."""
        assert self._origin is not None
        return self._origin + (sample - self._at) / self.rate * self._slope

    def sample(self, moment: float) -> float:
        """Which sample was captured at a moment, between two of them as a fraction."""
        assert self._origin is not None
        return self._at + (moment - self._origin) * self.rate / self._slope


class Delay:
    """How long after its moment a pose is shown: as late as nearly all poses are, and what it takes to glide.

    Args:
        step: seconds between two poses.
        prompt: whether poses are shown when they are made; else they are asked for at any moment between, and
            half a frame goes to gliding in.
    """

    def __init__(self, step: float, prompt: bool = False) -> None:
        self._glide = 0.0 if prompt else (1.0 - GUESSED) * step
        self._seen: deque[tuple[float, float]] = deque()
        self._rising: list[float] = []  # the same latenesses in order
        self._value: float | None = None
        self._invalidated = False
        self._set_at = 0.0
        self._steady_at, self._steady_since = 0.0, 0.0
        self.settled = False
        """Whether it has stayed where it is for STEADY_S."""

    def add(self, now: float, lateness: float) -> None:
        """A pose was ready so many seconds after its moment."""
        # Lateness of single poses and not a mean of them: the delay has to hold for the slow ones.
        self._seen.append((now, lateness))
        insort(self._rising, lateness)
        while self._seen and now - self._seen[0][0] > REMEMBERED_S:
            _, gone = self._seen.popleft()
            del self._rising[bisect_left(self._rising, gone)]
        # The first pose after a reset sets the delay at once; creeping there would take seconds.
        if self._value is None or self._invalidated:
            self._value, self._set_at, self._invalidated = self.target_delay, now, False
            self._steady_at, self._steady_since = self._value, now
        self._move(now)
        if abs(self._value - self._steady_at) > STEADY_WITHIN_S:
            self._steady_at, self._steady_since = self._value, now
        self.settled = now - self._steady_since >= STEADY_S

    @property
    def target_delay(self) -> float:
        """The delay that would do for what was seen lately, seconds."""
        seen = self._rising
        if not seen:
            return 0.0
        # A computer that is far too busy moves an avatar unevenly; it must not make it late as well.
        late = min(_percentile(seen, _NEARLY_ALL), seen[0] + MOST_UNEVEN_S)
        return max(late + self._glide + SPARE_S, 0.0)

    @property
    def value(self) -> float:
        """The delay now, seconds."""
        return self._value or 0.0

    def reset(self) -> None:
        """What was seen says nothing any more: another look-ahead, another device.

        The delay stays until the next pose says it anew: an avatar must not run ahead and back meanwhile.
        """
        self._seen.clear()
        self._rising.clear()
        self._invalidated, self.settled = True, False

    def _move(self, now: float) -> None:
        assert self._value is not None
        passed = max(now - self._set_at, 0.0)
        # Poses of one block arrive together; moving the delay for each would only cost percentiles.
        if passed < 0.02:
            return
        self._set_at = now
        change = self.target_delay - self._value
        # Sooner up than down: a pose that misses its moment is seen, a delay a little too long is not.
        self._value += min(max(change, -_QUICKER * passed), _SLOWER * passed)


def _percentile(rising: list[float], percent: float) -> float:
    """As numpy's, whose own takes ten times as long for a few hundred numbers."""
    place = percent / 100 * (len(rising) - 1)
    low = int(place)
    high = min(low + 1, len(rising) - 1)
    return rising[low] + (place - low) * (rising[high] - rising[low])


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
            # The clock may be pulled back by a fraction of a millisecond between two poses.
            if self._poses and moment <= self._poses[-1][0]:
                moment = self._poses[-1][0] + 1e-4
            self._poses.append((moment, pose, speaking))

    def discard_before(self, moment: float) -> None:
        """Poses before a moment are not asked for any more."""
        with self._lock:
            # Two stay whatever their age: interpolating and guessing on both need a pair.
            while len(self._poses) > 2 and self._poses[1][0] <= moment:
                self._poses.popleft()

    def at(self, moment: float) -> tuple[Pose | None, bool]:
        """The pose of a moment, None before the first, and whether somebody speaks then."""
        with self._lock:
            return self._at(moment)

    def _at(self, moment: float) -> tuple[Pose | None, bool]:
        poses = self._poses
        if not poses:
            return None, False
        # From the newest end: the moment asked for nearly always lies between the last few poses.
        after = next((i for i in range(len(poses) - 1, -1, -1) if poses[i][0] <= moment), -1) + 1
        if after == 0:
            return poses[0][1], poses[0][2]
        t, pose, speaking = poses[after - 1]
        if after == len(poses):
            guess = _guess((moment - t) / self._step)
            # Across a stall the step before says nothing of where the pose would go.
            if guess and after > 1 and t - poses[-2][0] < STALLED_S:
                pose = _beyond(poses[-2][1], pose, guess)
            return pose, speaking and moment - t < STALLED_S
        later, following, _ = poses[after]
        share = (moment - t) / max(later - t, 1e-6)
        return between(pose, following, min(max(share, 0.0), 1.0)), speaking


def _guess(frames: float) -> float:
    """How much of the last step to go on with, so many frames after the newest pose; back if none comes."""
    return TRUSTED * max(min(frames, GUESSED, 1.0 + GUESSED - frames), 0.0)


def _beyond(before: Pose, last: Pose, share: float) -> Pose:
    """The pose that follows if everything goes on as between two poses, for a share of that step."""
    pose = between(before, last, 1.0 + share)
    # Going on beyond a closed mouth would turn a shape inside out.
    return replace(pose, shapes=np.clip(pose.shapes, 0.0, 1.0))
