"""`saia generate`: a trained run turns any sound into motion."""

from __future__ import annotations

import argparse
import time
from pathlib import Path

from studio.cli._output import Output
from studio.cli._source import check_sound
from studio.cli._target import add_force, check_free

HELP = "turn sound into motion with a trained run"
EXAMPLE = "saia generate MyProject balanced_001 talk.wav -o talk.bvh"
_REPORT_SECONDS = 0.25


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """PROJECT RUN AUDIO [--style NAME] [--liveliness X] [--seed N] -o OUT."""
    parser.add_argument("project", type=Path, help="the project's folder")
    parser.add_argument("run", help="the run whose best weights are used")
    parser.add_argument("audio", type=Path, help="any sound or video file")
    parser.add_argument(
        "-o", "--out", type=Path, help="file to write; its ending says the format (exports/NAME.arrow)"
    )
    add_force(parser)
    add_manner(parser)


def add_manner(parser: argparse.ArgumentParser) -> None:
    """How a run is to move: --style NAME, --liveliness X and --seed N."""
    parser.add_argument(
        "--style",
        metavar="NAME",
        help="a take or performer it learnt from, or average (chosen on validation)",
    )
    add_chance(parser)


def add_chance(parser: argparse.ArgumentParser) -> None:
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
    from studio.formats import targets, writer_for

    project = opened(args.project, out)
    chosen = project.run(args.run)
    target = args.out or project.exports_folder / f"{args.audio.stem}_{chosen.id}.arrow"
    writer = writer_for(target)
    check_free(targets(target.absolute()), args.force, project)
    check_sound(args.audio)
    # Torch takes seconds to load: what was wrong with the request has been said by now.
    from studio.generate import chance_of, load_predictor

    predictor, chance = load_predictor(chosen.folder), chance_of(args.seed, args.liveliness)
    motion = predictor.generate(args.audio, on_progress=_Reporter(out), style=args.style, chance=chance)
    target.absolute().parent.mkdir(parents=True, exist_ok=True)
    files = writer.write(target.absolute(), motion, args.audio)
    text = f"{motion.duration:.1f} s of motion in {', '.join(str(file) for file in files)}."
    out.done(
        text,
        files=list(files),
        seconds=motion.duration,
        frames=len(motion),
        fps=motion.fps,
        style=args.style or predictor.style,
        seed=args.seed,
        liveliness=args.liveliness,
    )


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
