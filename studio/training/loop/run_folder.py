"""A run's folder as the loop writes it: recipe, metrics, report, TensorBoard, progress; rank 0 alone."""

from __future__ import annotations

import json
import math
import os
import platform
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from fractions import Fraction
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from studio import __version__
from studio.errors import RequestError, StudioError, say
from studio.features.motion import Layout
from studio.files import atomic
from studio.ipc.events import EpochEvent, StartedEvent, TrainingEvent
from studio.project import Project, Run, RunReport
from studio.project.run import METRICS_FILE, RunStatus
from studio.training.checkpoint import Model, TrainingState, frame_rate_of
from studio.training.recipe import Recipe

if TYPE_CHECKING:
    from torch.utils.tensorboard import SummaryWriter
import statistics
import time
from dataclasses import field

import torch
from torch import Tensor

from studio.training import checkpoint
from studio.training.checkpoint import LAST

FOLDER = "tensorboard"


def must_be_installed() -> None:
    """RequestError where TensorBoard is not installed."""
    if find_spec("tensorboard") is None:
        raise RequestError(
            "TensorBoard is not installed here.",
            "Install it with `pip install tensorboard`, or leave --tensorboard out.",
        )


class Board:
    """Listens to a training and writes loss and validation figures of every epoch, flushed at once.

    A file that cannot be written is no reason to end a training.
    """

    def __init__(self) -> None:
        self._writer: SummaryWriter | None = None

    def __call__(self, event: TrainingEvent) -> None:
        """Write what an event says."""
        with suppress(OSError):
            if isinstance(event, StartedEvent):
                self._open(Path(event.folder), event.resumed_from)
            elif isinstance(event, EpochEvent) and self._writer is not None:
                self._write(self._writer, event)

    def close(self) -> None:
        """Nothing more comes."""
        if self._writer is not None:
            with suppress(OSError):
                self._writer.close()

    def _open(self, run: Path, done: int) -> None:
        from torch.utils.tensorboard import SummaryWriter

        # A resumed run takes back the epochs that were told of but whose weights a kill took away.
        self._writer = SummaryWriter(str(run / FOLDER), purge_step=done + 1 if done else None)

    def _write(self, writer: SummaryWriter, epoch: EpochEvent) -> None:
        values = {"loss/train": epoch.train_loss, "loss/validation": epoch.val_loss}
        values |= {f"validation/{name}": v for name, v in epoch.val.items() if v is not None}
        for name, value in values.items():
            if math.isfinite(value):
                writer.add_scalar(name, value, epoch.epoch)
        writer.flush()


RECIPE_FILE = "recipe.toml"


@dataclass
class RunFolder:
    """Where a run lies.

    Args:
        path: its folder.
        writes: False on all processes but the first.
        notes: what to tell of its beginning.
    """

    path: Path
    writes: bool
    notes: tuple[str, ...] = ()

    @classmethod
    def begin(cls, writes: bool, project: Project, recipe: Recipe, resume: Run | None) -> RunFolder:
        """A new folder, or that of a run that goes on."""
        # Other processes need the folder for nothing but its name in sentences.
        if not writes:
            return cls(project.runs_folder if resume is None else resume.folder, writes=False)
        notes: tuple[str, ...] = ()
        if resume is None:
            folder = cls(project.new_run_folder(recipe.name), writes=True)
        else:
            folder = cls(resume.folder, writes=True)
            # Epochs behind the saved weights are learnt again; their old lines would be there twice.
            done = folder._forget_after_state()
            notes = (
                say("{run} goes on after epoch {done}.", run=resume.id, done=done)
                if done
                else say("{run} had not finished an epoch and begins anew.", run=resume.id),
            )
        with atomic.written(folder.path / RECIPE_FILE) as beside:
            beside.write_text(recipe.as_toml(), encoding="utf-8")
        folder.notes = notes
        return folder

    def append(self, event: EpochEvent) -> None:
        """Add an epoch to metrics.jsonl."""
        # One line an epoch, appended: a kill costs at most the line being written, and readers skip that.
        line = json.dumps({"event": "epoch", **event.as_dict()}, ensure_ascii=False)
        path = self.path / METRICS_FILE
        try:
            with path.open("a", encoding="utf-8") as file:
                file.write(line + "\n")
        except OSError as error:
            raise atomic.cannot_write(path, error) from error

    def figures(self, epoch: int) -> Mapping[str, float | None] | None:
        """The validation figures of an epoch, None where it has none."""
        if not self.writes:
            return None
        for event in Run.load(self.path).epochs():
            if event.get("epoch") == epoch:
                return event.get("val")
        return None

    def report(self, status: RunStatus, facts: RunReport) -> None:
        """Write report.json: the facts with the status and what made them."""
        if not self.writes:
            return
        made_with = {"studio": __version__, "python": platform.python_version(), **_torch_version()}
        report = replace(facts, run=self.path.name, status=status.value, made_with=made_with)
        if status is RunStatus.RUNNING:
            # So that a run whose process was killed can be told from one that goes on.
            report = replace(report, pid=os.getpid(), host=platform.node())
        report.save(self.path)

    def _forget_after_state(self) -> int:
        """Drop epochs that were told of but whose weights a kill took away; gives the last kept."""
        from studio.training.checkpoint import LAST, load_state

        for unfinished in self.path.glob(".*.new"):  # what a kill cut short
            unfinished.unlink(missing_ok=True)
        kept = 0
        if (self.path / LAST).is_file():
            kept = int(load_state(self.path / LAST).facts["epoch"])
        events = [e for e in Run.load(self.path).epochs() if int(e.get("epoch", 0)) <= kept]
        with atomic.written(self.path / METRICS_FILE) as beside:
            lines = (json.dumps(event, ensure_ascii=False) + "\n" for event in events)
            beside.write_text("".join(lines), encoding="utf-8")
        return kept


def columns_to_keep(model: Model) -> dict[str, Any]:
    """What of columns and styles must survive so that a resumed run predicts the same ones."""
    return {
        "layout": model.layout.as_dict(),
        "fps": [model.fps.numerator, model.fps.denominator],
        "styles": list(model.styles),
        "moods": list(model.moods),
    }


def kept_columns(state: TrainingState) -> tuple[Layout, Fraction, tuple[str, ...], tuple[str, ...]]:
    """The columns, the frame rate, the styles and the moods a run was started with.

    Raises:
        StudioError: its checkpoint is damaged.
    """
    try:
        fps = frame_rate_of(state.facts)
        styles, moods = (tuple(map(str, state.facts.get(name, ()))) for name in ("styles", "moods"))
        return Layout.from_dict(state.facts["layout"]), fps, styles, moods
    except (KeyError, TypeError, ValueError, ArithmeticError, RequestError) as error:
        raise StudioError("The run's last checkpoint is damaged.", "Train again.") from error


def _torch_version() -> dict[str, str]:
    import torch

    return {"torch": str(torch.__version__)}


_PACE_OF = 5
"""Epochs whose pace says how long the rest takes."""
_SAYS_MUCH = 0.25
"""Part of an epoch from which its own pace counts beside that of the ones before."""


@dataclass
class Progress:
    """Where a training stands.

    Args:
        epoch: the last one that is over.
        best_epoch, best_loss, best_val: of the weights kept as best, 0 where there are none yet.
        best_style: the default style of those, 0 but for trainings begun before the average was always it.
        seconds_before: of earlier sittings.
        began: when this sitting did; like all moments here by the monotonic clock.
        epoch_began: when the epoch under way did.
        learnt, checked: seconds that each epoch of this sitting took, and of each validation apart.
        after_s: what comes after the last epoch takes; None where nobody knows.
        after: how many validations that is about.
        reported_at: when it last told of something.
    """

    epoch: int = 0
    best_epoch: int = 0
    best_loss: float = math.inf
    best_style: int = 0
    best_val: Mapping[str, float | None] | None = None
    seconds_before: float = 0.0
    began: float = field(default_factory=time.monotonic)
    epoch_began: float = field(default_factory=time.monotonic)
    learnt: list[float] = field(default_factory=list)
    checked: list[float] = field(default_factory=list)
    after_s: float | None = None
    after: float = 0.0
    reported_at: float = field(default_factory=time.monotonic)

    @property
    def seconds(self) -> float:
        """Seconds since training began, earlier sittings included."""
        return self.seconds_before + time.monotonic() - self.began

    def eta(self, of: int, validate_every: int, part: float = 0.0) -> float:
        """Seconds left, in an epoch of which a part is done: steps, validations, and what is measured last.

        By the median of the last few epochs: a machine that is given other work meanwhile is slower from then
        on, and one epoch that was held up says nothing of the rest.
        """
        paces = self.learnt[-_PACE_OF:]
        if part and (part >= _SAYS_MUCH or not paces):
            paces = [*paces, (time.monotonic() - self.epoch_began) / part]
        pace = statistics.median(paces) if paces else 0.0
        check = statistics.median(self.checked[-_PACE_OF:]) if self.checked else 0.0
        due = sum(is_due(one, of, validate_every) for one in range(self.epoch + 1, of + 1))
        after = check * self.after if self.after_s is None else self.after_s
        return max(0.0, pace * (of - self.epoch - part)) + check * due + after

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
        # A loss in a style chosen on validation is not to be compared with one in the average.
        known = facts["best_loss"] is not None and not facts.get("best_style")
        return cls(
            int(facts["epoch"]),
            int(facts["best_epoch"]),
            float(facts["best_loss"]) if known else math.inf,
            int(facts.get("best_style", 0)),
            facts.get("best_val"),
            float(facts["seconds"]),
        )


def is_due(epoch: int, of: int, validate_every: int) -> bool:
    """Whether an epoch of so many is validated."""
    return epoch in (1, of) or epoch % validate_every == 0


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
    facts = {"version": checkpoint.version_of(model)} | progress.as_dict() | columns_to_keep(model)
    tensors = checkpoint.optimiser_tensors(optimiser)
    checkpoint.save_state(run / LAST, TrainingState(model.network.state_dict(), tensors, average, facts))
