"""Which regions move: the others are held still, or left out for a program that moves them itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from studio.motion import Motion
from studio.playback.layers.reference import Reference
from studio.playback.layers.regions import REGIONS, bone_region, shape_region


def held(motion: Motion, moves: frozenset[str], reference: Reference) -> Motion:
    """A motion in which only some regions move: shapes of the others rest at 0, bones stand as the reference.

    The regions that move come back bit for bit.
    """
    if moves.issuperset(REGIONS):
        return motion
    still = [
        i for i, name in enumerate(motion.shape_names)
        if shape_region(name) not in moves and name.lower() != "neutral"
    ]  # fmt: skip
    if still:
        shapes = motion.shapes.copy()
        shapes[:, still] = 0.0
        motion = replace(motion, shapes=shapes)
    bones = [i for i, name in enumerate(motion.bone_names) if bone_region(name) not in moves]
    if bones:
        positions, rotations = motion.positions.copy(), motion.rotations.copy()
        positions[:, bones], rotations[:, bones] = reference.positions[bones], reference.rotations[bones]
        motion = replace(motion, positions=positions, rotations=rotations)
    return motion if "torso" in moves else at_home(motion, reference)


def at_home(motion: Motion, reference: Reference) -> Motion:
    """A motion whose root stays where the reference has it."""
    count = len(motion)
    return replace(
        motion,
        root_position=np.tile(reference.root_position.astype(np.float32), (count, 1)),
        root_rotation=np.tile(reference.root_rotation.astype(np.float32), (count, 1)),
    )


def kept(
    shape_names: tuple[str, ...], bone_names: tuple[str, ...], moves: frozenset[str]
) -> tuple[list[int], list[int]]:
    """Columns of the shapes and of the bones that are not left out."""
    shapes = [i for i, name in enumerate(shape_names) if shape_region(name) in moves]
    return shapes, [i for i, name in enumerate(bone_names) if bone_region(name) in moves]


def without(motion: Motion, moves: frozenset[str]) -> Motion:
    """A motion without the channels of the regions that do not move."""
    shapes, bones = kept(motion.shape_names, motion.bone_names, moves)
    return replace(
        motion,
        shape_names=tuple(motion.shape_names[i] for i in shapes),
        shapes=motion.shapes[:, shapes],
        bone_names=tuple(motion.bone_names[i] for i in bones),
        positions=motion.positions[:, bones],
        rotations=motion.rotations[:, bones],
    )
