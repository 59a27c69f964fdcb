"""Files of takes that are missing: found again in another folder, by name and by what is in them.

What is found is copied back to where the take says it is; the take itself is never changed. The dataset
remembers which files were put back, so that undo can take them away again.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from studio.dataset.dataset import Dataset
from studio.dataset.history import is_inside
from studio.errors import StudioError, say
from studio.files import atomic, cache, leftovers
from studio.sound.peaks import CACHE_NAME
from studio.sound.sound_file import sound_info
from studio.take.folder import INFO_FILE, SOUND_SUFFIXES, TRASH_FOLDER, load_take
from studio.take.motion_file import SUFFIX as MOTION_SUFFIX
from studio.take.motion_file import read_motion
from studio.take.take import Take

AS_LONG = 0.005
"""Seconds by which the length of the same sound may differ."""
KEPT_FOLDER = "found"
"""In the trash: files put back once, and taken away by undo."""


@dataclass(frozen=True)
class Missing:
    """One thing of a take that is not where it should be.

    Args:
        take: id of the take.
        name: the file's name; "" where the whole folder is missing.
    """

    take: str
    name: str = ""

    @property
    def path(self) -> str:
        """Where it belongs, as a path inside the project."""
        return f"takes/{self.take}/{self.name}".rstrip("/")


@dataclass(frozen=True)
class Search:
    """Result of a search for missing files.

    Args:
        found: where each is now.
        unclear: those for which several different files would do.
    """

    found: Mapping[Missing, Path]
    unclear: tuple[Missing, ...] = ()


def missing_files(dataset: Dataset, takes: Mapping[str, Take]) -> tuple[Missing, ...]:
    """What is not there, of every take that is there, and every take that is not."""
    gone = dict.fromkeys(s.take for s in dataset.selections if s.take not in takes)
    result = [Missing(take) for take in gone]
    for take in takes.values():
        paths = (take.audio_path, take.motion_path)
        result += [Missing(take.id, path.name) for path in paths if path is not None and not path.exists()]
    return tuple(result)


def search(
    missing: Iterable[Missing],
    takes: Mapping[str, Take],
    folder: Path,
    cancelled: Callable[[], bool] = lambda: False,
) -> Search:
    """Look through a folder and all in it for what is missing.

    A file is taken where it holds what the take says: for sound the rate, the channels and the length (and
    the size, where it was seen before), for motion the frames and the channels. Among several that do, one of
    the take's own name wins; where they differ and none has it, nothing is taken. What lies in the folder of
    another take belongs to that one.

    Args:
        missing: what to look for.
        takes: by id, for what their files should hold.
        folder: where to look.
        cancelled: asked between files.

    Raises:
        StudioError: the folder cannot be looked into.
    """
    wanted = list(missing)
    files = list(_files(folder))
    found: dict[Missing, Path] = {}
    unclear: list[Missing] = []
    # Judged one by one with a look at `cancelled`: reading sounds on a slow disk can take minutes.
    for one in wanted:
        if cancelled():
            break
        fits = _fitting(one, takes.get(one.take), files)
        if fits and not _is_clear(one, fits):
            unclear.append(one)
        elif fits:
            found[one] = fits[0]
    return Search(found, tuple(unclear))


def put_back(project_folder: Path, one: Missing, source: Path) -> None:
    """Copy what was found to where it belongs; a file that is there by now is left alone.

    Raises:
        StudioError: it cannot be copied.
    """
    target = project_folder / one.path
    if target.exists():
        return
    if one.name:
        atomic.copied(source, target)
        return
    # Renamed at the end: a half-copied take would be taken for a whole one.
    beside = leftovers.beside(target)
    try:
        shutil.copytree(source, beside)
        beside.rename(target)
    except OSError as error:
        raise atomic.cannot_write(target, error) from error
    finally:
        shutil.rmtree(beside, ignore_errors=True)


def settle(project_folder: Path, before: Dataset, after: Dataset) -> bool:
    """Bring the files into the state that the choices tell of, after undo or redo; whether any was moved.

    What is taken away lies in the project's trash until redo brings it back.
    """
    moved = False
    kept = project_folder / TRASH_FOLDER / KEPT_FOLDER
    for path in (p for p in (*before.found, *after.found) if is_inside(p)):
        here, there = project_folder / path, kept / path
        if path in after.found and path not in before.found:
            moved |= _move(there, here)
        elif path in before.found and path not in after.found:
            moved |= _move(here, there)
    return moved


def _move(source: Path, target: Path) -> bool:
    if not source.exists() or target.exists():
        return False
    with suppress(OSError):
        target.parent.mkdir(parents=True, exist_ok=True)
        source.rename(target)
        return True
    return False


def _files(folder: Path) -> Iterator[Path]:
    """Everything below a folder in order; hidden folders are passed over."""
    if not folder.is_dir():
        raise StudioError(
            say("There is no folder {folder}.", folder=folder.name),
            "Choose the folder the files were moved to.",
        )
    for place, folders, names in os.walk(folder):
        # In place, which is how os.walk learns not to enter hidden folders such as our own trash.
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        yield from (Path(place, name) for name in sorted(names) if not name.startswith("."))


def _fitting(one: Missing, take: Take | None, files: list[Path]) -> list[Path]:
    """What would do, the best by name first."""
    if take is None:
        folders = [file.parent for file in files if file.name == INFO_FILE and file.parent.name == one.take]
        return [folder for folder in folders if _is_whole(folder)]
    is_sound = one.name == take.info.audio_file
    suffixes = {*SOUND_SUFFIXES} if is_sound else {MOTION_SUFFIX}
    own = Path(one.name).suffix.lower()
    # Its own take would miss it: the same voice often lies in several takes of one length.
    others = {file.parent for file in files if file.name == INFO_FILE and file.parent.name != one.take}
    near = [
        file
        for file in files
        if file.suffix.lower() in suffixes and file.suffix.lower() == own and file.parent not in others
    ]
    near.sort(key=lambda file: (-_closeness(file, one), str(file)))
    return [file for file in near if (_is_sound_of(file, take) if is_sound else _is_motion_of(file, take))]


def _closeness(file: Path, one: Missing) -> int:
    """How much a file's name says that it belongs to the take."""
    if file.parent.name == one.take and file.name == one.name:
        return 3
    if file.stem == one.take:
        return 2
    return int(one.take in str(file))


def _is_clear(one: Missing, fits: list[Path]) -> bool:
    """Whether the first is the one: by name, or because all of them are the same."""
    if len(fits) == 1 or not one.name or _closeness(fits[0], one) > _closeness(fits[1], one):
        return True
    # Copies in several backups are no question to ask a person.
    first = fits[0].read_bytes()
    return all(other.read_bytes() == first for other in fits[1:])


def _is_whole(folder: Path) -> bool:
    """Whether a folder holds a take with all its files."""
    try:
        take = load_take(folder)
    except StudioError:
        return False
    return all(path is None or path.is_file() for path in (take.audio_path, take.motion_path))


def _is_sound_of(file: Path, take: Take) -> bool:
    # The cheapest look first; most sounds of another take differ in size already.
    sizes = _sizes_seen(take)
    if sizes and file.stat().st_size not in sizes:
        return False
    try:
        info = sound_info(file)
    except StudioError:
        return False
    same = (info.sample_rate, info.channels) == (take.info.sample_rate, take.info.audio_channels)
    return same and abs(info.duration - take.info.audio_seconds) <= AS_LONG


def _sizes_seen(take: Take) -> set[int]:
    """Bytes of the sound file when its picture was made; none where none was kept."""
    assert take.audio_path is not None
    found = [cache.read_arrays(place) for place in cache.kept_beside(take.audio_path, CACHE_NAME)]
    # A damaged one tells nothing.
    return {int(one["size"]) for one in found if "size" in one and one["size"].size == 1}


def _is_motion_of(file: Path, take: Take) -> bool:
    try:
        motion = read_motion(file)
    except StudioError:
        return False
    channels = (motion.shape_names, motion.bone_names) == (take.info.shape_names, take.info.bone_names)
    return channels and len(motion) == take.info.frames
