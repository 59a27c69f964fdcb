"""Which joint of a skeleton is which bone, as a person corrected it: kept with a project for every import.

The file bones.json holds one table a skeleton; a skeleton is known again by the names of its joints.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from studio.errors import RequestError, StudioError
from studio.files import atomic
from studio.motion.channels import ALL_BONES

FILE = "bones.json"
FORMAT_VERSION = 1
BONES_FROM = "bones_from"
"""Under this name a take's extra facts say which file its bones were read from."""

Table = Mapping[str, str]
"""Bone by joint, both by name; "" is a joint that is no bone."""


class UnknownSkeleton(StudioError):  # noqa: N818 (named for what it is, like its neighbours)
    """A skeleton of which too little could be recognised.

    Args:
        name: of the file.
        joints: (joint, bone or "") in the file's order.
    """

    def __init__(self, name: str, joints: tuple[tuple[str, str], ...]) -> None:
        super().__init__(
            f"The joints of {name} are not named as a humanoid's (Hips, Spine, Head, ...).",
            "Export it with Unity's, VRM's or Mixamo's bone names, or say which joint is which bone.",
        )
        self.joints = joints


@dataclass(frozen=True)
class BoneTables:
    """Corrections.

    Args:
        by_skeleton: the table of each skeleton, by `skeleton_key`.
        every: used for every skeleton that has any of its joints, before the others.
    """

    by_skeleton: Mapping[str, Table] = field(default_factory=dict)
    every: Table = field(default_factory=dict)

    def of(self, joints: Sequence[str]) -> Table:
        """What a person said about a skeleton; empty where nothing was said."""
        kept = self.by_skeleton.get(skeleton_key(joints), {})
        return {**kept, **{joint: bone for joint, bone in self.every.items() if joint in joints}}


def skeleton_key(joints: Sequence[str]) -> str:
    """Digest of joint names; equal for every file with these joints in this order."""
    return hashlib.sha256("\n".join(joints).encode()).hexdigest()[:16]


def corrected(joints: Sequence[str], guess: Mapping[str, int], table: Table) -> dict[str, int]:
    """Joint index by bone: the guess, with a table's word before it.

    Args:
        joints: names in the file's order.
        guess: joint index by bone.
        table: bone by joint name.
    """
    corrections = {joint: bone for joint, bone in table.items() if joint in joints}
    bones = {bone: j for bone, j in guess.items() if joints[j] not in corrections}
    for joint, bone in corrections.items():
        if bone:
            bones[bone] = joints.index(joint)
    return bones


def pairs(joints: Sequence[str], bones: Mapping[str, int]) -> tuple[tuple[str, str], ...]:
    """(joint, bone or "") for every joint in order."""
    names = {j: bone for bone, j in bones.items()}
    return tuple((joint, names.get(j, "")) for j, joint in enumerate(joints))


def check_table(table: Table) -> None:
    """Raise RequestError unless every bone is one, and none is given twice."""
    known = {bone.lower() for bone in ALL_BONES}
    seen: dict[str, str] = {}
    for joint, bone in table.items():
        if not bone:
            continue
        if bone.lower() not in known:
            raise RequestError(f"There is no bone called {bone}.", "Use Unity's names, such as LeftUpperArm.")
        if bone.lower() in seen:
            what = f"{seen[bone.lower()]} and {joint} cannot both be {bone}."
            raise RequestError(what, "Give each bone to one joint.")
        seen[bone.lower()] = joint


def load_tables(project_folder: Path) -> BoneTables:
    """What is kept with a project; empty where there is nothing.

    Raises:
        StudioError: the file is damaged or of a newer version.
    """
    path = project_folder / FILE
    try:
        content = atomic.read_json(path)
    except FileNotFoundError:
        return BoneTables()
    except OSError as error:
        raise StudioError(f"{path} cannot be read.", "Check the folder's permissions.") from error
    atomic.check_version(path, content, FORMAT_VERSION)
    skeletons = content.get("skeletons")
    if not isinstance(skeletons, dict):
        raise atomic.damaged(path)
    return BoneTables({str(key): _table(table, path) for key, table in skeletons.items()})


def keep_table(project_folder: Path, joints: Sequence[str], table: Table) -> None:
    """Keep the table of one skeleton; a damaged file is set aside.

    Raises:
        RequestError: see check_table.
        StudioError: it cannot be written.
    """
    check_table(table)
    try:
        kept = dict(load_tables(project_folder).by_skeleton)
    except atomic.NewerVersionError:
        raise
    except StudioError:
        atomic.set_aside(project_folder / FILE)
        kept = {}
    kept[skeleton_key(joints)] = dict(table)
    content = {"version": FORMAT_VERSION, "skeletons": {key: dict(one) for key, one in kept.items()}}
    atomic.write_json(project_folder / FILE, content)


def read_table(path: Path) -> Table:
    """A table that a person wrote: one JSON object, `{"joint": "Bone", ...}`; "" is no bone.

    Raises:
        RequestError: it is missing, damaged, or names what is no bone.
    """
    try:
        table = _table(atomic.read_json(path), path)
    except OSError as error:
        raise RequestError(f"{path.name} cannot be read.", f"Check the file in {path.parent}.") from error
    except StudioError as error:
        remedy = 'Write it as {"joint": "Bone"}, such as {"Bip01 Spine": "Spine"}.'
        raise RequestError(f"{path.name} is no table of bones.", remedy) from error
    check_table(table)
    canonical = {bone.lower(): bone for bone in ALL_BONES}
    return {joint: canonical.get(bone.lower(), "") for joint, bone in table.items()}


def _table(content: object, path: Path) -> Table:
    if not isinstance(content, dict) or not all(isinstance(bone, str) for bone in content.values()):
        raise atomic.damaged(path)
    return {str(joint): str(bone) for joint, bone in content.items()}
