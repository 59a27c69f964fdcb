"""Where a command may write: never over a file unasked, never among what was recorded or learnt."""

from __future__ import annotations

import argparse
import os
from collections.abc import Iterable
from pathlib import Path

from studio.errors import FileThereError, RequestError
from studio.project import Project


def add_force(parser: argparse.ArgumentParser) -> None:
    """The option that allows writing over a file."""
    parser.add_argument("--force", action="store_true", help="write over a file that is there already")


def check_free(files: Iterable[Path], force: bool, project: Project | None = None) -> None:
    """Say no before the work begins, not after it.

    Args:
        files: what will be written.
        force: a file that is there may be written over.
        project: its takes and runs are never written over.

    Raises:
        RequestError: one of the files may not be written; FileThereError: it is there already.
    """
    for file in files:
        if file.is_dir():
            raise RequestError(f"{file} is a folder.", "Name a file to write with -o.")
        place = next(folder for folder in file.absolute().parents if folder.exists())
        if not place.is_dir():
            raise RequestError(f"{place} is a file, not a folder.", "Choose another folder with -o.")
        if not os.access(place, os.W_OK):
            raise RequestError(f"The folder {place} cannot be written.", "Choose another folder with -o.")
        own = (project.takes_folder, project.runs_folder) if project else ()
        if any(file.resolve().is_relative_to(folder.resolve()) for folder in own):
            what = f"{file.name} would lie among the project's own takes and runs, which are never altered."
            raise RequestError(what, "Choose another folder with -o.")
        if file.exists() and not force:
            remedy = "Choose another name with -o, or add --force to write over it."
            raise FileThereError(f"{file} is there already.", remedy, file.name)
