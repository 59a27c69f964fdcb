"""Which joint of another program's skeleton is which bone: by its name, and as a person corrected it.

Names are compared without their namespace ("mixamorig:"), case and punctuation; a side is read from words
and from single letters at an end (LeftArm, L_Arm, arm.L).

Corrections are kept with a project for every import: the file bones.json holds one table a skeleton, which
is known again by the names of its joints.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from studio.errors import RequestError, StudioError, say
from studio.files import atomic
from studio.motion.channels import ALL_BONES

_PREFIXES = re.compile(
    r"^(mixamorig\d*|bip\d*|valvebiped|def|org|mch|ccbase|genesis\d*(fe)?male|j_bip|character\d*)[ :_.-]+",
    re.IGNORECASE,
)
_SIDE_WORDS = {"left": "Left", "right": "Right", "l": "Left", "r": "Right", "lft": "Left", "rgt": "Right"}

# Without the side; the first that is there wins where two joints mean one bone.
_TRUNK = {
    "Hips": ("hips", "hip", "pelvis", "torsoroot", "root"),
    "Neck": ("neck", "neck1", "neck01"),
    "Head": ("head",),
    "Jaw": ("jaw",),
}
_SPINES = (
    "spine", "lowerback", "abdomen", "waist", "spine0", "spine00", "spine01", "spine1", "spine02", "spine2",
    "spine03", "spine3", "spine04", "spine4", "chest", "chest1", "chest2", "chest3", "chest4", "torso",
    "upperchest", "thorax",
)  # fmt: skip
_LIMBS = {
    "Shoulder": ("shoulder", "clavicle", "collar", "collarbone", "clav"),
    "UpperArm": ("upperarm", "uparm", "arm", "shldr", "armupper", "bicep"),
    "LowerArm": ("lowerarm", "forearm", "lowarm", "elbow", "armlower", "loarm"),
    "Hand": ("hand", "wrist"),
    "UpperLeg": ("upperleg", "upleg", "thigh", "upperthigh", "legupper"),
    "LowerLeg": ("lowerleg", "leg", "shin", "calf", "knee", "lowleg", "leglower"),
    "Foot": ("foot", "ankle"),
    "Toes": ("toes", "toe", "toebase", "ball", "toe0"),
    "Eye": ("eye", "eyeball"),
}
_FINGERS = {
    "Thumb": "Thumb", "Index": "Index", "Middle": "Middle", "Mid": "Middle", "Ring": "Ring",
    "Little": "Little", "Pinky": "Little", "Pinkie": "Little",
}  # fmt: skip
_PARTS = ("Proximal", "Intermediate", "Distal")
_KNUCKLES = {"1": 0, "2": 1, "3": 2, "01": 0, "02": 1, "03": 2}
# Blender's Rigify numbers one spine from the hips to the head.
_RIGIFY = {
    "spine001": "Spine", "spine002": "Chest", "spine003": "UpperChest", "spine004": "Neck",
    "spine006": "Head",
}  # fmt: skip


def humanoid_names(joints: Sequence[str]) -> dict[str, int]:
    """Which joint is which bone.

    Args:
        joints: names as a file has them, parents before children.

    Returns:
        Joint index by HumanBodyBones name; joints that are no bone are not in it.
    """
    bare = [_bare(name) for name in joints]
    found: dict[str, int] = {}
    exact = {bone.lower(): bone for bone in ALL_BONES}
    plain = [re.sub(r"[^a-z0-9]", "", _without_prefix(name).lower()) for name in joints]
    # Six in ten exact names with hips among them: Unity's own, and guessing could only make it worse.
    if "hips" in plain and sum(name in exact for name in plain) >= 0.6 * len(plain):
        for j, name in enumerate(plain):
            if name in exact:
                found.setdefault(exact[name], j)
        return found
    if "hips" not in plain and {"spine", *_RIGIFY} <= set(plain):
        found = {bone: plain.index(name) for name, bone in {"spine": "Hips", **_RIGIFY}.items()}
    for bone, words in _TRUNK.items():
        place = next(
            (j for word in words for j, (side, name) in enumerate(bare) if name == word and not side), None
        )
        if place is not None:
            found[bone] = place
    _limbs(bare, found)
    _fingers(bare, found)
    if "Spine" in found:
        return found
    spines = [
        j for j, (side, name) in enumerate(bare) if not side and name in _SPINES and j not in found.values()
    ]
    found |= _spine(spines)
    return found


def _limbs(bare: Sequence[tuple[str, str]], found: dict[str, int]) -> None:
    for side in ("Left", "Right"):
        names = {name: j for j, (own, name) in reversed(list(enumerate(bare))) if own == side}
        # Where there is a collar bone, "shoulder" means the upper arm; without one it is the shoulder itself.
        has_collar = any(word in names for word in ("clavicle", "collar", "collarbone", "clav"))
        has_arm = any(word in names for word in _LIMBS["UpperArm"])
        has_thigh = any(word in names for word in _LIMBS["UpperLeg"])
        for bone, words in _LIMBS.items():
            options: Sequence[str] = words
            if bone == "Shoulder" and has_collar:
                options = words[1:]
            if bone == "UpperArm" and not has_arm:
                options = ("shoulder",)
            if bone == "Shoulder" and not has_collar and not has_arm:
                options = ()
            if bone == "UpperLeg" and not has_thigh:
                options = ("hip", "leg")
            if bone == "LowerLeg" and not has_thigh and "hip" not in names:
                options = tuple(word for word in words if word != "leg")
            place = next((names[word] for word in options if word in names), None)
            if place is not None:
                found[side + bone] = place


def _fingers(bare: Sequence[tuple[str, str]], found: dict[str, int]) -> None:
    """LeftHandIndex1, f_index.01.L, index_02_l, IndexFinger1 and the like; the fourth is only a tip."""
    pattern = re.compile(
        r"^(?:hand|f|finger)?(thumb|index|middle|mid|ring|little|pinky|pinkie)(?:finger)?0?([123])$"
    )
    for j, (side, name) in enumerate(bare):
        match = pattern.match(name)
        if side and match:
            bone = side + _FINGERS[match[1].capitalize()] + _PARTS[_KNUCKLES[match[2]]]
            found.setdefault(bone, j)


def _spine(joints: list[int]) -> dict[str, int]:
    """Spine, Chest and UpperChest from a chain of any length: first, second and last."""
    if len(joints) <= 3:
        return dict(zip(("Spine", "Chest", "UpperChest"), joints, strict=False))
    return {"Spine": joints[0], "Chest": joints[1], "UpperChest": joints[-1]}


def _without_prefix(name: str) -> str:
    return _PREFIXES.sub("", name.rsplit(":", 1)[-1].strip())


def _bare(name: str) -> tuple[str, str]:
    """The side ("Left", "Right" or "") and the name in small letters without punctuation."""
    text = _without_prefix(name)
    words = [word for word in re.split(r"[^A-Za-z0-9]+", re.sub(r"(?<=[a-z])(?=[A-Z])", " ", text)) if word]
    # VRoid's centre.
    if len(words) > 1 and words[0].lower() == "c":
        words = words[1:]
    for place in (0, len(words) - 1):
        if len(words) > 1 and words[place].lower() in _SIDE_WORDS:
            rest = words[:place] + words[place + 1 :]
            return _SIDE_WORDS[words[place].lower()], "".join(rest).lower()
    low = "".join(words).lower()
    for word in ("left", "right"):
        if low.startswith(word):
            return _SIDE_WORDS[word], low.removeprefix(word)
        if low.endswith(word):
            return _SIDE_WORDS[word], low.removesuffix(word)
    # lShldr, rThigh: Daz and Poser.
    if len(text) > 2 and text[0] in "lr" and text[1].isupper():
        return _SIDE_WORDS[text[0]], low[1:]
    # A side in the middle: index.01.L has it at the end, hand_l_01 here.
    for word in words:
        if len(words) > 2 and word.lower() in ("l", "r"):
            return _SIDE_WORDS[word.lower()], "".join(w for w in words if w != word).lower()
    return "", low


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
            say("The joints of {name} are not named as a humanoid's (Hips, Spine, Head, ...).", name=name),
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
    # By small letters, since people write bones in any case.
    seen: dict[str, str] = {}
    for joint, bone in table.items():
        if not bone:
            continue
        if bone.lower() not in known:
            raise RequestError(
                say("There is no bone called {bone}.", bone=bone), "Use Unity's names, such as LeftUpperArm."
            )
        if bone.lower() in seen:
            what = say(
                "{seen} and {joint} cannot both be {bone}.", seen=seen[bone.lower()], joint=joint, bone=bone
            )
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
        raise StudioError(
            say("{path} cannot be read.", path=path), "Check the folder's permissions."
        ) from error
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
        raise RequestError(
            say("{name} cannot be read.", name=path.name),
            say("Check the file in {folder}.", folder=path.parent),
        ) from error
    except StudioError as error:
        remedy = 'Write it as {"joint": "Bone"}, such as {"Bip01 Spine": "Spine"}.'
        raise RequestError(say("{name} is no table of bones.", name=path.name), remedy) from error
    check_table(table)
    canonical = {bone.lower(): bone for bone in ALL_BONES}
    return {joint: canonical.get(bone.lower(), "") for joint, bone in table.items()}


def _table(content: object, path: Path) -> Table:
    if not isinstance(content, dict) or not all(isinstance(bone, str) for bone in content.values()):
        raise atomic.damaged(path)
    return {str(joint): str(bone) for joint, bone in content.items()}
