"""The humanoid: who hangs from whom, and where everything stands."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from studio.motion import rotation
from studio.motion.channels import ALL_BONES, BONES
from studio.motion.skeleton import PARENTS, REST_OFFSETS, Skeleton, parent_in


def rest(skeleton: Skeleton) -> tuple[np.ndarray, np.ndarray]:
    return skeleton.forward(skeleton.rest_positions, skeleton.rest_rotations)


def place(skeleton: Skeleton, positions: np.ndarray, bone: str) -> np.ndarray:
    return positions[..., skeleton.bone_names.index(bone), :]


def test_every_bone_hangs_from_the_hips() -> None:
    for bone in ALL_BONES:
        seen = [bone]
        while (parent := PARENTS[seen[-1]]) is not None:
            assert parent not in seen
            seen.append(parent)
        assert seen[-1] == "Hips"


def test_a_missing_parent_is_skipped_over() -> None:
    assert parent_in("Neck", {"Hips", "Spine", "Neck"}) == "Spine"
    assert parent_in("Hips", {"Hips"}) is None
    assert parent_in("Tail", {"Hips", "Tail"}) is None


def test_the_rest_pose_is_a_person_in_a_t() -> None:
    skeleton = Skeleton.humanoid()
    positions, _ = rest(skeleton)
    head, hips, left, right = (
        place(skeleton, positions, b) for b in ("Head", "Hips", "LeftHand", "RightHand")
    )
    toes = place(skeleton, positions, "LeftToes")
    assert 1.3 < head[1] < 1.8
    assert toes[1] == pytest.approx(0.0, abs=0.05)
    assert left[0] < hips[0] < right[0], "the avatar's own left is -X"
    assert left[1] == pytest.approx(right[1])
    assert np.allclose(left * [-1, 1, 1], right)
    assert toes[2] > 0, "feet point forward, +Z"


def test_a_skeleton_without_some_bones_stands_where_the_whole_one_does() -> None:
    whole, part = Skeleton.humanoid(), Skeleton.humanoid(("Hips", "Chest", "Head", "LeftHand"))
    there, here = rest(whole)[0], rest(part)[0]
    for bone in part.bone_names:
        assert np.allclose(place(part, here, bone), place(whole, there, bone)), bone


def test_the_order_of_names_does_not_matter() -> None:
    forth, back = Skeleton.humanoid(BONES), Skeleton.humanoid(BONES[::-1])
    assert np.allclose(rest(forth)[0], rest(back)[0][::-1])


def test_turning_a_shoulder_carries_the_arm() -> None:
    skeleton = Skeleton.humanoid()
    q = skeleton.rest_rotations.copy()
    arm = skeleton.bone_names.index("LeftUpperArm")
    q[arm] = rotation.from_axis_angle([0.0, 0.0, 1.0], np.pi / 2)
    positions, rotations = skeleton.forward(skeleton.rest_positions, q)
    before = rest(skeleton)[0]
    upper, hand = place(skeleton, positions, "LeftUpperArm"), place(skeleton, positions, "LeftHand")
    assert np.allclose(upper, place(skeleton, before, "LeftUpperArm")), "a joint stays when it turns"
    reach = np.array(REST_OFFSETS["LeftLowerArm"]) + np.array(REST_OFFSETS["LeftHand"])
    assert np.allclose(hand - upper, Rotation.from_rotvec([0, 0, np.pi / 2]).apply(reach))
    assert np.allclose(place(skeleton, positions, "RightHand"), place(skeleton, before, "RightHand"))
    assert np.allclose(place(skeleton, rotations, "LeftHand"), q[arm]), "rotations are inherited"


def test_forward_against_matrices() -> None:
    skeleton = Skeleton.humanoid()
    count = len(skeleton.bone_names)
    rng = np.random.default_rng(5)
    p, q = rng.normal(size=(count, 3)), Rotation.random(count, random_state=6).as_quat()
    world: dict[int, np.ndarray] = {}
    for i in skeleton.order:
        local = np.eye(4)
        local[:3, :3], local[:3, 3] = Rotation.from_quat(q[i]).as_matrix(), p[i]
        world[i] = world[skeleton.parents[i]] @ local if skeleton.parents[i] >= 0 else local
    positions, rotations = skeleton.forward(p, q)
    assert np.allclose(positions, [world[i][:3, 3] for i in range(count)])
    assert np.allclose(rotation.to_matrix(rotations), [world[i][:3, :3] for i in range(count)])


def test_forward_takes_any_leading_shape() -> None:
    skeleton = Skeleton.humanoid(("Hips", "Spine"))
    p, q = np.zeros((3, 2, 2, 3)), np.tile(rotation.IDENTITY, (3, 2, 2, 1))
    positions, rotations = skeleton.forward(p, q)
    assert positions.shape == (3, 2, 2, 3)
    assert rotations.shape == (3, 2, 2, 4)


def test_forward_leaves_its_input_alone() -> None:
    skeleton = Skeleton.humanoid()
    before = skeleton.rest_positions.copy()
    rest(skeleton)
    assert np.array_equal(skeleton.rest_positions, before)


def test_unknown_bones_stand_alone_at_their_own_place() -> None:
    skeleton = Skeleton.humanoid(("Hips", "Tail"), np.array([[0, 1.0, 0], [0, 0.5, -0.2]]))
    assert skeleton.parents == (-1, -1)
    assert np.allclose(rest(skeleton)[0][1], [0, 0.5, -0.2])


def test_no_bones_is_a_skeleton_too() -> None:
    skeleton = Skeleton.humanoid(())
    assert skeleton.order == ()
    assert skeleton.edges() == ()
    assert skeleton.forward(np.zeros((4, 0, 3)), np.zeros((4, 0, 4)))[0].shape == (4, 0, 3)


def test_edges_join_every_bone_but_the_root() -> None:
    skeleton = Skeleton.humanoid()
    assert len(skeleton.edges()) == len(BONES) - 1
    names = skeleton.bone_names
    assert all(PARENTS[names[child]] == names[parent] for parent, child in skeleton.edges())
