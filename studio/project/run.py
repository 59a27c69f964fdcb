"""Training runs on disk: folders `<recipe>_<nnn>` with a recipe, metrics, weights and a report.

The motion that a run generated is kept in the project's cache, and generated again where it is gone.
"""

from __future__ import annotations

import hashlib
import json
import platform
import re
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field, fields
from enum import StrEnum
from functools import cache
from pathlib import Path
from typing import Any, get_type_hints

import msgspec

from studio.errors import StudioError, say
from studio.files import atomic, lock
from studio.paths import resource

GENERATED = Path(".cache") / "generated"
"""Folder of a project that keeps what its runs made of sounds; made again where it is gone."""

REPORT_FILE, METRICS_FILE, WEIGHTS_FILE = "report.json", "metrics.jsonl", "best.safetensors"
LICENCE_FILE, EVALUATION_FILE = "licence.txt", "evaluation.json"


BASE_VOICE = "base_voice"
"""Id of the run that comes with the studio: it moves any voice a little, in a project without a take."""


class RunStatus(StrEnum):
    """How a run is doing; `status` in report.json."""

    RUNNING = "running"
    DONE = "done"
    STOPPED = "stopped"
    FAILED = "failed"


@dataclass(frozen=True)
class RunReport:
    """What a run's report.json says; None, "" or empty where it does not say.

    Args:
        status: "running", "done", "stopped" or "failed".
        recipe, title, form, model, seed: how it was asked for.
        draws: the same sound gives another motion with another seed.
        epochs, of: finished and planned.
        best_epoch, best_val_loss, best_val: the best epoch with its loss and figures on validation.
        seconds: the training took.
        step_s, check_s: of them a step took, and a validation.
        train, val: ids of the selections learnt from and validated on.
        frames, minutes, fps: of what was learnt from.
        performers, styles, style: whose and which it tells apart, and the style used unless asked otherwise.
        moods: labels it was taught.
        channels, parameters, device: of its network.
        notes: sentences worth knowing.
        look_aheads, look_aheads_on: figures at each look-ahead of Live, and the takes measured on.
        made_with: versions by program.
        pid, host: the process that trains it, while it does.
        imported_from: file and run it came from.
        other: facts of other versions, kept when it is saved again.
    """

    status: str = "done"
    run: str = ""
    recipe: str = ""
    title: str = ""
    form: str = ""
    model: str = ""
    draws: bool | None = None
    seed: int | None = None
    epochs: int | None = None
    of: int | None = None
    best_epoch: int = 0
    best_val_loss: float | None = None
    best_val: dict[str, Any] | None = None
    seconds: float | None = None
    step_s: float | None = None
    check_s: float | None = None
    train: tuple[str, ...] = ()
    val: tuple[str, ...] = ()
    frames: int | None = None
    minutes: float | None = None
    fps: float | None = None
    performers: tuple[str, ...] = ()
    styles: tuple[str, ...] = ()
    style: str = ""
    moods: tuple[str, ...] = ()
    channels: int | None = None
    parameters: int | None = None
    device: str = ""
    notes: tuple[str, ...] = ()
    look_aheads: tuple[Any, ...] = ()
    look_aheads_on: dict[str, Any] | None = None
    made_with: dict[str, str] | None = None
    pid: int | None = None
    host: str = ""
    imported_from: dict[str, str] | None = None
    version: int = 1
    other: dict[str, Any] = field(default_factory=dict)

    @classmethod
    def load(cls, folder: Path) -> RunReport | None:
        """The report in a run's folder; None where there is none or it is damaged.

        A fact that cannot be what it is called is left out: somebody edited or broke it.
        """
        try:
            content = atomic.read_json(folder / REPORT_FILE)
        except (OSError, StudioError):
            return None
        known: dict[str, Any] = {}
        for name, kind in _kinds().items():
            # One by one: a single odd fact must not cost the others.
            with suppress(msgspec.ValidationError, ValueError, OverflowError, KeyError):
                known[name] = msgspec.convert(content.pop(name), kind)
        return cls(**known, other=content)

    def save(self, folder: Path) -> None:
        """Write report.json.

        Raises:
            StudioError: the folder cannot be written.
        """
        atomic.write_json(folder / REPORT_FILE, self.to_plain())

    def to_plain(self) -> dict[str, Any]:
        """JSON values; what it does not say is left out."""
        said = {name: getattr(self, name) for name in _kinds()}
        return {name: value for name, value in said.items() if value not in (None, "", ())} | self.other


@cache
def _kinds() -> dict[str, Any]:
    """The type of each fact of a report."""
    hints = get_type_hints(RunReport)
    return {one.name: hints[one.name] for one in fields(RunReport) if one.name != "other"}


@dataclass(frozen=True)
class Run:
    """One training run.

    Args:
        id: its folder's name, `<recipe>_<nnn>`.
        folder: where it lies.
        recipe: the recipe's name.
        report: what report.json says, None before there is one.
        status: "done", "stopped" (it has weights but no report), "interrupted" (its process is gone without
            having ended it), or what its report says.
    """

    id: str
    folder: Path
    recipe: str
    report: RunReport | None = field(default=None, compare=False)
    status: str = "unfinished"

    @classmethod
    def load(cls, folder: Path) -> Run:
        """The run in a folder; a damaged report counts as none."""
        report = RunReport.load(folder)
        weights = (folder / WEIGHTS_FILE).is_file()
        status = report.status if report is not None else "stopped" if weights else "unfinished"
        # A killed training cannot write that it ended; whether its process lives tells.
        if report is not None and status == "running" and not _goes_on(report):
            status = "interrupted"
        return cls(folder.name, folder, re.sub(r"_\d+$", "", folder.name), report, status)

    @property
    def facts(self) -> RunReport:
        """Its report; an empty one before there is one."""
        return self.report or RunReport()

    @property
    def is_shipped(self) -> bool:
        """Whether it is the studio's own: every project uses it, and nothing may be written into it."""
        return self.folder == resource(BASE_VOICE)

    @property
    def blinks(self) -> float:
        """How many a minute are laid over its motion: a voice tells nothing of them."""
        return 18.0 if self.is_shipped else 0.0

    @property
    def has_weights(self) -> bool:
        """Whether it can generate."""
        return (self.folder / WEIGHTS_FILE).is_file()

    def epochs(self) -> list[dict[str, Any]]:
        """Its epoch events in order; a line cut short by a kill, or damaged, is left out."""
        try:
            lines = (self.folder / METRICS_FILE).read_text(encoding="utf-8", errors="replace").splitlines()
        except OSError:
            return []
        events = []
        for line in lines:
            try:
                event = json.loads(line)
            except (ValueError, RecursionError):
                # The latter: brackets nested deeper than Python reads.
                continue
            if isinstance(event, dict) and _is_epoch(event):
                events.append(event)
        return events


def _is_epoch(event: dict[str, Any]) -> bool:
    number = event.get("epoch")
    return isinstance(number, int) and isinstance(event.get("val") or {}, dict)


def _goes_on(report: RunReport) -> bool:
    """Whether the process that wrote a report still lives; on another computer nobody can tell."""
    if report.pid is None or report.pid <= 0:
        return False
    return report.host != platform.node() or lock.is_alive(report.pid)


def list_runs(folder: Path) -> tuple[Run, ...]:
    """All runs in a folder by id; hidden folders are none."""
    return tuple(Run.load(path) for path in list_run_folders(folder))


def list_run_folders(folder: Path) -> list[Path]:
    """The folders of all runs in a folder, by id."""
    if not folder.is_dir():
        return []
    return sorted(path for path in folder.iterdir() if path.is_dir() and not path.name.startswith("."))


def base_voice() -> Run:
    """The run that comes with the studio."""
    return Run.load(resource(BASE_VOICE))


def run_title(run_id: str) -> str:
    """What people call a run."""
    return say("Base voice") if run_id == BASE_VOICE else run_id


def new_run_folder(folder: Path, recipe: str) -> Path:
    """A new empty folder `<recipe>_<nnn>` among the runs, this caller's alone.

    Raises:
        StudioError: it cannot be made.
    """
    name = atomic.safe_name(recipe)
    pattern = re.compile(rf"{re.escape(name)}_(\d+)")
    numbers = (int(found[1]) for run in list_runs(folder) if (found := pattern.fullmatch(run.id)))
    number = 1 + max(numbers, default=0)
    while True:
        new = folder / f"{name}_{number:03d}"
        try:
            new.mkdir(parents=True)
        except FileExistsError:
            number += 1
        except OSError as error:
            raise atomic.cannot_write(new, error) from error
        else:
            return new


def generated_path(project: Path, run: Run, sound: Path, words: Sequence[str] = ()) -> Path:
    """Where a project keeps the motion that a run made for a sound.

    Args:
        project: its folder.
        run: the run.
        sound: the sound.
        words: whatever else `saia generate` is told: another style is another motion.

    Returns:
        Another name once sound, weights or words change.
    """
    # By size and time, not by content: hashing an hour of sound would delay every look.
    stat = sound.stat()
    weights = run.folder / "best.safetensors"
    made = weights.stat().st_mtime_ns if weights.is_file() else 0
    facts = "|".join((str(sound.absolute()), str(stat.st_size), str(stat.st_mtime_ns), str(made), *words))
    digest = hashlib.sha256(facts.encode()).hexdigest()[:12]
    return generated_folder(project, run.id) / f"{digest}.arrow"


def generated_folder(project: Path, run_id: str) -> Path:
    """Where a project keeps everything that a run made."""
    return project / GENERATED / run_id
