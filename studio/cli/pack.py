"""`saia pack`: a project as one zip file, to keep or to take elsewhere."""

from __future__ import annotations

import argparse
from pathlib import Path

from studio.cli._output import Output
from studio.cli._target import add_force, check_free

HELP = "put a whole project into one zip"
EXAMPLE = "saia pack MyProject -o MyProject.zip"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """PROJECT -o ZIP."""
    parser.add_argument("project", type=Path, help="the project's folder")
    parser.add_argument("-o", "--out", type=Path, required=True, metavar="ZIP", help="the zip to write")
    add_force(parser)


def run(args: argparse.Namespace, out: Output) -> None:
    """Pack it; only reads the project."""
    from studio.archive import pack

    check_free([args.out.absolute()], args.force)
    path = pack(args.project, args.out)
    out.done(f"Packed into {path}.", files=[path])
