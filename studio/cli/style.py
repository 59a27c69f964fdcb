"""`saia style`: a run is shown how to move by some seconds of a take, forgets that, or lists its styles."""

from __future__ import annotations

import argparse
from pathlib import Path

from studio.cli._output import Output
from studio.errors import RequestError
from studio.ipc.events import ProgressEvent, StyleDone

EXAMPLE = "saia style MyProject balanced_001 Hello_003 --from 12 --to 22 --name calm"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """PROJECT RUN [TAKE --from S --to S] [--name NAME] [--list] [--forget NAME]."""
    parser.add_argument("project", type=Path, help="the project's folder")
    parser.add_argument("run", help="the run that is to know the style")
    parser.add_argument("take", nargs="?", help="a take that moves as wanted, or a part of one")
    parser.add_argument("--from", type=float, dest="start", metavar="S", help="where the seconds begin")
    parser.add_argument("--to", type=float, dest="end", metavar="S", help="where they end; ten do well")
    parser.add_argument("--name", default="", help="what the style is called (like TAKE)")
    parser.add_argument("--list", action="store_true", help="only list the run's styles")
    parser.add_argument("--forget", metavar="NAME", help="remove a style that the run was shown")


def run(args: argparse.Namespace, out: Output) -> None:
    """Fit the style, keep it in the run, and say how to use it."""
    shows = (args.take, args.start, args.end)
    if args.list or args.forget is not None:
        if args.name or any(value is not None for value in shows):
            raise RequestError(
                "A style is shown, listed or forgotten, one at a time.", "Ask for one of them."
            )
    elif None in shows:
        raise RequestError("It is not said which seconds show the style.", "Give TAKE, --from S and --to S.")
    from studio.cli._project import opened
    from studio.training import checkpoint
    from studio.training.fit_style import forget_style, show_style

    project = opened(args.project, out)
    chosen, style, text = project.run(args.run), "", "It knows only the average."
    if args.forget is not None:
        style = args.forget
        forget_style(chosen, style)
        text = f"{chosen.id} no longer knows {style}."
    elif not args.list:
        span = (args.start, args.end)
        style = show_style(
            project, chosen, args.take, span, args.name,
            lambda fraction: out.progress(ProgressEvent(fraction), f"{chosen.id} looks at {args.take}"),
        )  # fmt: skip
        text = f'{chosen.id} knows "{style}" now. Choose it in Review or Live, or with --style "{style}".'
    model = checkpoint.load_model(chosen.folder / checkpoint.BEST)
    shown = tuple(one.name for one in model.fitted)
    if args.list and model.style_names:
        text = "\n".join(f"{name} (shown)" if name in shown else name for name in model.style_names)
    out.done(StyleDone(chosen.id, style, model.style_names, shown), text)
