"""What a training run tells while it works: plain values, one JSON line each (no torch)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from enum import StrEnum
from typing import Any

STILL_RATIO = 0.3
"""Below this share of the captured motion a model is called still."""

STILL_ADVICE = (
    "The model hardly moves yet. If this stays, train longer, choose the recipe balanced, "
    "or check in Curate that sound and motion line up."
)


class Status(StrEnum):
    """How a run stands; `status` in report.json."""

    RUNNING = "running"
    DONE = "done"
    STOPPED = "stopped"
    FAILED = "failed"


@dataclass(frozen=True)
class Started:
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

    run: str
    folder: str
    recipe: str
    of: int
    resumed_from: int = 0
    train: tuple[str, ...] = ()
    val: tuple[str, ...] = ()
    frames: int = 0
    parameters: int = 0
    device: str = "cpu"


@dataclass(frozen=True)
class Note:
    """Something worth knowing, one sentence."""

    text: str


@dataclass(frozen=True)
class Cleaning:
    """Before it starts: the cleaned sound of a take is made, since that was chosen and it is not there.

    Args:
        take: whose.
        fraction: how much of it is done, 0..1.
    """

    take: str
    fraction: float


@dataclass(frozen=True)
class Listening:
    """Before it starts: what a take sounds like is worked out, slowly by a speech encoder.

    Args:
        take: whose.
        number: which it is, counts from 1.
        of: how many there are.
    """

    take: str
    number: int
    of: int


@dataclass(frozen=True)
class Epoch:
    """One epoch is over.

    Args:
        epoch: counts from 1.
        of: epochs planned.
        train_loss: mean over its steps.
        val_loss: on the validation takes.
        val: metrics on the validation takes; None where one does not apply.
        seconds: since training began, earlier sittings of a resumed run included.
        eta_s: seconds still to go, by the pace so far.
        best: whether its weights are now the ones kept as best.
        still: whether the model hardly moves.
        advice: what to try then, "" else.
    """

    epoch: int
    of: int
    train_loss: float
    val_loss: float
    val: Mapping[str, float | None] = field(default_factory=dict)
    seconds: float = 0.0
    eta_s: float = 0.0
    best: bool = False
    still: bool = False
    advice: str = ""

    def as_dict(self) -> dict[str, Any]:
        """Plain JSON values, numbers that are not finite as None; the line of metrics.jsonl."""
        facts = asdict(self)
        facts["val"] = {key: _finite(value) for key, value in self.val.items()}
        return {key: _finite(v) if isinstance(v, float) else v for key, v in facts.items()}

    @classmethod
    def from_dict(cls, facts: Mapping[str, Any]) -> Epoch:
        """The epoch in a line of metrics.jsonl or a JSON event; unknown keys are passed over."""

        def number(key: str) -> float:
            value = facts.get(key)
            return float(value) if isinstance(value, int | float) else math.nan

        val = facts.get("val")
        return cls(
            int(facts["epoch"]),
            int(facts.get("of", 0)),
            number("train_loss"),
            number("val_loss"),
            dict(val) if isinstance(val, dict) else {},
            number("seconds"),
            number("eta_s"),
            bool(facts.get("best", False)),
            bool(facts.get("still", False)),
            str(facts.get("advice", "")),
        )


@dataclass(frozen=True)
class Step:
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

    epoch: int
    of: int
    step: int
    steps: int
    train_loss: float
    seconds: float = 0.0
    eta_s: float = 0.0


@dataclass(frozen=True)
class OutOfMemory:
    """The memory was not enough; the failure itself is told as always.

    Args:
        run: id of the run it had begun, "" for none.
        setting: what may fit, as --set takes it; "" where it is as small as can be.
    """

    run: str
    setting: str


Event = Started | Note | Cleaning | Listening | Epoch | Step | OutOfMemory


def is_still(motion_ratio: float | None) -> bool:
    """Whether a model moves so little that a person should be told."""
    return motion_ratio is not None and motion_ratio < STILL_RATIO


def _finite(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None
