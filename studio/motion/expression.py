"""An avatar's named faces, and which blend shapes move them: by the names of every common set, or as a person
has it.

Source: VRMC_vrm 1.0, expressions and their overrides; the names of ARKit, VRM 0 and 1, VRoid Studio, VRChat,
Oculus and MikuMikuDance.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache

from studio.motion.channels import ARKIT_SHAPES, VRM0_SHAPES, VRM1_TO_VRM0
from studio.motion.material import MaterialBind

NOTHING = ""
"""The driver of an expression that no blend shape moves."""


@dataclass(frozen=True)
class Expression:
    """A named face.

    Args:
        name: as the file calls it.
        binds: (surface, morph, weight 0..1) each.
        binary: on above one half, else off.
        overrides: what it takes the place of: "blink", "lookAt" or "mouth" -> "block" or "blend".
        looks: what it makes of materials.
    """

    name: str
    binds: tuple[tuple[int, int, float], ...]
    binary: bool = False
    overrides: Mapping[str, str] = field(default_factory=dict)
    looks: tuple[MaterialBind, ...] = ()

    @property
    def moves(self) -> bool:
        """Whether anything is seen of it."""
        return bool(self.binds or self.looks)


def key(name: str) -> str:
    """One spelling for an expression, whether VRM 0, VRM 1 or a rig's own name."""
    return _KEYS.get(name.lower(), name.lower())


@lru_cache(4096)  # asked for every shape of every frame
def meaning(name: str) -> str:
    """The `key` of the VRM 0 or ARKit shape that a name of any common set stands for; its own without one."""
    own = key(name)
    if own in _KNOWN:
        return own
    # "eyeBlink.L" as a whole, and "Face.M_F00_000_00_Fcl_MTH_A" without what stands before the last word.
    for text in (own, _BEFORE.sub("", own)):
        plain = _SEPARATORS.sub("", text)
        sided = plain[:-1] + {"l": "left", "r": "right"}.get(plain[-1:], plain[-1:])
        for spelt in (text, plain, sided):
            found = _MEANINGS.get(spelt) or key(spelt)
            if found in _KNOWN:
                return found
    return own


_KEYS = {new.lower(): old.lower() for new, old in VRM1_TO_VRM0.items()}
_KNOWN = frozenset(name.lower() for name in (*VRM0_SHAPES, *ARKIT_SHAPES))
_BEFORE = re.compile(r"^.*(?=fcl_)|^.*\.")
_SEPARATORS = re.compile(r"[\s_.\-]+")
_WORDS = {
    "a": ("あ",),
    "i": ("い",),
    "u": ("う",),
    "e": ("え",),
    "o": ("お",),
    "blink": ("まばたき", "瞬き", "eyesclosed", "eyeclose", "fcl_eye_close"),
    "blink_l": ("ウィンク", "wink", "winkl", "winkleft", "fcl_eye_close_l"),
    "blink_r": ("ウィンク右", "winkr", "winkright", "fcl_eye_close_r"),
    "joy": ("smile", "笑い", "喜び", "喜", "fcl_all_joy"),
    "angry": ("怒り", "怒", "anger", "fcl_all_angry"),
    "sorrow": ("悲しみ", "哀", "困る", "sadness", "fcl_all_sorrow"),
    "fun": ("楽", "relax", "fcl_all_fun"),
    "surprised": ("びっくり", "驚き", "surprise", "fcl_all_surprised"),
}
"""What other programs call VRM's faces: without separators, or as they are."""
_VOWELS = {"a": "aa", "i": "ih", "u": "ou", "e": "ee", "o": "oh"}
_MEANINGS = {word: own for own, words in _WORDS.items() for word in words} | {
    f"{before}{spelt}": own
    for own, long in _VOWELS.items()
    for before in ("v_", "viseme_", "mouth_", "fcl_mth_")
    for spelt in (own, long)
}
GROUPS = {
    "blink": frozenset({"blink", "blink_l", "blink_r"}),
    "lookAt": frozenset({"lookup", "lookdown", "lookleft", "lookright"}),
    "mouth": frozenset("aiueo"),
}
"""What an expression may take the place of -> keys."""


class FaceMap:
    """Which blend shapes move which of an avatar's expressions.

    Args:
        expressions: the avatar's.
        drivers: by an expression's name the blend shape that moves it in place of those of its own names, or
            NOTHING.
    """

    def __init__(self, expressions: Sequence[Expression], drivers: Mapping[str, str]) -> None:
        self._expressions, self._drivers = expressions, drivers
        self._driven: dict[str, list[int]] = {}
        free = [i for i, one in enumerate(expressions) if one.name not in drivers]
        # The first of a name counts, and a name itself counts before what another one stands for.
        for spelt in (key, meaning):
            for i in free:
                self._driven.setdefault(spelt(expressions[i].name), [i])
        for i, one in enumerate(expressions):
            if drivers.get(one.name, NOTHING):
                self._driven.setdefault(key(drivers[one.name]), []).append(i)
        keys = [key(one.name) for one in expressions]
        self._groups = {i: g for i, own in enumerate(keys) for g, known in GROUPS.items() if own in known}

    def driver(self, index: int) -> str:
        """The key of the blend shape that moves an expression, NOTHING where none does."""
        one = self._expressions[index]
        if one.name in self._drivers:
            return key(self._drivers[one.name])
        names = (meaning(one.name), key(one.name))
        return next((name for name in names if index in self._driven.get(name, ())), NOTHING)

    def moved_by(self, shape: str) -> tuple[Expression, ...]:
        """The expressions that a blend shape moves."""
        return tuple(self._expressions[i] for i in self._found(shape))

    def weights(self, shapes: Mapping[str, float]) -> tuple[dict[int, float], dict[str, float]]:
        """Weights by expression as blend shapes have them, and how much of each group is left beside them."""
        found: dict[int, float] = {}
        for name, value in shapes.items():
            for i in self._found(name) if value > 0.0 else ():
                amount = min(float(value), 1.0)
                amount = float(amount > 0.5) if self._expressions[i].binary else amount
                found[i] = max(found.get(i, 0.0), amount)
        left = dict.fromkeys(GROUPS, 1.0)
        for i, amount in found.items():
            for group, way in self._expressions[i].overrides.items():
                left[group] -= amount if way == "blend" else float(amount > 0.0)
        return found, {group: max(share, 0.0) for group, share in left.items()}

    def played(self, shapes: Mapping[str, float]) -> list[tuple[Expression, float]]:
        """Expressions with the weight they are seen with."""
        found, left = self.weights(shapes)
        made = []
        for i, amount in found.items():
            one = self._expressions[i]
            amount *= left[self._groups[i]] if i in self._groups else 1.0
            if one.binary and amount < 1.0:
                amount = 0.0
            if amount > 0.0:
                made.append((one, amount))
        return made

    def _found(self, shape: str) -> Sequence[int]:
        return self._driven.get(key(shape)) or self._driven.get(meaning(shape)) or ()
