"""Regions of the body: which shape or bone belongs where, what is masked, and the posture they refer to."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from studio.motion import Motion, Pose, Skeleton, rotation
from studio.motion.channels import is_blink_shape, is_mouth_shape

FACE_REGIONS = ("mouth", "brows", "eyes", "face")
BODY_REGIONS = ("head", "torso", "arms", "hands", "legs")
REGIONS = (*FACE_REGIONS, *BODY_REGIONS)
"""Disjoint; "face" is what is left of it: smiles, cheeks, nose, whole expressions."""

_VOWELS = {
    "a": "a", "i": "i", "u": "u", "e": "e", "o": "o", "aa": "a", "ih": "i", "ou": "u", "ee": "e", "oh": "o",
    "あ": "a", "い": "i", "う": "u", "え": "e", "お": "o",
}  # fmt: skip
_EYES = ("eye", "look", "fcl_eye", "まばたき", "ウィンク", "瞳")
_BROWS = ("brow", "fcl_brw", "眉")
_MOUTH = ("fcl_mth", "口")
_LEGS = ("UpperLeg", "LowerLeg", "Foot", "Toes")
_ARMS = ("Shoulder", "UpperArm", "LowerArm")


@lru_cache(maxsize=256)
def shape_region(name: str) -> str:
    """The region of a blend shape of VRM 0, VRM 1, ARKit, VRoid or MikuMikuDance; "face" for others."""
    low = name.lower()
    # The mouth first: "MouthSmile" moves it, whatever else its name says.
    if low in _VOWELS or is_mouth_shape(low) or low.startswith(_MOUTH):
        return "mouth"
    if low.startswith(_BROWS):
        return "brows"
    return "eyes" if is_lid(low) or low.startswith(_EYES) else "face"


@lru_cache(maxsize=256)
def bone_region(name: str) -> str:
    """The region of a bone of the humanoid; "torso" for the hips and for bones nobody knows."""
    if name in ("Head", "Neck"):
        return "head"
    if name == "Jaw":
        return "mouth"
    part = name.removeprefix("Left").removeprefix("Right")
    if part == name:
        return "torso"
    if part == "Eye":
        return "eyes"
    if part in _LEGS:
        return "legs"
    return "arms" if part in _ARMS else "hands"


def vowel(name: str) -> str | None:
    """Which of a, i, u, e, o a blend shape is, None for another shape."""
    return _VOWELS.get(name.lower())


def is_lid(name: str) -> bool:
    """Whether a blend shape closes an eye."""
    low = name.lower()
    return is_blink_shape(low) or low.startswith(("fcl_eye_close", "まばたき", "ウィンク"))


@lru_cache(maxsize=64)
def lid_sides(names: tuple[str, ...]) -> tuple[list[int], list[int]]:
    """Columns of the shapes that close both eyes at once, and of those that close one.

    Args:
        names: S blend-shape names.
    """
    lids = [i for i, name in enumerate(names) if is_lid(name)]
    single = [i for i in lids if names[i].lower().endswith(("_l", "_r", "left", "right", "右", "左"))]
    single += [i for i in lids if names[i].startswith("ウィンク") and i not in single]
    return [i for i in lids if i not in single], single


def held(motion: Motion, moves: frozenset[str], reference: Reference) -> Motion:
    """A motion in which only some regions move: shapes of the others rest at 0, bones stand as the reference.

    The regions that move come back bit for bit.
    """
    if moves.issuperset(REGIONS):
        return motion
    still = [
        i for i, name in enumerate(motion.shape_names)
        # "Neutral" is no movement, so there is nothing to hold still.
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


@dataclass(frozen=True, eq=False)
class Reference:
    """A posture: what stands still stands like this, and what swings swings about it.

    Args:
        skeleton: J bones.
        positions: local positions (J, 3).
        rotations: local unit quaternions (J, 4).
        root_position: (3,).
        root_rotation: (4,).
    """

    skeleton: Skeleton
    positions: NDArray[np.float64]
    rotations: NDArray[np.float64]
    root_position: NDArray[np.float64]
    root_rotation: NDArray[np.float64]

    @classmethod
    def of(cls, motion: Motion) -> Reference:
        """The mean posture of a motion; the rest pose where it has no frames."""
        names = motion.bone_names
        if not len(motion):
            return cls.of_pose(names, Motion.build([0.0], bone_names=names).pose(0.0))
        return cls(
            Skeleton.humanoid(names),
            motion.positions.mean(axis=0, dtype=np.float64),
            np.asarray(
                rotation.normalised(motion.rotations.mean(axis=0, dtype=np.float64)), dtype=np.float64
            ),
            motion.root_position.mean(axis=0, dtype=np.float64),
            np.asarray(
                rotation.normalised(motion.root_rotation.mean(axis=0, dtype=np.float64)), dtype=np.float64
            ),
        )

    @classmethod
    def of_pose(cls, bone_names: tuple[str, ...], pose: Pose) -> Reference:
        """A pose as the posture."""
        parts = (pose.positions, pose.rotations, pose.root_position, pose.root_rotation)
        return cls(Skeleton.humanoid(bone_names), *(np.asarray(part, dtype=np.float64) for part in parts))

    def towards(self, pose: Pose, share: float) -> Reference:
        """This posture moved by a share (0 to 1) of the way to a pose."""

        def line(a: NDArray[np.float64], b: NDArray[np.float32]) -> NDArray[np.float64]:
            return a + (b.astype(np.float64) - a) * share

        def turn(a: NDArray[np.float64], b: NDArray[np.float32]) -> NDArray[np.float64]:
            return rotation.towards(a, b, share).astype(np.float64)

        return Reference(
            self.skeleton,
            line(self.positions, pose.positions),
            turn(self.rotations, pose.rotations),
            line(self.root_position, pose.root_position),
            turn(self.root_rotation, pose.root_rotation),
        )
