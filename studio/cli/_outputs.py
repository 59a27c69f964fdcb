"""Several files of several formats into one folder: their names, and how each is made."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any, Protocol

from studio.cli._clip import Clip, Report
from studio.cli._draw import Look
from studio.cli._queue import CancelledError, Entry
from studio.cli._shape import Shape
from studio.cli._target import check_free
from studio.errors import RequestError, StudioError

if TYPE_CHECKING:
    from studio.project import Project

SOUND_SUFFIXES = frozenset(
    {".wav", ".flac", ".ogg", ".opus", ".mp3", ".m4a", ".aac", ".aif", ".aiff", ".wma",
     ".mp4", ".mov", ".mkv", ".webm", ".avi"}
)  # fmt: skip
"""What is taken out of a folder; a file that is named is read whatever its ending."""


class Maker(Protocol):
    """Reads or generates what a source gives."""

    def __call__(self, report: Report) -> Clip:
        """The clip; `report` is told the fraction done."""
        ...


@dataclass(frozen=True, eq=False)
class Source:
    """Something to export: what its files are called, how long it takes, and how it is read or made."""

    name: str
    weight: float
    clip: Maker


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
    sources: Sequence[Source],
    modules: Sequence[ModuleType],
    folder: Path,
    shape: Shape,
    look: Look,
    force: bool,
    project: Project | None = None,
) -> list[Entry]:
    """What a queue makes: one file of each format for each source.

    Args:
        sources: what is exported.
        modules: the formats.
        folder: where to.
        shape: what is kept of each.
        look: how films and stills are drawn.
        force: files that are there are written over.
        project: its takes and runs are never written over.

    Raises:
        RequestError: one of the files may not be written.
    """
    from studio import formats

    if folder.exists() and not folder.is_dir():
        raise RequestError(f"{folder} is a file, not a folder.", "Choose another folder with -o.")
    entries: list[Entry] = []
    shelf = _Shelf()
    for source, name in zip(sources, distinct([source.name for source in sources]), strict=True):
        shared = _Shared(source, shelf, shape, look)
        for number, module in enumerate(modules):
            target = (folder / f"{name}{formats.written_suffix(module)}").absolute()
            check_free(formats.targets(target), force, project)
            share = 3.0 if getattr(module, "DRAWS", False) else 1.0 if number == 0 else 0.05
            weight = source.weight * share
            entries.append(Entry(target.name, weight, _Writing(shared, module, target)))
    return entries


def distinct(names: Sequence[str]) -> list[str]:
    """File names that every system accepts, no two alike: `talk.wav` and `talk.mp3` give talk and talk_2."""
    from studio.take.safe_file import safe_name

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
    clip: Clip,
    shape: Shape,
    look: Look,
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
        shape, fps = replace(shape, fps=0.0), shape.fps
    shaped = shape.motion(motion, name) if motion is not None and len(motion) else motion
    audio = shape.sound(clip.audio, scratch) if clip.audio is not None else None
    more: dict[str, Any] = {"drawing": look.drawing(fps, report)} if draws else {}
    if getattr(module, "WEARS", False):
        more["avatar"] = look.avatar
    files: tuple[Path, ...] = module.write(target, shaped or Motion.build([]), audio, **more)
    return files


def shares(module: ModuleType, report: Report) -> tuple[Report, Report]:
    """What reading or making a clip reports to, and what writing it does: a film takes far longer to draw."""
    reading = 0.1 if getattr(module, "DRAWS", False) else 0.95
    return (
        lambda fraction: report(reading * fraction),
        lambda fraction: report(reading + (1 - reading) * fraction),
    )


class _Shelf:
    """Keeps the clip of one source, for its next format: an hour of motion is large."""

    def __init__(self) -> None:
        self._source: Source | None = None
        self._clip: Clip | None = None

    def clip(self, source: Source, report: Report) -> Clip:
        """The clip of a source, read or made unless it is the one that was asked for last."""
        if self._source is not source or self._clip is None:
            self._source, self._clip = source, None  # the one before is let go first
            self._clip = source.clip(report)
        return self._clip


class _Shared:
    """A source read once for all its formats; what went wrong with it goes wrong with each."""

    def __init__(self, source: Source, shelf: _Shelf, shape: Shape, look: Look) -> None:
        self.source, self.shape, self.look = source, shape, look
        self._shelf = shelf
        self._error: StudioError | None = None

    def clip(self, report: Report) -> Clip:
        if self._error is not None:
            raise self._error
        try:
            return self._shelf.clip(self.source, report)
        except CancelledError:
            raise
        except StudioError as error:
            self._error = error
            raise


class _Writing:
    """Makes one file of a source."""

    def __init__(self, shared: _Shared, module: ModuleType, target: Path) -> None:
        self._shared, self._module, self._target = shared, module, target

    def __call__(self, report: Report) -> tuple[Path, ...]:
        import tempfile

        shared = self._shared
        reading, writing = shares(self._module, report)
        clip = shared.clip(reading)
        with tempfile.TemporaryDirectory(prefix="saia-export-") as scratch:
            return write_clip(
                self._module, self._target, clip, shared.shape, shared.look, shared.source.name,
                Path(scratch), writing,
            )  # fmt: skip
