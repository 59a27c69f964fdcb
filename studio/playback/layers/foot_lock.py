"""Root lock, and foot lock by two-bone inverse kinematics while the hips move.

Source: two-bone inverse kinematics by the law of cosines, the knee kept in the plane it was in.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from studio.motion import Motion, rotation
from studio.playback.layers.regions import Reference, at_home

Array = NDArray[np.float64]

STRETCH = 0.9995
"""A leg is never straighter than this share of its length: near straight a knee snaps."""
FORWARD = np.array([0.0, 0.0, 1.0])


def in_place(motion: Motion, reference: Reference) -> Motion:
    """A motion whose root stands still, and whose hips no longer wander over the floor (they may dip)."""
    motion = at_home(motion, reference)
    if "Hips" not in motion.bone_names:
        return motion
    hips, positions = motion.bone_names.index("Hips"), motion.positions.copy()
    positions[:, hips, 0] = reference.positions[hips, 0]
    positions[:, hips, 2] = reference.positions[hips, 2]
    return replace(motion, positions=positions)


def with_foot_lock(motion: Motion, reference: Reference) -> Motion:
    """A motion whose feet stand as they do in the reference; a side without the whole leg stays as it is.

    Hips that are higher than the legs are long come down as far as it takes.
    """
    legs = []
    for side in ("Left", "Right"):
        names = [side + part for part in ("UpperLeg", "LowerLeg", "Foot")]
        if all(name in motion.bone_names for name in names):
            legs.append(_Leg(motion, reference, [motion.bone_names.index(name) for name in names]))
    if not legs:
        return motion
    rotations, positions = motion.rotations.copy(), motion.positions
    down = np.zeros(len(motion))
    if "Hips" in motion.bone_names:
        # The leg that is shorter decides for both, or one foot would leave the floor.
        down = np.maximum.reduce([down, *(leg.too_high() for leg in legs)])
        positions = positions.copy()
        positions[:, motion.bone_names.index("Hips"), 1] -= down.astype(np.float32)
    for leg in legs:
        leg.plant(rotations, down)
    return replace(motion, positions=positions, rotations=rotations)


class _Leg:
    """One leg through all frames, seen from the root.

    Args:
        motion: T frames.
        reference: where its foot belongs.
        bones: numbers of thigh, shin and foot.
    """

    def __init__(self, motion: Motion, reference: Reference, bones: list[int]) -> None:
        self._bones = bones
        # From the foot up to the root, since positions are local to their parents.
        chain, up = [bones[-1]], reference.skeleton.parents[bones[-1]]
        while up >= 0:
            chain.insert(0, up)
            up = reference.skeleton.parents[up]
        p = np.concatenate([motion.positions[:, chain], reference.positions[None, chain]], dtype=np.float64)
        q = np.concatenate([motion.rotations[:, chain], reference.rotations[None, chain]], dtype=np.float64)
        for child in range(1, len(chain)):
            p[:, child] = p[:, child - 1] + rotation.rotate(q[:, child - 1], p[:, child])
            q[:, child] = rotation.multiply(q[:, child - 1], q[:, child])
        places = [chain.index(bone) for bone in bones]
        self._joints, self._turns = p[:-1, places], q[:-1, places]
        above = places[0] - 1
        self._above = q[:-1, above] if above >= 0 else np.tile(rotation.IDENTITY, (len(motion), 1))
        self._ground, self._sole = _foothold(motion, reference, p[-1, -1], q[-1, -1])

    def too_high(self) -> Array:
        """Metres by which the hips are too high for the foot to reach the floor (T,)."""
        hip, knee, ankle = (self._joints[:, i] for i in range(3))
        length = STRETCH * (_length(knee - hip) + _length(ankle - knee))[:, 0]
        way = hip - self._ground
        highest = np.sqrt(np.maximum(length**2 - way[:, 0] ** 2 - way[:, 2] ** 2, 0.0))
        return np.asarray(way[:, 1] - highest)

    def plant(self, rotations: NDArray[np.float32], down: Array) -> None:
        """Write the leg's turns into rotations (T, J, 4), with the hips lowered by some metres (T,)."""
        joints = self._joints - down[:, None, None] * np.array([0.0, 1.0, 0.0])
        hip, knee, ankle = (joints[:, i] for i in range(3))
        forward = rotation.rotate(self._turns[:, 0], FORWARD)
        new_knee, new_ankle = _bent(hip, knee, ankle, self._ground, np.asarray(forward))
        first = _arc(knee - hip, new_knee - hip)
        second = _arc(np.asarray(rotation.rotate(first, ankle - knee)), new_ankle - new_knee)
        thigh = rotation.multiply(first, self._turns[:, 0])
        shin = rotation.multiply(second, rotation.multiply(first, self._turns[:, 1]))
        worlds = (self._above, thigh, shin, self._sole)
        for bone, parent, world in zip(self._bones, worlds, worlds[1:], strict=False):
            local = rotation.multiply(rotation.inverse(parent), world)
            # Of q and -q the one near the old rotation, so that interpolating never turns the long way.
            flip = (local * rotations[:, bone]).sum(axis=-1, keepdims=True) < 0
            rotations[:, bone] = np.where(flip, -local, local)


def _foothold(motion: Motion, reference: Reference, place: Array, turn: Array) -> tuple[Array, Array]:
    """Where a foot belongs (T, 3) and how it is turned (T, 4), seen from the moving root.

    Args:
        motion, reference: the root as it is and as it was.
        place, turn: of the foot in the reference, seen from its root.
    """
    home, back = reference.root_rotation, rotation.inverse(motion.root_rotation)
    ground = rotation.rotate(home, place) + reference.root_position - motion.root_position
    turned = np.broadcast_to(rotation.multiply(home, turn), back.shape)
    return np.asarray(rotation.rotate(back, ground)), np.asarray(rotation.multiply(back, turned))


def _bent(hip: Array, knee: Array, ankle: Array, wanted: Array, forward: Array) -> tuple[Array, Array]:
    """Knee and ankle (T, 3) of a leg whose ankle reaches for a place."""
    thigh, shin = _length(knee - hip), _length(ankle - knee)
    way = wanted - hip
    reach = np.clip(_length(way), np.abs(thigh - shin) + 1e-6, STRETCH * (thigh + shin))
    way = way / np.maximum(_length(way), 1e-9)
    cosine = np.clip((thigh**2 + reach**2 - shin**2) / np.maximum(2.0 * thigh * reach, 1e-9), -1.0, 1.0)
    # A leg that is straight has its knee in no plane: it bends forwards.
    side = (knee - hip) + 0.05 * forward
    side = side - (side * way).sum(axis=-1, keepdims=True) * way
    side = side / np.maximum(_length(side), 1e-9)
    return hip + way * thigh * cosine + side * thigh * np.sqrt(1.0 - cosine**2), hip + way * reach


def _arc(a: Array, b: Array) -> Array:
    """The shortest turn from one direction to another (T, 4)."""
    a, b = a / np.maximum(_length(a), 1e-9), b / np.maximum(_length(b), 1e-9)
    w = 1.0 + (a * b).sum(axis=-1, keepdims=True)
    return np.asarray(rotation.normalised(np.concatenate([rotation.cross(a, b), w], axis=-1)))


def _length(v: Array) -> Array:
    return np.asarray(np.linalg.norm(v, axis=-1, keepdims=True))
