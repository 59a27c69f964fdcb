"""`saia generate`: a trained run turns any sound into motion, one or a whole folder of them."""

from __future__ import annotations

import argparse
from functools import partial
from itertools import count
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
from studio.cli._output import Output
from studio.cli._project import check_sound, opened, trim_cache
from studio.cli._stdin import ends_clean
from studio.errors import RequestError
from studio.export.clip import ExportClip, ExportSource, Generator, Report, sound_files
from studio.export.range import ExportRange
from studio.ipc.events import GenerateDone, NoteEvent, PieceEvent

if TYPE_CHECKING:
    from studio.motion import Motion
    from studio.project import Project

EXAMPLE = "saia generate MyProject balanced_001 talk.wav -o talk.bvh"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """PROJECT RUN AUDIO... [--format A,B] [--style NAME] [--liveliness X] [--seed N] -o OUT."""
    parser.add_argument("project", type=Path, help="the project's folder")
    parser.add_argument("run", help="the run whose best weights are used")
    parser.add_argument("audio", type=Path, nargs="+", help="sound or video files, or folders of them")
    parser.add_argument(
        "-o", "--out", type=Path,
        help="file to write; its ending says the format (exports/NAME.arrow); a folder for several",
    )  # fmt: skip
    add_format(parser)
    add_force(parser)
    add_range(parser)
    add_generation_options(parser)
    add_render_options(parser)
    parser.add_argument(
        "--pieces", type=Path, metavar="FOLDER",
        help="also write each piece of motion into this folder as soon as it is made",
    )  # fmt: skip


def run(args: argparse.Namespace, out: Output) -> None:
    """Generate, write, and name the files."""
    export_range = range_of(args)
    project = opened(args.project, out)
    generator = Generator(project.run(args.run), generation_options_of(args))
    with ends_clean():
        if args.format is not None or len(args.audio) > 1 or args.audio[0].is_dir():
            _many(args, out, project, generator, export_range)
        else:
            _one(args, out, project, generator, export_range)
    # After the work, so that what it used counts as newest.
    trim_cache(project)


def _one(
    args: argparse.Namespace, out: Output, project: Project, generator: Generator, export_range: ExportRange
) -> None:
    from studio import formats
    from studio.export.options import check_writable
    from studio.export.queue import ClipCache, SourceJob, entry_of, to_name

    audio = args.audio[0]
    # Into the project's exports: the sound's own folder may be read-only or of another program.
    target = args.out or project.exports_folder / f"{audio.stem}_{generator.run.id}.arrow"
    writer = formats.writer_for(target)
    check_writable(formats.targets(target.absolute()), args.force, project)
    if note := check_sound(audio):
        out.emit(NoteEvent(note, note), note)
    render_options = render_options_of(args)
    cache, generated = ClipCache(), partial(_generated, generator, audio, args.pieces, out)
    job = SourceJob(ExportSource(audio.stem, 1.0, generated), cache, export_range, render_options)
    files = run_one(entry_of(job, writer, target.absolute()), out)
    motion = job.clip(lambda fraction: None).motion
    assert motion is not None
    out.done(
        GenerateDone(
            tuple(str(file) for file in files), seconds=motion.duration, frames=len(motion), fps=motion.fps,
            style=generator.style, seed=args.seed, liveliness=args.liveliness,
        ),
        f"{motion.duration:.1f} s of motion in {', '.join(map(str, to_name(files)))}.",
    )  # fmt: skip


def _many(
    args: argparse.Namespace, out: Output, project: Project, generator: Generator, export_range: ExportRange
) -> None:
    """Every sound in every format, into one folder."""
    from studio.export.options import writers_named
    from studio.export.queue import entries_of

    sounds = sound_files(args.audio)
    folder = args.out or project.exports_folder
    # Pieces of several sounds in one folder could not be told apart.
    if args.pieces is not None:
        raise RequestError("--pieces is for one sound.", "Leave it out, or name one sound and no --format.")

    def clip(sound: Path, report: Report) -> ExportClip:
        return ExportClip(generator.motion(sound, report), sound)

    sources = [
        # By the file's size: how long it sounds is known only once it is decoded.
        ExportSource(
            f"{sound.stem}_{generator.run.id}", float(max(sound.stat().st_size, 1)), partial(clip, sound)
        )
        for sound in sounds
    ]
    modules = writers_named(args.format or "vrma")
    render_options = render_options_of(args)
    run_queue(entries_of(sources, modules, folder, export_range, render_options, args.force, project), out)


def _generated(
    generator: Generator, audio: Path, pieces: Path | None, out: Output, report: Report
) -> ExportClip:
    """The motion of a sound; each piece is also written into a folder as soon as it is there."""
    if pieces is None:
        return ExportClip(generator.motion(audio, report), audio)
    from studio.take.motion_file import write_motion

    written = count()

    def write(piece: Motion) -> None:
        file = pieces.absolute() / f"piece_{next(written):05d}.arrow"
        write_motion(file, piece)
        out.emit(PieceEvent(str(file), float(piece.times[0]), float(piece.times[-1])))

    return ExportClip(generator.motion(audio, report, write), audio)
