"""`saia compare`: several runs on the same takes, in one table beside the baselines."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from studio.cli._measure import (
    CAPTURED,
    SPLITS,
    baseline_figures,
    captured_figures,
    measure,
    say_learnt,
    table,
)
from studio.cli._output import Output
from studio.cli._project import trim_cache
from studio.errors import say
from studio.evaluation.evaluation_set import choose_evaluation_set
from studio.evaluation.verdict import better_of
from studio.ipc.events import CompareDone, MeasuredEvent

if TYPE_CHECKING:
    from studio.project import Run

EXAMPLE = "saia compare MyProject quick_001 balanced_001"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """PROJECT RUN... [--takes T...] [--split test] [--all]."""
    parser.add_argument("project", type=Path, help="the project's folder")
    parser.add_argument("runs", nargs="+", metavar="RUN", help="the runs to compare")
    parser.add_argument("--takes", nargs="+", metavar="T", help="compare on these takes")
    parser.add_argument("--split", choices=SPLITS, default="test", help="compare on this split (test)")
    parser.add_argument("--no-baselines", action="store_true", help="leave the baselines out")
    parser.add_argument("--all", action="store_true", help="show every figure, one a line")


def run(args: argparse.Namespace, out: Output) -> None:
    """Measure each run and print one row each, under the sentence which is better."""
    from studio.cli._project import opened

    project = opened(args.project, out)
    # All names are looked up before the first run is measured, which takes minutes.
    chosen = [project.run(name) for name in dict.fromkeys(args.runs)]
    # One set for all: figures on different takes cannot be compared.
    evaluation_set = choose_evaluation_set(project, args.takes, args.split, out.note)
    rows, per_take, frames = {}, {}, 0
    for one in chosen:
        say_learnt(one, evaluation_set, out)
        result = measure(one, evaluation_set, out)
        rows[one.id], per_take[one.id], frames = result.metrics, result.per_take, result.frames
        out.emit(MeasuredEvent(one.id, metrics=rows[one.id]))
    _say_different_training(chosen, out)
    trim_cache(project)
    # Fitted to what the first run learnt from; a note says where the others differ.
    baselines = {} if args.no_baselines else baseline_figures(project, chosen[0], evaluation_set, out)
    captured = captured_figures(evaluation_set)
    seeds = {one.id: one.facts.seed for one in chosen}
    title = f"On {evaluation_set.words(frames)}; seeds {', '.join(str(seed) for seed in seeds.values())}"
    text = table({**rows, **baselines, CAPTURED: captured}, every=args.all)
    done = CompareDone(
        evaluation_set.split, tuple(evaluation_set.takes), frames, seeds, rows, baselines, captured, per_take
    )
    better = better_of(rows, per_take)
    out.done(done, "\n".join(part for part in (better, title, text) if part))


def _say_different_training(chosen: list[Run], out: Output) -> None:
    """A note where the runs did not learn from the same takes."""
    learnt = {one.facts.train for one in chosen}
    if len(learnt) > 1:
        out.note(
            say(
                "The runs learnt from different takes; the baselines are fitted to those of {run}.",
                run=chosen[0].id,
            )
        )
