"""`saia split`: which takes are learnt from, selected by, and tested on."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from studio.cli._output import Output
from studio.errors import RequestError, say
from studio.ipc.events import SplitDone

if TYPE_CHECKING:
    from studio.dataset import Dataset
    from studio.project import Project

EXAMPLE = "saia split MyProject --train Hello_001 Hello_002 --val Chat_001 --test Story_001"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """PROJECT --train T... --val T... --test T... --unused T... --lock T... --unlock T..."""
    parser.add_argument("project", type=Path, help="the project's folder")
    for split, text in (
        ("train", "learnt from"),
        ("val", "used to select the best epoch"),
        ("test", "kept for the final measure"),
        ("unused", "left out"),
        ("lock", "kept as test takes, so that nothing learns from them by mistake"),
        ("unlock", "no longer kept as test takes"),
    ):
        parser.add_argument(f"--{split}", nargs="+", default=[], metavar="T", help=f"takes {text}")


def run(args: argparse.Namespace, out: Output) -> None:
    """Set the splits as one step of undo; takes that are not named keep theirs."""
    from studio.cli._project import opened

    wanted = {"train": args.train, "val": args.val, "test": args.test, "": args.unused}
    if not any([*wanted.values(), args.lock, args.unlock]):
        raise RequestError("No take was named.", "Name takes after --train, --val or --test.")
    project = opened(args.project, out, read_only=False)
    # Locks first: --unlock lets the same command move a take out of the test split.
    project.edit("Split takes", _with_splits(_with_locks(project, args), project, wanted))
    dataset = project.dataset
    splits = {split: tuple(s.id for s in dataset.of_split(split)) for split in ("train", "val", "test")}
    unused = tuple(s.id for s in dataset.of_split(""))
    counts = ", ".join(f"{len(ids)} {split}" for split, ids in splits.items())
    locked = tuple(s.id for s in dataset.selections if s.locked)
    done = SplitDone(**splits, unused=unused, locked=locked)
    out.done(done, f"{project.name} in all: {counts}.")


def _with_locks(project: Project, args: argparse.Namespace) -> Dataset:
    from studio.dataset import edits

    dataset = project.dataset
    for names, locked in ((args.unlock, False), (args.lock, True)):
        ids = [one for name in names for one in _ids(project, name)]
        dataset = edits.set_locked(dataset, ids, locked)
    return dataset


def _with_splits(dataset: Dataset, project: Project, wanted: dict[str, list[str]]) -> Dataset:
    from studio.dataset import edits

    placed: dict[str, str] = {}
    for split, names in wanted.items():
        ids = [one for name in names for one in _ids(project, name)]
        for one in ids:
            # The order of options must not decide where a take ends up.
            if placed.setdefault(one, split) != split:
                raise RequestError(say("{one} was named for two splits.", one=one), "Name each take once.")
            if dataset[one].locked and split != "test":
                what = say(
                    "{one} is kept as a test take, so that nothing learns from it by mistake.", one=one
                )
                raise RequestError(what, say("Add --unlock {one} to use it otherwise.", one=one))
        dataset = edits.set_split(dataset, ids, split)
    return dataset


def _ids(project: Project, name: str) -> list[str]:
    """The selections a person means by a name: one of that name, or all of a take."""
    ids = [s.id for s in project.dataset.selections if name in (s.id, s.take)]
    if not ids:
        # Says which takes there are.
        project.take(name)
        raise RequestError(
            say("{name} was taken out of the project's choices.", name=name), "Undo that in Curate first."
        )
    return ids
