"""Importers and exporters, one file each: TITLE, SUFFIX, NOTE, and read and/or write.

TITLE: str      what a menu calls it
SUFFIX: str     of the file it reads or writes, with the dot
NOTE: str       what the format, or the programs that read it, leave out
read(path, audio=None) -> Imported          what was guessed stands in its notes
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

_any_skeleton  Any program's skeleton made a humanoid: its unit, its axes and its rest pose guessed, and
               said
_arkit         VRM's expressions told in ARKit's shapes: near enough to look at, never exact
_bone_names    What other programs call the bones of a humanoid
_bone_tables   Which joint of a skeleton is which bone, as a person corrected it: kept with a project for
               every import
_bvh_text      The text of a BVH file: joints, channels and frames, to and from arrays
_find          Which files belong together: every recording that can be imported from some files and folders
_glb           GLB, the binary container of glTF 2.0: a JSON document and one block of numbers
_glb_body      An avatar's surfaces as glTF meshes, skins, materials and pictures
_imported      What every importer gives
_table         Tables of numbers in text files, whatever their encoding, separator and decimal sign
_vrm/          Reading avatars and VRM Animations: what their glTF says, taken apart
_writing       What writers share: a humanoid on an even grid, its sound, and files read back before they
               are named
"""

from __future__ import annotations

import sys
from pathlib import Path
from types import ModuleType

from studio import registry
from studio.errors import RequestError
from studio.formats._imported import Imported
from studio.motion.avatar import Avatar

__all__ = [
    "Imported", "load", "names", "read_avatar", "reader_for", "readers", "targets", "writer_for", "writers",
    "written_suffix",
]  # fmt: skip


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
        what = f"{path.name} has no ending that the studio writes."
        raise RequestError(what, f"Choose a name that ends in one of: {known}.")
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


def reader_for(path: Path) -> ModuleType | None:
    """The format that reads this file, by suffix and, where several share it, by content; None for none."""
    for module in readers().values():
        if path.suffix.lower() != module.SUFFIX:
            continue
        if not hasattr(module, "recognises") or module.recognises(path):
            return module
    return None
