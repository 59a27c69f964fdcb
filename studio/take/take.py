"""A take: what was recorded, how, where it lies, and what was noticed about it."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

SEVERITIES = ("note", "minor", "major", "fatal")
"""A note is no fault; minor can stay; major spoils a part; fatal makes the take of no use."""


@dataclass(frozen=True)
class Finding:
    """One thing noticed.

    Args:
        kind: a word for programs ("gap", "clipping", ...).
        severity: one of SEVERITIES.
        what: one sentence.
        remedy: one sentence saying what to do about it.
        at: where in the take, seconds; None for all of it.
        until: where that ends, seconds; None for a moment.
    """

    kind: str
    severity: str
    what: str
    remedy: str
    at: float | None = None
    until: float | None = None

    def to_plain(self) -> dict[str, Any]:
        """JSON values; without `at` and `until` where there is no such moment."""
        plain: dict[str, Any] = dict(vars(self))
        return {key: value for key, value in plain.items() if value is not None}


FORMAT_VERSION = 1
NO_MOTION = "No motion"
"""Why a span is left out in which sound went on and motion did not."""
PREDICTED = "predicted by "
"""Begins the source of a take whose motion a run made; its name follows."""


@dataclass(frozen=True)
class TakeInfo:
    """What is known of a recording beside its sound and motion; the content of take.json.

    Args:
        slate: what the performer calls it.
        number: counts up within the slate.
        created: local time, ISO 8601.
        duration: seconds of the take's clock.
        audio_file: name of the sound file in the take's folder, None without sound.
        sample_rate, audio_channels, audio_seconds: of that file; 0 without sound.
        motion_file: name of the motion file, None without motion.
        frames, fps, frames_lost: motion frames kept, their median rate, and those known missing.
        shape_names, bone_names: channels that arrived.
        packets, packets_bad: datagrams received and refused.
        drift_ppm: how much faster the motion clock ran than the sound's.
        offset: seconds that the clock fit added to arrival times; the motion file has them in it already, and
            what a person moves is `Selection.offset`.
        source: "recorded", "imported" or "performer", and what from; or PREDICTED and a run.
        device: the sound device's name.
        notes: things noticed while recording or importing, one sentence each; in English in the file, which
            people of other languages may open.
        left_out: spans (start, end, why) in which nobody was tracked, seconds; what is made of the take
            excludes them at first.
        extra: avatar title, VMC state and other facts kept as they came.
    """

    slate: str
    number: int = 1
    created: str = ""
    duration: float = 0.0
    audio_file: str | None = None
    sample_rate: int = 0
    audio_channels: int = 0
    audio_seconds: float = 0.0
    motion_file: str | None = None
    frames: int = 0
    fps: float = 0.0
    frames_lost: int = 0
    shape_names: tuple[str, ...] = ()
    bone_names: tuple[str, ...] = ()
    packets: int = 0
    packets_bad: int = 0
    drift_ppm: float = 0.0
    offset: float = 0.0
    source: str = "recorded"
    device: str = ""
    notes: tuple[str, ...] = ()
    left_out: tuple[tuple[float, float, str], ...] = ()
    extra: dict[str, str] = field(default_factory=dict)
    version: int = FORMAT_VERSION

    @property
    def predicted(self) -> bool:
        """Whether a run made its motion: a network must not learn from its own guesses."""
        return self.source.startswith(PREDICTED)


@dataclass(frozen=True)
class Take:
    """A saved recording.

    Args:
        id: its folder's name, unique in a project.
        folder: where it lies.
        info: the content of its take.json.
    """

    id: str
    folder: Path
    info: TakeInfo

    @property
    def audio_path(self) -> Path | None:
        """The sound file, or None."""
        return self.folder / self.info.audio_file if self.info.audio_file else None

    @property
    def trains(self) -> bool:
        """Whether there are both sound and motion, which training needs."""
        return bool(self.info.audio_file and self.info.motion_file and self.info.frames > 1)

    @property
    def motion_path(self) -> Path | None:
        """The motion file, or None."""
        return self.folder / self.info.motion_file if self.info.motion_file else None
