"""`saia export`: a take, or what a run makes of a take's sound, as files for other programs."""

from __future__ import annotations

import argparse
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from studio.cli._output import Output
from studio.cli._run import as_request
from studio.cli._source import check_sound
from studio.cli._target import add_force, check_free
from studio.cli.generate import add_manner
from studio.errors import RequestError

if TYPE_CHECKING:
    from studio.dataset import Selection
    from studio.motion import Motion
    from studio.project import Project
    from studio.take import Take

HELP = "write a take, or a run's motion for it, as BVH, SAIA CSV and more"
EXAMPLE = "saia export MyProject Hello_001 -o hello.bvh"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """PROJECT TAKE|RUN:TAKE|FILE.arrow [--style NAME] -o OUT."""
    parser.add_argument("project", type=Path, help="the project's folder")
    parser.add_argument(
        "what",
        metavar="TAKE|RUN:TAKE|FILE.arrow",
        help="a take, a run and a take to generate for, or a motion file as it is",
    )
    parser.add_argument("--audio", type=Path, help="the sound of a motion file")
    parser.add_argument(
        "-o", "--out", type=Path, required=True, help="file to write; its ending says the format"
    )
    add_force(parser)
    parser.add_argument("--fps", type=float, default=0.0, help="frame rate; the motion's own where not given")
    add_manner(parser)


def run(args: argparse.Namespace, out: Output) -> None:
    """Write the files with in and out points and offset applied."""
    from studio.cli._project import opened
    from studio.formats import targets, writer_for
    from studio.motion import Motion

    target = args.out.absolute()
    writer = writer_for(target)
    if args.fps and not 1 <= args.fps <= 1000:
        raise RequestError(
            "The frame rate must be from 1 to 1000.", "Leave --fps out to keep the motion's own."
        )
    project = opened(args.project, out)
    check_free(targets(target), args.force, project)
    run_id, _, name = args.what.rpartition(":")
    # A take's name may hold no colon, a run's neither, so the last one divides them.
    if args.style is not None and not run_id:
        raise RequestError("A take has no style to choose.", "Leave --style out, or name RUN:TAKE.")
    progress = _Progress(out)
    progress.report(0.0)
    with tempfile.TemporaryDirectory(prefix="saia-export-") as folder:
        as_file = Path(args.what)
        if as_file.suffix == ".arrow" and as_file.is_file():
            run_id, name, clip = "", as_file.stem, _file_clip(as_file, args.audio)
        else:
            clip = _clip(*_selection(project, name), Path(folder))
        motion = clip.motion
        if run_id:
            motion = _generated(project, run_id, clip, progress, args)
        if motion is None and writer.SUFFIX != ".wav":
            raise RequestError(f"{name} has no motion to export.", f"Generate it first: RUN:{name}.")
        if motion is not None and args.fps and len(motion):
            motion = motion.resampled(args.fps)
        files = writer.write(target, motion or Motion.build([]), clip.audio)
    progress.report(1.0)
    names = ", ".join(str(file) for file in files)
    out.done(f"Exported {names}. {writer.NOTE}", files=list(files), note=writer.NOTE)


@dataclass(frozen=True)
class _Clip:
    """The used part of a take: motion from 0, and a file with just its sound."""

    motion: Motion | None
    audio: Path | None


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


def _selection(project: Project, name: str) -> tuple[Selection, Take]:
    """A selection by its id, or the whole of a take by the take's id."""
    from studio.dataset import Selection

    if name in project.dataset:
        selection = project.dataset[name]
        return selection, project.take(selection.take)
    return Selection(name, name), project.take(name)


def _clip(selection: Selection, take: Take, folder: Path) -> _Clip:
    from studio.dataset.material import load_material
    from studio.take.cleaned import clean
    from studio.take.sound import Sound, read_span, write_sound

    motion = load_material(selection, take, 8000).motion if take.motion_path else None
    start = max(selection.in_point, 0.0)
    end = take.info.duration if selection.out_point is None else selection.out_point
    audio = clean(take.audio_path, selection.clean) if take.audio_path is not None else None
    if audio is not None and (start > 0 or end < take.info.audio_seconds):
        span: Sound = read_span(audio, start, end)
        audio = folder / f"{selection.id}.wav"
        write_sound(audio, span, "PCM_24")
    return _Clip(motion, audio)


def _file_clip(path: Path, audio: Path | None) -> _Clip:
    """A motion file as it is: what Review tuned and shows."""
    from studio.motion.mend import mended
    from studio.take.motion_file import read_motion

    if audio is not None:
        check_sound(audio)
    with as_request():
        return _Clip(mended(read_motion(path))[0], audio)


def _generated(
    project: Project, run_id: str, clip: _Clip, progress: _Progress, args: argparse.Namespace
) -> Motion:
    run = project.run(run_id)
    if not run.has_weights:
        raise RequestError(f"{run.id} has no trained weights yet.", "Train it first, or choose another run.")
    if clip.audio is None:
        raise RequestError("There is no sound to generate motion from.", "Choose a take with sound.")
    from studio.generate import chance_of, load_predictor

    predictor, chance = load_predictor(run.folder), chance_of(args.seed, args.liveliness)
    motion: Motion = predictor.generate(
        clip.audio, on_progress=progress.report, style=args.style, chance=chance
    )
    return motion
