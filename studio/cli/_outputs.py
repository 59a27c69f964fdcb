"""Several files of several formats into one folder: their names, and how each is made."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any, Protocol

from studio.cli._clip import ExportClip, Report
from studio.cli._export_args import ExportRange, RenderOptions, check_free
from studio.cli._queue import Entry
from studio.errors import Cancelled, RequestError, StudioError

if TYPE_CHECKING:
    from studio.project import Project

SOUND_SUFFIXES = frozenset(
    {".wav", ".flac", ".ogg", ".opus", ".mp3", ".m4a", ".aac", ".aif", ".aiff", ".wma",
     ".mp4", ".mov", ".mkv", ".webm", ".avi"}
)  # fmt: skip
"""What is taken out of a folder; a file that is named is read whatever its ending."""


class ClipReader(Protocol):
    """Reads or generates what a source gives."""

    def __call__(self, report: Report) -> ExportClip:
        """The clip; `report` is told the fraction done."""
        ...


@dataclass(frozen=True, eq=False)
class ExportSource:
    """Something to export: what its files are called, how long it takes, and how it is read or made."""

    name: str
    weight: float
    clip: ClipReader


def add_format(parser: argparse.ArgumentParser) -> None:
    """--format A,B: several files into the folder named by -o."""
    parser.add_argument(
        "--format", metavar="A,B", help="write these formats into the folder named by -o, e.g. vrma,bvh"
    )


def formats_of(text: str) -> list[ModuleType]:
    """The writers that were named, by their name or by the ending of their files.

    Raises:
        RequestError: one of them is not known.
    """
    from studio import formats

    writers = formats.writers()
    endings = {formats.written_suffix(module).lstrip("."): module for module in writers.values()}
    found = []
    for word in filter(None, (part.strip().lower().lstrip(".") for part in text.split(","))):
        module = writers.get(word) or endings.get(word)
        if module is None:
            what = f"There is no format {word} to write."
            raise RequestError(what, f"Choose from: {', '.join(sorted(writers))}.")
        if module not in found:
            found.append(module)
    if not found:
        raise RequestError("No format was named.", f"Choose from: {', '.join(sorted(writers))}.")
    return found


def sounds_of(paths: Iterable[Path]) -> list[Path]:
    """The sound files that were named, folders replaced by those in them.

    Raises:
        RequestError: there is nothing at a path, or a folder holds no sound.
    """
    found: list[Path] = []
    for path in paths:
        if path.is_dir():
            found += _within(path)
        elif path.exists():
            found.append(path)
        else:
            raise RequestError(f"There is no sound file at {path}.", "Check how the path is written.")
    return list(dict.fromkeys(found))


def _within(folder: Path) -> list[Path]:
    try:
        inside = sorted(
            path
            for path in folder.iterdir()
            if path.suffix.lower() in SOUND_SUFFIXES and not path.name.startswith(".") and path.is_file()
        )
    except OSError as error:
        what = f"The folder {folder} cannot be read."
        raise RequestError(what, "Choose another folder, or allow reading in it.") from error
    if not inside:
        raise RequestError(
            f"There is no sound in the folder {folder.resolve().name}.",
            "Choose a folder with WAV, MP3 or other sounds.",
        )
    return inside


def entries_of(
    sources: Sequence[ExportSource],
    modules: Sequence[ModuleType],
    folder: Path,
    export_range: ExportRange,
    render_options: RenderOptions,
    force: bool,
    project: Project | None = None,
) -> list[Entry]:
    """What a queue makes: one file of each format for each source.

    Args:
        sources: what is exported.
        modules: the formats.
        folder: where to.
        export_range: what is kept of each.
        render_options: how films and stills are drawn.
        force: files that are there are written over.
        project: its takes and runs are never written over.

    Raises:
        RequestError: one of the files may not be written.
    """
    from studio import formats

    if folder.exists() and not folder.is_dir():
        raise RequestError(
            f"{folder} is a file, not a folder.",
            "Choose another folder with -o.",
            in_window="Choose another folder.",
        )
    entries: list[Entry] = []
    cache = ClipCache()
    for source, name in zip(sources, distinct([source.name for source in sources]), strict=True):
        shared = SourceJob(source, cache, export_range, render_options)
        for number, module in enumerate(modules):
            target = (folder / f"{name}{formats.written_suffix(module)}").absolute()
            check_free(formats.targets(target), force, project)
            share = 3.0 if getattr(module, "DRAWS", False) else 1.0 if number == 0 else 0.05
            weight = source.weight * share
            entries.append(Entry(target.name, weight, _Writing(shared, module, target)))
    return entries


def distinct(names: Sequence[str]) -> list[str]:
    """File names that every system accepts, no two alike: `talk.wav` and `talk.mp3` give talk and talk_2."""
    from studio.files.atomic import safe_name

    found: list[str] = []
    taken: set[str] = set()
    for name in names:
        base = chosen = safe_name(name)
        number = 1
        while chosen.casefold() in taken:
            number += 1
            chosen = f"{base}_{number}"
        taken.add(chosen.casefold())
        found.append(chosen)
    return found


def write_clip(
    module: ModuleType,
    target: Path,
    clip: ExportClip,
    export_range: ExportRange,
    render_options: RenderOptions,
    name: str,
    scratch: Path,
    report: Report,
) -> tuple[Path, ...]:
    """Write one file of a clip, read back by its format."""
    from studio.motion import Motion

    motion = clip.motion
    if motion is None and module.SUFFIX != ".wav":
        raise RequestError(f"{name} has no motion to export.", f"Generate it first: RUN:{name}.")
    draws = getattr(module, "DRAWS", False)
    if draws:  # a film has frames of its own, and a still none
        export_range, fps = replace(export_range, fps=0.0), export_range.fps
    shaped = export_range.motion(motion, name) if motion is not None and len(motion) else motion
    audio = export_range.sound(clip.audio, scratch) if clip.audio is not None else None
    more: dict[str, Any] = {"drawing": render_options.drawing(fps, report)} if draws else {}
    if getattr(module, "WEARS", False):
        more["avatar"] = render_options.avatar
    files: tuple[Path, ...] = module.write(target, shaped or Motion.build([]), audio, **more)
    return files


def progress_shares(module: ModuleType, report: Report) -> tuple[Report, Report]:
    """What reading or making a clip reports to, and what writing it does: a film takes far longer to draw."""
    reading = 0.1 if getattr(module, "DRAWS", False) else 0.95
    return (
        lambda fraction: report(reading * fraction),
        lambda fraction: report(reading + (1 - reading) * fraction),
    )


class ClipCache:
    """Keeps the clip of one source, for its next format: an hour of motion is large."""

    def __init__(self) -> None:
        self._source: ExportSource | None = None
        self._clip: ExportClip | None = None

    def clip(self, source: ExportSource, report: Report) -> ExportClip:
        """The clip of a source, read or made unless it is the one that was asked for last."""
        if self._source is not source or self._clip is None:
            self._source, self._clip = source, None  # the one before is let go first
            self._clip = source.clip(report)
        return self._clip


class SourceJob:
    """A source read once for all its formats; what went wrong with it goes wrong with each."""

    def __init__(
        self, source: ExportSource, cache: ClipCache, export_range: ExportRange, render_options: RenderOptions
    ) -> None:
        self.source, self.export_range, self.render_options = source, export_range, render_options
        self._cache = cache
        self._error: StudioError | None = None

    def clip(self, report: Report) -> ExportClip:
        """The source's clip; raises again what went wrong with it the first time."""
        if self._error is not None:
            raise self._error
        try:
            return self._cache.clip(self.source, report)
        except Cancelled:
            raise
        except StudioError as error:
            self._error = error
            raise


class _Writing:
    """Makes one file of a source."""

    def __init__(self, shared: SourceJob, module: ModuleType, target: Path) -> None:
        self._shared, self._module, self._target = shared, module, target

    def __call__(self, report: Report) -> tuple[Path, ...]:
        import tempfile

        from studio.files import leftovers

        shared = self._shared
        reading, writing = progress_shares(self._module, report)
        clip = shared.clip(reading)
        with tempfile.TemporaryDirectory(prefix=leftovers.scratch_prefix("export")) as scratch:
            return write_clip(
                self._module, self._target, clip, shared.export_range, shared.render_options,
                shared.source.name, Path(scratch), writing,
            )  # fmt: skip
