"""`saia evaluate`: how near and how alive a run's motion is, beside the baselines."""

from __future__ import annotations

import argparse
from pathlib import Path

from studio.cli._export import add_sampling_options
from studio.cli._measure import (
    CAPTURED,
    DRAWN,
    SPLITS,
    baseline_figures,
    captured_figures,
    keep_evaluation,
    measure,
    poses_measured,
    progress_callback,
    say_learnt,
    table,
)
from studio.cli._output import Output
from studio.cli._project import trim_cache
from studio.evaluation.evaluation_set import choose_evaluation_set
from studio.ipc.events import EvaluateDone

EXAMPLE = "saia evaluate MyProject balanced_001"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """PROJECT RUN [--takes T...] [--split test] [--style NAME] [--all]."""
    parser.add_argument("project", type=Path, help="the project's folder")
    parser.add_argument("run", help="the run to measure")
    parser.add_argument("--takes", nargs="+", metavar="T", help="measure on these takes")
    parser.add_argument("--split", choices=SPLITS, default="test", help="measure on this split (test)")
    parser.add_argument("--style", metavar="NAME", help="measure this style (average)")
    add_sampling_options(parser)
    parser.add_argument("--no-baselines", action="store_true", help="leave the baselines out")
    parser.add_argument("--all", action="store_true", help="show every figure, one a line")


def run(args: argparse.Namespace, out: Output) -> None:
    """Generate motion for the takes, compare, and keep the figures in the run's folder."""
    from studio.cli._project import opened

    project = opened(args.project, out)
    chosen = project.run(args.run)
    evaluation_set = choose_evaluation_set(project, args.takes, args.split, out.note)
    say_learnt(chosen, evaluation_set, out)
    result = measure(chosen, evaluation_set, out, args.style, args.seed, args.liveliness)
    baselines = {} if args.no_baselines else baseline_figures(project, chosen, evaluation_set, out)
    done = EvaluateDone(
        run=chosen.id,
        seed=chosen.facts.seed,
        best_epoch=chosen.facts.best_epoch,
        style=args.style or (chosen.facts.style or "average"),
        chance={"seed": args.seed, "liveliness": args.liveliness},
        poses=poses_measured(chosen, args.liveliness),
        split=evaluation_set.split,
        takes=tuple(evaluation_set.takes),
        frames=result.frames,
        metrics=result.metrics,
        per_take=result.per_take,
        per_bone=result.per_bone,
        captured=captured_figures(evaluation_set),
        baselines=baselines,
    )
    # Before the look-aheads are measured: Ctrl+C there loses nothing of this.
    keep_evaluation(chosen, done)
    # Only figures of the usual takes and style may stand beside Live's slider.
    if not args.takes and args.split == "test" and args.style is None and not chosen.is_shipped:
        # What Live shows beside its slider.
        from studio.evaluation.look_aheads import store_look_aheads

        store_look_aheads(chosen, evaluation_set, progress_callback(out))
    trim_cache(project)
    # The captured motion last: it is what every row above is read against.
    rows = {chosen.id: result.metrics, **baselines, CAPTURED: done.captured}
    if len(result.per_take) > 1:
        rows |= {f"  {take}": figures for take, figures in result.per_take.items()}
    title = f"{chosen.id} (seed {done.seed}) on {evaluation_set.words(result.frames)}"
    if done.poses == DRAWN:
        title += f", drawn with seed {args.seed} at liveliness {args.liveliness:g}"
    out.done(done, f"{title}\n{table(rows, every=args.all)}")
