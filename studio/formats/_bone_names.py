"""What other programs call the bones of a humanoid.

Names are compared without their namespace ("mixamorig:"), case and punctuation; a side is read from words
and from single letters at an end (LeftArm, L_Arm, arm.L).
"""

from __future__ import annotations

import re
from collections.abc import Sequence

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
    if len(words) > 1 and words[0].lower() == "c":  # VRoid's centre
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
