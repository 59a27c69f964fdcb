"""Which motion channels can be drawn as curves, which move at all, and their values. Pure: no Qt."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from studio.motion import Motion, rotation
from studio.motion.channels import is_blink_shape, is_mouth_shape

AXES = {"nod": 1, "turn": 0, "tilt": 2}
"""How a head says yes, no and maybe, as places in R = Ry Rx Rz."""
LEAST_WEIGHT, LEAST_DEGREES = 0.01, 0.5
"""Standard deviations below which a channel counts as still."""
LOOKED_AT = 2_000
"""Frames, spread evenly, by which stillness is judged."""


@dataclass(frozen=True)
class CurveChannel:
    """One curve that can be drawn.

    Args:
        name: the blend shape's or the bone's.
        axis: "" for a blend shape, else one of AXES.
        spread: standard deviation, in weight or degrees.
    """

    name: str
    axis: str = ""
    spread: float = 0.0

    @property
    def key(self) -> str:
        """Unique in a motion: "JawOpen" or "Head nod"."""
        return f"{self.name} {self.axis}".strip()

    @property
    def moves(self) -> bool:
        """Whether it is worth drawing."""
        return self.spread > (LEAST_DEGREES if self.axis else LEAST_WEIGHT)


def channels(motion: Motion) -> tuple[CurveChannel, ...]:
    """All channels: blend shapes in their order, then bones by axis."""
    if not len(motion):
        return ()
    rows = np.unique(np.linspace(0, len(motion) - 1, min(len(motion), LOOKED_AT)).astype(np.int64))
    weights = motion.shapes[rows].std(axis=0)
    shapes = [CurveChannel(n, "", float(s)) for n, s in zip(motion.shape_names, weights, strict=True)]
    bones = []
    for j, name in enumerate(motion.bone_names):
        angles = rotation.to_euler_yxz(motion.rotations[rows, j])
        bones += [
            CurveChannel(name, axis, float(np.degrees(np.unwrap(angles[i])).std()))
            for axis, i in AXES.items()
        ]
    return (*shapes, *bones)


def first_choice(found: tuple[CurveChannel, ...]) -> tuple[str, ...]:
    """Keys worth showing unasked: the liveliest mouth shape, a blink, and how the head nods."""
    moving = [channel for channel in found if channel.moves]
    picks: list[str] = []
    mouths = [c for c in moving if not c.axis and is_mouth_shape(c.name)]
    blinks = [c for c in moving if not c.axis and is_blink_shape(c.name)]
    heads = [c for c in moving if c.axis and c.name == "Head"]
    # A take without a moving head shows another bone, or at least a shape.
    others = [c for c in moving if c.axis and c.name != "Head"] or [c for c in moving if not c.axis]
    for group in (mouths, blinks, heads or others):
        best = max(group, key=lambda c: c.spread, default=None)
        if best is not None and best.key not in picks:
            picks.append(best.key)
    return tuple(picks)


def values(motion: Motion, key: str) -> NDArray[np.float64] | None:
    """The values of one channel, weights or degrees (T,); None where the motion has no such channel."""
    if key in motion.shape_names:
        return motion.shapes[:, motion.shape_names.index(key)].astype(np.float64)
    bone, _, axis = key.rpartition(" ")
    if axis in AXES and bone in motion.bone_names:
        angles = rotation.to_euler_yxz(motion.rotations[:, motion.bone_names.index(bone)])
        return np.degrees(np.unwrap(angles[AXES[axis]]))
    return None
