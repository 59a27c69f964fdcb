"""A run as one file: weights, recipe, channels and scaling, to be used on another computer.

A zip of known names only: safetensors for the weights (their header holds recipe, channels and scaling), TOML
and JSON for the rest, no pickle. What comes from elsewhere is looked at before it becomes a run, and nothing
of it is executed (no torch here).
"""

from __future__ import annotations

import json
import shutil
import struct
import zipfile
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from studio.errors import RequestError, StudioError, say
from studio.files import atomic, leftovers
from studio.project import Project, Run, RunReport
from studio.project.archive import open_packed
from studio.project.run import EVALUATION_FILE, LICENCE_FILE, METRICS_FILE, REPORT_FILE, WEIGHTS_FILE
from studio.training.recipe import UnusableRunError, read_recipe

SUFFIX = ".saiarun"
FORMAT_VERSION = 1
_MARK, _RECIPE = "saia-run.json", "recipe.toml"
_NEEDED = (WEIGHTS_FILE, _RECIPE)
_MOST_BYTES = {WEIGHTS_FILE: 4 << 30, _RECIPE: 1 << 20, REPORT_FILE: 8 << 20, METRICS_FILE: 64 << 20,
               EVALUATION_FILE: 8 << 20, "note.txt": 1 << 20, LICENCE_FILE: 1 << 20}  # fmt: skip
"""What a run file holds, and how much of each is believed."""
_LARGEST_HEADER = 100 << 20
_OTHER = "Choose a run that Saia Studio exported, or export it again."


def pack_run(run: Run, target: Path) -> Path:
    """Write a run into one file, in one piece.

    Args:
        run: one with weights.
        target: the file.

    Raises:
        RequestError: the run has no weights.
        StudioError: the file cannot be written.
    """
    if not run.has_weights:
        raise RequestError(
            say("{run} has no trained weights yet.", run=run.id), "Train it first, or choose another run."
        )
    mark = {"version": FORMAT_VERSION, "run": run.id, "recipe": run.recipe}
    with (
        atomic.written(target) as beside,
        zipfile.ZipFile(beside, "w", zipfile.ZIP_DEFLATED, compresslevel=1, strict_timestamps=False) as file,
    ):
        file.writestr(_MARK, json.dumps(mark, ensure_ascii=False))
        for name in _MOST_BYTES:
            if (run.folder / name).is_file():
                file.write(run.folder / name, name)
    return target


def is_run_file(path: Path) -> bool:
    """Whether a file says of itself that it is a run."""
    with (
        suppress(OSError, zipfile.BadZipFile, NotImplementedError, ValueError),
        zipfile.ZipFile(path) as file,
    ):
        return _MARK in file.namelist()
    return path.suffix.lower() == SUFFIX


def unpack_run(source: Path, project: Project, check: Callable[[Path], object] = lambda weights: None) -> Run:
    """Make a run of a project of a run file; nothing is left behind where that fails.

    Args:
        source: the file.
        project: where it goes, under a free number.
        check: looks at the weights before they become a run; raises StudioError where they are no good.

    Raises:
        StudioError: the file is missing, damaged, not a run, of a newer version, asks for what is not
            possible, or would fill the disk.
    """
    # Beside the runs and renamed at the end: a failure or a kill leaves no half run in the list.
    beside = leftovers.beside(project.runs_folder / "import")
    try:
        beside.mkdir(parents=True)
        # By known names alone: whatever else a zip holds is never written, wherever its paths lead.
        mark = _extract(source, beside)
        _look_at(beside, source)
        _check(beside / WEIGHTS_FILE, check, source)
        _tidy(beside, source, mark)
        folder = project.new_run_folder(str(mark.get("recipe") or "imported"))
        for path in beside.iterdir():
            path.rename(folder / path.name)
    except OSError as error:
        raise atomic.cannot_write(project.runs_folder, error) from error
    finally:
        shutil.rmtree(beside, ignore_errors=True)
    return Run.load(folder)


def _extract(source: Path, folder: Path) -> dict[str, Any]:
    """The known files of a run file into a folder; gives what it says of itself."""
    if not source.is_file():
        raise StudioError(say("{name} is missing.", name=source.name), "Check how the path is written.")
    try:
        with open_packed(source) as packed, zipfile.ZipFile(packed) as file:
            mark = json.loads(file.read(_MARK) if file.getinfo(_MARK).file_size < 1 << 20 else b"")
            version = mark["version"]
            if isinstance(version, bool) or not isinstance(version, int) or version < 1:
                raise ValueError("no version")
            if version > FORMAT_VERSION:
                raise atomic.newer(source)
            there = set(file.namelist())
            if not set(_NEEDED) <= there:
                raise _damaged(source)
            _must_fit([file.getinfo(name) for name in _MOST_BYTES if name in there], folder, source)
            for name, most in _MOST_BYTES.items():
                if name in there:
                    _copy(file, name, most, folder / name, source)
            return dict(mark)
    except (*atomic.UNREADABLE_ZIP, KeyError, TypeError) as error:
        raise _damaged(source) from error


def _must_fit(members: list[zipfile.ZipInfo], folder: Path, source: Path) -> None:
    """StudioError where a run file is made to fill the disk, or there is no room for it."""
    needed = sum(member.file_size for member in members)
    # By what the entries say first, which costs nothing; _copy then holds them to it.
    if atomic.is_bomb(needed, source.stat().st_size):
        raise StudioError(say("{name} would fill the disk.", name=source.name), _OTHER)
    if needed > (room := atomic.room(folder)):
        what = say(
            "{name} needs {needed} MB, and there is room for {room} MB.",
            name=source.name,
            needed=f"{needed / 1e6:,.0f}",
            room=f"{room / 1e6:,.0f}",
        )
        raise StudioError(what, "Make room on the project's disk.")
    if any(member.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED) for member in members):
        raise NotImplementedError("others may ask for any amount of memory")


def _copy(file: zipfile.ZipFile, name: str, most: int, target: Path, source: Path) -> None:
    """One file, and never more of it than is believed, whatever its entry says."""
    left = most
    with file.open(name) as packed, target.open("wb") as plain:
        while chunk := packed.read(1 << 20):
            left -= len(chunk)
            if left < 0:
                raise StudioError(say("{name} would fill the disk.", name=source.name), _OTHER)
            plain.write(chunk)


def _look_at(folder: Path, source: Path) -> None:
    """The recipe can be read, and the weights are safetensors with our facts in them."""
    try:
        read_recipe(folder / _RECIPE)
        weights = folder / WEIGHTS_FILE
        with weights.open("rb") as file:
            (length,) = struct.unpack("<Q", file.read(8))
            # The length comes from the file; believed, it could ask for all memory.
            if length > min(_LARGEST_HEADER, weights.stat().st_size - 8):
                raise ValueError("the header is longer than the file")
            header = json.loads(file.read(length))
        json.loads(header["__metadata__"]["saia"])["version"]
    except UnusableRunError as error:
        raise _unusable(source, error) from error
    except (struct.error, ValueError, KeyError, TypeError, RecursionError, StudioError) as error:
        raise _damaged(source) from error


def _check(weights: Path, check: Callable[[Path], object], source: Path) -> None:
    try:
        check(weights)
    except atomic.NewerVersionError as error:
        raise atomic.newer(source) from error
    except UnusableRunError as error:
        raise _unusable(source, error) from error
    except StudioError as error:
        raise _damaged(source) from error


def _tidy(folder: Path, source: Path, mark: dict[str, Any]) -> None:
    """Leave of report and epochs what can be understood, and say where the run comes from."""
    report = RunReport.load(folder) or RunReport()
    status = report.status if report.status in ("done", "stopped") else "done"
    origin = {"file": source.name, "run": str(mark.get("run", ""))}
    # The process belongs to another computer: here it would look like one that still trains.
    replace(report, pid=None, host="", status=status, imported_from=origin).save(folder)
    epochs = [e for e in Run.load(folder).epochs() if _is_epoch(e)]
    lines = "".join(json.dumps(event, ensure_ascii=False) + "\n" for event in epochs)
    (folder / METRICS_FILE).write_text(lines, encoding="utf-8")
    with suppress(OSError):
        try:
            atomic.read_json(folder / EVALUATION_FILE)
        except StudioError:
            (folder / EVALUATION_FILE).unlink()


def _is_epoch(event: dict[str, Any]) -> bool:
    epoch, val = event.get("epoch"), event.get("val")
    return isinstance(epoch, int) and not isinstance(epoch, bool) and (val is None or isinstance(val, dict))


def _unusable(source: Path, error: UnusableRunError) -> StudioError:
    return StudioError(say("{name} cannot be used: {reason}", name=source.name, reason=error.why), _OTHER)


def _damaged(source: Path) -> StudioError:
    return StudioError(say("{name} is damaged or no run of Saia Studio.", name=source.name), _OTHER)
