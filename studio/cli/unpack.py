"""`saia unpack`: a project, or a run, out of the file that `saia pack` made."""

from __future__ import annotations

import argparse
from pathlib import Path

from studio.cli._output import Output
from studio.errors import counted
from studio.ipc.events import UnpackDone

EXAMPLE = "saia unpack MyProject.zip MyProjectAgain"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """FILE FOLDER."""
    parser.add_argument("zip", type=Path, metavar="FILE", help="the packed project or run")
    parser.add_argument("folder", type=Path, help="a new or empty folder; for a run, a project")


def run(args: argparse.Namespace, out: Output) -> None:
    """Unpack it; a bad zip leaves nothing behind."""
    from studio.project.archive import unpack
    from studio.training.run_file import is_run_file

    # By content: people rename files on their way from one computer to another.
    if args.zip.is_file() and is_run_file(args.zip):
        _bring_in(args, out)
        return
    made = unpack(args.zip, args.folder)
    rest = f" Left out: {counted(made.left_out, 'file')} that no project holds." if made.left_out else ""
    out.done(UnpackDone(str(made.folder), made.left_out), f"Unpacked into {made.folder}.{rest}")


def _bring_in(args: argparse.Namespace, out: Output) -> None:
    """A packed run becomes a run of a project, once its weights were opened for a test."""
    from studio.cli._project import opened
    from studio.training.run_file import unpack_run

    project = opened(args.folder, out)
    from studio.evaluation.model_card import write_card
    from studio.training.checkpoint import load_model

    run = unpack_run(args.zip, project, lambda weights: load_model(weights))
    write_card(run.folder)
    out.done(UnpackDone(run=run.id, folder=str(run.folder)), f"{args.zip.name} is {run.id} now.")
