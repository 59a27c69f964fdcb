"""Where the bones of a pose are in the world."""

import numpy as np
from scipy.spatial.transform import Rotation

from studio.motion import Motion, rotation
from studio.render.world_pose import WorldPose


def test_the_root_moves_the_whole_body() -> None:
    turn = rotation.from_axis_angle([0, 1.0, 0], np.pi / 2)
    motion = Motion.build(
        [0.0], (), None, ("Hips", "Head"), None, None, root_position=[[1.0, 0, 0]], root_rotation=[turn]
    )
    still = Motion.build([0.0], (), None, ("Hips", "Head"))
    expected = Rotation.from_quat(turn).apply(WorldPose.of(still, 0.0).joints) + np.array([1, 0, 0])
    pose = WorldPose.of(motion, 0.0)
    assert pose.turns is not None
    assert np.allclose(pose.joints, expected, atol=1e-6)
    assert np.all(rotation.angle_between(pose.turns, turn) < 1e-3)


def test_a_head_alone_stands_on_a_body_with_its_arms_down() -> None:
    turned = rotation.from_euler_yxz(0.4, 0.0, 0.0)
    motion = Motion.build(
        np.array([0.0, 1.0]), ("JawOpen",), np.zeros((2, 1)), ("Neck", "Head"), np.zeros((2, 2, 3)),
        np.tile([rotation.IDENTITY, turned], (2, 1, 1)),
    )  # fmt: skip
    pose = WorldPose.of(motion, 0.5)
    names = pose.skeleton.bone_names
    at = dict(zip(names, pose.joints, strict=True))
    assert at["LeftHand"][1] < at["LeftUpperArm"][1] - 0.3, "no T-pose"
    assert at["Head"][1] > at["Hips"][1]
    assert pose.turns is not None
    assert np.allclose(pose.turns[names.index("Head")], turned, atol=1e-6)
