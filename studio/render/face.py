"""What a face looks like, read from blend shapes of any set, and fitted to an avatar without names. Pure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from studio.motion.avatar import Avatar, key
from studio.motion.channels import is_blink_shape, is_mouth_shape

OPENERS: dict[str, tuple[float, float, float]] = {
    "a": (0.85, 0.0, 0.0), "aa": (0.85, 0.0, 0.0), "i": (0.25, 0.6, 0.0), "ih": (0.25, 0.6, 0.0),
    "u": (0.25, 0.0, 0.9), "ou": (0.25, 0.0, 0.9), "e": (0.5, 0.4, 0.0), "ee": (0.5, 0.4, 0.0),
    "o": (0.65, 0.0, 0.6), "oh": (0.65, 0.0, 0.6), "jawopen": (1.0, 0.0, 0.0),
    "mouthfunnel": (0.2, 0.0, 0.6), "mouthpucker": (0.0, 0.0, 1.0), "mouthclose": (-0.9, 0.0, 0.0),
}  # fmt: skip
"""Whole names -> how far they open, widen and round the mouth."""

WORDS: tuple[tuple[str, tuple[float, float, float]], ...] = (
    ("oh", (0.5, 0.0, 0.6)), ("oo", (0.2, 0.0, 0.8)), ("funnel", (0.06, 0.0, 0.12)),
    ("pucker", (0.0, 0.0, 0.45)), ("stretch", (0.0, 0.3, 0.0)), ("dimple", (0.0, 0.2, 0.0)),
    ("lowerlipdepress", (0.25, 0.0, 0.0)), ("lowerdown", (0.15, 0.0, 0.0)),
    ("upperlipraise", (0.12, 0.0, 0.0)), ("upperup", (0.12, 0.0, 0.0)), ("press", (-0.15, 0.0, 0.0)),
    ("suck", (-0.1, 0.0, 0.0)), ("rolllower", (-0.2, 0.0, 0.0)), ("rollupper", (-0.2, 0.0, 0.0)),
)  # fmt: skip
"""Parts of other names -> the same, each side of a pair counting alone."""


@dataclass(frozen=True)
class FaceShape:
    """A face in a few numbers.

    Args:
        open: lips apart, 0..1.
        wide: mouth corners drawn outwards, 0..1.
        round: lips pursed, 0..1.
        smile: corners up, -1..1.
        blink_left, blink_right: lids closed, 0..1, the face's own sides.
        brow_left, brow_right: brows up (+) or down (-), -1..1.
        look: where the eyes point, right and up of the viewer positive, -1..1 each.
        surprise: eyes widened, 0..1.
    """

    open: float = 0.0
    wide: float = 0.0
    round: float = 0.0
    smile: float = 0.0
    blink_left: float = 0.0
    blink_right: float = 0.0
    brow_left: float = 0.0
    brow_right: float = 0.0
    look: tuple[float, float] = (0.0, 0.0)
    surprise: float = 0.0


def face_shape(values: Mapping[str, float]) -> FaceShape:
    """The face that blend shapes make.

    Args:
        values: name -> weight 0..1, VRM0, VRM1, ARKit or a rig's own names.
    """
    v = {_plain(name): float(value) for name, value in values.items()}
    lips, wide, pursed = _mouth(v)
    both = _one(v, "blink")
    joy = max(_one(v, "joy", "happy"), _one(v, "fun", "relaxed") * 0.7)
    sad, angry = _one(v, "sorrow", "sad"), _one(v, "angry")
    surprise = max(_one(v, "surprised"), _pair(v, "eyewide"))
    smile = joy + _pair(v, "mouthsmile", "lipcornerpull", "lipcornerpullopen")
    smile -= 0.8 * sad + _pair(v, "mouthfrown")
    raised = _one(v, "browinnerup") * 0.6 + 0.8 * surprise
    left = raised + _one(v, "browouterupleft") * 0.6 - _one(v, "browdownleft") - angry
    right = raised + _one(v, "browouterupright") * 0.6 - _one(v, "browdownright") - angry
    return FaceShape(
        _unit(lips),
        _unit(wide + 0.5 * max(smile, 0.0)),
        _unit(pursed),
        min(max(smile, -1.0), 1.0),
        _unit(max(both, _one(v, "blinkl", "blinkleft", "eyeblinkleft"))),
        _unit(max(both, _one(v, "blinkr", "blinkright", "eyeblinkright"))),
        min(max(left, -1.0), 1.0),
        min(max(right, -1.0), 1.0),
        _look(v),
        _unit(surprise),
    )


def _mouth(v: Mapping[str, float]) -> tuple[float, float, float]:
    total = [0.0, 0.0, 0.0]
    for name, value in v.items():
        weights = OPENERS.get(name)
        if weights is None:
            weights = next((w for word, w in WORDS if _has(name, word)), None)
        if weights is not None:
            for i, weight in enumerate(weights):
                total[i] += weight * value
    jaw = v.get("jawopen", 0.0)
    if v.get("mouthclose", 0.0) > 0.0:  # ARKit's MouthClose is measured with the jaw open
        total[0] = max(total[0], 0.1 * jaw)
    return total[0], total[1], total[2]


def _has(name: str, word: str) -> bool:
    # "oh" and "oo" are too short to look for anywhere but in names that begin with mouth.
    return word in name if len(word) > 2 else name.startswith("mouth" + word)


def _look(v: Mapping[str, float]) -> tuple[float, float]:
    # The face looks at the viewer: its own left is the viewer's right.
    x = _one(v, "lookleft") - _one(v, "lookright")
    x += 0.5 * (v.get("eyelookoutleft", 0.0) + v.get("eyelookinright", 0.0))
    x -= 0.5 * (v.get("eyelookinleft", 0.0) + v.get("eyelookoutright", 0.0))
    y = _one(v, "lookup") - _one(v, "lookdown") + _pair(v, "eyelookup") - _pair(v, "eyelookdown")
    return min(max(x, -1.0), 1.0), min(max(y, -1.0), 1.0)


def _plain(name: str) -> str:
    return name.lower().replace("_", "").replace(" ", "").replace(".", "")


def _one(v: Mapping[str, float], *names: str) -> float:
    return max((v.get(name, 0.0) for name in names), default=0.0)


def _pair(v: Mapping[str, float], *stems: str) -> float:
    """The mean of left and right of each stem, the largest of them; rigs write the side in many ways."""
    best = 0.0
    for stem in stems:
        for left, right in (("left", "right"), ("l", "r")):
            for before in ("", "mouth", "eye"):
                sides = (v.get(before + stem + left), v.get(before + stem + right))
                found = [side for side in sides if side is not None]
                if found:
                    best = max(best, sum(found) / len(found))
    return best


def _unit(value: float) -> float:
    return min(max(value, 0.0), 1.0)


def fitted(avatar: Avatar, shapes: Mapping[str, float]) -> Mapping[str, float]:
    """Shapes with what moves the avatar's mouth and eyes added, where none of theirs does.

    Near enough to look at, never exact: jaw and lips become vowels, lids become blinks.
    """
    if not shapes or not avatar.by_key:
        return shapes
    known = [name for name in shapes if key(name) in avatar.by_key]
    mouth = any(is_mouth_shape(name) for name in known)
    eyes = any(is_blink_shape(name) for name in known)
    if mouth and eyes:
        return shapes
    face, more = face_shape(shapes), dict(shapes)
    if not mouth:
        spread = max(1.0 - face.round - face.wide, 0.0)
        more |= {
            "A": face.open * spread,
            "I": face.wide * (1.0 - 0.5 * face.open),
            "O": face.round * face.open,
            "U": face.round * (1.0 - face.open),
            "Joy": max(face.smile, 0.0) * 0.6,
        }
    if not eyes:
        more |= {"Blink_L": face.blink_left, "Blink_R": face.blink_right}
    return more
