"""How commands open a project and read files: what was found damaged is said, and the command goes on."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from studio import settings
from studio.cli._output import Output, as_request
from studio.errors import RequestError, StudioError, say
from studio.files import cache
from studio.files.lock import LOCK_FILE
from studio.ipc.events import BonesEvent, NotRecoveredEvent, ProblemEvent, RecoveredEvent
from studio.project import DATASET_FILE, HISTORY_FILE, PROJECT_FILE, Project, is_project

if TYPE_CHECKING:
    from studio.formats import Imported
    from studio.formats._bones import BoneTables, Table
    from studio.formats._find import ImportCandidate


def opened(folder: Path, out: Output, read_only: bool = True) -> Project:
    """Project.open after recovery, with a line for each problem it met.

    Raises:
        StudioError: as Project.open.
    """
    # Before the project is read, so that a recovered take is listed at once.
    recover_takes(folder, out)
    project = Project.open(folder, read_only=read_only)
    _tell_problems(project, out)
    return project


@contextmanager
def opened_or_made(folder: Path, out: Output) -> Iterator[Project]:
    """Project.open_or_create after recovery; where it was made here without a take, nothing stays behind.

    Raises:
        StudioError: as Project.open_or_create.
    """
    folder = folder.absolute()
    # Asked before opening, which makes the project where there is none.
    was_there = is_project(folder)
    # Folders made on the way go again with the project that holds no take.
    missing = [path for path in (folder, *folder.parents) if not path.exists()]
    recover_takes(folder, out)
    project = Project.open_or_create(folder)
    _tell_problems(project, out)
    try:
        yield project
    finally:
        project.close()
        # A folder that is gone meanwhile holds nothing to remove, and must not hide why it is.
        if not was_there and project.takes_folder.is_dir() and not any(project.takes_folder.iterdir()):
            _unmake(project, missing)


def recover_takes(folder: Path, out: Output) -> None:
    """Make takes of recordings that were cut short, or say why not; the command goes on in any case.

    Args:
        folder: a project's folder or its project.json; anything else is passed over.
    """
    # People name the file project.json as well as its folder.
    folder = folder.parent if folder.name == PROJECT_FILE else folder
    if not is_project(folder):
        return
    # Here, since most commands have nothing else from capture.
    from studio.capture.recovery import recover

    def on_problem(left: Path, error: StudioError) -> None:
        text = f"{left.name} was not recovered. {error.what} {error.remedy}"
        out.warn(NotRecoveredEvent(str(left), error.what, error.remedy), text)

    for take in recover(folder / "takes", on_problem):
        damage = take.info.extra.get("damage", "")
        text = f"Recovered {take.id} from an earlier session. {damage}".rstrip()
        out.emit(RecoveredEvent(take.id, tuple(take.info.notes)), text)


def _tell_problems(project: Project, out: Output) -> None:
    for what, remedy in project.problems:
        out.emit(ProblemEvent(what, remedy), f"{what} {remedy}")


def _unmake(project: Project, folders: list[Path]) -> None:
    """Remove the files of a project without takes, then folders as far as they are empty."""
    for name in (PROJECT_FILE, DATASET_FILE, HISTORY_FILE, LOCK_FILE):
        with suppress(OSError):
            (project.folder / name).unlink(missing_ok=True)
    for folder in (project.takes_folder, project.runs_folder, project.exports_folder, *folders):
        with suppress(OSError):
            folder.rmdir()


def trim_cache(project: Project) -> None:
    """Remove what was used longest ago; where nothing can be removed, nothing happens."""
    cache.trim(project.folder / cache.FOLDER, 1e9 * settings.load().cache_gb)


def check_sound(path: Path) -> str:
    """Make sure that there is sound in a file; gives what of it cannot be read, "" for nothing.

    Raises:
        RequestError: it is missing, a folder, or holds no sound.
    """
    from studio.sound.sound_file import sound_info

    # Said by itself: libraries call a folder an unknown format.
    if path.is_dir():
        raise RequestError(say("{path} is a folder.", path=path), "Name a sound file.")
    if not path.exists():
        raise RequestError(
            say("There is no sound file at {path}.", path=path), "Check how the path is written."
        )
    with as_request():
        return sound_info(path).note


def bone_tables(project_folder: Path, corrections: Table, out: Output) -> BoneTables:
    """The project's tables, with what is said now before them; a damaged file is told and passed over."""
    from studio.formats._bones import BoneTables, load_tables

    try:
        kept = load_tables(project_folder)
    except StudioError as error:
        remedy = "The bones were matched by their names instead."
        out.emit(ProblemEvent(error.what, remedy), f"{error.what} {remedy}")
        kept = BoneTables()
    return BoneTables(kept.by_skeleton, corrections)


def save_bone_table(project_folder: Path, imported: Imported, tables: BoneTables) -> None:
    """Keep the whole table of a skeleton of which something was said on this command line."""
    from studio.formats._bones import keep_table

    joints = [joint for joint, _ in imported.joints]
    if any(joint in tables.every for joint in joints):
        keep_table(project_folder, joints, dict(imported.joints))


def offer_table(source: ImportCandidate, read: Imported | StudioError, take: str | None, out: Output) -> None:
    """Tell programs which joint was taken for which bone where that was guessed, or could not be."""
    from studio.formats._bones import UnknownSkeleton

    if isinstance(read, StudioError):
        if isinstance(read, UnknownSkeleton):
            out.emit(_bones(source, read.joints, source.audio, take))
    elif read.guessed:
        out.emit(_bones(source, read.joints, read.audio, take))


def _bones(
    source: ImportCandidate, joints: Iterable[tuple[str, str]], audio: Path | None, take: str | None
) -> BonesEvent:
    return BonesEvent(str(source.path), tuple(joints), str(audio) if audio is not None else None, take)
