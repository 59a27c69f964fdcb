"""`saia unpack`: a project out of the zip that `saia pack` made."""

from __future__ import annotations

import argparse
from pathlib import Path

from studio.cli._output import Output

HELP = "make a project folder of a packed zip"
EXAMPLE = "saia unpack MyProject.zip MyProjectAgain"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """ZIP FOLDER."""
    parser.add_argument("zip", type=Path, help="the packed project")
    parser.add_argument("folder", type=Path, help="where the project goes: a new or an empty folder")


def run(args: argparse.Namespace, out: Output) -> None:
    """Unpack it; a bad zip leaves nothing behind."""
    from studio.archive import unpack

    folder = unpack(args.zip, args.folder)
    out.done(f"Unpacked into {folder}.", project=folder)
