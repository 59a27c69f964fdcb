"""Events of commands that record, import, change and export takes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar

import msgspec

from studio.ipc.events.common import ChildEvent, DoneEvent, ProgressEvent


class BonesEvent(ChildEvent, frozen=True):
    """The bones of a file's joints were guessed, or could not be.

    Args:
        path: the file.
        bones: (joint, the bone it was taken for or "") in the file's order.
        audio: the sound that belongs to it, None without.
        take: id of the take made of it, None for none.
    """

    NAME = "bones"

    path: str
    bones: tuple[tuple[str, str], ...]
    audio: str | None = None
    take: str | None = None


class TrackingEvent(ProgressEvent, frozen=True):
    """How far the tracking of a video is, beside what was imported already.

    Args:
        path: the video.
        of: how many recordings are imported.
        jpeg: now and then what is seen, with the face's points: a JPEG in Base64.
    """

    VERBS = ("import",)

    path: str = ""
    of: int = 1
    jpeg: str = ""


class ImportDone(DoneEvent, frozen=True):
    """Ids of the takes made, and how many files failed."""

    VERBS = ("import",)

    takes: tuple[str, ...] = ()
    failed: int = 0


class RollingEvent(ChildEvent, frozen=True):
    """The recording has begun."""

    NAME = "rolling"

    port: int | None = None
    device: str | None = None


class RecordStateEvent(ChildEvent, frozen=True):
    """Counters of a recording under way.

    Args:
        state: "rolling", else it ended by itself.
        elapsed, audio_seconds: seconds.
        frames, frames_lost, frames_thinned: counts of motion frames so far.
        packets, packets_bad, packets_lost, packets_refused: counts of datagrams so far.
        frames_per_s, refused_per_s: over the last second.
        peak_dbfs: of the sound.
        problems: `what` and `remedy` of each.
    """

    NAME = "state"
    VERBS = ("record",)

    state: str = ""
    elapsed: float = 0.0
    frames: int = 0
    frames_per_s: float = 0.0
    frames_lost: int = 0
    frames_thinned: int = 0
    packets: int = 0
    packets_bad: int = 0
    packets_lost: int = 0
    packets_refused: int = 0
    refused_per_s: int = 0
    audio_seconds: float = 0.0
    peak_dbfs: float = -math.inf
    problems: tuple[Mapping[str, str], ...] = ()


class RecordDone(DoneEvent, frozen=True):
    """The take that was recorded.

    Args:
        take: its id.
        folder: where it lies.
        seconds, audio_seconds: its length, and that of its sound.
        seconds_asked: the length requested; None for none, or where it was cut off.
        frames, frames_lost, frames_thinned, fps: of its motion.
        packets, packets_bad, packets_lost, packets_refused: datagrams.
        drift_ppm: how much faster the computer's clock ran than the sound device's.
        cut_off, reason: whether it ended before its time, and why.
        verified, proof: whether the files, read again, hold all of it, in a sentence.
        notes: sentences about it.
        problems: `what` and `remedy` of each.
    """

    VERBS = ("record",)

    take: str = ""
    folder: str = ""
    seconds: float = 0.0
    seconds_asked: float | None = None
    frames: int = 0
    frames_lost: int = 0
    frames_thinned: int = 0
    fps: float = 0.0
    packets: int = 0
    packets_bad: int = 0
    packets_lost: int = 0
    packets_refused: int = 0
    audio_seconds: float = 0.0
    drift_ppm: float | None = None
    cut_off: bool = False
    reason: str | None = None
    verified: bool = False
    proof: str = ""
    notes: tuple[str, ...] = ()
    problems: tuple[Mapping[str, str], ...] = ()


class FindingEvent(ChildEvent, frozen=True):
    """Something a check found in a take; from `at` to `until` is where, seconds."""

    NAME = "finding"

    take: str = ""
    kind: str = ""
    severity: str = ""
    what: str = ""
    remedy: str = ""
    at: float | None = None
    until: float | None = None


class CheckDone(DoneEvent, frozen=True):
    """Reports of takes by their ids, as take/check.py writes them."""

    VERBS = ("check",)

    takes: Mapping[str, Mapping[str, Any]] = msgspec.field(default_factory=dict)


class FoundEvent(ChildEvent, frozen=True):
    """The file a take lacked."""

    NAME = "found"

    take: str = ""
    path: str = ""
    source: str = ""


class UnclearEvent(ChildEvent, frozen=True):
    """Several files may be the one a take lacks."""

    NAME = "unclear"

    take: str = ""
    path: str = ""


class FindDone(DoneEvent, frozen=True):
    """How many missing files were found and put back, of how many."""

    VERBS = ("find",)

    found: int = 0
    missing: int = 0


class SplitDone(DoneEvent, frozen=True):
    """Ids of all selections of a project by what they are for, and of those locked as test takes."""

    VERBS = ("split",)

    train: tuple[str, ...] = ()
    val: tuple[str, ...] = ()
    test: tuple[str, ...] = ()
    unused: tuple[str, ...] = ()
    locked: tuple[str, ...] = ()


class CutDone(DoneEvent, frozen=True):
    """Spans of each selection between its pauses, seconds."""

    VERBS = ("cut",)

    takes: Mapping[str, tuple[tuple[float, float], ...]] = msgspec.field(default_factory=dict)


class CleanDone(DoneEvent, frozen=True):
    """The cleaned sound of each take, and the way it was cleaned, "" for as recorded."""

    VERBS = ("clean",)

    takes: Mapping[str, str] = msgspec.field(default_factory=dict)
    way: str = ""


class UnpackDone(DoneEvent, frozen=True):
    """What was unpacked: a project with the number of files left out, or a run."""

    VERBS = ("unpack",)

    project: str = ""
    left_out: int = 0
    run: str = ""
    folder: str = ""


class PieceEvent(ChildEvent, frozen=True):
    """The next seconds of a motion are in a file, while the rest is made."""

    NAME = "piece"

    file: str
    start: float = 0.0
    end: float = 0.0


class QueueEvent(ChildEvent, frozen=True):
    """Names of all files that are to be made."""

    NAME = "queue"

    names: tuple[str, ...] = ()


class EntryEvent(ChildEvent, frozen=True):
    """The state of an entry of the queue changed.

    Args:
        index: which, counts from 0.
        state: "running", "done", "failed" or "cancelled".
        name: what a list calls it.
        files: those that were made.
        what, remedy: why it failed, "" else.
    """

    NAME = "entry"

    index: int
    state: str
    name: str = ""
    files: tuple[str, ...] = ()
    what: str = ""
    remedy: str = ""


class QueueProgressEvent(ProgressEvent, frozen=True):
    """How far a queue is: `index` counts the entries from 0, `entry` is how far that one is."""

    VERBS = ("generate", "export")

    index: int = 0
    entry: float = 0.0


class QueueFailure(msgspec.Struct, frozen=True):
    """An entry that came to nothing, and why."""

    name: str = ""
    what: str = ""
    remedy: str = ""


class FilesDone(DoneEvent, frozen=True):
    """Files that were made, entries that failed, and names of those that were cancelled.

    `note` says what their format leaves out, "" for nothing.
    """

    VERBS: ClassVar[tuple[str, ...]] = ("export", "pack")

    files: tuple[str, ...] = ()
    failed: tuple[QueueFailure, ...] = ()
    cancelled: tuple[str, ...] = ()
    note: str = ""


class GenerateDone(FilesDone, frozen=True):
    """Files of generated motion; of one sound how long it is, and how it was generated."""

    VERBS = ("generate",)

    seconds: float | None = None
    frames: int | None = None
    fps: float | None = None
    style: str | None = None
    seed: int | None = None
    liveliness: float | None = None


class CardDone(FilesDone, frozen=True):
    """The data card, and what it says in all."""

    VERBS = ("card",)

    takes: int = 0
    seconds: float = 0.0
    moving: int = 0


class PlayStateEvent(ChildEvent, frozen=True):
    """Position of playback, frames sent, and the status of each avatar program."""

    NAME = "state"
    VERBS = ("play",)

    position: float = 0.0
    sent: int = 0
    lights: tuple[str, ...] = ()


class PlayDone(DoneEvent, frozen=True):
    """Frames that were sent and left out, and the position reached, seconds."""

    VERBS = ("play",)

    sent: int = 0
    dropped: int = 0
    seconds: float = 0.0
