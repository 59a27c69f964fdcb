from __future__ import annotations

import numpy as np
import pytest

from studio.motion import Skeleton, rotation
from studio.motion.channels import BONES, VRM0_SHAPES
from studio.motion.neutral import WAVE_SECONDS, between, neutral_pose, wave_pose


def _heights(rotations: np.ndarray) -> dict[str, float]:
    skeleton = Skeleton.humanoid(BONES)
    world, _ = skeleton.forward(skeleton.rest_positions, rotations)
    return dict(zip(BONES, world[:, 1], strict=True))


def test_at_rest_both_hands_hang_below_the_shoulders() -> None:
    height = _heights(neutral_pose(VRM0_SHAPES, BONES).rotations)
    for side in ("Left", "Right"):
        assert height[side + "Hand"] < height[side + "UpperArm"] - 0.3


def test_at_rest_the_face_is_empty() -> None:
    assert not neutral_pose(("A", "JawOpen"), ()).shapes.any()


def test_the_wave_raises_the_right_hand_alone() -> None:
    pose, _, _ = wave_pose(WAVE_SECONDS / 2)
    height = _heights(pose.rotations)
    assert height["RightHand"] > height["RightUpperArm"]
    assert height["LeftHand"] < height["LeftUpperArm"]


def test_the_wave_begins_and_ends_at_rest() -> None:
    rest = neutral_pose(VRM0_SHAPES, BONES)
    for t in (0.0, WAVE_SECONDS):
        pose, _, _ = wave_pose(t)
        assert rotation.angle_between(pose.rotations, rest.rotations).max() < 0.01


@pytest.mark.parametrize("amount", [0.0, 0.5, 1.0])
def test_between_goes_from_one_pose_to_the_other(amount: float) -> None:
    a, b = neutral_pose(("A",), BONES), wave_pose(2.0)[0]
    b = type(b)(np.ones(1, np.float32), b.positions, b.rotations, b.root_position, b.root_rotation)
    mixed = between(a, b, amount)
    whole = rotation.angle_between(a.rotations, b.rotations).max()
    assert mixed.shapes[0] == pytest.approx(amount)
    assert rotation.angle_between(a.rotations, mixed.rotations).max() == pytest.approx(
        whole * amount, abs=1e-2
    )
