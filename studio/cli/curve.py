"""`saia curve`: what more takes would bring, measured on a person's own."""

from __future__ import annotations

import argparse
import sys
from dataclasses import asdict
from pathlib import Path

from studio.cli._output import Output
from studio.cli._project import trim_cache
from studio.cli._stdin import StopRequest, ends_clean
from studio.evaluation import learning_curve
from studio.evaluation.learning_curve import LearningCurve
from studio.evaluation.verdict import curve_text
from studio.ipc.events import CurveDone, CurveProgressEvent, EpochEvent

EXAMPLE = "saia curve MyProject"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """PROJECT [--set key=value]."""
    parser.add_argument("project", type=Path, help="the project's folder")
    parser.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE", help="change a value of the recipe quick"
    )


def run(args: argparse.Namespace, out: Output) -> None:
    """Train three times on shares of the takes, measure, and keep the curve with the project's runs."""
    from studio.cli._project import opened
    from studio.evaluation.evaluation_set import choose_evaluation_set
    from studio.training.recipe import load_recipe

    project = opened(args.project, out)
    recipe = load_recipe(learning_curve.RECIPE).with_overrides(args.set)
    stop = StopRequest(read=out.as_json or not sys.stdin.isatty(), watched=out.as_json)
    evaluation_set = choose_evaluation_set(project, None, "test", out.note)
    of = len(learning_curve.SHARES)

    def tell(index: int, event: object) -> None:
        if isinstance(event, EpochEvent):
            fraction = (index + event.epoch / max(event.of, 1)) / of
            text = f"Training {index + 1} of {of}: {fraction:.0%}"
            out.pass_by(CurveProgressEvent(fraction, number=index + 1, of=of), text)

    out.pass_by(CurveProgressEvent(number=1, of=of), "Reading the takes ...")
    with ends_clean("SIGHUP"):
        curve = learning_curve.measure_curve(project, evaluation_set, recipe, tell, stop.is_set)
    learning_curve.save_curve(project, curve)
    trim_cache(project)
    out.done(_done(curve), curve_text(curve))


def _done(curve: LearningCurve) -> CurveDone:
    return CurveDone(
        curve_text(curve),
        tuple(asdict(point) for point in curve.points),
        curve.next_gain,
        curve.enough_seconds,
        curve.split,
        curve.takes,
        curve.missing,
    )
