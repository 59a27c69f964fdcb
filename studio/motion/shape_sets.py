"""VRM's expressions and ARKit's shapes made of one another. Approximate: mouths differ."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from studio.motion.channels import ARKIT_SHAPES, VRM1_TO_VRM0, shape_set
from studio.motion.motion import Motion

EXPRESSIONS: dict[str, dict[str, float]] = {
    "A": {"JawOpen": 0.7, "MouthLowerDown": 0.2, "MouthUpperUp": 0.1},
    "I": {"MouthStretch": 0.5, "MouthSmile": 0.2, "JawOpen": 0.1},
    "U": {"MouthPucker": 0.7, "MouthFunnel": 0.3, "JawOpen": 0.1},
    "E": {"JawOpen": 0.3, "MouthStretch": 0.3, "MouthSmile": 0.15},
    "O": {"JawOpen": 0.4, "MouthFunnel": 0.7},
    "Blink": {"EyeBlink": 1.0},
    "Blink_L": {"EyeBlinkLeft": 1.0},
    "Blink_R": {"EyeBlinkRight": 1.0},
    "Joy": {"MouthSmile": 0.8, "CheekSquint": 0.5},
    "Fun": {"MouthSmile": 0.6, "EyeSquint": 0.3},
    "Angry": {"BrowDown": 1.0, "NoseSneer": 0.4, "MouthFrown": 0.3},
    "Sorrow": {"BrowInnerUp": 1.0, "MouthFrown": 0.6},
    "Surprised": {"EyeWide": 1.0, "BrowInnerUp": 0.7, "BrowOuterUp": 0.7, "JawOpen": 0.2},
    "LookUp": {"EyeLookUp": 1.0},
    "LookDown": {"EyeLookDown": 1.0},
    "LookLeft": {"EyeLookOutLeft": 1.0, "EyeLookInRight": 1.0},
    "LookRight": {"EyeLookInLeft": 1.0, "EyeLookOutRight": 1.0},
    "Neutral": {},
}
"""ARKit weights of a full expression; a name without its side means both. Vowels by the shapes of mouths."""

_VRM = {name.lower(): name for name in EXPRESSIONS} | {a.lower(): b for a, b in VRM1_TO_VRM0.items()}
_PLACE = {name.lower(): i for i, name in enumerate(ARKIT_SHAPES)}


def arkit_weights(motion: Motion) -> NDArray[np.float64]:
    """ARKit's 52 weights (T, 52): as they are where the motion has them, else made of VRM's expressions."""
    weights = np.zeros((len(motion), len(ARKIT_SHAPES)))
    own = [(s, _PLACE[n.lower()]) for s, n in enumerate(motion.shape_names) if n.lower() in _PLACE]
    if shape_set(motion.shape_names) != "arkit":
        mixed = np.zeros_like(weights)
        for s, name in _expressions(motion.shape_names):
            for shape, amount in EXPRESSIONS[name].items():
                for place in _places(shape):
                    mixed[:, place] += amount * motion.shapes[:, s]
        weights = mixed
    for s, place in own:
        weights[:, place] = motion.shapes[:, s]
    return np.clip(weights, 0.0, 1.0)


def _expressions(names: tuple[str, ...]) -> Iterator[tuple[int, str]]:
    """Which shapes are VRM expressions, each expression once."""
    seen: set[str] = set()
    for s, name in enumerate(names):
        known = _VRM.get(name.lower())
        if known is not None and known not in seen:
            seen.add(known)
            yield s, known


def _places(shape: str) -> list[int]:
    low = shape.lower()
    return [_PLACE[low]] if low in _PLACE else [_PLACE[low + "left"], _PLACE[low + "right"]]


VRM_FACE = ("A", "I", "U", "E", "O", "Blink", "Blink_L", "Blink_R")
"""What `vrm_face` makes."""


def vrm_face(weights: NDArray[np.floating]) -> NDArray[np.float64]:
    """VRM's vowels and blinks (T, 8), in the order of VRM_FACE, of ARKit's 52 weights (T, 52).

    The rounded vowels are told first, since lips round in no other, then the wide ones; what the jaw is open
    beyond them is A. A pure vowel of EXPRESSIONS comes back as itself, but for some E within an I.
    """

    def mean(*names: str) -> NDArray[np.float64]:
        return np.asarray(weights[:, [_PLACE[name] for name in names]].mean(axis=1), dtype=np.float64)

    jaw, wide = mean("jawopen"), mean("mouthstretchleft", "mouthstretchright")
    left, right = mean("eyeblinkleft"), mean("eyeblinkright")
    u = np.clip(mean("mouthpucker") / 0.7, 0, 1)
    o = np.clip((mean("mouthfunnel") - 0.3 * u) / 0.7, 0, 1)
    left_over = np.clip(jaw - 0.4 * o - 0.1 * u, 0, 1)
    e = np.clip(np.minimum(wide, left_over) / 0.3, 0, 1)
    i = np.clip((wide - 0.3 * e) / 0.5, 0, 1)
    a = np.clip((left_over - 0.3 * e - 0.1 * i) / 0.7, 0, 1)
    return np.clip(np.stack([a, i, u, e, o, np.minimum(left, right), left, right], axis=1), 0, 1)
