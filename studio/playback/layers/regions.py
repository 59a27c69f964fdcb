"""Which region of the body a blend shape or a bone belongs to, whatever set its name comes from."""

from __future__ import annotations

from functools import lru_cache

from studio.motion.channels import is_blink_shape, is_mouth_shape

FACE_REGIONS = ("mouth", "brows", "eyes", "face")
BODY_REGIONS = ("head", "torso", "arms", "hands", "legs")
REGIONS = (*FACE_REGIONS, *BODY_REGIONS)
"""Disjoint; "face" is what is left of it: smiles, cheeks, nose, whole expressions."""

_VOWELS = {
    "a": "a", "i": "i", "u": "u", "e": "e", "o": "o", "aa": "a", "ih": "i", "ou": "u", "ee": "e", "oh": "o",
    "あ": "a", "い": "i", "う": "u", "え": "e", "お": "o",
}  # fmt: skip
_EYES = ("eye", "look", "fcl_eye", "まばたき", "ウィンク", "瞳")
_BROWS = ("brow", "fcl_brw", "眉")
_MOUTH = ("fcl_mth", "口")
_LEGS = ("UpperLeg", "LowerLeg", "Foot", "Toes")
_ARMS = ("Shoulder", "UpperArm", "LowerArm")


@lru_cache(maxsize=256)
def shape_region(name: str) -> str:
    """The region of a blend shape of VRM 0, VRM 1, ARKit, VRoid or MikuMikuDance; "face" for others."""
    low = name.lower()
    if low in _VOWELS or is_mouth_shape(low) or low.startswith(_MOUTH):
        return "mouth"
    if low.startswith(_BROWS):
        return "brows"
    return "eyes" if is_lid(low) or low.startswith(_EYES) else "face"


@lru_cache(maxsize=256)
def bone_region(name: str) -> str:
    """The region of a bone of the humanoid; "torso" for the hips and for bones nobody knows."""
    if name in ("Head", "Neck"):
        return "head"
    if name == "Jaw":
        return "mouth"
    part = name.removeprefix("Left").removeprefix("Right")
    if part == name:
        return "torso"
    if part == "Eye":
        return "eyes"
    if part in _LEGS:
        return "legs"
    return "arms" if part in _ARMS else "hands"


def vowel(name: str) -> str | None:
    """Which of a, i, u, e, o a blend shape is, None for another shape."""
    return _VOWELS.get(name.lower())


def is_lid(name: str) -> bool:
    """Whether a blend shape closes an eye."""
    low = name.lower()
    return is_blink_shape(low) or low.startswith(("fcl_eye_close", "まばたき", "ウィンク"))


def lid_sides(names: tuple[str, ...]) -> tuple[list[int], list[int]]:
    """Columns of the shapes that close both eyes at once, and of those that close one.

    Args:
        names: S blend-shape names.
    """
    lids = [i for i, name in enumerate(names) if is_lid(name)]
    single = [i for i in lids if names[i].lower().endswith(("_l", "_r", "left", "right", "右", "左"))]
    single += [i for i in lids if names[i].startswith("ウィンク") and i not in single]
    return [i for i in lids if i not in single], single
