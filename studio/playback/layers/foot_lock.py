"""Root lock, and foot lock by two-bone inverse kinematics while the hips move."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from studio.motion import Motion, leg, rotation
from studio.playback.layers.regions import Reference, at_home

Array = NDArray[np.float64]


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
        names = [side + part for part in leg.PARTS]
        if all(name in motion.bone_names for name in names):
            legs.append(_Leg(motion, reference, [motion.bone_names.index(name) for name in names]))
    if not legs:
        return motion
    rotations, positions = motion.rotations.copy(), motion.positions
    down = np.zeros(len(motion))
    if "Hips" in motion.bone_names:
        # The leg that is shorter decides for both, or one foot would leave the floor.
        down = np.maximum.reduce([down, *(one.too_high() for one in legs)])
        positions = positions.copy()
        positions[:, motion.bone_names.index("Hips"), 1] -= down.astype(np.float32)
    for one in legs:
        one.plant(rotations, down)
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
        return leg.too_high(self._joints, self._ground)

    def plant(self, rotations: NDArray[np.float32], down: Array) -> None:
        """Write the leg's turns into rotations (T, J, 4), with the hips lowered by some metres (T,)."""
        joints = self._joints - down[:, None, None] * np.array([0.0, 1.0, 0.0])
        thigh, shin = leg.bent(joints, self._turns[:, :2], self._ground)
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
