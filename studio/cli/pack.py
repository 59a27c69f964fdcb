"""`saia pack`: a project, or one of its runs, as one file, to keep or to take elsewhere."""

from __future__ import annotations

import argparse
from pathlib import Path

from studio.cli._export import add_force
from studio.cli._output import Output
from studio.export.options import check_writable
from studio.ipc.events import FilesDone, UnfinishedEvent

EXAMPLE = "saia pack MyProject -o MyProject.zip"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """PROJECT [--run RUN] -o FILE."""
    parser.add_argument("project", type=Path, help="the project's folder")
    parser.add_argument("-o", "--out", type=Path, required=True, metavar="FILE", help="the file to write")
    parser.add_argument("--run", metavar="RUN", help="only this run, as NAME.saiarun for another computer")
    add_force(parser)


def run(args: argparse.Namespace, out: Output) -> None:
    """Pack it; only reads the project."""
    from studio.capture.recovery import left_behind
    from studio.cli._project import opened, recover_takes
    from studio.project.archive import pack

    check_writable([args.out.absolute()], args.force)
    if args.run is not None:
        from studio.training.run_file import pack_run

        path = pack_run(opened(args.project, out).run(args.run), args.out.absolute())
        out.done(FilesDone((str(path),)), f"{args.run} is in {path}.")
        return
    recover_takes(args.project, out)
    for left in left_behind(args.project / "takes"):
        text = f"{left.name} is no take yet; its recording is packed as far as it is."
        out.warn(UnfinishedEvent(str(left), text), text)
    path = pack(args.project, args.out)
    out.done(FilesDone((str(path),)), f"Packed into {path}.")
