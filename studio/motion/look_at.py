"""What moves an avatar's eyes: bones or expressions, and how far a gaze turns them.

Angles are degrees as the avatar sees it: yaw to its own left, pitch down.

Source: VRMC_vrm 1.0, lookAt; VRM 0's firstPerson, without its curves, which nobody writes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.motion import rotation

Array = NDArray[np.floating]
Gaze = tuple[float, float]
"""Yaw and pitch."""
Range = tuple[float, float]
"""The largest angle that is taken in, and what comes out for it."""

WIDEST = (45.0, 35.0)
"""Degrees to the side and up or down that ARKit's eyeLook shapes mean at full weight: as far as eyes go."""
_SEEN = 0.1
"""Degrees below which an eye bone looks straight ahead."""
_ARKIT = {
    "left": ("eyelookoutleft", "eyelookinleft", "eyelookdownleft", "eyelookupleft"),
    "right": ("eyelookinright", "eyelookoutright", "eyelookdownright", "eyelookupright"),
}
"""Names of what turns each eye to the left, right, down and up."""
_PRESETS = ("lookleft", "lookright", "lookdown", "lookup")


@dataclass(frozen=True)
class LookAt:
    """How an avatar looks somewhere.

    Args:
        by_bones: its eye bones turn; else its expressions lookLeft, lookRight, lookUp and lookDown move.
        inner, outer: of an eye that looks to the nose, and away from it.
        down, up: of both eyes.
    """

    by_bones: bool = True
    inner: Range = (90.0, 10.0)
    outer: Range = (90.0, 10.0)
    down: Range = (90.0, 10.0)
    up: Range = (90.0, 10.0)

    def turn(self, eye: str, yaw: float, pitch: float) -> tuple[float, float]:
        """Degrees that the "left" or "right" eye's bone turns for a gaze."""
        outwards = yaw if eye == "left" else -yaw
        across = mapped(self.outer, outwards) if outwards > 0.0 else -mapped(self.inner, -outwards)
        down = mapped(self.down, pitch) if pitch > 0.0 else -mapped(self.up, -pitch)
        return across if eye == "left" else -across, down

    def weights(self, yaw: float, pitch: float) -> dict[str, float]:
        """Weights of the four expressions for a gaze."""
        return {
            "LookLeft": mapped(self.outer, yaw),
            "LookRight": mapped(self.outer, -yaw),
            "LookDown": mapped(self.down, pitch),
            "LookUp": mapped(self.up, -pitch),
        }

    def of_presets(self, eye: str, weights: Mapping[str, float]) -> tuple[float, float]:
        """The gaze (yaw, pitch) that VRM's presets ask of an eye; at full weight as far as it goes."""
        left, right, down, up = (weights.get(name, 0.0) for name in _PRESETS)
        out, into = (left, right) if eye == "left" else (right, left)
        yaw = out * self.outer[0] - into * self.inner[0]
        return yaw if eye == "left" else -yaw, down * self.down[0] - up * self.up[0]


def mapped(along: Range, angle: float) -> float:
    """What comes out of a range for an angle; nothing below 0."""
    most, scale = along
    return scale * min(max(angle, 0.0) / most, 1.0) if most > 0.0 else 0.0


def gaze_of(shapes: Mapping[str, float], eye: str) -> tuple[float, float]:
    """Where the "left" or "right" eye looks (yaw, pitch) by ARKit's shapes, their names in lower case."""
    left, right, down, up = (min(max(shapes.get(name, 0.0), 0.0), 1.0) for name in _ARKIT[eye])
    return (left - right) * WIDEST[0], (down - up) * WIDEST[1]


def gaze_between(head: Array, eye: Array) -> tuple[float, float]:
    """Where an eye looks (yaw, pitch) by rotations (4,), changes from the T-pose in a picture's axes."""
    x, y, z = rotation.rotate(rotation.multiply(rotation.inverse(head), eye), (0.0, 0.0, 1.0)).tolist()
    return float(np.degrees(np.arctan2(x, z))), float(np.degrees(np.arctan2(-y, np.hypot(x, z))))


def turned_by(yaw: float, pitch: float) -> Array:
    """The rotation (4,) of an eye that looks somewhere, in a picture's axes."""
    return rotation.from_euler_yxz(np.radians(yaw), np.radians(pitch), 0.0)


def is_ahead(yaw: float, pitch: float) -> bool:
    """Whether a gaze is too small to be one."""
    return abs(yaw) < _SEEN and abs(pitch) < _SEEN


def asks(shapes: Mapping[str, float]) -> tuple[dict[str, float], dict[str, float]]:
    """What of blend shapes asks for a gaze, in lower case: ARKit's, and VRM's presets."""
    low = {name.lower().replace("_", ""): float(value) for name, value in shapes.items()}
    arkit = {name: low[name] for names in _ARKIT.values() for name in names if low.get(name, 0.0) > 0.0}
    return arkit, {name: low[name] for name in _PRESETS if low.get(name, 0.0) > 0.0}
