"""What Review has on its stage: a sound, what was captured with it, and what a run made of it. No widgets.

Everything that reads files here runs on the thread pool.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from studio.dataset import Selection
from studio.metrics.comparison import MotionComparison, compare
from studio.motion import Motion
from studio.motion.channels import is_mouth_shape
from studio.playback.layers import Tuning, tuned
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
    def stands_for(self) -> tuple[object, ...]:
        """What decides how it is seen and heard: where this changes it has to be read anew."""
        used = self.selection
        return self.sound, (used.in_point, used.out_point, used.offset) if used is not None else None


@dataclass(frozen=True, eq=False)
class Captured:
    """The recorded motion of a source with its trims, on the clock of its sound."""

    motion: Motion | None
    in_point: float
    out_point: float | None


@dataclass(frozen=True, eq=False)
class ReviewClip:
    """A source that was read: what was captured, how loud it is, and a player standing at its start."""

    captured: Captured
    peaks: Peaks | None
    player: Player


@dataclass(frozen=True, eq=False)
class Tuned:
    """The motion that is seen, sent and exported, and how it compares with the captured one."""

    motion: Motion
    comparison: MotionComparison | None


def review_items(project: Project, sounds: dict[Path, float]) -> tuple[ReviewItem, ...]:
    """Dropped sounds with their seconds (0 where not known yet) first, then all takes as they are heard.

    Each part that was cut from a take is an entry of its own.
    """
    used: dict[str, list[Selection]] = {}
    for selection in project.dataset.selections:
        used.setdefault(selection.take, []).append(selection)
    dropped = [ReviewItem(f"sound:{path}", path.stem, path, None, length) for path, length in sounds.items()]
    takes = [
        _source(take, selection)
        for take in project.takes
        if take.audio_path or take.motion_path
        for selection in used.get(take.id, [None])
    ]
    return (*dropped, *takes)


def _source(take: Take, selection: Selection | None) -> ReviewItem:
    if selection is None:
        return ReviewItem(f"take:{take.id}", take.id, take.audio_path, take, take.info.duration)
    start, end = selection.span(take.info.duration)
    sound = _heard(take, selection.clean)
    return ReviewItem(f"take:{selection.id}", selection.id, sound, take, end - start, selection)


def _heard(take: Take, way: str) -> Path | None:
    """The take's sound, cleaned where that was chosen and is made."""
    return sound_path(take.audio_path, way) if take.audio_path is not None else None


def load_captured(take: Take, selection: Selection | None) -> Captured:
    """Read a take's motion and apply the offset of its selection."""
    if selection is None:
        return Captured(load_motion(take), 0.0, None)
    return Captured(load_motion(take, selection.offset), selection.in_point, selection.out_point)


def load(source: ReviewItem, device: str | None) -> ReviewClip:
    """Read everything about a source.

    Args:
        device: the loudspeaker's name, None for the system's own.

    Raises:
        StudioError: motion or sound cannot be read.
    """
    take = source.take
    captured = load_captured(take, source.selection) if take else Captured(None, 0.0, None)
    duration = take.info.duration if take else 0.0
    if captured.motion is not None and len(captured.motion):
        duration = max(duration, float(captured.motion.times[-1]))
    loudness = peaks(source.sound) if source.sound else None
    return ReviewClip(captured, loudness, Player(source.sound, duration or None, device))


def tune(main: Motion, truth: Motion | None, tuning: Tuning) -> Tuned:
    """Lay the sliders over a motion and compare it with the captured one."""
    motion = tuned(main, tuning)
    return Tuned(motion, compare(truth, motion) if truth is not None else None)


def shapes_by_activity(*motions: Motion | None) -> list[str]:
    """Blend shapes of some motions: the mouth's first, since speech tells most of it, the liveliest first."""
    spread: dict[str, float] = {}
    for motion in motions:
        if motion is not None and len(motion):
            for name, value in zip(motion.shape_names, motion.shapes.std(axis=0), strict=True):
                spread[name] = max(spread.get(name, 0.0), float(value))
    return sorted(spread, key=lambda name: (not is_mouth_shape(name), -spread[name]))
