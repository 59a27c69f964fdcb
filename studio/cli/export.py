"""`saia export`: takes, or what a run makes of their sound, as files for other programs."""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from studio.cli._export import (
    add_force,
    add_format,
    add_generation_options,
    add_range,
    add_render_options,
    generation_options_of,
    range_of,
    render_options_of,
    run_one,
    run_queue,
)
from studio.cli._output import Output, as_request
from studio.cli._stdin import ends_clean
from studio.errors import RequestError
from studio.export.clip import (
    ExportClip,
    ExportSource,
    Generator,
    Report,
    file_clip,
    generated_clip,
    selection_of,
    take_clip,
)

if TYPE_CHECKING:
    from studio.project import Project

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
    from studio import formats
    from studio.cli._project import opened
    from studio.export.options import check_writable, writers_named
    from studio.export.queue import ClipCache, SourceJob, entries_of, entry_of, to_name
    from studio.files import leftovers
    from studio.ipc.events import FilesDone, ProgressEvent

    target = args.out.absolute()
    several = args.format is not None or len(args.what) > 1
    # An ending that no format has is refused before the project is opened, which may take seconds.
    writer = None if several else formats.writer_for(target)
    export_range = range_of(args)
    project = opened(args.project, out)
    with ends_clean(), tempfile.TemporaryDirectory(prefix=leftovers.scratch_prefix("export")) as folder:
        sources = _Sources(args, project, Path(folder))
        if writer is None:
            found = [sources.named(what) for what in args.what]
            modules = writers_named(args.format or "vrma")
            note = str(modules[0].NOTE) if len(modules) == 1 else ""
            render_options = render_options_of(args)
            run_queue(
                entries_of(found, modules, target, export_range, render_options, args.force, project),
                out,
                note,
            )
            return
        check_writable(formats.targets(target), args.force, project)
        render_options = render_options_of(args)
        job = SourceJob(sources.named(args.what[0]), ClipCache(), export_range, render_options)
        # A run's weights take seconds to load: say at once that it works.
        out.progress(ProgressEvent())
        files = run_one(entry_of(job, writer, target), out)
        named = ", ".join(str(file) for file in to_name(files))
        done = FilesDone(tuple(str(file) for file in files), note=writer.NOTE)
        out.done(done, f"Exported {named}. {writer.NOTE}")


class _Sources:
    """Finds what was named, and the runs it takes.

    Args:
        args: the command's arguments.
        project: the open project.
        folder: a temporary folder for sound that has to be cut.
    """

    def __init__(self, args: argparse.Namespace, project: Project, folder: Path) -> None:
        self._args, self._project, self._folder = args, project, folder
        self._generators: dict[str, Generator] = {}

    def named(self, what: str) -> ExportSource:
        """One of the things named; RequestError where there is no such take, run or file."""
        as_file = Path(what)
        if as_file.suffix == ".arrow" and as_file.is_file():
            return ExportSource(self._args.name or as_file.stem, 1.0, lambda report: self._file(as_file))
        # A take's name may hold no colon, a run's neither, so the last one divides them.
        run_id, _, name = what.rpartition(":")
        if self._args.style is not None and not run_id:
            raise RequestError("A take has no style to choose.", "Leave --style out, or name RUN:TAKE.")
        if (self._args.mood or self._args.mix) and not run_id:
            what = "A take moves as it was captured."
            raise RequestError(what, "Leave --mood and --mix out, or name RUN:TAKE.")
        selection, take = selection_of(self._project, name)
        if not run_id:
            return ExportSource(name, 1.0, lambda report: take_clip(selection, take, self._folder))
        if run_id not in self._generators:
            self._generators[run_id] = Generator(self._project.run(run_id), generation_options_of(self._args))
        generator = self._generators[run_id]

        def generated(report: Report) -> ExportClip:
            return generated_clip(generator, take_clip(selection, take, self._folder), report)

        # Among several files the run's name keeps RUN:TAKE apart from the take as it was captured.
        alone = len(self._args.what) == 1 and self._args.format is None
        return ExportSource(name if alone else f"{name}_{run_id}", max(take.info.duration, 1.0), generated)

    def _file(self, path: Path) -> ExportClip:
        from studio.cli._project import check_sound

        if self._args.audio is not None:
            check_sound(self._args.audio)
        with as_request():
            return file_clip(path, self._args.audio)
