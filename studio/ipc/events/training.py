"""Events of commands that train, measure and describe: train, evaluate, compare, suggest, card, encoder."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import msgspec

from studio.ipc.events.common import ChildEvent, DoneEvent, NoteEvent, ProgressEvent

Figures = Mapping[str, float | None]
"""Metrics by name; None where one does not apply."""


class StartedEvent(ChildEvent, frozen=True):
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


class PreparingEvent(ChildEvent, frozen=True):
    """The takes are read."""

    NAME = "preparing"


class CleaningEvent(ChildEvent, frozen=True):
    """Before training starts: the cleaned sound of a take is made, since that was chosen and it is not there.

    Args:
        take: whose.
        fraction: how much of it is done, 0..1.
    """

    NAME = "cleaning"

    take: str
    fraction: float = 0.0


class ListeningEvent(ChildEvent, frozen=True):
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


class EpochEvent(ChildEvent, frozen=True):
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
    val: Figures = msgspec.field(default_factory=dict)
    seconds: float = math.nan
    eta_s: float = math.nan
    best: bool = False
    still: bool = False
    advice: str = ""

    def as_dict(self) -> dict[str, Any]:
        """Plain JSON values, numbers that are not finite as None; the line of metrics.jsonl."""
        facts = msgspec.to_builtins(self, enc_hook=str)  # sentences stay English in the file
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


class StepEvent(ChildEvent, frozen=True):
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


class OutOfMemoryEvent(ChildEvent, frozen=True):
    """The memory was not enough; the failure itself is told as always.

    Args:
        run: id of the run it had begun, "" for none.
        setting: what may fit, as --set takes it; "" where it is as small as can be.
    """

    NAME = "out_of_memory"

    run: str = ""
    setting: str = ""


class LookAheadsEvent(ChildEvent, frozen=True):
    """How well a run does at each look-ahead is measured: the one at work, and how many are done."""

    NAME = "look_aheads"

    ms: int = 0
    done: int = 0
    of: int = 0
    fraction: float = 0.0


class RecipeEvent(ChildEvent, frozen=True):
    """A recipe there is, as training/recipe.py lists it."""

    NAME = "recipe"

    name: str = ""
    title: str = ""
    summary: str = ""
    preset: str = ""
    minutes: float = 0.0
    forms: tuple[str, ...] = ()
    with_encoder: str = ""


class ChosenEvent(ChildEvent, frozen=True):
    """The recipe whose settings follow."""

    NAME = "chosen"

    recipe: str = ""


class SettingEvent(ChildEvent, frozen=True):
    """Something --set can change, and its value."""

    NAME = "setting"

    key: str = ""
    value: Any = None


class TrainDone(DoneEvent, frozen=True):
    """The run that was trained.

    Args:
        run, folder: its id, and where it lies.
        best_epoch: whose weights it has.
        stopped: somebody asked to end early.
        seconds: how long it took.
        val: metrics of the best epoch.
        recipes: names of all recipes, from --list alone.
    """

    VERBS = ("train",)

    run: str = ""
    folder: str = ""
    best_epoch: int | None = None
    stopped: bool = False
    seconds: float = 0.0
    val: Figures | None = None
    recipes: tuple[str, ...] = ()


class MeasureProgressEvent(ProgressEvent, frozen=True):
    """How far measuring is: `run` is measured on `take`, and `done` of `of` takes are."""

    VERBS = ("evaluate", "compare")

    run: str = ""
    take: str = ""
    done: int = 0
    of: int = 0


class EvaluateDone(DoneEvent, frozen=True):
    """Figures of a run, in all, by take and by bone, and of the simple guesses it has to beat.

    Args:
        run, seed: its id, and the seed it was trained with.
        best_epoch: whose weights were measured; None where the run does not say.
        style: the style it moved in.
        chance: seed and liveliness of what was generated.
        poses: whether expected poses were measured, or drawn ones.
        split, takes, frames: what it was measured on.
        metrics, per_take, per_bone: the figures.
        captured: those of the captured motion, held against itself.
        baselines: those of the simple guesses.
    """

    VERBS = ("evaluate",)

    run: str = ""
    seed: int | None = None
    best_epoch: int | None = None
    style: str = ""
    chance: Mapping[str, float] = msgspec.field(default_factory=dict)
    poses: str = ""
    split: str = ""
    takes: tuple[str, ...] = ()
    frames: int = 0
    metrics: Figures = msgspec.field(default_factory=dict)
    per_take: Mapping[str, Figures] = msgspec.field(default_factory=dict)
    per_bone: Figures = msgspec.field(default_factory=dict)
    captured: Figures = msgspec.field(default_factory=dict)
    baselines: Mapping[str, Figures] = msgspec.field(default_factory=dict)


class StyleDone(DoneEvent, frozen=True):
    """The style that a run was shown or forgot, and all that it knows now.

    Args:
        run: its id.
        style: the style's name; "" where they are only listed.
        styles: names of all its styles, "average" first.
        shown: those of them that it was shown.
    """

    VERBS = ("style",)

    run: str = ""
    style: str = ""
    styles: tuple[str, ...] = ()
    shown: tuple[str, ...] = ()


class MeasuredEvent(ChildEvent, frozen=True):
    """A run (compare) or a selection (suggest) is measured."""

    NAME = "measured"

    run: str = ""
    take: str = ""
    fraction: float | None = None
    metrics: Figures = msgspec.field(default_factory=dict)


class BaselinesEvent(ChildEvent, frozen=True):
    """The simple guesses are being made: which, on which take, and how far that is."""

    NAME = "baselines"

    name: str = ""
    take: str = ""
    done: int = 0
    of: int = 0
    fraction: float = 0.0


class CompareDone(DoneEvent, frozen=True):
    """Figures of runs and of simple guesses by their names, and of what was captured."""

    VERBS = ("compare",)

    split: str = ""
    takes: tuple[str, ...] = ()
    frames: int = 0
    seeds: Mapping[str, int | None] = msgspec.field(default_factory=dict)
    runs: Mapping[str, Figures] = msgspec.field(default_factory=dict)
    baselines: Mapping[str, Figures] = msgspec.field(default_factory=dict)
    captured: Figures = msgspec.field(default_factory=dict)
    per_take: Mapping[str, Mapping[str, Figures]] = msgspec.field(default_factory=dict)


class CurveProgressEvent(ProgressEvent, frozen=True):
    """How far a learning curve is: the training it is at counts from 1, `of` so many, on so many seconds."""

    VERBS = ("curve",)

    number: int = 0
    of: int = 0


class CurveDone(DoneEvent, frozen=True):
    """What more takes would bring.

    Args:
        text: in words.
        points: seconds learnt from, `follow` (r) and other figures of each training.
        next_gain: of r, by twice as much.
        enough_seconds: from where on more hardly helps.
        split, takes: what was measured on.
        missing: kinds of speech there is too little of.
    """

    VERBS = ("curve",)

    text: str = ""
    points: tuple[Figures, ...] = ()
    next_gain: float | None = None
    enough_seconds: float | None = None
    split: str = ""
    takes: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()


class CheckedEvent(ChildEvent, frozen=True):
    """A take is looked at, and how much of all is."""

    NAME = "checked"

    take: str = ""
    fraction: float = 0.0


class SuggestionEvent(ChildEvent, frozen=True):
    """One thing worth a look, as dataset/suggest.py ranks it."""

    NAME = "suggestion"

    selection: str = ""
    kind: str = ""
    weight: float = 0.0
    what: str = ""
    remedy: str = ""
    span: tuple[float, float] | None = None


class ErrorSpan(msgspec.Struct, frozen=True):
    """Where a run errs much more than elsewhere, seconds, and by how many times."""

    start: float
    end: float
    ratio: float


class SuggestDone(DoneEvent, frozen=True):
    """How many suggestions there are, and spans of large error by selection."""

    VERBS = ("suggest",)

    count: int = 0
    run: str | None = None
    worst: Mapping[str, tuple[ErrorSpan, ...]] = msgspec.field(default_factory=dict)


class ReadEvent(ChildEvent, frozen=True):
    """The words of a data card are counted this far."""

    NAME = "read"

    fraction: float = 0.0


class DownloadProgressEvent(ProgressEvent, frozen=True):
    """How much of a speech encoder or the face model is here: `bytes` of `of`, 0 where nobody knows."""

    VERBS = ("encoder", "camera")

    bytes: int = 0
    of: int = 0


class EncoderEvent(ChildEvent, frozen=True):
    """A speech encoder, and whether it is here."""

    NAME = "encoder"

    name: str = ""
    here: bool = False
    folder: str = ""


class EncoderDone(DoneEvent, frozen=True):
    """The encoder that was brought here with the digest of its weights, or the names of all that are here."""

    VERBS = ("encoder",)

    name: str = ""
    folder: str = ""
    sha256: str = ""
    encoders: tuple[str, ...] = ()


def _finite(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None


TrainingEvent = (
    StartedEvent | NoteEvent | CleaningEvent | ListeningEvent | EpochEvent | StepEvent | OutOfMemoryEvent
)
"""What a training reports from the first take it reads to its end."""
