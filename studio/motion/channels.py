"""What the channels are called, and in which order: expressions, bones and SAIA's 396 columns.

Source: VMC protocol and UniVRM for names; SAIA's client for the 18 + 54 x 7 = 396 layout.
"""

from __future__ import annotations

import re
from collections.abc import Iterable

VRM0_SHAPES: tuple[str, ...] = (
    "A", "Angry", "Blink", "Blink_L", "Blink_R", "E", "Fun", "I", "Joy", "LookDown", "LookLeft",
    "LookRight", "LookUp", "Neutral", "O", "Sorrow", "Surprised", "U",
)  # fmt: skip

VRM0_TO_VRM1: dict[str, str] = {
    "A": "aa", "I": "ih", "U": "ou", "E": "ee", "O": "oh",
    "Blink": "blink", "Blink_L": "blinkLeft", "Blink_R": "blinkRight",
    "Joy": "happy", "Angry": "angry", "Sorrow": "sad", "Fun": "relaxed", "Surprised": "surprised",
    "Neutral": "neutral", "LookUp": "lookUp", "LookDown": "lookDown", "LookLeft": "lookLeft",
    "LookRight": "lookRight",
}  # fmt: skip
VRM1_TO_VRM0: dict[str, str] = {new: old for old, new in VRM0_TO_VRM1.items()}
VRM1_SHAPES: tuple[str, ...] = tuple(sorted(VRM1_TO_VRM0))

ARKIT_SHAPES: tuple[str, ...] = (
    "EyeBlinkLeft", "EyeLookDownLeft", "EyeLookInLeft", "EyeLookOutLeft", "EyeLookUpLeft",
    "EyeSquintLeft", "EyeWideLeft", "EyeBlinkRight", "EyeLookDownRight", "EyeLookInRight",
    "EyeLookOutRight", "EyeLookUpRight", "EyeSquintRight", "EyeWideRight", "JawForward", "JawRight",
    "JawLeft", "JawOpen", "MouthClose", "MouthFunnel", "MouthPucker", "MouthRight", "MouthLeft",
    "MouthSmileLeft", "MouthSmileRight", "MouthFrownLeft", "MouthFrownRight", "MouthDimpleLeft",
    "MouthDimpleRight", "MouthStretchLeft", "MouthStretchRight", "MouthRollLower", "MouthRollUpper",
    "MouthShrugLower", "MouthShrugUpper", "MouthPressLeft", "MouthPressRight",
    "MouthLowerDownLeft", "MouthLowerDownRight", "MouthUpperUpLeft", "MouthUpperUpRight",
    "BrowDownLeft", "BrowDownRight", "BrowInnerUp", "BrowOuterUpLeft", "BrowOuterUpRight",
    "CheekPuff", "CheekSquintLeft", "CheekSquintRight", "NoseSneerLeft", "NoseSneerRight",
    "TongueOut",
)  # fmt: skip

MOUTH_SHAPES: frozenset[str] = frozenset({"a", "i", "u", "e", "o", "aa", "ih", "ou", "ee", "oh", "tongueout"})
"""Lower-case names of mouth shapes that do not begin with jaw, mouth or lip."""


def is_mouth_shape(name: str) -> bool:
    """Whether a blend shape moves the mouth, whatever set its name comes from."""
    low = name.lower()
    return low in MOUTH_SHAPES or low.startswith(("jaw", "mouth", "lip"))


def is_blink_shape(name: str) -> bool:
    """Whether a blend shape closes an eye."""
    return "blink" in name.lower()


def shape_set(names: tuple[str, ...]) -> str:
    """Which known set a list of blend shapes comes from.

    Args:
        names: shape names, any case.

    Returns:
        "vrm0", "vrm1", "arkit", "custom", or "none" for no names. A set is named when more than half
        of it is there; 26 or more ARKit names mean Perfect Sync and win over VRM names sent beside.
    """
    if not names:
        return "none"
    low = {name.lower() for name in names}
    # 26 is half of ARKit's, as VMagicMirror decides it too.
    if len(low & {n.lower() for n in ARKIT_SHAPES}) >= 26:
        return "arkit"
    for label, known in (("vrm0", VRM0_SHAPES), ("vrm1", VRM1_SHAPES)):
        if 2 * len(low & {n.lower() for n in known}) > len(known):
            return label
    return "custom"


_FINGERS = tuple(
    finger + part
    for finger in ("Thumb", "Index", "Middle", "Ring", "Little")
    for part in ("Proximal", "Intermediate", "Distal")
)
_LIMBS = ("UpperLeg", "LowerLeg", "Foot", "Toes", "Shoulder", "UpperArm", "LowerArm", "Hand", "Eye")
_SIDED = tuple(side + part for side in ("Left", "Right") for part in _LIMBS + _FINGERS)

BONES: tuple[str, ...] = tuple(sorted(("Hips", "Spine", "Chest", "UpperChest", "Neck", "Head", *_SIDED)))
"""SAIA's 54 bones: Unity's HumanBodyBones less Jaw, sorted ordinally."""

ALL_BONES: tuple[str, ...] = tuple(sorted((*BONES, "Jaw")))

_BY_LOWER_BONE = {name.lower(): name for name in ALL_BONES}
_KNOWN_SHAPES = frozenset((*VRM0_SHAPES, *VRM1_SHAPES, *ARKIT_SHAPES))
# "Angry" and "angry" are two sets' names for one thing: in any other case the first set's spelling wins.
_BY_LOWER_SHAPE = {name.lower(): name for name in (*ARKIT_SHAPES, *VRM1_SHAPES, *VRM0_SHAPES)}


def canonical_bone(name: str) -> str:
    """The HumanBodyBones spelling of a bone name in any case; unknown names come back unchanged."""
    return _BY_LOWER_BONE.get(name.lower(), name)


def bone_words(names: Iterable[str]) -> list[str]:
    """Bones as people say them in a sentence's head: ["Right lower leg", "head"]."""
    words = [re.sub(r"(?<!^)(?=[A-Z])", " ", name).lower() for name in names]
    return [words[0].capitalize(), *words[1:]] if words else []


def canonical_shape(name: str) -> str:
    """The known spelling of a blend-shape name in any case; unknown names come back unchanged.

    VRM0 and VRM1 share words (Angry, angry), so a name spelt as either set has it stays what it is.
    """
    return name if name in _KNOWN_SHAPES else _BY_LOWER_SHAPE.get(name.lower(), name)


def vrm1_bone(name: str) -> str:
    """A HumanBodyBones name as VRM 1.0 spells it (first letter lowered, thumbs shifted by one)."""
    low = name[0].lower() + name[1:]
    if "Thumb" in low:
        low = low.replace("ThumbProximal", "ThumbMetacarpal")
        low = low.replace("ThumbIntermediate", "ThumbProximal")
    return low


SAIA_WIDTH = len(VRM0_SHAPES) + len(BONES) * 7
assert len(BONES) == 54
assert SAIA_WIDTH == 396
