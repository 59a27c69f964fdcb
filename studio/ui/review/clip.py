"""What can be reviewed: how an item's sound and captured motion are read, and its motions tuned. No widgets.

All of it but the list of items runs on the thread pool.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from studio.dataset import Selection
from studio.metrics.comparison import MotionComparison, compare
from studio.motion import Motion
from studio.motion.channels import is_mouth_shape
from studio.playback.layers import PieceTuner, Tuning, tuned
from studio.playback.player import Player
from studio.project import Project
from studio.sound.peaks import Peaks, peaks
from studio.take import Take
from studio.take.cleaned import sound_path
from studio.take.motion_file import load_motion


@dataclass(frozen=True)
class ReviewItem:
    """Something that can be reviewed.

    Args:
        key: unique: "take:ID" of a selection, or "sound:PATH".
        title: what the list shows.
        sound: its sound, or None.
        take: the take, or None for a dropped sound.
        duration: seconds that are used, 0 where not known yet.
        selection: what is used of the take; None for a dropped sound, and for a take nothing is used of.
    """

    key: str
    title: str
    sound: Path | None
    take: Take | None = None
    duration: float = 0.0
    selection: Selection | None = None

    @property
    def content_key(self) -> tuple[object, ...]:
        """What decides how it is seen and heard: where this changes it has to be read anew."""
        used = self.selection
        if used is None:
            return self.sound, None
        return self.sound, (used.in_point, used.out_point, used.offset, used.excluded)


@dataclass(frozen=True, eq=False)
class Captured:
    """The recorded motion of an item with its trims, on the clock of its sound.

    Args:
        motion: all of it, None where there is none.
        in_point, out_point: what is used of it, seconds.
        excluded: (start, end) spans within that are left out, seconds.
    """

    motion: Motion | None
    in_point: float
    out_point: float | None
    excluded: tuple[tuple[float, float], ...] = ()

    def compared_with(self, predicted: Motion) -> MotionComparison | None:
        """Figures of a prediction over what is used, as an evaluation measures them; None without motion."""
        if self.motion is None:
            return None
        return compare(self.motion, predicted, self.in_point, self.out_point, self.excluded)

    @cached_property
    def activity(self) -> dict[str, float]:
        """How much each blend shape moves: its standard deviation, by name."""
        return _Activity().of(self.motion) if self.motion is not None else {}


@dataclass(frozen=True, eq=False)
class ReviewClip:
    """An item that was read: what was captured, how loud it is, and a player standing at its start."""

    captured: Captured
    peaks: Peaks | None
    player: Player


@dataclass(frozen=True, eq=False)
class Tuned:
    """The motion that is seen, sent and exported.

    Args:
        motion: with the sliders over it.
        comparison: how it compares with the captured one, None where there is none or it is still growing.
        activity: how much each blend shape moves: its standard deviation, by name.
    """

    motion: Motion
    comparison: MotionComparison | None
    activity: dict[str, float]


def sound_key(sound: Path) -> str:
    """The key of a dropped sound's item."""
    return f"sound:{sound}"


def review_items(project: Project, sounds: dict[Path, float]) -> tuple[ReviewItem, ...]:
    """Dropped sounds with their seconds (0 where not known yet) first, then all takes as they are heard.

    Each part that was cut from a take is an entry of its own.
    """
    used: dict[str, list[Selection]] = {}
    for selection in project.dataset.selections:
        used.setdefault(selection.take, []).append(selection)
    dropped = [ReviewItem(sound_key(path), path.stem, path, None, length) for path, length in sounds.items()]
    # One whose sound and motion are both missing has nothing to show.
    takes = [
        _item_of(take, selection)
        for take in project.takes
        if take.audio_path or take.motion_path
        for selection in used.get(take.id, [None])
    ]
    return (*dropped, *takes)


def _item_of(take: Take, selection: Selection | None) -> ReviewItem:
    if selection is None:
        return ReviewItem(f"take:{take.id}", take.id, take.audio_path, take, take.info.duration)
    start, end = selection.span(take.info.duration)
    # The cleaned sound where that was chosen and is made, else the recording.
    sound = sound_path(take.audio_path, selection.clean) if take.audio_path is not None else None
    return ReviewItem(f"take:{selection.id}", selection.id, sound, take, end - start, selection)


def load_captured(take: Take, selection: Selection | None) -> Captured:
    """Read a take's motion and apply the offset of its selection."""
    if selection is None:
        return Captured(load_motion(take), 0.0, None)
    motion = load_motion(take, selection.offset)
    return Captured(motion, selection.in_point, selection.out_point, selection.excluded)


def load(item: ReviewItem, device: str | None) -> ReviewClip:
    """Read everything about an item.

    Args:
        device: the loudspeaker's name, None for the system's own.

    Raises:
        StudioError: motion or sound cannot be read.
    """
    take = item.take
    captured = load_captured(take, item.selection) if take else Captured(None, 0.0, None)
    duration = take.info.duration if take else 0.0
    if captured.motion is not None and len(captured.motion):
        # The motion may be longer than the sound, and is shown to its end.
        duration = max(duration, float(captured.motion.times[-1]))
    # Here, where nobody waits: an hour of it takes a while to read through.
    _ = captured.activity
    loudness = peaks(item.sound) if item.sound else None
    return ReviewClip(captured, loudness, Player(item.sound, duration or None, device))


class MotionTuner:
    """Lays the sliders over one motion of the stage, and does only what is new.

    A motion that grows is worked on piece by piece, and one that is the same as before comes back as it is.
    Not for several threads at a time.
    """

    def __init__(self) -> None:
        self._last: tuple[Motion, Captured | None, Tuning, Tuned] | None = None
        self._pieces: PieceTuner | None = None
        self._activity = _Activity()

    def tuned(
        self, motion: Motion, truth: Captured | None, tuning: Tuning, complete: bool = True
    ) -> Tuned | None:
        """A motion with the sliders over it.

        Args:
            motion: of one item and run; while it grows, what was given before with more frames behind it.
            truth: what it is compared with once it is complete.
            tuning: the sliders.
            complete: all of the motion is there.

        Returns:
            None while the beginning is too short to know what the sliders make of it.
        """
        if not complete:
            return self._grown(motion, tuning)
        self._pieces = None
        if self._last is not None:
            last_motion, last_truth, last_tuning, found = self._last
            if last_motion is motion and last_truth is truth and last_tuning == tuning:
                return found
        # As a whole, although its pieces were tuned: only now is the mean known that strengths refer to,
        # and a comparison counts every frame.
        whole = tuned(motion, tuning)
        comparison = truth.compared_with(whole) if truth is not None else None
        found = Tuned(whole, comparison, _Activity().of(whole))
        self._last = motion, truth, tuning, found
        return found

    def _grown(self, motion: Motion, tuning: Tuning) -> Tuned | None:
        if self._pieces is None or self._pieces.tuning != tuning:
            self._pieces, self._activity = PieceTuner(tuning), _Activity()
        beginning = self._pieces.tuned(motion)
        return Tuned(beginning, None, self._activity.of(beginning)) if beginning is not None else None


class _Activity:
    """Standard deviations of blend shapes, of a motion that may grow: frames are counted once."""

    def __init__(self) -> None:
        self._frames = 0
        self._sum: NDArray[np.float64] | float = 0.0
        self._squares: NDArray[np.float64] | float = 0.0

    def of(self, motion: Motion) -> dict[str, float]:
        """By name, of all frames of a motion; those seen in the call before are not read again."""
        new = motion.shapes[self._frames :]
        self._frames = len(motion)
        if not self._frames:
            return {}
        self._sum = self._sum + new.sum(axis=0, dtype=np.float64)
        self._squares = self._squares + np.einsum("ij,ij->j", new, new, dtype=np.float64)
        # Weights lie in 0..1, so that double precision leaves the difference of squares 12 digits or more.
        mean = self._sum / self._frames
        deviation = np.sqrt(np.maximum(self._squares / self._frames - mean**2, 0.0))
        return {name: float(value) for name, value in zip(motion.shape_names, deviation, strict=True)}


def most_active_first(activity: Mapping[str, float]) -> list[str]:
    """Blend shapes by how much they move: the mouth's first, since speech tells most of it."""
    return sorted(activity, key=lambda name: (not is_mouth_shape(name), -activity[name]))
