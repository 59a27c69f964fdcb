"""BVH files of other programs' skeletons: names, units, axes and rest poses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from studio.formats import bvh
from studio.formats._bones import humanoid_names
from studio.motion import Motion, Skeleton
from tests.world import world_of

BODY = ("Hips", "Spine", "Head", "LeftUpperArm", "LeftLowerArm", "LeftHand", "RightUpperArm",
        "LeftUpperLeg", "LeftLowerLeg", "LeftFoot", "RightUpperLeg", "RightLowerLeg",
        "RightFoot")  # fmt: skip


@pytest.mark.parametrize(
    ("joints", "expected"),
    [
        (
            "mixamorig:Hips mixamorig:Spine mixamorig:Spine1 mixamorig:Spine2 mixamorig:Neck mixamorig:Head "
            "mixamorig:LeftShoulder mixamorig:LeftArm mixamorig:LeftForeArm mixamorig:LeftHand "
            "mixamorig:LeftHandIndex1 mixamorig:LeftUpLeg mixamorig:LeftLeg mixamorig:LeftFoot",
            "Hips Spine Chest UpperChest Neck Head LeftShoulder LeftUpperArm LeftLowerArm LeftHand "
            "LeftIndexProximal LeftUpperLeg LeftLowerLeg LeftFoot",
        ),
        (
            "Hips LHipJoint LeftUpLeg LeftLeg LeftFoot LeftToeBase LowerBack Spine Spine1 Neck Neck1 Head "
            "LeftShoulder LeftArm LeftForeArm LeftHand LThumb",
            "Hips - LeftUpperLeg LeftLowerLeg LeftFoot LeftToes Spine Chest UpperChest Neck - Head "
            "LeftShoulder LeftUpperArm LeftLowerArm LeftHand -",
        ),
        (
            "Hips Chest Chest2 Chest3 Chest4 Neck Head RightCollar RightShoulder RightElbow RightWrist "
            "LeftHip LeftKnee LeftAnkle",
            "Hips Spine Chest - UpperChest Neck Head RightShoulder RightUpperArm RightLowerArm RightHand "
            "LeftUpperLeg LeftLowerLeg LeftFoot",
        ),
        (
            "spine spine.001 spine.002 spine.003 spine.004 spine.005 spine.006 shoulder.L upper_arm.L "
            "forearm.L hand.L f_index.01.L thumb.02.R thigh.L shin.L foot.L toe.L",
            "Hips Spine Chest UpperChest Neck - Head LeftShoulder LeftUpperArm LeftLowerArm LeftHand "
            "LeftIndexProximal RightThumbIntermediate LeftUpperLeg LeftLowerLeg LeftFoot LeftToes",
        ),
        (
            "pelvis spine_01 spine_02 spine_03 neck_01 head clavicle_l upperarm_l lowerarm_l hand_l "
            "thigh_r calf_r",
            "Hips Spine Chest UpperChest Neck Head LeftShoulder LeftUpperArm LeftLowerArm LeftHand "
            "RightUpperLeg RightLowerLeg",
        ),
        (
            "hip abdomen chest neck head lCollar lShldr lForeArm lHand rThigh rShin rFoot",
            "Hips Spine Chest Neck Head LeftShoulder LeftUpperArm LeftLowerArm LeftHand RightUpperLeg "
            "RightLowerLeg RightFoot",
        ),
        (
            "J_Bip_C_Hips J_Bip_C_Spine J_Bip_C_Head J_Bip_L_UpperArm J_Bip_R_Index2",
            "Hips Spine Head LeftUpperArm RightIndexIntermediate",
        ),
    ],
    ids=["mixamo", "cmu", "poser", "rigify", "unreal", "daz", "vroid"],
)
def test_names_of_other_programs(joints: str, expected: str) -> None:
    found = {j: bone for bone, j in humanoid_names(joints.split()).items()}
    assert [found.get(j, "-") for j in range(len(joints.split()))] == expected.split()


def a_figure(
    path: Path,
    scale: float = 100.0,
    arm: tuple[float, float, float] = (1.0, 0.0, 0.0),
    axes: NDArray[np.float64] | None = None,
    root: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Motion:
    """Read a BVH of one frame of a figure with Mixamo's names, its left arm resting along `arm`."""
    axes = np.eye(3) if axes is None else axes
    offsets: dict[str, tuple[str, NDArray[np.float64]]] = {
        "Spine": ("Hips", np.array([0, 0.1, 0])), "Head": ("Spine", np.array([0, 0.45, 0])),
        "LeftArm": ("Spine", np.array([0.14, 0.3, 0])), "LeftForeArm": ("LeftArm", 0.25 * np.array(arm)),
        "LeftHand": ("LeftForeArm", 0.23 * np.array(arm)), "RightArm": ("Spine", np.array([-0.14, 0.3, 0])),
    }  # fmt: skip
    for side, x in (("Left", 0.09), ("Right", -0.09)):
        offsets |= {
            side + "UpLeg": ("Hips", np.array([x, -0.05, 0])),
            side + "Leg": (side + "UpLeg", np.array([0, -0.4, 0])),
            side + "Foot": (side + "Leg", np.array([0, -0.4, 0])),
        }
    numbers: list[float] = []

    def lines(name: str, at: NDArray[np.float64], depth: int) -> list[str]:
        at = axes @ at * scale
        found = ["JOINT " + name if depth else "ROOT " + name, "{", f"OFFSET {at[0]} {at[1]} {at[2]}"]
        if depth:
            found.append("CHANNELS 3 Zrotation Yrotation Xrotation")
            numbers.extend((0.0, 0.0, 0.0))
        else:
            found.append("CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation")
            numbers.extend((0.0, 0.95 * scale, 0.0, *root))
        below = [child for child, (parent, _) in offsets.items() if parent == name]
        for child in below:
            found += lines(child, offsets[child][1], depth + 1)
        return [*found, "}"] if below else [*found, "End Site", "{", "OFFSET 0 0 0", "}", "}"]

    hierarchy = lines("Hips", np.zeros(3), 0)
    frame = " ".join(str(number) for number in numbers)
    path.write_text(
        "\n".join(["HIERARCHY", *hierarchy, "MOTION", "Frames: 1", "Frame Time: 0.03", frame, ""])
    )
    imported = bvh.read(path)
    assert imported.motion is not None
    assert set(imported.motion.bone_names) == set(BODY)
    path.with_suffix(".notes").write_text("\n".join(imported.notes))
    return imported.motion


def at(motion: Motion, bone: str) -> NDArray[np.floating]:
    """Where a bone stands against the hips, in Unity's axes."""
    world = world_of(motion)[0][0]
    place: NDArray[np.floating] = (
        world[motion.bone_names.index(bone)] - world[motion.bone_names.index("Hips")]
    )
    return place


@pytest.mark.parametrize(
    ("scale", "said"),
    [(100.0, ""), (1.0, "metres"), (1 / 0.0254, "inches"), (17.7, "CMU"), (900.0, "millimetres")],
)
def test_any_unit_becomes_metres(tmp_path: Path, scale: float, said: str) -> None:
    motion = a_figure(tmp_path / "x.bvh", scale)
    height = at(motion, "Head")[1] - at(motion, "LeftFoot")[1]
    assert height == pytest.approx(1.4, rel=0.11)
    assert (f"x.bvh: read in {said}" in (tmp_path / "x.notes").read_text()) == bool(said)


def test_arms_that_rest_lowered_still_hang_lowered_and_a_t_pose_is_no_turn(tmp_path: Path) -> None:
    lowered = a_figure(tmp_path / "a.bvh", arm=(np.cos(0.7), -np.sin(0.7), 0.0))
    elbow = at(lowered, "LeftLowerArm") - at(lowered, "LeftUpperArm")
    np.testing.assert_allclose(elbow, 0.25 * np.array([-np.cos(0.7), -np.sin(0.7), 0.0]), atol=1e-6)
    # The bone itself says so: on a rig in T-pose the same rotation lowers the arm.
    turned = lowered.rotations[0, lowered.bone_names.index("LeftUpperArm")]
    np.testing.assert_allclose(turned, [0, 0, np.sin(0.35), np.cos(0.35)], atol=1e-6)
    assert "a.bvh: its rest pose was taken for a T-pose." in (tmp_path / "a.notes").read_text()
    level = a_figure(tmp_path / "t.bvh")
    np.testing.assert_allclose(level.rotations[0], np.tile([0, 0, 0, 1], (len(BODY), 1)), atol=1e-6)


@pytest.mark.parametrize(
    ("axes", "root"),
    [
        (np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]]), (0.0, 0.0, 0.0)),  # looks along +X
        (np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]), (0.0, 0.0, 0.0)),  # Z is up
        (np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]), (0.0, 0.0, -90.0)),  # Z is up, stood up by the root
    ],
    ids=["sideways", "z_up", "z_up_stood_up"],
)
def test_a_figure_of_other_axes_stands_and_looks_ahead(
    tmp_path: Path, axes: NDArray[np.float64], root: tuple[float, float, float]
) -> None:
    motion = a_figure(tmp_path / "x.bvh", axes=axes, root=root)
    np.testing.assert_allclose(at(motion, "Head"), [0.0, 0.55, 0.0], atol=1e-6)
    np.testing.assert_allclose(at(motion, "LeftUpperLeg"), [-0.09, -0.05, 0.0], atol=1e-6)
    np.testing.assert_allclose(at(motion, "LeftLowerArm"), [-0.39, 0.4, 0.0], atol=1e-6)


def test_it_is_said_which_joint_was_taken_for_which_bone(tmp_path: Path) -> None:
    a_figure(tmp_path / "x.bvh")
    said = (tmp_path / "x.notes").read_text()
    assert "x.bvh: joints were taken for bones by name: " in said
    assert "LeftArm as LeftUpperArm" in said


def test_a_small_avatar_of_our_own_stays_small(tmp_path: Path) -> None:
    rest = Skeleton.humanoid(BODY).rest_positions * 0.3
    motion = Motion.build([0.0, 0.1], (), None, BODY, np.tile(rest, (2, 1, 1)))
    (file,) = bvh.write(tmp_path / "x.bvh", motion)
    back = bvh.read(file).motion
    assert back is not None
    np.testing.assert_allclose(at(back, "Head"), at(motion, "Head"), atol=1e-4)
