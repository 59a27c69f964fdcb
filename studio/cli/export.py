"""`saia export`: takes, or what a run makes of their sound, as files for other programs."""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

from studio.cli._clip import (
    ExportClip,
    GenerationOptions,
    Generator,
    Report,
    file_clip,
    generated_clip,
    selection_of,
    take_clip,
)
from studio.cli._export_args import (
    ExportRange,
    add_force,
    add_range,
    add_render_options,
    check_free,
    range_of,
    render_options_of,
)
from studio.cli._output import Output
from studio.cli._outputs import ExportSource, add_format, entries_of, formats_of, progress_shares, write_clip
from studio.cli._queue import run_queue
from studio.cli._stdin import ends_clean
from studio.cli.generate import add_generation_options
from studio.errors import RequestError

if TYPE_CHECKING:
    from studio.project import Project

HELP = "write takes, or a run's motion for them, as BVH, VRMA and more"
EXAMPLE = "saia export MyProject Hello_001 -o hello.bvh"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """PROJECT TAKE|RUN:TAKE|FILE.arrow... [--format A,B] [--style NAME] -o OUT."""
    parser.add_argument("project", type=Path, help="the project's folder")
    parser.add_argument(
        "what",
        nargs="+",
        metavar="TAKE|RUN:TAKE|FILE.arrow",
        help="a take, a run and a take to generate for, or a motion file as it is",
    )
    parser.add_argument("--audio", type=Path, help="the sound of a motion file")
    parser.add_argument(
        "-o", "--out", type=Path, required=True,
        help="file to write; its ending says the format; a folder for several",
    )  # fmt: skip
    parser.add_argument("--name", help="what the files of one motion are called, with --format")
    add_format(parser)
    add_force(parser)
    add_range(parser)
    add_generation_options(parser)
    add_render_options(parser)


def run(args: argparse.Namespace, out: Output) -> None:
    """Write the files with in and out points and offset applied."""
    from studio.cli._project import opened
    from studio.files import leftovers

    target = args.out.absolute()
    several = args.format is not None or len(args.what) > 1
    if not several:
        from studio.formats import writer_for

        writer_for(target)
    export_range = range_of(args)
    project = opened(args.project, out)
    with ends_clean(), tempfile.TemporaryDirectory(prefix=leftovers.scratch_prefix("export")) as folder:
        exporting = _Exporting(args, project, Path(folder))
        if several:
            sources = [exporting.source(what) for what in args.what]
            modules = formats_of(args.format or "vrma")
            entries = entries_of(
                sources, modules, target, export_range, render_options_of(args), args.force, project
            )
            run_queue(entries, out, _note(modules))
        else:
            _one(exporting, target, export_range, out)


def _one(exporting: _Exporting, target: Path, export_range: ExportRange, out: Output) -> None:
    from studio.formats import targets, writer_for

    args, writer = exporting.args, writer_for(target)
    check_free(targets(target), args.force, exporting.project)
    render_options = render_options_of(args)
    source = exporting.source(args.what[0])
    progress = _Progress(out)
    progress.report(0.0)
    reading, writing = progress_shares(writer, progress.report)
    clip = source.clip(reading)
    files = write_clip(
        writer, target, clip, export_range, render_options, source.name, exporting.folder, writing
    )
    progress.report(1.0)
    names = ", ".join(str(file) for file in files)
    out.done(f"Exported {names}. {writer.NOTE}", files=list(files), note=writer.NOTE)


def _note(modules: Sequence[ModuleType]) -> str:
    return str(modules[0].NOTE) if len(modules) == 1 else ""


class _Exporting:
    """What was asked for, and the runs it takes.

    Args:
        args: the command's words.
        project: the open project.
        folder: a folder of our own for sound that has to be cut.
    """

    def __init__(self, args: argparse.Namespace, project: Project, folder: Path) -> None:
        self.args, self.project, self.folder = args, project, folder
        self._generators: dict[str, Generator] = {}

    def source(self, what: str) -> ExportSource:
        """One of the things named; RequestError where there is no such take, run or file."""
        as_file = Path(what)
        if as_file.suffix == ".arrow" and as_file.is_file():
            name = self.args.name or as_file.stem
            return ExportSource(name, 1.0, lambda report: file_clip(as_file, self.args.audio))
        # A take's name may hold no colon, a run's neither, so the last one divides them.
        run_id, _, name = what.rpartition(":")
        if self.args.style is not None and not run_id:
            raise RequestError("A take has no style to choose.", "Leave --style out, or name RUN:TAKE.")
        selection, take = selection_of(self.project, name)
        if not run_id:
            return ExportSource(name, 1.0, lambda report: take_clip(selection, take, self.folder))
        generator = self._generator(run_id)

        def made(report: Report) -> ExportClip:
            return generated_clip(generator, take_clip(selection, take, self.folder), report)

        called = name if len(self.args.what) == 1 and self.args.format is None else f"{name}_{run_id}"
        return ExportSource(called, max(take.info.duration, 1.0), made)

    def _generator(self, run_id: str) -> Generator:
        if run_id not in self._generators:
            args = self.args
            options = GenerationOptions(args.style, args.seed, args.liveliness)
            self._generators[run_id] = Generator(self.project.run(run_id), options)
        return self._generators[run_id]


class _Progress:
    """Progress events with the time left, at most five a second."""

    def __init__(self, out: Output) -> None:
        self._out, self._start, self._last = out, time.monotonic(), -1.0

    def report(self, fraction: float) -> None:
        now = time.monotonic()
        if 0 < fraction < 1 and now - self._last < 0.2:
            return
        self._last = now
        spent = now - self._start
        eta = spent * (1 - fraction) / fraction if fraction > 0 else None
        self._out.passing("progress", f"{fraction:4.0%}", fraction=fraction, eta_s=eta)
