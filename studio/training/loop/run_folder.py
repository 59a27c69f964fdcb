"""A run's folder as the loop writes it: recipe, metrics, report, TensorBoard; rank 0 alone."""

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
from studio.errors import RequestError, StudioError
from studio.features.motion import Layout
from studio.files import atomic
from studio.ipc.events import EpochEvent, StartedEvent
from studio.project import Project, Run, RunReport
from studio.project.run import METRICS_FILE
from studio.training.checkpoint import Model, TrainingState, frame_rate_of
from studio.training.events import Event, RunStatus
from studio.training.recipe import Recipe

if TYPE_CHECKING:
    from torch.utils.tensorboard import SummaryWriter

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

    def __call__(self, event: Event) -> None:
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
        if not writes:
            return cls(project.runs_folder if resume is None else resume.folder, writes=False)
        notes: tuple[str, ...] = ()
        if resume is None:
            folder = cls(project.new_run_folder(recipe.name), writes=True)
        else:
            folder = cls(resume.folder, writes=True)
            done = folder._forget_after_state()
            notes = (
                f"{resume.id} goes on after epoch {done}."
                if done
                else f"{resume.id} had not finished an epoch and begins anew.",
            )
        with atomic.written(folder.path / RECIPE_FILE) as beside:
            beside.write_text(recipe.as_toml(), encoding="utf-8")
        folder.notes = notes
        return folder

    def append(self, event: EpochEvent) -> None:
        """Add an epoch to metrics.jsonl."""
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
    }


def kept_columns(state: TrainingState) -> tuple[Layout, Fraction, tuple[str, ...]]:
    """The columns, the frame rate and the styles a run was started with.

    Raises:
        StudioError: its checkpoint is damaged.
    """
    try:
        fps = frame_rate_of(state.facts)
        return Layout.from_dict(state.facts["layout"]), fps, tuple(map(str, state.facts.get("styles", ())))
    except (KeyError, TypeError, ValueError, ArithmeticError, RequestError) as error:
        raise StudioError("The run's last checkpoint is damaged.", "Train again.") from error


def _torch_version() -> dict[str, str]:
    import torch

    return {"torch": str(torch.__version__)}
