"""Where a body stands: place and heading told by its feet and put into the root, and feet that stay.

Captured hips wander through the room, and no sound tells where to. Seen from where the feet stand, what is
left of them is what a body does while it speaks: it sways, leans and shifts its weight.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from studio.motion import leg, rotation
from studio.motion.motion import Motion

Array = NDArray[np.float64]

STEP_SECONDS, SLOW_SECONDS = 0.4, 3.0
"""How slowly the place follows the feet, and the hips where no legs were captured (sigma)."""
RAISED = (0.08, 0.2)
"""Metres over where it stands from which a foot counts as lifted on purpose, a little and wholly."""


def standing(motion: Motion) -> Motion:
    """A motion, the same in the room, whose root stands where its feet do and looks where they point.

    Args:
        motion: on even frames. Without Hips it comes back as it is; without legs the slow part of the hips
            tells the place.
    """
    if "Hips" not in motion.bone_names or len(motion) < 2:
        return motion
    place, heading = _place(motion)
    turn = rotation.from_euler_yxz(heading, 0 * heading, 0 * heading)
    back, hips = rotation.inverse(turn), motion.bone_names.index("Hips")
    positions, rotations = motion.positions.copy(), motion.rotations.copy()
    positions[:, hips] = rotation.rotate(back, positions[:, hips] - place)
    rotations[:, hips] = rotation.multiply(back, rotations[:, hips])
    root = motion.root_rotation.astype(np.float64)
    moved = rotation.rotate(root, place) + motion.root_position
    return replace(
        motion,
        positions=positions,
        rotations=rotation.sign_continuous(rotations).astype(np.float32),
        root_position=moved.astype(np.float32),
        root_rotation=rotation.sign_continuous(rotation.multiply(root, turn)).astype(np.float32),
    )


def planted(motion: Motion) -> Motion:
    """A standing motion whose feet stay where they usually are, but where they are lifted high.

    In place every step would slide: of a step there stays what the rest of the body does.
    """
    names = motion.bone_names
    if not _has_legs(names) or len(motion) < 2:
        return motion
    legs = [_Leg(motion, side) for side in ("Left", "Right")]
    # The leg that has to reach further decides for both, or one foot would leave the floor.
    down = np.maximum.reduce([np.zeros(len(motion)), *(one.too_high() for one in legs)])
    positions, rotations = motion.positions.copy(), motion.rotations.copy()
    positions[:, names.index("Hips"), 1] -= down.astype(np.float32)
    for one in legs:
        one.plant(rotations, down)
    return replace(
        motion, positions=positions, rotations=rotation.sign_continuous(rotations).astype(np.float32)
    )


def _has_legs(names: tuple[str, ...]) -> bool:
    return {"Hips", *(side + part for side in ("Left", "Right") for part in leg.PARTS)} <= set(names)


def _chain(motion: Motion, bones: list[str]) -> tuple[Array, Array]:
    """Places (T, B, 3) and turns (T, B, 4) of bones, each the child of the one before, seen from the root."""
    at = [motion.bone_names.index(name) for name in bones]
    p, q = motion.positions[:, at].astype(np.float64), motion.rotations[:, at].astype(np.float64)
    for child in range(1, len(at)):
        p[:, child] = p[:, child - 1] + rotation.rotate(q[:, child - 1], p[:, child])
        q[:, child] = rotation.multiply(q[:, child - 1], q[:, child])
    return p, q


def _place(motion: Motion) -> tuple[Array, Array]:
    """Where the body stands (T, 3), its height left out, and its heading (T,), radians about Y."""
    from scipy.ndimage import gaussian_filter1d

    rate = (len(motion) - 1) / max(motion.duration, 1e-9)
    if _has_legs(motion.bone_names):
        sides = [["Hips", *(side + part for part in leg.PARTS)] for side in ("Left", "Right")]
        chains = [_chain(motion, bones) for bones in sides]
        middle = np.mean([p[:, -1] for p, _ in chains], axis=0)
        ahead = np.mean([_level(q[:, -1]) for _, q in chains], axis=0)
        sigma, rest = STEP_SECONDS * rate, _resting_middle(motion)
    else:
        p, q = _chain(motion, ["Hips"])
        middle, ahead, sigma, rest = p[:, 0], _level(q[:, 0]), SLOW_SECONDS * rate, np.zeros(3)
    ahead = gaussian_filter1d(ahead, sigma, axis=0, mode="nearest")
    heading: Array = np.unwrap(np.arctan2(ahead[:, 0], ahead[:, 2]))
    place = gaussian_filter1d(middle, sigma, axis=0, mode="nearest")
    place -= rotation.rotate(rotation.from_euler_yxz(heading, 0 * heading, 0 * heading), rest)
    place[:, 1] = 0.0
    return place, heading


def _resting_middle(motion: Motion) -> Array:
    """The middle between the feet of the rest pose, seen from the hips."""
    legs = [motion.bone_names.index(side + part) for side in ("Left", "Right") for part in leg.PARTS]
    return np.asarray(np.median(motion.positions[:, legs], axis=0).sum(axis=0) / 2, dtype=np.float64)


def _level(turns: Array) -> Array:
    """Where turns (T, 4) look on the floor, unit length (T, 3)."""
    ahead = rotation.rotate(turns, leg.FORWARD) * np.array([1.0, 0.0, 1.0])
    return np.asarray(ahead / np.maximum(leg.length(ahead), 1e-9))


class _Leg:
    """One leg through all frames, seen from the root, and where its foot belongs.

    Args:
        motion: T frames, standing.
        side: "Left" or "Right".
    """

    def __init__(self, motion: Motion, side: str) -> None:
        self._bones = [motion.bone_names.index(side + part) for part in leg.PARTS]
        self._p, self._q = _chain(motion, ["Hips", *(side + part for part in leg.PARTS)])
        foot, turn = self._p[:, -1], self._q[:, -1]
        home = np.median(foot, axis=0)
        share = np.clip((foot[:, 1:2] - home[1] - RAISED[0]) / (RAISED[1] - RAISED[0]), 0.0, 1.0)
        self._ground = home + share * (foot - home)
        usual = rotation.normalised(rotation.sign_continuous(turn).mean(axis=0))
        self._sole = rotation.slerp(np.broadcast_to(usual, turn.shape), turn, share[:, 0])

    def too_high(self) -> Array:
        """Metres by which the hips are too high for the foot to reach where it belongs (T,)."""
        return leg.too_high(self._p[:, 1:], self._ground)

    def plant(self, rotations: NDArray[np.float32], down: Array) -> None:
        """Write the leg's turns into rotations (T, J, 4), with the hips lowered by some metres (T,)."""
        joints = self._p[:, 1:] - down[:, None, None] * np.array([0.0, 1.0, 0.0])
        upper, lower = leg.bent(joints, self._q[:, 1:3], self._ground)
        worlds = (self._q[:, 0], upper, lower, self._sole)
        for bone, parent, world in zip(self._bones, worlds, worlds[1:], strict=False):
            rotations[:, bone] = rotation.multiply(rotation.inverse(parent), world)
