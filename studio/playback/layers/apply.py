"""Applies a tuning to a whole motion, or to a stream of poses."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from studio.motion import Motion, MotionBuffer, Pose, concatenate
from studio.playback.layers import foot_lock, regions, strength
from studio.playback.layers.idle import (
    CLEAR,
    INFERRED,
    LONGEST,
    Blinks,
    Saccades,
    blinking,
    blinks_of,
    breathing,
    swaying,
    with_saccades,
)
from studio.playback.layers.regions import Reference, is_lid
from studio.playback.layers.strength import StreamSmoothing, reach, smoothed
from studio.playback.layers.tuning import Tuning

BLOCK = 8192
"""Frames worked on at a time, so that an hour of motion needs no more memory than a few minutes."""
SETTLING = 10.0
"""Seconds of a stream whose mean posture is the reference of what follows, where none is given."""


def tuned(motion: Motion, tuning: Tuning, reference: Reference | None = None) -> Motion:
    """A motion with all layers of a tuning over it; the very same where the tuning is neutral.

    Args:
        motion: T frames.
        tuning: what to do.
        reference: the posture that strengths and masks refer to; the motion's mean where None.
    """
    if tuning.neutral:
        return motion
    if tuning.smoothing > 0:
        # First: strength would enlarge the tracker's trembling together with the movement.
        motion = smoothed(motion, tuning.smoothing)
    layers = Layers(tuning)
    if len(motion) and not layers.empty:
        seen = tuning.blinks > 0 and "eyes" in tuning.moves
        # Of the whole motion and not of a block: a blink may lie across the border of two.
        inferred = blinks_of(motion) if seen else np.zeros(0)
        motion = _in_blocks(layers, motion, reference or Reference.of(motion), inferred)
    if tuning.left_out:
        motion = regions.without(motion, tuning.moves)
    return motion.shifted(tuning.offset_ms / 1000.0) if tuning.offset_ms else motion


class Layers:
    """The layers of a tuning that need no other frame than the one they change.

    Args:
        tuning: what to do.
    """

    def __init__(self, tuning: Tuning) -> None:
        self._tuning = tuning
        self.empty = replace(tuning, smoothing=0.0, offset_ms=0.0).neutral
        """Whether nothing is left to do once a motion is smoothed and shifted."""
        self._blinks = Blinks(tuning.blinks, tuning.seed) if tuning.blinks > 0 else None
        self._darts = Saccades(tuning.darts, tuning.seed) if tuning.darts > 0 else None

    def over(
        self, motion: Motion, reference: Reference, inferred: NDArray[np.float64], ahead: float = CLEAR
    ) -> Motion:
        """Some frames with the layers over them.

        Args:
            motion: T frames.
            reference: the posture of their bones.
            inferred, ahead: when it blinks by itself; see Blinks.lids.
        """
        tuning = self._tuning
        # In this order: strengths act on what was captured, masks hold the rest, life is laid over both.
        motion = strength.strengthened(motion, tuning, reference)
        motion = strength.single_shapes(motion, tuning)
        if tuning.top_vowels:
            motion = strength.two_vowels(motion)
        motion = regions.held(motion, tuning.moves, reference)
        if self._blinks is not None:
            motion = blinking(motion, self._blinks, inferred, ahead)
        if self._darts is not None:
            motion = with_saccades(motion, self._darts)
        if tuning.breath > 0:
            motion = breathing(motion, tuning.breath)
        if tuning.sway > 0:
            motion = swaying(motion, tuning.sway, tuning.seed)
        if tuning.lock_root:
            motion = foot_lock.in_place(motion, reference)
        # Last: breath and sway move the hips, and the feet must not follow.
        return foot_lock.with_foot_lock(motion, reference) if tuning.plant_feet else motion


def _in_blocks(layers: Layers, motion: Motion, posture: Reference, inferred: NDArray[np.float64]) -> Motion:
    """Layers over a motion of at least one frame, some thousand frames at a time."""
    blocks = [
        layers.over(motion.at_rows(slice(start, start + BLOCK)), posture, inferred)
        for start in range(0, len(motion), BLOCK)
    ]
    return blocks[0] if len(blocks) == 1 else concatenate(blocks)


class PieceTuner:
    """Lays a tuning over a motion that is still growing: each call works on the frames that are new.

    It gives what `tuned` gives for the same frames, but for the posture that strengths and masks refer to:
    the mean of all frames is known at the end only. Meanwhile it is the mean of what there was when the
    length last doubled, from where all is tuned anew: twice the work in all, however long it gets. So tune
    the whole with `tuned` once it is there. The newest frames are held back for as long as frames that come
    after them could change them. Not for several threads at a time.

    Args:
        tuning: what to do.
        reference: the posture that strengths and masks refer to, where it is known.
    """

    def __init__(self, tuning: Tuning, reference: Reference | None = None) -> None:
        self.tuning = tuning
        self._layers = Layers(tuning)
        self._given = reference
        self._reference = reference
        self._fps = 0.0
        self._seen = 0  # frames there were when the reference was worked out
        self._done = 0  # frames that are tuned
        self._out = MotionBuffer()

    def tuned(self, motion: Motion) -> Motion | None:
        """The beginning of a motion with the tuning over it, None while all of it is held back.

        Args:
            motion: what was given before, with more frames behind it.
        """
        if self.tuning.neutral:
            return motion
        count = len(motion)
        if count >= 2 * self._seen and count:
            self._begin_anew(motion)
        around = self._frames_around()
        ready = count - around
        if ready > self._done:
            # The frames before are worked on once more, as the surroundings of the first new one.
            start = max(self._done - around, 0)
            part = self._over(motion.at_rows(slice(start, count)))
            self._out.append(part.at_rows(slice(self._done - start, ready - start)))
            self._done = ready
        return self._out.motion if self._done else None

    def _begin_anew(self, motion: Motion) -> None:
        self._seen, self._done, self._out = len(motion), 0, MotionBuffer()
        self._fps = motion.fps
        self._reference = self._given or Reference.of(motion)

    def _frames_around(self) -> int:
        """How many frames on either side decide about a frame."""
        around = reach(self.tuning.smoothing, self._fps)
        if self.tuning.blinks > 0:  # one that the motion has by itself keeps others away
            around += math.ceil((CLEAR + LONGEST) * self._fps)
        return around

    def _over(self, motion: Motion) -> Motion:
        tuning = self.tuning
        if tuning.smoothing > 0:
            motion = smoothed(motion, tuning.smoothing, self._fps)
        if not self._layers.empty:
            assert self._reference is not None
            seen = tuning.blinks > 0 and "eyes" in tuning.moves
            inferred = blinks_of(motion) if seen else np.zeros(0)
            motion = _in_blocks(self._layers, motion, self._reference, inferred)
        if tuning.left_out:
            motion = regions.without(motion, tuning.moves)
        return motion.shifted(tuning.offset_ms / 1000.0) if tuning.offset_ms else motion


class Tuner:
    """Lays a tuning over one pose after another: for a stream, whose future nobody knows.

    It gives what `tuned` gives for the whole motion with the same reference, but for three things: smoothing
    lags by its time constant, a blink of its own may come less than a second before an inferred one, and the
    offset is left to whoever sends. Not for several threads at a time.

    Args:
        tuning: what to do.
        shape_names, bone_names: S and J channels of the poses that come.
        reference: the posture that strengths and masks refer to, best that of the training takes; the mean of
            the first seconds where None.
    """

    def __init__(
        self,
        tuning: Tuning,
        shape_names: tuple[str, ...],
        bone_names: tuple[str, ...],
        reference: Reference | None = None,
    ) -> None:
        self._names = shape_names, bone_names
        self._lids = [i for i, name in enumerate(shape_names) if is_lid(name)]
        self._given, self._reference = reference is not None, reference
        self._seen = 0.0
        # NaN, so that the first pose counts as no step of time.
        self._last = float("nan")
        self._inferred: list[float] = []
        self.retune(tuning)

    @property
    def shape_names(self) -> tuple[str, ...]:
        """Channels of the poses that go out."""
        return tuple(self._names[0][i] for i in self._columns[0])

    @property
    def bone_names(self) -> tuple[str, ...]:
        """Channels of the poses that go out."""
        return tuple(self._names[1][i] for i in self._columns[1])

    def retune(self, tuning: Tuning) -> None:
        """Another tuning from the next pose on."""
        shape_names, bone_names = self._names
        self._tuning = tuning
        self._layers = Layers(tuning)
        self._smoothing = StreamSmoothing(shape_names, tuning.smoothing) if tuning.smoothing > 0 else None
        everything = list(range(len(shape_names))), list(range(len(bone_names)))
        self._columns = regions.kept(shape_names, bone_names, tuning.moves) if tuning.left_out else everything

    def pose(self, t: float, pose: Pose) -> Pose:
        """A pose with the layers over it.

        Args:
            t: its moment in seconds on any clock that begins near 0: blinks, darts and sway follow from it.
            pose: S shapes, J bones.
        """
        reference = self._posture(t, pose)
        if self._smoothing is not None:
            pose = self._smoothing.pose(t, pose)
        if not self._layers.empty:
            one = self._layers.over(self._as_motion(t, pose), reference, self._blinked(t, pose), ahead=0.0)
            pose = one.row(0)
        if not self._tuning.left_out:
            return pose
        shapes, bones = self._columns
        return replace(
            pose, shapes=pose.shapes[shapes], positions=pose.positions[bones], rotations=pose.rotations[bones]
        )

    def _as_motion(self, t: float, pose: Pose) -> Motion:
        parts = (pose.positions, pose.rotations, pose.root_position, pose.root_rotation)
        names = self._names
        return Motion(np.array([t]), names[0], pose.shapes[None], names[1], *(part[None] for part in parts))

    def _posture(self, t: float, pose: Pose) -> Reference:
        """The reference, which settles on the mean of the first seconds where none was given."""
        step = t - self._last
        self._last = t
        if self._reference is None:
            self._reference = Reference.of_pose(self._names[1], pose)
        # Only while time goes on evenly: a pause or a seek is no time that the performer was seen for.
        elif not self._given and self._seen < SETTLING and 0.0 < step < 1.0:
            self._seen += step
            self._reference = self._reference.towards(pose, min(step / self._seen, 1.0))
        return self._reference

    def _blinked(self, t: float, pose: Pose) -> NDArray[np.float64]:
        """When the poses blinked by themselves lately."""
        self._inferred = [moment for moment in self._inferred if t - 3.0 * CLEAR < moment < t]
        seen = bool(self._lids) and "eyes" in self._tuning.moves
        if seen and pose.shapes[self._lids].max() > INFERRED:
            self._inferred.append(t)
        return np.array(self._inferred)
