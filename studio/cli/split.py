"""`saia split`: which takes are learnt from, selected by, and tested on."""

from __future__ import annotations

import argparse
from pathlib import Path

from studio.cli._output import Output
from studio.errors import RequestError, StudioError

HELP = "say which takes are for training, validation and test"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """PROJECT --train T... --val T... --test T... --unused T..."""
    parser.add_argument("project", type=Path, help="the project's folder")
    for split, text in (
        ("train", "learnt from"),
        ("val", "used to select the best epoch"),
        ("test", "kept for the final measure"),
        ("unused", "left out"),
    ):
        parser.add_argument(f"--{split}", nargs="+", default=[], metavar="T", help=f"takes {text}")


def run(args: argparse.Namespace, out: Output) -> None:
    """Set the splits as one step of undo; takes that are not named keep theirs."""
    from studio.cli._project import opened
    from studio.dataset import edits

    wanted = {"train": args.train, "val": args.val, "test": args.test, "": args.unused}
    if not any(wanted.values()):
        raise RequestError("No take was named.", "Name takes after --train, --val or --test.")
    project = opened(args.project, out, read_only=False)
    if project.read_only:
        raise StudioError(project.read_only_reason, "Set the split there, or close it there first.")
    dataset = project.dataset
    placed: dict[str, str] = {}
    for split, names in wanted.items():
        for name in names:
            ids = [s.id for s in dataset.selections if name in (s.id, s.take)]
            if not ids:
                project.take(name)  # says which takes there are
                raise RequestError(f"{name} is not selected for anything.", "Add it to the dataset first.")
            for selection_id in ids:
                if placed.setdefault(selection_id, split) != split:
                    what = f"{selection_id} was named for two splits."
                    raise RequestError(what, "Name each take once.")
            dataset = edits.set_split(dataset, ids, split)
    project.edit("Split takes", dataset)
    splits = {split: [s.id for s in dataset.of_split(split)] for split in ("train", "val", "test")}
    unused = [s.id for s in dataset.of_split("")]
    counts = ", ".join(f"{len(ids)} {split}" for split, ids in splits.items())
    out.done(f"{project.name}: {counts}.", **splits, unused=unused)
