"""Importers and exporters, one file each: TITLE, SUFFIX, NOTE, and read and/or write.

TITLE: str      what a menu calls it
SUFFIX: str     of the file it reads or writes, with the dot
NOTE: str       what the format, or the programs that read it, leave out
read(path, audio=None) -> Imported          what was guessed stands in its notes
read(path, audio=None, video=None)          where pictures are tracked; video: VideoReading | None
read(path, audio=None, tables=None)         where joints have names of their own; tables: BoneTables | None
joints(path) -> names                       of those; Imported.joints says what they were taken for
write(path, motion, audio=None) -> files    read back and compared before it returns
write(path, motion, audio=None, drawing=None)   where it draws pictures (DRAWS); drawing: _drawing.Drawing
write(path, motion, audio=None, avatar=None)    where it writes a body (WEARS); avatar: a .vrm's Path | None
recognises(path) -> bool                    only where several formats share a suffix
WRITES: str                                 the suffix of what it writes, where another format owns SUFFIX
targets(path) -> files                      only where it writes other files than `path`
FPS: float                                  its one frame rate, where it has only one
WEARS: bool                                 it writes a body, an avatar's where one is given
DRAWS: bool                                 it draws, and tells the drawing how far it is
BONES_KEPT: frozenset[str]                  the bones it keeps, where it does not keep all
BONES_ONLY: bool                            it holds nothing of a face

_any_skeleton  Any program's skeleton made a humanoid: its unit, its axes and its rest pose guessed, and
               said
_bones         Which joint of another program's skeleton is which bone: by its name, and as a person corrected
               it
_bvh_text      The text of a BVH file: joints, channels and frames, to and from arrays
_film          Films with their sound, drawn without a window and read back picture by picture: what their
               kinds share
_find          Which files belong together: every recording that can be imported from some files and folders
_glb           GLB, the binary container of glTF 2.0: a JSON document and one block of numbers
_table         Tables of numbers in text files, whatever their encoding, separator and decimal sign
_vrm/          Reading avatars and VRM Animations: what their glTF says, taken apart
_writing       What writers share: a humanoid on an even grid, its sound, and files read back before they
               are named
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType

from studio import registry
from studio.errors import RequestError, say
from studio.motion import Motion
from studio.motion.avatar import Avatar

__all__ = [
    "Imported", "keep_drivers", "load", "names", "read_avatar", "read_drivers", "reader_for", "readers",
    "targets", "writer_for", "writers", "written_suffix",
]  # fmt: skip


@dataclass(frozen=True, eq=False)
class Imported:
    """A recording read from foreign files.

    Args:
        name: what it is called: the files' base name.
        motion: None without motion.
        audio: the sound file it belongs to, None without.
        notes: what was guessed or mended while reading, one sentence each.
        extra: facts kept as they came.
        joints: (joint, the bone it was taken for or "") where names of joints had to be matched.
        joints_from: the file they stand in; set by who reads many.
        guessed: whether any of that was a guess nobody has confirmed.
        left_out: spans (start, end, why) that are of no use, seconds.
    """

    name: str
    motion: Motion | None
    audio: Path | None
    notes: tuple[str, ...] = ()
    extra: dict[str, str] = field(default_factory=dict)
    joints: tuple[tuple[str, str], ...] = ()
    guessed: bool = False
    joints_from: Path | None = None
    left_out: tuple[tuple[float, float, str], ...] = ()


def names() -> tuple[str, ...]:
    """All formats by module name."""
    return registry.names(sys.modules[__name__])


def load(name: str) -> ModuleType:
    """One format; RequestError where there is none of that name."""
    return registry.load(sys.modules[__name__], name, "format")


def readers() -> dict[str, ModuleType]:
    """The formats that can be imported."""
    return {name: module for name in names() if hasattr(module := load(name), "read")}


def writers() -> dict[str, ModuleType]:
    """The formats that can be exported to."""
    return {name: module for name in names() if hasattr(module := load(name), "write")}


def written_suffix(module: ModuleType) -> str:
    """The ending of what a format writes."""
    suffix: str = getattr(module, "WRITES", module.SUFFIX)
    return suffix


def writer_for(path: Path) -> ModuleType:
    """The format that writes files of this ending, the longest that fits; RequestError without one."""
    found = {written_suffix(module): module for module in writers().values()}
    fitting = [suffix for suffix in found if path.name.lower().endswith(suffix)]
    if not fitting:
        known = ", ".join(sorted(found))
        what = say("The studio cannot write files like {name}.", name=path.name)
        raise RequestError(what, say("Choose a name that ends in one of: {known}.", known=known))
    return found[max(fitting, key=len)]


def targets(path: Path) -> tuple[Path, ...]:
    """The files that writing to `path` may make; RequestError where no format has its ending."""
    module = writer_for(path)
    found: tuple[Path, ...] = module.targets(path) if hasattr(module, "targets") else (path,)
    return found


def read_avatar(path: Path) -> Avatar:
    """The avatar of a .vrm of version 0 or 1; StudioError where it cannot be read.

    Takes up to some seconds for a large file: not on a thread that draws.
    """
    from studio.formats._vrm import avatar

    return avatar.read(path)


def read_drivers(path: Path) -> Mapping[str, str]:
    """What `keep_drivers` kept beside an avatar's file; nothing where that cannot be read."""
    from studio.formats._vrm import drivers

    return drivers.read(path) or {}


def keep_drivers(path: Path, drivers: Mapping[str, str]) -> None:
    """Keep beside an avatar's file which blend shapes move its faces; `read_avatar` knows it from then on.

    Raises:
        NewerVersionError: a newer studio kept some there, which stay.
        StudioError: the folder cannot be written.
    """
    from studio.formats._vrm import drivers as beside

    beside.write(path, drivers)


def reader_for(path: Path) -> ModuleType | None:
    """The format that reads this file, by suffix and, where several share it, by content; None for none."""
    for module in readers().values():
        if path.suffix.lower() != module.SUFFIX:
            continue
        if not hasattr(module, "recognises") or module.recognises(path):
            return module
    return None
