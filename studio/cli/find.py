"""`saia find`: missing files of takes, looked for in a folder and put back."""

from __future__ import annotations

import argparse
from pathlib import Path

from studio.cli._output import Output
from studio.ipc.events import FindDone, FoundEvent, UnclearEvent

EXAMPLE = "saia find MyProject OldDisk"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """PROJECT FOLDER."""
    parser.add_argument("project", type=Path, help="the project's folder")
    parser.add_argument("folder", type=Path, help="where to look, in all folders inside too")


def run(args: argparse.Namespace, out: Output) -> None:
    """Copy back what holds what the takes say, as one step of undo; the takes stay as they are."""
    from studio.cli._output import as_request
    from studio.cli._project import opened
    from studio.dataset import edits, relink

    project = opened(args.project, out, read_only=False)
    takes = {take.id: take for take in project.takes}
    # Asked before the search: a folder of a million files is read only for what is missing.
    missing = relink.missing_files(project.dataset, takes)
    with as_request():
        search = relink.search(missing, takes, args.folder)
    for one, source in search.found.items():
        relink.put_back(project.folder, one, source)
        out.emit(FoundEvent(one.take, str(one.path), str(source)), f"{one.path} is {source}.")
    for one in search.unclear:
        text = f"Several files could be {one.path}. Rename the right one to match the take."
        out.emit(UnclearEvent(one.take, str(one.path)), text)
    # Without a find no step of undo is made.
    if search.found:
        paths = [one.path for one in search.found]
        project.edit("Put back missing files", edits.put_back(project.dataset, paths))
    project.close()
    text = f"{len(search.found)} of {len(missing)} missing files were found and put back."
    done = FindDone(len(search.found), len(missing))
    out.done(done, text if missing else "No files are missing.")
