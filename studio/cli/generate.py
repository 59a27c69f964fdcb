"""`saia generate`: a trained run turns any sound into motion, one or a whole folder of them."""

from __future__ import annotations

import argparse
import tempfile
import time
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from studio.cli._clip import ExportClip, GenerationOptions, Generator, Report
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
from studio.cli._outputs import (
    ExportSource,
    add_format,
    entries_of,
    formats_of,
    progress_shares,
    sounds_of,
    write_clip,
)
from studio.cli._project import check_sound, trim_cache
from studio.cli._queue import run_queue
from studio.cli._stdin import ends_clean
from studio.errors import RequestError, StudioError

if TYPE_CHECKING:
    from studio.motion import Motion
    from studio.project import Project

HELP = "turn sound into motion with a trained run"
EXAMPLE = "saia generate MyProject balanced_001 talk.wav -o talk.bvh"
_REPORT_SECONDS = 0.25


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


def add_generation_options(parser: argparse.ArgumentParser) -> None:
    """How a run is to move: --style NAME, --liveliness X and --seed N."""
    parser.add_argument(
        "--style",
        metavar="NAME",
        help="a take or performer it learnt from, or average (chosen on validation)",
    )
    add_sampling_options(parser)


def add_sampling_options(parser: argparse.ArgumentParser) -> None:
    """--liveliness X and --seed N."""
    parser.add_argument(
        "--liveliness",
        type=float,
        default=1.0,
        metavar="X",
        help="0 is still, 1 as it was learnt (1), more exaggerates, up to 3",
    )
    parser.add_argument(
        "--seed", type=int, default=0, metavar="N", help="another seed, another take of models that draw (0)"
    )


def run(args: argparse.Namespace, out: Output) -> None:
    """Generate, write, and name the files."""
    from studio.cli._project import opened

    export_range = range_of(args)
    project = opened(args.project, out)
    generator = Generator(project.run(args.run), GenerationOptions(args.style, args.seed, args.liveliness))
    with ends_clean():
        if args.format is not None or len(args.audio) > 1 or args.audio[0].is_dir():
            _many(args, out, project, generator, export_range)
        else:
            _one(args, out, project, generator, export_range)
    trim_cache(project)


def _one(
    args: argparse.Namespace, out: Output, project: Project, generator: Generator, export_range: ExportRange
) -> None:
    from studio.files import leftovers
    from studio.formats import targets, writer_for

    audio = args.audio[0]
    target = args.out or project.exports_folder / f"{audio.stem}_{generator.run.id}.arrow"
    writer = writer_for(target)
    check_free(targets(target.absolute()), args.force, project)
    if note := check_sound(audio):
        out.event("note", note, note=note)
    render_options, report = render_options_of(args), _Reporter(out)
    reading, writing = progress_shares(writer, report)
    motion = _generated(generator, audio, reading, args.pieces, out)
    target.absolute().parent.mkdir(parents=True, exist_ok=True)
    clip = ExportClip(motion, audio)
    with tempfile.TemporaryDirectory(prefix=leftovers.scratch_prefix("export")) as scratch:
        files = write_clip(
            writer, target.absolute(), clip, export_range, render_options, audio.stem, Path(scratch), writing
        )
    report(1.0)
    text = f"{motion.duration:.1f} s of motion in {', '.join(str(file) for file in files)}."
    out.done(
        text,
        files=list(files),
        seconds=motion.duration,
        frames=len(motion),
        fps=motion.fps,
        style=generator.style,
        seed=args.seed,
        liveliness=args.liveliness,
    )


def _many(
    args: argparse.Namespace, out: Output, project: Project, generator: Generator, export_range: ExportRange
) -> None:
    """Every sound in every format, into one folder."""
    sounds = sounds_of(args.audio)
    folder = args.out or project.exports_folder
    if args.pieces is not None:
        raise RequestError("--pieces is for one sound.", "Leave it out, or name one sound and no --format.")
    sources = [
        ExportSource(
            f"{sound.stem}_{generator.run.id}",
            float(max(sound.stat().st_size, 1)),
            partial(_clip, generator, sound),
        )
        for sound in sounds
    ]
    modules = formats_of(args.format or "vrma")
    run_queue(
        entries_of(sources, modules, folder, export_range, render_options_of(args), args.force, project), out
    )


def _clip(generator: Generator, sound: Path, report: Report) -> ExportClip:
    return ExportClip(generator.motion(sound, report), sound)


def _generated(generator: Generator, audio: Path, report: Report, pieces: Path | None, out: Output) -> Motion:
    """The motion of a sound; each piece is written beside as soon as it is there."""
    if pieces is None:
        return generator.motion(audio, report)
    from studio.motion.motion import concatenate
    from studio.sound.sound_file import sound_info
    from studio.take.motion_file import write_motion

    seconds = sound_info(audio).duration
    parts: list[Motion] = []
    for part in generator.pieces(audio):
        file = pieces.absolute() / f"piece_{len(parts):05d}.arrow"
        write_motion(file, part)
        parts.append(part)
        end = float(part.times[-1])
        out.event("piece", file=file, start=float(part.times[0]), end=end)
        report(min(1.0, end / seconds) if seconds > 0 else 1.0)
    if not parts:
        raise StudioError(f"The sound file {audio.name} is empty.", "Choose another file.")
    return concatenate(parts)


class _Reporter:
    """Progress as events with the time left, at most four a second."""

    def __init__(self, out: Output) -> None:
        self._out, self._began, self._last = out, time.monotonic(), 0.0

    def __call__(self, fraction: float) -> None:
        now = time.monotonic()
        if fraction < 1 and now - self._last < _REPORT_SECONDS:
            return
        self._last = now
        eta_s = (now - self._began) * (1 / max(fraction, 1e-6) - 1)
        left = f", {eta_s:.0f} s left" if fraction < 1 else ""
        self._out.passing("progress", f"{fraction:4.0%}{left}", fraction=fraction, eta_s=eta_s)
