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
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from studio.errors import StudioError
from studio.files import atomic, lock

GENERATED = Path(".cache") / "generated"
"""Folder of a project that keeps what its runs made of sounds; made again where it is gone."""


@dataclass(frozen=True)
class Run:
    """One training run.

    Args:
        id: its folder's name, `<recipe>_<nnn>`.
        folder: where it lies.
        recipe: the recipe's name.
        report: the content of report.json, None before there is one.
        status: "done", "stopped" (it has weights but no report), "interrupted" (its process is gone without
            having ended it), or what its report says.
    """

    id: str
    folder: Path
    recipe: str
    report: dict[str, Any] | None = field(default=None, compare=False)
    status: str = "unfinished"

    @classmethod
    def load(cls, folder: Path) -> Run:
        """The run in a folder; a damaged report counts as none."""
        report = None
        with suppress(OSError, StudioError):
            report = _understood(atomic.read_json(folder / "report.json"))
        weights = (folder / "best.safetensors").is_file()
        status = "done" if report is not None else "stopped" if weights else "unfinished"
        if report is not None and isinstance(report.get("status"), str):
            status = report["status"]
            if status == "running" and not _goes_on(report):
                status = "interrupted"
        return cls(folder.name, folder, re.sub(r"_\d+$", "", folder.name), report, status)

    @property
    def has_weights(self) -> bool:
        """Whether it can generate."""
        return (self.folder / "best.safetensors").is_file()

    def epochs(self) -> list[dict[str, Any]]:
        """Its epoch events in order; a line cut short by a kill, or damaged, is left out."""
        try:
            lines = (self.folder / "metrics.jsonl").read_text(encoding="utf-8", errors="replace").splitlines()
        except OSError:
            return []
        events = []
        for line in lines:
            try:
                event = json.loads(line)
            except (ValueError, RecursionError):  # the latter: brackets nested deeper than Python reads
                continue
            if isinstance(event, dict) and _is_epoch(event):
                events.append(event)
        return events


_KINDS: dict[str, type | tuple[type, ...]] = {
    "status": str, "train": list, "val": list, "styles": list, "notes": list, "performers": list,
    "fps": (int, float), "seconds": (int, float), "best_val": dict, "best_epoch": int, "epochs": int,
}  # fmt: skip


def _understood(report: dict[str, Any]) -> dict[str, Any]:
    """A report without the facts that cannot be what they are called; somebody edited or broke it."""
    return {
        key: value
        for key, value in report.items()
        if key not in _KINDS or isinstance(value, _KINDS[key]) or (value is None and key == "best_val")
    }


def _is_epoch(event: dict[str, Any]) -> bool:
    number = event.get("epoch")
    return isinstance(number, int) and isinstance(event.get("val") or {}, dict)


def _goes_on(report: dict[str, Any]) -> bool:
    """Whether the process that wrote a report still lives; on another computer nobody can tell."""
    pid, host = report.get("pid"), report.get("host")
    if not isinstance(pid, int) or pid <= 0:
        return False
    return host != platform.node() or lock.is_alive(pid)


def list_runs(folder: Path) -> tuple[Run, ...]:
    """All runs in a folder by id; hidden folders are none."""
    return tuple(Run.load(path) for path in list_run_folders(folder))


def list_run_folders(folder: Path) -> list[Path]:
    """The folders of all runs in a folder, by id."""
    if not folder.is_dir():
        return []
    return sorted(path for path in folder.iterdir() if path.is_dir() and not path.name.startswith("."))


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


def generated_path(run: Run, sound: Path, words: Sequence[str] = ()) -> Path:
    """Where a run keeps the motion it made for a sound.

    Args:
        run: the run.
        sound: the sound.
        words: whatever else `saia generate` is told: another style is another motion.

    Returns:
        Another name once sound, weights or words change.
    """
    stat = sound.stat()
    weights = run.folder / "best.safetensors"
    made = weights.stat().st_mtime_ns if weights.is_file() else 0
    facts = "|".join((str(sound.absolute()), str(stat.st_size), str(stat.st_mtime_ns), str(made), *words))
    digest = hashlib.sha256(facts.encode()).hexdigest()[:12]
    return generated_folder(run) / f"{digest}.arrow"


def generated_folder(run: Run) -> Path:
    """Where everything that a run made is kept."""
    return run.folder.parent.parent / GENERATED / run.id
