"""Every event a command prints with --json, as a frozen type (no Qt, no torch, no numpy).

NAME is the line's `event`; VERBS are the commands that mean this by it, () for all that use the name.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, ClassVar

Figures = Mapping[str, float | None]
"""Metrics by name; None where one does not apply."""
Row = tuple[float | None, ...]
Rows = tuple[Row, ...]


@dataclass(frozen=True)
class ChildEvent:
    """One line of output."""

    NAME: ClassVar[str] = ""
    VERBS: ClassVar[tuple[str, ...]] = ()


# -- said by many commands -----------------------------------------------------------------------


@dataclass(frozen=True)
class NoteEvent(ChildEvent):
    """Something worth knowing, one sentence.

    Args:
        text: the sentence.
        note: the same, from commands that call it so.
        take: whom it is about, "" for nobody.
    """

    NAME = "note"

    text: str = ""
    note: str = ""
    take: str = ""


@dataclass(frozen=True)
class ProblemEvent(ChildEvent):
    """Something went wrong, and the command goes on.

    Args:
        what, remedy: one sentence each.
        path: the file it is about, "" for none.
        fraction: how much of the work is done, None where nobody counts.
    """

    NAME = "problem"

    what: str = ""
    remedy: str = ""
    path: str = ""
    fraction: float | None = None


@dataclass(frozen=True)
class NoticeEvent(ChildEvent):
    """What a performance or playback tells while it goes on: a fault, or that one is over."""

    NAME = "notice"

    what: str = ""
    remedy: str = ""


@dataclass(frozen=True)
class RecoveredEvent(ChildEvent):
    """A take whose recording was cut off is whole again."""

    NAME = "recovered"

    take: str = ""
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class NotRecoveredEvent(ChildEvent):
    """A recording that was cut off could not be made a take."""

    NAME = "not_recovered"

    folder: str = ""
    what: str = ""
    remedy: str = ""


@dataclass(frozen=True)
class UnfinishedEvent(ChildEvent):
    """A recording that is no take yet is packed as it lies."""

    NAME = "unfinished"

    folder: str = ""
    what: str = ""


@dataclass(frozen=True)
class ProgressEvent(ChildEvent):
    """How far a command is.

    Args:
        fraction: 0..1.
        eta_s: seconds left, None where nobody can tell.
    """

    NAME = "progress"

    fraction: float = 0.0
    eta_s: float | None = None


@dataclass(frozen=True)
class TakeProgressEvent(ProgressEvent):
    """How far a command is, and at which take it works."""

    VERBS = ("cut", "clean")

    take: str = ""


@dataclass(frozen=True)
class TakeEvent(ChildEvent):
    """A command is done with a take: it is imported, checked, cut, cleaned or made.

    Args:
        take: its id.
        fraction: how much of the whole work is done, None where nobody counts.
        grade: of `check`.
        path: the file it was imported from.
        file: its cleaned sound.
        notes: sentences about it.
        parts: spans it was cut into, seconds.
    """

    NAME = "take"

    take: str = ""
    fraction: float | None = None
    grade: str = ""
    path: str = ""
    file: str = ""
    notes: tuple[str, ...] = ()
    parts: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True)
class DoneEvent(ChildEvent):
    """The last line of every command that ended well."""

    NAME = "done"


@dataclass(frozen=True)
class ErrorEvent(ChildEvent):
    """The last line of a command that failed.

    Args:
        what, remedy: one sentence each.
        code: what programs decide by, see StudioError.
        in_window: what to do about it in the window, where that is something else.
        there: the file that would have been written over, "" where that is not why.
        log: where the details lie.
    """

    NAME = "error"

    what: str = ""
    remedy: str = ""
    code: str = "failed"
    in_window: str = ""
    there: str = ""
    log: str = ""


# -- import, record, check, find, cut, pack ------------------------------------------------------


@dataclass(frozen=True)
class BonesEvent(ChildEvent):
    """The bones of a file's joints were guessed, or could not be.

    Args:
        path: the file.
        bones: (joint, the bone it was taken for or "") in the file's order.
        audio: the sound that belongs to it, "" without.
        take: id of the take made of it, "" for none.
    """

    NAME = "bones"

    path: str
    bones: tuple[tuple[str, str], ...]
    audio: str = ""
    take: str = ""


@dataclass(frozen=True)
class ImportDone(DoneEvent):
    """Ids of the takes made, and how many files failed."""

    VERBS = ("import",)

    takes: tuple[str, ...] = ()
    failed: int = 0


@dataclass(frozen=True)
class RollingEvent(ChildEvent):
    """The recording has begun."""

    NAME = "rolling"

    port: int | None = None
    device: str = ""


@dataclass(frozen=True)
class RecordStateEvent(ChildEvent):
    """How a recording stands.

    Args:
        state: "rolling", else it ended by itself.
        elapsed, audio_seconds: seconds.
        frames, frames_lost, packets, packets_bad: counts so far.
        peak_dbfs: of the sound.
        problems: `what` and `remedy` of each.
    """

    NAME = "state"
    VERBS = ("record",)

    state: str = ""
    elapsed: float = 0.0
    frames: int = 0
    frames_lost: int = 0
    packets: int = 0
    packets_bad: int = 0
    audio_seconds: float = 0.0
    peak_dbfs: float = -math.inf
    problems: tuple[Mapping[str, str], ...] = ()


@dataclass(frozen=True)
class RecordDone(DoneEvent):
    """The take that was recorded."""

    VERBS = ("record",)

    take: str = ""
    seconds: float = 0.0
    frames: int = 0
    frames_lost: int = 0
    packets: int = 0
    packets_bad: int = 0
    audio_seconds: float = 0.0
    drift_ppm: float | None = None


@dataclass(frozen=True)
class FindingEvent(ChildEvent):
    """Something a check found in a take; `at` is where, seconds."""

    NAME = "finding"

    take: str = ""
    kind: str = ""
    severity: str = ""
    what: str = ""
    remedy: str = ""
    at: float | None = None


@dataclass(frozen=True)
class CheckDone(DoneEvent):
    """Reports of takes by their ids, as take/check.py writes them."""

    VERBS = ("check",)

    takes: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)


@dataclass(frozen=True)
class FoundEvent(ChildEvent):
    """The file a take lacked."""

    NAME = "found"

    take: str = ""
    path: str = ""
    source: str = ""


@dataclass(frozen=True)
class UnclearEvent(ChildEvent):
    """Several files may be the one a take lacks."""

    NAME = "unclear"

    take: str = ""
    path: str = ""


@dataclass(frozen=True)
class UnpackDone(DoneEvent):
    """What was unpacked: a project with the number of files left out, or a run."""

    VERBS = ("unpack",)

    project: str = ""
    left_out: int = 0
    run: str = ""
    folder: str = ""


# -- train, evaluate, compare, suggest, card, encoder --------------------------------------------


@dataclass(frozen=True)
class StartedEvent(ChildEvent):
    """Training begins.

    Args:
        run: the run's id.
        folder: where it lies.
        recipe: its recipe.
        of: epochs planned.
        resumed_from: the last finished epoch it goes on after; 0 for a new run.
        train, val: ids of the selections used.
        frames: motion frames trained on.
        parameters: numbers in the network.
        device: what it runs on.
    """

    NAME = "started"
    VERBS = ("train",)

    run: str
    folder: str = ""
    recipe: str = ""
    of: int = 0
    resumed_from: int = 0
    train: tuple[str, ...] = ()
    val: tuple[str, ...] = ()
    frames: int = 0
    parameters: int = 0
    device: str = "cpu"


@dataclass(frozen=True)
class PreparingEvent(ChildEvent):
    """The takes are read."""

    NAME = "preparing"


@dataclass(frozen=True)
class CleaningEvent(ChildEvent):
    """Before training starts: the cleaned sound of a take is made, since that was chosen and it is not there.

    Args:
        take: whose.
        fraction: how much of it is done, 0..1.
    """

    NAME = "cleaning"

    take: str
    fraction: float = 0.0


@dataclass(frozen=True)
class ListeningEvent(ChildEvent):
    """Before training starts: what a take sounds like is worked out, slowly by a speech encoder.

    Args:
        take: whose.
        number: which it is, counts from 1.
        of: how many there are.
    """

    NAME = "listening"

    take: str
    number: int = 0
    of: int = 0


@dataclass(frozen=True)
class EpochEvent(ChildEvent):
    """One epoch is over.

    Args:
        epoch: counts from 1.
        of: epochs planned.
        train_loss: mean over its steps; NaN where it is not known.
        val_loss: on the validation takes; NaN likewise.
        val: metrics on the validation takes; None where one does not apply.
        seconds: since training began, earlier sittings of a resumed run included.
        eta_s: seconds still to go, by the pace so far.
        best: whether its weights are now the ones kept as best.
        still: whether the model hardly moves.
        advice: what to try then, "" else.
    """

    NAME = "epoch"

    epoch: int
    of: int = 0
    train_loss: float = math.nan
    val_loss: float = math.nan
    val: Figures = field(default_factory=dict)
    seconds: float = math.nan
    eta_s: float = math.nan
    best: bool = False
    still: bool = False
    advice: str = ""

    def as_dict(self) -> dict[str, Any]:
        """Plain JSON values, numbers that are not finite as None; the line of metrics.jsonl."""
        facts = asdict(self)
        facts["val"] = {key: _finite(value) for key, value in self.val.items()}
        return {key: _finite(v) if isinstance(v, float) else v for key, v in facts.items()}

    @classmethod
    def from_dict(cls, facts: Mapping[str, Any]) -> EpochEvent:
        """The epoch in a line of metrics.jsonl, which somebody may have edited; unknown keys are passed over.

        Raises:
            KeyError, TypeError, ValueError: it has no number.
        """

        def number(key: str) -> float:
            value = facts.get(key)
            return float(value) if isinstance(value, int | float) else math.nan

        val, of = facts.get("val"), number("of")
        return cls(
            int(facts["epoch"]),
            int(of) if math.isfinite(of) else 0,
            number("train_loss"),
            number("val_loss"),
            dict(val) if isinstance(val, dict) else {},
            number("seconds"),
            number("eta_s"),
            bool(facts.get("best", False)),
            bool(facts.get("still", False)),
            str(facts.get("advice") or ""),
        )


@dataclass(frozen=True)
class StepEvent(ChildEvent):
    """An epoch takes long and goes on; told at most once a second, and kept nowhere.

    Args:
        epoch: the one under way, counts from 1.
        of: epochs planned.
        step: steps of it that are done.
        steps: steps it has.
        train_loss: mean over those that are done.
        seconds: since training began, earlier sittings of a resumed run included.
        eta_s: seconds still to go, by the pace so far.
    """

    NAME = "step"
    VERBS = ("train",)

    epoch: int
    of: int = 0
    step: int = 0
    steps: int = 0
    train_loss: float = math.nan
    seconds: float = math.nan
    eta_s: float = math.nan


@dataclass(frozen=True)
class OutOfMemoryEvent(ChildEvent):
    """The memory was not enough; the failure itself is told as always.

    Args:
        run: id of the run it had begun, "" for none.
        setting: what may fit, as --set takes it; "" where it is as small as can be.
    """

    NAME = "out_of_memory"

    run: str = ""
    setting: str = ""


@dataclass(frozen=True)
class LookAheadsEvent(ChildEvent):
    """How well a run does at each look-ahead is measured: the one at work, and how many are done."""

    NAME = "look_aheads"

    ms: int = 0
    done: int = 0
    of: int = 0
    fraction: float = 0.0


@dataclass(frozen=True)
class RecipeEvent(ChildEvent):
    """A recipe there is."""

    NAME = "recipe"

    name: str = ""
    title: str = ""


@dataclass(frozen=True)
class ChosenEvent(ChildEvent):
    """The recipe whose settings follow."""

    NAME = "chosen"

    recipe: str = ""


@dataclass(frozen=True)
class SettingEvent(ChildEvent):
    """Something --set can change, and its value."""

    NAME = "setting"

    key: str = ""
    value: Any = None


@dataclass(frozen=True)
class TrainDone(DoneEvent):
    """The run that was trained; `stopped` where somebody asked to end early."""

    VERBS = ("train",)

    run: str = ""
    folder: str = ""
    best_epoch: int | None = None
    stopped: bool = False


@dataclass(frozen=True)
class MeasureProgressEvent(ProgressEvent):
    """How far measuring is: `run` is measured on `take`, and `done` of `of` takes are."""

    VERBS = ("evaluate", "compare")

    run: str = ""
    take: str = ""
    done: int = 0
    of: int = 0


@dataclass(frozen=True)
class EvaluateDone(DoneEvent):
    """Figures of a run, in all and by take, and of the simple guesses it has to beat."""

    VERBS = ("evaluate",)

    run: str = ""
    split: str = ""
    takes: tuple[str, ...] = ()
    style: str = ""
    metrics: Figures = field(default_factory=dict)
    per_take: Mapping[str, Figures] = field(default_factory=dict)
    baselines: Mapping[str, Figures] = field(default_factory=dict)


@dataclass(frozen=True)
class MeasuredEvent(ChildEvent):
    """A run (compare) or a selection (suggest) is measured."""

    NAME = "measured"

    run: str = ""
    take: str = ""
    fraction: float | None = None
    metrics: Figures = field(default_factory=dict)


@dataclass(frozen=True)
class BaselinesEvent(ChildEvent):
    """The simple guesses are being made: which, on which take, and how far that is."""

    NAME = "baselines"

    name: str = ""
    take: str = ""
    done: int = 0
    of: int = 0
    fraction: float = 0.0


@dataclass(frozen=True)
class CompareDone(DoneEvent):
    """Figures of runs and of simple guesses by their names, and of what was captured."""

    VERBS = ("compare",)

    split: str = ""
    takes: tuple[str, ...] = ()
    runs: Mapping[str, Figures] = field(default_factory=dict)
    baselines: Mapping[str, Figures] = field(default_factory=dict)
    captured: Figures = field(default_factory=dict)


@dataclass(frozen=True)
class CheckedEvent(ChildEvent):
    """A take is looked at, and how much of all is."""

    NAME = "checked"

    take: str = ""
    fraction: float = 0.0


@dataclass(frozen=True)
class SuggestionEvent(ChildEvent):
    """One thing worth a look, as dataset/suggest.py ranks it."""

    NAME = "suggestion"

    selection: str = ""
    kind: str = ""
    weight: float = 0.0
    what: str = ""
    remedy: str = ""
    span: tuple[float, float] | None = None


@dataclass(frozen=True)
class ErrorSpan:
    """Where a run errs much more than elsewhere, seconds, and by how many times."""

    start: float
    end: float
    ratio: float


@dataclass(frozen=True)
class SuggestDone(DoneEvent):
    """How many suggestions there are, and spans of large error by selection."""

    VERBS = ("suggest",)

    count: int = 0
    run: str = ""
    worst: Mapping[str, tuple[ErrorSpan, ...]] = field(default_factory=dict)


@dataclass(frozen=True)
class ReadEvent(ChildEvent):
    """The words of a data card are counted this far."""

    NAME = "read"

    fraction: float = 0.0


@dataclass(frozen=True)
class DownloadProgressEvent(ProgressEvent):
    """How much of a speech encoder is here: `bytes` of `of`, which is 0 where nobody knows."""

    VERBS = ("encoder",)

    bytes: int = 0
    of: int = 0


@dataclass(frozen=True)
class EncoderEvent(ChildEvent):
    """A speech encoder, and whether it is here."""

    NAME = "encoder"

    name: str = ""
    here: bool = False
    folder: str = ""


# -- generate, export, play ----------------------------------------------------------------------


@dataclass(frozen=True)
class PieceEvent(ChildEvent):
    """The next seconds of a motion are in a file, while the rest is made."""

    NAME = "piece"

    file: str
    start: float = 0.0
    end: float = 0.0


@dataclass(frozen=True)
class QueueEvent(ChildEvent):
    """Names of all files that are to be made."""

    NAME = "queue"

    names: tuple[str, ...] = ()


@dataclass(frozen=True)
class EntryEvent(ChildEvent):
    """An entry of the queue stands otherwise than before.

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


@dataclass(frozen=True)
class QueueProgressEvent(ProgressEvent):
    """How far a queue is: `index` counts the entries from 0, `entry` is how far that one is."""

    VERBS = ("generate", "export")

    index: int = 0
    entry: float = 0.0


@dataclass(frozen=True)
class QueueFailure:
    """An entry that came to nothing, and why."""

    name: str = ""
    what: str = ""
    remedy: str = ""


@dataclass(frozen=True)
class FilesDone(DoneEvent):
    """Files that were made, entries that failed, and names of those that were cancelled.

    `note` says what their format leaves out, "" for nothing.
    """

    VERBS: ClassVar[tuple[str, ...]] = ("export", "pack")

    files: tuple[str, ...] = ()
    failed: tuple[QueueFailure, ...] = ()
    cancelled: tuple[str, ...] = ()
    note: str = ""


@dataclass(frozen=True)
class GenerateDone(FilesDone):
    """Files of generated motion; of one sound how long it is, and how it was generated."""

    VERBS = ("generate",)

    seconds: float | None = None
    frames: int | None = None
    fps: float | None = None
    style: str | None = None
    seed: int | None = None
    liveliness: float | None = None


@dataclass(frozen=True)
class CardDone(FilesDone):
    """The data card, and what it says in all."""

    VERBS = ("card",)

    takes: int = 0
    seconds: float = 0.0
    moving: int = 0


@dataclass(frozen=True)
class PlayStateEvent(ChildEvent):
    """Where playback stands, and how each avatar program does."""

    NAME = "state"
    VERBS = ("play",)

    position: float = 0.0
    sent: int = 0


# -- live ----------------------------------------------------------------------------------------


@dataclass(frozen=True)
class ReadyEvent(ChildEvent):
    """What is known once, when a performance begins.

    Args:
        source: the microphone or file that is heard.
        look_aheads: those offered, milliseconds, the shortest first.
        look_ahead_ms, reach_ms: the one in use.
        shape_names, bone_names: channels of the poses.
        positions: where bones rest (J, 3).
    """

    NAME = "ready"

    source: str
    look_aheads: tuple[int, ...]
    look_ahead_ms: int
    reach_ms: float
    shape_names: tuple[str, ...]
    bone_names: tuple[str, ...]
    positions: Rows


@dataclass(frozen=True)
class ChannelsEvent(ChildEvent):
    """Other channels from now on: layers leave some out. Fields as in `ReadyEvent`."""

    NAME = "channels"

    shape_names: tuple[str, ...]
    bone_names: tuple[str, ...]
    positions: Rows


@dataclass(frozen=True)
class PoseEvent(ChildEvent):
    """The pose to be seen now, and the level of the sound.

    Args:
        shapes: by shape (S,).
        rotations: by bone (J, 4).
        positions: of the first bones (up to J, 3); the others rest.
        root_position, root_rotation: (3,) and (4,).
        peak_dbfs, rms_dbfs: the level.
    """

    NAME = "pose"

    shapes: Row
    rotations: Rows
    positions: Rows
    root_position: Row
    root_rotation: Row
    peak_dbfs: float
    rms_dbfs: float


@dataclass(frozen=True)
class LiveTarget:
    """How an avatar program does that is sent to.

    Args:
        to: HOST:PORT.
        light: its TargetStatus.
        sent, dropped: frames.
        what, remedy: what is wrong with it, "" for nothing.
    """

    to: str
    light: str
    sent: int = 0
    dropped: int = 0
    what: str = ""
    remedy: str = ""


@dataclass(frozen=True)
class LiveStateEvent(ChildEvent):
    """How a performance stands, some ten times a second.

    Args:
        speaking: whether somebody speaks.
        gain_db: the automatic gain.
        latency_ms: how long after a sound its pose is sent; 0 before it is known.
        sound_delay_ms: how much to delay the sound to match.
        seen: "unseen", "seen" or "minded" by viewers.
        muted, frozen, neutral, gain_on, idles: the switches.
        clipped: the sound clipped.
        lost: no sound comes from the microphone.
        idling: how far the avatar idles, 0 to 1.
        load: share of a core used.
        targets: how each target does.
    """

    NAME = "state"
    VERBS = ("live",)

    speaking: bool
    gain_db: float
    latency_ms: float
    sound_delay_ms: int
    seen: str
    muted: bool
    frozen: bool
    neutral: bool
    gain_on: bool
    idles: bool
    clipped: bool
    lost: bool
    idling: float
    load: float
    targets: tuple[LiveTarget, ...] = ()


@dataclass(frozen=True)
class LookAheadEvent(ChildEvent):
    """Another look-ahead is in use."""

    NAME = "look_ahead"

    look_ahead_ms: int
    reach_ms: float = 0.0


@dataclass(frozen=True)
class VoiceEvent(ChildEvent):
    """Where the delayed voice goes: an output's name, "" for the system's, None for nowhere."""

    NAME = "voice"

    to: str | None = None


@dataclass(frozen=True)
class LatencyEvent(ChildEvent):
    """How late the avatar moves, told once that is settled."""

    NAME = "latency"

    latency_ms: float = 0.0
    sound_delay_ms: int = 0


@dataclass(frozen=True)
class SwitchEvent(ChildEvent):
    """A switch was turned."""

    NAME = "switch"

    name: str = ""
    on: bool = False


@dataclass(frozen=True)
class WaveEvent(ChildEvent):
    """A target gets the test wave."""

    NAME = "wave"

    to: str = ""


# -- performer, doctor, tour ---------------------------------------------------------------------


@dataclass(frozen=True)
class PerformerStartedEvent(ChildEvent):
    """The practice performer begins to send."""

    NAME = "started"
    VERBS = ("performer",)

    host: str = ""
    port: int = 0
    fps: float = 0.0


@dataclass(frozen=True)
class LineEvent(ChildEvent):
    """The sentence the practice performer says now."""

    NAME = "line"

    text: str = ""
    t: float = 0.0


@dataclass(frozen=True)
class SystemCheckEvent(ChildEvent):
    """One finding of `saia doctor`: what was looked at, whether it is well, and what to do where not."""

    NAME = "check"

    name: str = ""
    ok: bool = False
    what: str = ""
    remedy: str = ""


@dataclass(frozen=True)
class DoctorDone(DoneEvent):
    """All findings of `saia doctor`."""

    VERBS = ("doctor",)

    checks: tuple[SystemCheckEvent, ...] = ()


@dataclass(frozen=True)
class TourStepEvent(ChildEvent):
    """A step of the tour is over; `what` says what was missing, "" where it went well."""

    NAME = "step"
    VERBS = ("tour",)

    name: str = ""
    ok: bool = False
    seconds: float = 0.0
    what: str = ""


@dataclass(frozen=True)
class TourDone(DoneEvent):
    """Files and steps of the tour."""

    VERBS = ("tour",)

    files: tuple[str, ...] = ()
    steps: tuple[TourStepEvent, ...] = ()


def _finite(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None
