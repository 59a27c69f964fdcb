"""The humanoid skeleton: hierarchy, rest pose and forward kinematics.

Axes are Unity's (left-handed, Y up, +Z forward, metres), as VMC sends them; the avatar's own left is -X.
Source: Unity HumanBodyBones; VRM 1.0 humanoid.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from studio.motion import rotation
from studio.motion.channels import ALL_BONES, BONES

PARENTS: dict[str, str | None] = {
    "Hips": None, "Spine": "Hips", "Chest": "Spine", "UpperChest": "Chest", "Neck": "UpperChest",
    "Head": "Neck", "Jaw": "Head", "LeftEye": "Head", "RightEye": "Head",
}  # fmt: skip
for _side in ("Left", "Right"):
    PARENTS |= {
        _side + "Shoulder": "UpperChest", _side + "UpperArm": _side + "Shoulder",
        _side + "LowerArm": _side + "UpperArm", _side + "Hand": _side + "LowerArm",
        _side + "UpperLeg": "Hips", _side + "LowerLeg": _side + "UpperLeg",
        _side + "Foot": _side + "LowerLeg", _side + "Toes": _side + "Foot",
    }  # fmt: skip
    for _finger in ("Thumb", "Index", "Middle", "Ring", "Little"):
        PARENTS[f"{_side}{_finger}Proximal"] = _side + "Hand"
        PARENTS[f"{_side}{_finger}Intermediate"] = f"{_side}{_finger}Proximal"
        PARENTS[f"{_side}{_finger}Distal"] = f"{_side}{_finger}Intermediate"


def parent_in(bone: str, present: frozenset[str] | set[str]) -> str | None:
    """The nearest ancestor of a bone that is present, or None for a root or an unknown bone."""
    parent = PARENTS.get(bone)
    while parent is not None and parent not in present:
        parent = PARENTS[parent]
    return parent


_LEFT_OFFSETS: dict[str, tuple[float, float, float]] = {
    "Eye": (-0.03, 0.06, 0.07),
    "Shoulder": (-0.03, 0.09, 0.0), "UpperArm": (-0.11, 0.0, 0.0), "LowerArm": (-0.25, 0.0, 0.0),
    "Hand": (-0.23, 0.0, 0.0),
    "UpperLeg": (-0.09, -0.05, 0.0), "LowerLeg": (0.0, -0.40, 0.0), "Foot": (0.0, -0.41, -0.02),
    "Toes": (0.0, -0.06, 0.13),
    "ThumbProximal": (-0.03, -0.01, 0.03), "ThumbIntermediate": (-0.03, 0.0, 0.02), "ThumbDistal": (-0.025, 0.0, 0.015),
    "IndexProximal": (-0.08, 0.0, 0.025), "IndexIntermediate": (-0.035, 0.0, 0.0), "IndexDistal": (-0.022, 0.0, 0.0),
    "MiddleProximal": (-0.082, 0.0, 0.005), "MiddleIntermediate": (-0.04, 0.0, 0.0), "MiddleDistal": (-0.025, 0.0, 0.0),
    "RingProximal": (-0.078, 0.0, -0.013), "RingIntermediate": (-0.037, 0.0, 0.0), "RingDistal": (-0.024, 0.0, 0.0),
    "LittleProximal": (-0.072, 0.0, -0.03), "LittleIntermediate": (-0.028, 0.0, 0.0), "LittleDistal": (-0.02, 0.0, 0.0),
}  # fmt: skip
REST_OFFSETS: dict[str, tuple[float, float, float]] = {
    "Hips": (0.0, 0.95, 0.0), "Spine": (0.0, 0.09, 0.0), "Chest": (0.0, 0.12, 0.0),
    "UpperChest": (0.0, 0.12, 0.0), "Neck": (0.0, 0.13, 0.0), "Head": (0.0, 0.08, 0.0),
    "Jaw": (0.0, 0.01, 0.03),
}  # fmt: skip
for _name, (_x, _y, _z) in _LEFT_OFFSETS.items():
    REST_OFFSETS["Left" + _name] = (_x, _y, _z)
    REST_OFFSETS["Right" + _name] = (-_x, _y, _z)
assert set(PARENTS) == set(ALL_BONES) == set(REST_OFFSETS)


@dataclass(frozen=True, eq=False)
class Skeleton:
    """Bones, their parents and their local rest pose.

    Args:
        bone_names: J names, any order.
        parents: index of each bone's parent among bone_names, -1 for a root; J numbers.
        rest_positions: local offsets from the parent in metres, (J, 3).
        rest_rotations: local rest rotations, unit quaternions (J, 4).
    """

    bone_names: tuple[str, ...]
    parents: tuple[int, ...]
    rest_positions: NDArray[np.float64]
    rest_rotations: NDArray[np.float64]

    @classmethod
    def humanoid(
        cls,
        bone_names: tuple[str, ...] = BONES,
        rest_positions: NDArray[np.floating] | None = None,
    ) -> Skeleton:
        """A T-pose skeleton of the given bones; unknown bones stand at their own as roots.

        Args:
            bone_names: J names; parents that are missing are skipped over.
            rest_positions: (J, 3) local offsets; the built-in proportions where None.
        """
        present = frozenset(bone_names)
        index = {name: i for i, name in enumerate(bone_names)}
        up = [parent_in(name, present) for name in bone_names]
        if rest_positions is None:
            rest_positions = np.array([_offset_from(n, p) for n, p in zip(bone_names, up, strict=True)])
        count = len(bone_names)
        return cls(
            bone_names,
            tuple(-1 if p is None else index[p] for p in up),
            np.asarray(rest_positions, dtype=np.float64).reshape(count, 3),
            np.tile(rotation.IDENTITY, (count, 1)),
        )

    @cached_property
    def order(self) -> tuple[int, ...]:
        """Bone indices with every parent before its children."""
        done: list[int] = []
        waiting = list(range(len(self.bone_names)))
        while waiting:
            ready = [i for i in waiting if self.parents[i] < 0 or self.parents[i] in done]
            assert ready, "a skeleton has no cycles"
            done += ready
            waiting = [i for i in waiting if i not in ready]
        return tuple(done)

    def forward(
        self, positions: NDArray[np.floating], rotations: NDArray[np.floating]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Forward kinematics.

        Args:
            positions: local positions (..., J, 3).
            rotations: local unit quaternions (..., J, 4).

        Returns:
            World positions (..., J, 3) and world rotations (..., J, 4), float64.
        """
        p = np.array(positions, dtype=np.float64)
        q = np.array(rotations, dtype=np.float64)
        # Generation by generation in whole arrays: a live pose is worked out in a few steps, not in 54.
        for ups, bones in self._generations:
            p[..., bones, :] = p[..., ups, :] + rotation.rotate(q[..., ups, :], p[..., bones, :])
            q[..., bones, :] = rotation.multiply(q[..., ups, :], q[..., bones, :])
        return p, q

    @cached_property
    def _generations(self) -> tuple[tuple[NDArray[np.intp], NDArray[np.intp]], ...]:
        """(parents, children) of each depth below the roots: a live pose is worked out in a few steps."""
        depth = [0] * len(self.parents)
        for i in self.order:
            depth[i] = depth[self.parents[i]] + 1 if self.parents[i] >= 0 else 0
        return tuple(
            (np.array([self.parents[i] for i in bones], dtype=np.intp), np.array(bones, dtype=np.intp))
            for level in range(1, max(depth, default=0) + 1)
            if (bones := [i for i, d in enumerate(depth) if d == level])
        )

    def edges(self) -> tuple[tuple[int, int], ...]:
        """(parent, child) index pairs: the lines of a stick figure."""
        return tuple((up, i) for i, up in enumerate(self.parents) if up >= 0)


def _offset_from(bone: str, ancestor: str | None) -> tuple[float, float, float]:
    """The rest offset of a bone from an ancestor, over the parents that are missing between them."""
    x, y, z = REST_OFFSETS.get(bone, (0.0, 0.0, 0.0))
    step = PARENTS.get(bone)
    while step is not None and step != ancestor:
        dx, dy, dz = REST_OFFSETS[step]
        x, y, z, step = x + dx, y + dy, z + dz, PARENTS[step]
    return x, y, z
