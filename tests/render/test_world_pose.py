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
