"""Files made one after another: what fails is reported, and the others go on. One file is a queue of one."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from studio.errors import Cancelled, RequestError, StudioError, say
from studio.export.clip import ExportClip, ExportSource, Report
from studio.export.options import RenderOptions, check_writable, wrong_folder
from studio.export.range import ExportRange
from studio.files import leftovers
from studio.ipc.events import ChildEvent, EntryEvent, QueueEvent, QueueProgressEvent

if TYPE_CHECKING:
    from studio.project import Project

REPORT_SECONDS = 0.2
# A film takes far longer to draw than its motion to read; any other file is written in a moment.
_READING_SHARE_DRAWN, _READING_SHARE = 0.1, 0.95
_WEIGHT_DRAWN, _WEIGHT_FIRST, _WEIGHT_FURTHER = 3.0, 1.0, 0.05


@dataclass(frozen=True, eq=False)
class Entry:
    """One file to make.

    Args:
        name: what a list calls it.
        weight: how long it takes in comparison with the others.
        make: makes it, and gives the files; given what to report progress to (0..1), which raises where the
            entry is to end.
    """

    name: str
    weight: float
    make: Callable[[Report], Sequence[Path]]


@dataclass(frozen=True)
class Failure:
    """An entry that came to nothing, why in two sentences, and what was raised."""

    name: str
    what: str
    remedy: str
    error: Exception


class Queue:
    """Makes entries one after another.

    Args:
        entries: what is to be made, in this order.
        on_event: given a `QueueEvent` with all names, an `EntryEvent` whenever an entry's state changes,
            and `QueueProgressEvent`s.
        is_cancelled: whether the entry of a number is no longer requested.

    Attributes:
        files: those that were made.
        failed: entries that came to nothing.
        cancelled: names of entries that were left out.
    """

    def __init__(
        self,
        entries: Sequence[Entry],
        on_event: Callable[[ChildEvent], None],
        is_cancelled: Callable[[int], bool] = lambda index: False,
    ) -> None:
        self._entries, self._on_event, self._is_cancelled = list(entries), on_event, is_cancelled
        self._whole = sum(entry.weight for entry in entries) or 1.0
        # Weight of the entries that are over.
        self._before = 0.0
        self._began, self._last = time.monotonic(), 0.0
        # Weight of those that took no time.
        self._left_out = 0.0
        self.files: list[Path] = []
        self.failed: list[Failure] = []
        self.cancelled: list[str] = []

    def run(self) -> None:
        """Make one after another."""
        self._on_event(QueueEvent(tuple(entry.name for entry in self._entries)))
        for index, entry in enumerate(self._entries):
            if self._is_cancelled(index):
                self._cancel(index, entry)
                self._left_out += entry.weight
            else:
                self._make(index, entry)
            self._before += entry.weight
        self._progress(len(self._entries) - 1, 1.0, last=True)

    def _make(self, index: int, entry: Entry) -> None:
        self._on_event(EntryEvent(index, "running", entry.name))

        def report(fraction: float) -> None:
            if self._is_cancelled(index):
                raise Cancelled
            self._progress(index, min(max(fraction, 0.0), 1.0))

        try:
            files = list(entry.make(report))
        except Cancelled:
            self._cancel(index, entry)
        except StudioError as error:
            self._fail(index, entry, Failure(entry.name, error.what, error.remedy, error))
        except Exception as error:  # noqa: BLE001 - one bad file must not cost a person the ninety others
            what = say(
                "Something unexpected happened: {kind}: {error}.", kind=type(error).__name__, error=error
            )
            self._fail(
                index, entry, Failure(entry.name, what, "Please report it; the other files continue.", error)
            )
        else:
            self.files += files
            self._on_event(EntryEvent(index, "done", entry.name, tuple(str(file) for file in files)))

    def _fail(self, index: int, entry: Entry, failure: Failure) -> None:
        self.failed.append(failure)
        self._on_event(EntryEvent(index, "failed", entry.name, what=failure.what, remedy=failure.remedy))

    def _cancel(self, index: int, entry: Entry) -> None:
        self.cancelled.append(entry.name)
        self._on_event(EntryEvent(index, "cancelled", entry.name))

    def _progress(self, index: int, own: float, last: bool = False) -> None:
        now = time.monotonic()
        if not last and now - self._last < REPORT_SECONDS:
            return
        self._last = now
        done = self._before + (0.0 if last else own * self._entries[index].weight)
        fraction = 1.0 if last else done / self._whole
        # Entries that were cancelled before their turn took no time, so they say nothing about the pace.
        worked = max(done - self._left_out, 0.0)
        spent = now - self._began
        eta_s = 0.0 if last else spent * (self._whole - done) / worked if worked > 0 else None
        self._on_event(QueueProgressEvent(fraction, eta_s, index, own))


class SourceJob:
    """A source read once for all its formats; what went wrong with it goes wrong with each.

    Args:
        source: what is exported.
        cache: shared by all sources of a queue.
        export_range: what is written of it.
        render_options: how films and stills are drawn.
    """

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
            # Of one format; the next may still be requested.
            raise
        except StudioError as error:
            self._error = error
            raise

    def write(self, module: ModuleType, target: Path, report: Report) -> tuple[Path, ...]:
        """Write one file of it."""
        reading, writing = progress_shares(module, report)
        clip = self.clip(reading)
        with tempfile.TemporaryDirectory(prefix=leftovers.scratch_prefix("export")) as scratch:
            return write_clip(
                module, target, clip, self.export_range, self.render_options, self.source.name, Path(scratch),
                writing,
            )  # fmt: skip


def progress_shares(module: ModuleType, report: Report) -> tuple[Report, Report]:
    """What reading or generating a clip reports to, and what writing it does."""
    reading = _READING_SHARE_DRAWN if getattr(module, "DRAWS", False) else _READING_SHARE
    return (
        lambda fraction: report(reading * fraction),
        lambda fraction: report(reading + (1 - reading) * fraction),
    )


class ClipCache:
    """The clip of one source, for its next format: an hour of motion is too large to keep those of all."""

    def __init__(self) -> None:
        self._source: ExportSource | None = None
        self._clip: ExportClip | None = None

    def clip(self, source: ExportSource, report: Report) -> ExportClip:
        """The clip of a source, read or generated unless it is the one that was asked for last."""
        if self._source is not source or self._clip is None:
            # Freed first: two hours of motion may not fit.
            self._source, self._clip = source, None
            self._clip = source.clip(report)
        return self._clip


def entry_of(job: SourceJob, module: ModuleType, target: Path, share: float = 1.0) -> Entry:
    """One file of a source.

    Args:
        job: the source, shared by its formats.
        module: the format.
        target: the file to write.
        share: of the source's weight.
    """
    return Entry(target.name, job.source.weight * share, lambda report: job.write(module, target, report))


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
        export_range: what is written of each.
        render_options: how films and stills are drawn.
        force: files that are there are written over.
        project: its takes and runs are never written over.

    Raises:
        RequestError: one of the files may not be written.
    """
    from studio import formats

    if folder.exists() and not folder.is_dir():
        raise wrong_folder(say("{folder} is a file, not a folder.", folder=folder))
    entries: list[Entry] = []
    cache = ClipCache()
    for source, name in zip(sources, distinct([source.name for source in sources]), strict=True):
        job = SourceJob(source, cache, export_range, render_options)
        for number, module in enumerate(modules):
            target = (folder / f"{name}{formats.written_suffix(module)}").absolute()
            check_writable(formats.targets(target), force, project)
            # The first format pays for reading or generating the motion, the others only for writing it.
            share = _WEIGHT_FURTHER if number else _WEIGHT_FIRST
            share = _WEIGHT_DRAWN if getattr(module, "DRAWS", False) else share
            entries.append(entry_of(job, module, target, share))
    return entries


def to_name(files: Iterable[Path]) -> list[Path]:
    """What a person is told of files that were written: of a sequence's pictures their folder alone."""
    from studio.formats.frames import SUFFIX

    return list(dict.fromkeys(file.parent if file.parent.suffix == SUFFIX else file for file in files))


def distinct(names: Sequence[str]) -> list[str]:
    """File names that every system accepts, no two alike: `talk.wav` and `talk.mp3` give talk and talk_2."""
    from studio.files.atomic import safe_name

    found: list[str] = []
    used: set[str] = set()
    for name in names:
        base = chosen = safe_name(name)
        number = 1
        while chosen.casefold() in used:
            # Windows and macOS take Talk and talk for one file.
            number += 1
            chosen = f"{base}_{number}"
        used.add(chosen.casefold())
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
        raise RequestError(
            say("{name} has no motion to export.", name=name),
            say("Generate it first: RUN:{name}.", name=name),
        )
    draws = getattr(module, "DRAWS", False)
    if draws:
        # A film has frames of its own, and a still none.
        export_range, fps = replace(export_range, fps=0.0), export_range.fps
    ranged = export_range.motion(motion, name) if motion is not None and len(motion) else motion
    audio = export_range.sound(clip.audio, scratch) if clip.audio is not None else None
    more: dict[str, Any] = {"drawing": render_options.drawing(fps, report)} if draws else {}
    if getattr(module, "WEARS", False):
        more["avatar"] = render_options.avatar
    files: tuple[Path, ...] = module.write(target, ranged or Motion.build([]), audio, **more)
    return files
