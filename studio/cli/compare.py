"""`saia compare`: several runs on the same takes, in one table."""

from __future__ import annotations

import argparse
from pathlib import Path

from studio.cli._output import Output
from studio.cli.evaluate import SPLITS, choose_ground, measure, table

HELP = "compare runs on the same takes"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """PROJECT RUN... [--takes T...] [--split test]."""
    parser.add_argument("project", type=Path, help="the project's folder")
    parser.add_argument("runs", nargs="+", metavar="RUN", help="the runs to compare")
    parser.add_argument("--takes", nargs="+", metavar="T", help="compare on these takes")
    parser.add_argument("--split", choices=SPLITS, default="test", help="compare on this split (test)")


def run(args: argparse.Namespace, out: Output) -> None:
    """Measure each run and print one row each."""
    from studio.cli._project import opened

    project = opened(args.project, out)
    chosen = [project.run(name) for name in dict.fromkeys(args.runs)]
    ground = choose_ground(project, args.takes, args.split, out)
    rows = {}
    for one in chosen:
        rows[one.id] = measure(one, ground).metrics
        out.event("measured", run=one.id, metrics=rows[one.id])
    title = f"On {', '.join(ground.takes)} ({ground.split})"
    out.done(f"{title}\n{table(rows)}", split=ground.split, takes=ground.takes, runs=rows)
