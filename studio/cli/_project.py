"""How commands open a project: what was found damaged is said, and the command goes on."""

from __future__ import annotations

from pathlib import Path

from studio.cli._output import Output
from studio.project import Project


def opened(folder: Path, out: Output, read_only: bool = True) -> Project:
    """Project.open, with a line for each problem it met.

    Raises:
        StudioError: as Project.open.
    """
    project = Project.open(folder, read_only=read_only)
    for what, remedy in project.problems:
        out.event("problem", f"{what} {remedy}", what=what, remedy=remedy)
    return project
