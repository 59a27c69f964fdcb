"""How commands open a project: what was found damaged is said, and the command goes on."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from studio.cli._output import Output
from studio.dataset.lock import LOCK_FILE
from studio.project import DATASET_FILE, HISTORY_FILE, PROJECT_FILE, Project, is_project


def opened(folder: Path, out: Output, read_only: bool = True) -> Project:
    """Project.open, with a line for each problem it met.

    Raises:
        StudioError: as Project.open.
    """
    project = Project.open(folder, read_only=read_only)
    _tell_problems(project, out)
    return project


@contextmanager
def opened_or_made(folder: Path, out: Output) -> Iterator[Project]:
    """Project.open_or_create; where it was made here and no take came of it, nothing stays behind.

    Raises:
        StudioError: as Project.open_or_create.
    """
    folder = folder.absolute()
    was_there = is_project(folder)
    missing = [path for path in (folder, *folder.parents) if not path.exists()]
    project = Project.open_or_create(folder)
    _tell_problems(project, out)
    try:
        yield project
    finally:
        project.close()
        if not was_there and not any(project.takes_folder.iterdir()):
            _unmake(project, missing)


def _tell_problems(project: Project, out: Output) -> None:
    for what, remedy in project.problems:
        out.event("problem", f"{what} {remedy}", what=what, remedy=remedy)


def _unmake(project: Project, folders: list[Path]) -> None:
    """Remove the files of a project without takes, then folders as far as they are empty."""
    for name in (PROJECT_FILE, DATASET_FILE, HISTORY_FILE, LOCK_FILE):
        with suppress(OSError):
            (project.folder / name).unlink(missing_ok=True)
    for folder in (project.takes_folder, project.runs_folder, project.exports_folder, *folders):
        with suppress(OSError):
            folder.rmdir()
