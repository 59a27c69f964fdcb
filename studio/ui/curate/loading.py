"""A take read for looking at it: its motion, its peaks, and which channels move. Runs on the thread pool."""

from __future__ import annotations

from dataclasses import dataclass

from studio.errors import StudioError
from studio.motion import Motion
from studio.take.motion_file import read_motion
from studio.take.peaks import peaks
from studio.take.take import Take
from studio.ui.curate.channels import Channel, channels
from studio.ui.widgets.timeline_content import PeakSource


@dataclass(frozen=True, eq=False)
class LoadedTake:
    """What is shown of a take.

    Args:
        take: which one.
        motion: None without motion, or where it cannot be read.
        peaks: None without sound, or where it cannot be read.
        channels: of the motion.
        problems: why something could not be read.
    """

    take: Take
    motion: Motion | None
    peaks: PeakSource | None
    channels: tuple[Channel, ...] = ()
    problems: tuple[StudioError, ...] = ()

    @property
    def duration(self) -> float:
        """Seconds of the take's clock."""
        return self.take.info.duration


def load(take: Take) -> LoadedTake:
    """Read a take; what cannot be read is left out and told."""
    problems: list[StudioError] = []
    motion, loudness = None, None
    try:
        motion = read_motion(take.motion_path) if take.motion_path else None
    except StudioError as error:
        problems.append(error)
    try:
        loudness = _peaks(take)
    except StudioError as error:
        problems.append(error)
    found = channels(motion) if motion is not None else ()
    return LoadedTake(take, motion, loudness, found, tuple(problems))


def _peaks(take: Take) -> PeakSource | None:
    return peaks(take.audio_path) if take.audio_path is not None else None
