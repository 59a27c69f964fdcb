"""Takes that ended early by a fault: how a lost folder is noticed, the cause, and what could be saved."""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

from studio.capture import journal_contents, recovery, roll
from studio.capture.microphone import SoundBlock
from studio.errors import StudioError, say
from studio.files import atomic
from studio.paths import rescue_folder
from studio.take.take import Take
from studio.vmc.rows import RowBlock

_PIECE = 1 << 20


class FolderWatch:
    """Notices that a folder with open files was moved or removed, and still reads what they held.

    It holds them open for reading: the content of a removed file stays until the last one lets go of it. On
    Windows the system refuses to move or remove a folder with open files, and only a disk that went away is
    noticed.

    Args:
        folder: with the files.
        names: of the files; those that are not there are passed over.
    """

    def __init__(self, folder: Path, names: Sequence[str]) -> None:
        self._folder = folder
        self._files: dict[str, int | None] = {}
        for name in names:
            if (folder / name).is_file():
                self._files[name] = None
                with suppress(OSError):
                    # Windows would refuse to let anybody rename a folder with files that are open for
                    # reading; there the writer's own handles do that already.
                    self._files[name] = os.open(folder / name, os.O_RDONLY) if os.name == "posix" else None
        # Some network drives number a file anew at every look; there only its absence tells anything.
        # Assumed first, since _lie_in reads it.
        self._numbered = True
        self._numbered = self._lie_in(folder)

    def is_there(self) -> bool:
        """Whether the files are where they were begun."""
        return self._lie_in(self._folder)

    def moved_to(self) -> Path | None:
        """The folder they lie in now; None where they were removed, or the system does not tell."""
        descriptor = next((one for one in self._files.values() if one is not None), None)
        path = _path_of(descriptor) if descriptor is not None else None
        # A path in the trash is no place to go on: it is emptied without asking, so it counts as removed.
        if path is None or not path.is_absolute() or _is_trash(path) or not self._lie_in(path.parent):
            return None
        return path.parent

    def copy(self, folder: Path) -> None:
        """Write what the files hold into another folder, as far as it can still be read.

        Raises:
            OSError: it cannot be written there.
        """
        for name, descriptor in self._files.items():
            if descriptor is None:
                continue
            with (folder / name).open("xb") as copy:
                # By position, so that a second copy begins at the start again.
                while piece := _read(descriptor, copy.tell()):
                    copy.write(piece)
                copy.flush()
                os.fsync(copy.fileno())

    def close(self) -> None:
        """Let go of the files; whether they are there is all it tells from now on."""
        for name, descriptor in self._files.items():
            self._files[name] = None
            if descriptor is not None:
                os.close(descriptor)

    def _lie_in(self, folder: Path) -> bool:
        return all(self._is_same(folder / name, descriptor) for name, descriptor in self._files.items())

    def _is_same(self, path: Path, descriptor: int | None) -> bool:
        try:
            there = path.stat()
            if descriptor is None or not self._numbered:
                return True
            return os.path.samestat(there, os.fstat(descriptor))
        except (FileNotFoundError, NotADirectoryError):
            return False
        except OSError:
            # A network drive that fails for a moment says nothing about the folder: a write that fails will.
            return True


def _path_of(descriptor: int) -> Path | None:
    """The path of an open file as the system knows it now; it need not be right."""
    try:
        if sys.platform == "darwin":
            import fcntl

            return Path(os.fsdecode(fcntl.fcntl(descriptor, fcntl.F_GETPATH, bytes(1024)).rstrip(b"\0")))
        return Path(f"/proc/self/fd/{descriptor}").readlink()
    except OSError:
        return None


def _is_trash(path: Path) -> bool:
    """Whether a path leads into a desktop's trash, where nobody looks before it is emptied."""
    return any(part.lower().lstrip(".").startswith("trash") for part in path.parts)


def _read(descriptor: int, at: int) -> bytes:
    """The next piece; empty at the end, and where a disk that went away gives no more."""
    try:
        return os.pread(descriptor, _PIECE, at)
    except OSError:
        return b""


@dataclass(frozen=True)
class CutOff:
    """Why a take is not whole.

    Args:
        reason: for programs: disk_full, write_failed, folder_moved, folder_gone or sound_lost.
        cause: what happened.
        at: where the take ends, seconds.
        todo: what to do before the next one.
        folder: where what could be kept lies; None while it rolls.
    """

    reason: str
    cause: str
    at: float
    todo: str
    folder: Path | None = None

    @property
    def what(self) -> str:
        """What happened, for people."""
        if self.reason == "sound_lost":
            return self.cause
        return say("{cause} Recording ended at {at} s.", cause=self.cause, at=f"{self.at:.1f}")

    @property
    def remedy(self) -> str:
        """What is kept and where, and what to do."""
        if self.reason == "sound_lost":
            return self.todo
        if self.folder is None:
            return "What came until then is being saved."
        return say("What came until then is kept in {folder}. {todo}", folder=self.folder, todo=self.todo)


def full(at: float) -> CutOff:
    """There is no more room."""
    return CutOff("disk_full", "The disk is full.", at, "Free some space.")


def failed(error: OSError, at: float) -> CutOff:
    """The files took no more."""
    if atomic.is_full(error):
        return full(at)
    cause = say("The take could not be written on: {reason}.", reason=error.strerror or error)
    return CutOff("write_failed", cause, at, "Check the disk.")


def lost_folder(rolling: roll.Roll, watch: FolderWatch, at: float) -> CutOff:
    """Its folder is no longer there."""
    name, moved = rolling.folder.name, watch.moved_to()
    if moved is None:
        cause = say("The folder or disk of {name} was removed.", name=name)
        return CutOff("folder_gone", cause, at, "Copy it into the takes folder of a project.")
    with_project = moved.parent.name == rolling.folder.parent.name
    todo = (
        "Open the project where it is now." if with_project else "Move it into the takes folder of a project."
    )
    return CutOff("folder_moved", say("The folder of {name} was moved or renamed.", name=name), at, todo)


def lost_sound(device: str, at: float) -> CutOff:
    """The microphone vanished, and was not back when the take ended."""
    cause = say(
        "The sound of {device} stopped at {at} s and did not come back.", device=device, at=f"{at:.1f}"
    )
    return CutOff("sound_lost", cause, at, "The take is silent from there on; check the cable.")


def saved(
    rolling: roll.Roll,
    watch: FolderWatch,
    cut: CutOff | None,
    last: tuple[Sequence[RowBlock], Sequence[SoundBlock]],
) -> tuple[Take, CutOff | None]:
    """The take of a roll that ended, wherever its files lie by now.

    Args:
        rolling: closed.
        cut: why it ended, None where it was asked to.
        last: what came in the last seconds, for a disk that went away with all the rest.

    Returns:
        The take, and why it is not whole.

    Raises:
        StudioError: nothing came in, or it cannot be saved; says where lies what was recorded.
    """
    # The folder first: whatever else ended the take, its files are where they belong.
    if watch.is_there():
        return completed(rolling.folder, cut)
    cut = lost_folder(rolling, watch, cut.at if cut else rolling.seconds)
    moved = watch.moved_to()
    if moved is not None:
        return completed(moved, cut)
    place = _new_place(rolling.folder.name)
    try:
        place.mkdir(parents=True)
        watch.copy(place)
        # Only now is it known what the disk still gave; a journal without anything is no better than none.
        contents = journal_contents.read(place) if (place / roll.JOURNAL).is_file() else None
        if contents is None or not recovery.holds_anything(place, contents):
            shutil.rmtree(place)
            _from_memory(place, rolling, *last)
    except OSError as error:
        remedy = say(
            "It could not be kept in {place} either: {reason}.", place=place, reason=error.strerror or error
        )
        raise StudioError(cut.what, remedy) from error
    return completed(place, cut)


def completed(folder: Path, cut: CutOff | None) -> tuple[Take, CutOff | None]:
    """The take of a folder's journal, with why it ended early as its note.

    Raises:
        StudioError: nothing was recorded, or it cannot be saved; says where what was recorded lies.
    """
    # Of lost sound the take has a note from the moment it happened.
    notes = [cut.what] if cut is not None and cut.reason != "sound_lost" else []
    try:
        take = recovery.complete(folder, *notes)
    except StudioError as error:
        # Nothing was recorded, and the cause known here says more than that.
        if not folder.exists():
            if cut is None:
                raise
            nothing = say("{cause} Nothing of {folder} was recorded.", cause=cut.cause, folder=folder.name)
            raise StudioError(nothing, _before_again(cut)) from error
        what = cut.what if cut is not None else error.what
        # No project ever looks into the rescue folder, so nothing would turn it into a take by itself.
        if cut is not None and cut.reason == "folder_gone":
            lies = say("What was recorded lies in {folder}. {todo}", folder=folder, todo=cut.todo)
        else:
            lies = say(
                "What was recorded lies in {folder} and becomes a take the next time the project is opened.",
                folder=folder,
            )
        raise StudioError(what, say("{lies} {remedy}", lies=lies, remedy=error.remedy)) from error
    return take, replace(cut, folder=folder) if cut is not None else None


def _before_again(cut: CutOff) -> str:
    if cut.reason == "disk_full":
        return "Free some space, then record again."
    return "Check the folder and its disk, then record again."


def _new_place(name: str) -> Path:
    """A folder for a take that has none any more; it does not exist yet."""
    number, place = 2, rescue_folder() / name
    while place.exists():
        number, place = number + 1, place.with_name(f"{name}_{number}")
    return place


def _from_memory(
    place: Path, rolling: roll.Roll, rows: Sequence[RowBlock], blocks: Sequence[SoundBlock]
) -> None:
    """A roll of the last seconds, which were still in memory."""
    begins = [
        min(times) for times in ([float(r.arrivals[0]) for r in rows], [b.captured for b in blocks]) if times
    ]
    start = max(rolling.start, min(begins, default=rolling.start))
    again = roll.Roll(place, start=start, sound=rolling.sound, **rolling.head)
    for block in blocks:
        again.add_block(block)
    for motion_rows in rows:
        again.add_rows(motion_rows)
    again.flush({})
    again.close()
