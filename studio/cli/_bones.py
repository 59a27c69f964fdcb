"""Which joint is which bone, while importing: what is kept with the project, and what may be corrected."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from studio.cli._output import Output
from studio.errors import StudioError

if TYPE_CHECKING:
    from studio.formats import Imported
    from studio.formats._bone_tables import BoneTables, Table
    from studio.formats._find import Source


def bone_tables(project_folder: Path, said: Table, out: Output) -> BoneTables:
    """The project's tables, with what is said now before them; a damaged file is told and passed over."""
    from studio.formats._bone_tables import BoneTables, load_tables

    try:
        kept = load_tables(project_folder)
    except StudioError as error:
        remedy = "The bones were matched by their names instead."
        out.event("problem", f"{error.what} {remedy}", what=error.what, remedy=remedy)
        kept = BoneTables()
    return BoneTables(kept.by_skeleton, said)


def keep_said(project_folder: Path, imported: Imported, tables: BoneTables) -> None:
    """Keep the whole table of a skeleton of which something was said on this command line."""
    from studio.formats._bone_tables import keep_table

    joints = [joint for joint, _ in imported.joints]
    if any(joint in tables.every for joint in joints):
        keep_table(project_folder, joints, dict(imported.joints))


def offer_table(source: Source, read: Imported | StudioError, take: str | None, out: Output) -> None:
    """Tell programs which joint was taken for which bone where that was guessed, or could not be."""
    from studio.formats._bone_tables import UnknownSkeleton

    if isinstance(read, StudioError):
        if isinstance(read, UnknownSkeleton):
            out.event("bones", take=take, path=source.path, audio=source.audio, bones=read.joints)
    elif read.guessed:
        out.event("bones", take=take, path=source.path, audio=read.audio, bones=read.joints)
