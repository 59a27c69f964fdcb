"""Progress of a training, saved by rank 0 after every epoch and restored on resume."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from studio.project import Run
from studio.training import checkpoint
from studio.training.checkpoint import LAST, Model, TrainingState
from studio.training.loop import run_folder

_PACE_OF = 5
"""Epochs whose pace says how long the rest takes."""


@dataclass
class Progress:
    """Where a training stands.

    Args:
        epoch: the last one that is over.
        best_epoch, best_loss, best_style, best_val: of the weights kept as best, 0 where there are none yet.
        seconds_before: of earlier sittings.
        began: when this sitting did; this and the following are by the monotonic clock.
        ends: when epochs of this sitting were over.
        reported_at: when it last told of something.
    """

    epoch: int = 0
    best_epoch: int = 0
    best_loss: float = math.inf
    best_style: int = 0
    best_val: Mapping[str, float | None] | None = None
    seconds_before: float = 0.0
    began: float = field(default_factory=time.monotonic)
    ends: list[float] = field(default_factory=list)
    reported_at: float = field(default_factory=time.monotonic)

    @property
    def seconds(self) -> float:
        """Seconds since training began, earlier sittings included."""
        return self.seconds_before + time.monotonic() - self.began

    def eta(self, of: int, part: float = 0.0) -> float:
        """Seconds left, in an epoch of which a part is done, by the pace of the last few epochs.

        A machine that is given other work meanwhile is slower from then on, not from the beginning.
        """
        known = [self.began, *self.ends][-_PACE_OF - 1 :]
        pace = (time.monotonic() - known[0]) / (len(known) - 1 + part or 1)
        return max(0.0, pace * (of - self.epoch - part))

    def as_dict(self) -> dict[str, Any]:
        """What must survive a kill, plain JSON values."""
        return {
            "epoch": self.epoch,
            "best_epoch": self.best_epoch,
            "best_loss": self.best_loss if math.isfinite(self.best_loss) else None,
            "best_style": self.best_style,
            "best_val": None if self.best_val is None else dict(self.best_val),
            "seconds": self.seconds,
        }

    @classmethod
    def from_dict(cls, facts: Mapping[str, Any]) -> Progress:
        """The progress `as_dict` gave, going on now."""
        return cls(
            int(facts["epoch"]),
            int(facts["best_epoch"]),
            float(facts["best_loss"]) if facts["best_loss"] is not None else math.inf,
            int(facts.get("best_style", 0)),
            facts.get("best_val"),
            float(facts["seconds"]),
        )


def saved_state(resume: Run | None) -> TrainingState | None:
    """Where a run stood; None for a new one and for one that had not finished an epoch."""
    if resume is None or not (resume.folder / LAST).is_file():
        return None
    return checkpoint.load_state(resume.folder / LAST)


def save_progress(
    run: Path,
    model: Model,
    optimiser: torch.optim.Optimizer,
    average: dict[str, Tensor],
    progress: Progress,
) -> None:
    """Write into a run's folder where its training stands."""
    facts = progress.as_dict() | run_folder.columns_to_keep(model)
    tensors = checkpoint.optimiser_tensors(optimiser)
    checkpoint.save_state(run / LAST, TrainingState(model.network.state_dict(), tensors, average, facts))
