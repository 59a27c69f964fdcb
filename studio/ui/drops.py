"""What dropped files are: a project (packed or not), a run, sounds or an avatar for Review, or material."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

SOUNDS = frozenset(
    {".wav", ".mp3", ".flac", ".ogg", ".m4a", ".aac", ".opus", ".mp4", ".mov", ".mkv", ".webm"}
)


@dataclass(frozen=True)
class Drop:
    """What to do with dropped paths; only one of the eight is filled.

    Args:
        project: a project folder to open.
        packed: a packed project to open.
        run: a run that was exported elsewhere.
        sounds: sounds to generate motion for at once.
        batch: a folder of nothing but sounds, to make motion files of.
        performed: sounds to perform live, the first of them.
        avatar: a .vrm to wear.
        imports: files and folders to bring into the project.
    """

    project: Path | None = None
    packed: Path | None = None
    run: Path | None = None
    sounds: tuple[Path, ...] = ()
    batch: Path | None = None
    performed: tuple[Path, ...] = ()
    avatar: Path | None = None
    imports: tuple[Path, ...] = ()


def sort_drop(paths: tuple[Path, ...], room: str) -> Drop:
    """What is meant by dropping paths.

    Args:
        paths: existing files and folders.
        room: the name of the room shown, "" for the welcome page.
    """
    from studio.training.run_file import SUFFIX as RUN_SUFFIX  # not needed for the window to come up

    first = paths[0] if len(paths) == 1 else None
    if first is not None and (first.name == "project.json" or (first / "project.json").is_file()):
        return Drop(project=first.parent if first.name == "project.json" else first)
    if first is not None and first.suffix.lower() == ".zip":
        return Drop(packed=first)
    if first is not None and first.suffix.lower() == RUN_SUFFIX:
        return Drop(run=first)
    if first is not None and first.suffix.lower() == ".vrm":
        return Drop(avatar=first)
    if room in ("review", "live") and paths and all(path.suffix.lower() in SOUNDS for path in paths):
        return Drop(sounds=paths) if room == "review" else Drop(performed=paths)
    if first is not None and room == "review" and _holds_sounds_alone(first):
        return Drop(batch=first)
    return Drop(imports=paths)


def _holds_sounds_alone(folder: Path) -> bool:
    """Whether there is nothing in a folder that could be a take's motion."""
    try:
        inside = [path for path in folder.iterdir() if not path.name.startswith(".")]
        return bool(inside) and all(path.suffix.lower() in SOUNDS and path.is_file() for path in inside)
    except OSError:
        return False  # a file, or a folder that may not be read: the import says so
