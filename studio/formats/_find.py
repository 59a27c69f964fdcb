"""Which files belong together: every recording that can be imported from some files and folders."""

from __future__ import annotations

import inspect
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType

from studio import formats
from studio.errors import RequestError, StudioError, say, together
from studio.formats import Imported
from studio.formats._bones import BoneTables
from studio.formats._table import sanitized_note, why_unknown
from studio.formats.saia_csv import AUDIO_FOLDER, BONES_FOLDER, SHAPES_FOLDER
from studio.formats.video import VideoReading
from studio.motion.sanitize import sanitized
from studio.tracking import VIDEO_SUFFIXES
from studio.tracking.video_file import has_pictures

SOUND_SUFFIXES = frozenset({".wav", ".flac", ".ogg", ".mp3", ".m4a", ".aac", ".opus"}) | VIDEO_SUFFIXES
_LAYOUT = (SHAPES_FOLDER.lower(), BONES_FOLDER.lower())


@dataclass(frozen=True)
class ImportCandidate:
    """Files that make one take.

    Args:
        format: module name of the format that reads it.
        path: its motion file, or its sound where there is no motion.
        audio: its sound where that is known already.
        note: what was guessed about the pair, "" for nothing.
    """

    format: str
    path: Path
    audio: Path | None = None
    note: str = ""

    def read(self, tables: BoneTables | None = None, videos: VideoReading | None = None) -> Imported:
        """Read it, joints matched as `tables` say; what was guessed about the pair is its first note."""
        module = formats.load(self.format)
        known = inspect.signature(module.read).parameters
        # Each format takes what it knows of.
        more = {name: value for name, value in (("tables", tables), ("video", videos)) if name in known}
        imported: Imported = module.read(self.path, self.audio, **more)
        notes = ((self.note,) if self.note else ()) + imported.notes
        motion = imported.motion
        if motion is not None:
            motion, bad = sanitized(motion)
            if bad:
                notes += (sanitized_note(self.path, bad),)
        joints_from = self.path if imported.joints else None
        return replace(imported, motion=motion, notes=notes, joints_from=joints_from)


def find_candidates(paths: Iterable[Path]) -> tuple[ImportCandidate, ...]:
    """Every recording in some files and folders, in order of their paths.

    Args:
        paths: a folder with Audio, Blendshapes and Bones (or any of them); any folder, searched through; or
            files. Sound and motion of one base name are a pair.

    Raises:
        RequestError: a path is not there, or nothing in them can be imported.
    """
    paths = list(paths)
    files: list[Path] = []
    for path in paths:
        if path.is_dir():
            root = path.parent if path.name.lower() in (*_LAYOUT, AUDIO_FOLDER.lower()) else path
            files += (p for p in sorted(root.rglob("*")) if p.is_file() and not _is_hidden(p, root))
        elif path.is_file():
            files.append(path)
        else:
            raise RequestError(say("There is nothing at {path}.", path=path), "Check the path and try again.")
    sources = tuple(_sources(list(dict.fromkeys(file.absolute() for file in files))))
    if not sources and len(paths) == 1 and paths[0].suffix.lower() == ".csv":
        why = why_unknown(paths[0])
        raise RequestError(why.what, why.remedy)
    if not sources:
        named = ", ".join(path.name for path in paths)
        raise RequestError(
            say("Nothing in {named} can be imported.", named=named),
            say("The studio reads {kinds}.", kinds=_kinds()),
        )
    return sources


def _sources(files: list[Path]) -> Iterator[ImportCandidate]:
    sounds = [file for file in files if file.suffix.lower() in SOUND_SUFFIXES]
    motions: list[tuple[Path, ModuleType]] = []
    for file in files:
        module = None if file.suffix.lower() in SOUND_SUFFIXES else formats.reader_for(file)
        if module is None and file.suffix.lower() == ".csv" and file.parent.name.lower() in _LAYOUT:
            # It lies where motion lies, so reading it says what is wrong.
            module = formats.load("saia_csv")
        if module is not None and not _is_second_half(file, files):
            motions.append((file, module))
    used: set[Path] = set()
    for file, module in motions:
        audio, note = _partner(file, sounds, [path for path, _ in motions])
        used |= {audio} if audio else set()
        yield ImportCandidate(module.__name__.rsplit(".", 1)[-1], file, audio, note)
    for sound in sounds:
        if sound not in used:
            shows = sound.suffix.lower() in VIDEO_SUFFIXES and has_pictures(sound)
            yield ImportCandidate("video" if shows else "wav", sound)


def _partner(file: Path, sounds: list[Path], motions: list[Path]) -> tuple[Path | None, str]:
    """The sound of a motion file: of the same name, near; else the only one in its folder."""
    in_layout = file.parent.name.lower() in _LAYOUT
    near = file.parent.parent if in_layout else file.parent
    named = [s for s in sounds if s.stem.lower() == _base(file)]
    for sound in named:
        if sound.parent == file.parent or (in_layout and sound.parent.parent == near):
            return sound, ""
    if len(named) == 1 and sum(_base(m) == _base(file) for m in motions) == 1:
        return named[0], ""
    here = [s for s in sounds if s.parent == file.parent]
    if not in_layout and len(here) == 1 and [m for m in motions if m.parent == file.parent] == [file]:
        return here[0], say(
            "{sound} was taken as the sound of {file}: they are alone in their folder.",
            sound=here[0].name,
            file=file.name,
        )
    return None, ""


def _base(motion: Path) -> str:
    """The name that a motion file shares with its sound: NAME.livelink.csv goes with NAME.wav."""
    return motion.stem.lower().removesuffix(".livelink")


def _is_second_half(file: Path, files: list[Path]) -> bool:
    """Whether it is the Bones file of a pair whose Blendshapes file is there too."""
    if file.parent.name.lower() != BONES_FOLDER.lower():
        return False
    return any(
        other.name == file.name
        and other.parent.name.lower() == SHAPES_FOLDER.lower()
        and other.parent.parent == file.parent.parent
        for other in files
    )


def _is_hidden(path: Path, root: Path) -> bool:
    return any(part.startswith((".", "__MACOSX")) for part in path.relative_to(root).parts)


def _kinds() -> str:
    return together(", ", *(say(module.TITLE) for module in formats.readers().values()))


def read_all(
    sources: Iterable[ImportCandidate],
    tables: BoneTables | None = None,
    videos: VideoReading | None = None,
) -> Iterator[tuple[ImportCandidate, Imported | StudioError]]:
    """Each source with what was read of it, or with why it could not be."""
    for source in sources:
        try:
            yield source, source.read(tables, videos)
        except StudioError as error:
            yield source, error
