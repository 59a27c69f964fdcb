"""Springs and constraints of VRM 0 and 1 files, as they are read and as they move a surface."""

from __future__ import annotations

import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from studio import formats
from studio.motion.avatar import Avatar
from studio.motion.springs import STEP, Springs
from tests.formats.avatars import BONES, Maker
from tests.formats.test_vrma import document_of, with_document

Document = dict[str, Any]
HEAD = BONES.index("Head") + 1
NAN = float("nan")


def with_hair(document: Document, joints: int = 3) -> list[int]:
    """Add nodes behind the head, each 0.1 m below the last; the last one carries a second face."""
    nodes, first = document["nodes"], len(document["nodes"])
    # Rotated nodes, as VRM 1 may have them: hair of its own axes.
    at = [0.0, 0.1, 0.0], *([[0.0, -0.1, 0.0]] * (joints - 1))
    for i, offset in enumerate(at):
        nodes.append({"name": f"Hair {i}", "translation": offset, "children": [first + i + 1]})
    nodes[-1]["children"] = []
    nodes[-1]["mesh"] = 1
    nodes[HEAD].setdefault("children", []).append(first)
    return [*range(first, first + joints)]


def an_avatar(tmp_path: Path, version: int, change: Callable[[Document, list[int]], None]) -> Avatar:
    file = Maker(version, turned=False).write(tmp_path / "x.vrm")
    document = document_of(file)
    change(document, with_hair(document))
    with_document(file, document)
    return formats.read_avatar(file)


def spring_of_vrm0(document: Document, hair: list[int], **values: Any) -> None:
    group: Document = {"stiffiness": 0.0, "gravityPower": 1.0, "gravityDir": {"x": 0.5, "y": -1, "z": 0.25},
             "dragForce": 0.4, "center": -1, "hitRadius": 0.02, "bones": hair[:1], "colliderGroups": [0],
    }  # fmt: skip
    touched = {"node": HEAD, "colliders": [{"offset": {"x": 0.0, "y": 0.1, "z": 0.05}, "radius": 0.08}]}
    document["extensions"]["VRM"]["secondaryAnimation"] = {
        "boneGroups": [group | values], "colliderGroups": [touched]
    }  # fmt: skip


def spring_of_vrm1(document: Document, hair: list[int], **values: Any) -> None:
    joint = {
        "stiffness": 0.0,
        "gravityPower": 1.0,
        "gravityDir": [1, 0, 0],
        "dragForce": 0.3,
        "hitRadius": 0.01,
    }
    document["extensions"]["VRMC_springBone"] = {
        "specVersion": "1.0",
        "colliders": [
            {"node": HEAD, "shape": {"sphere": {"offset": [0, 0.1, 0], "radius": 0.05}}},
            {"node": HEAD, "shape": {"capsule": {"offset": [0, 0, 0], "tail": [0, -0.1, 0], "radius": 0.04}}},
            {"node": -1, "shape": {"sphere": {"radius": 1.0}}},
        ],
        "colliderGroups": [{"colliders": [0, 1, 2]}],
        "springs": [{"joints": [joint | values | {"node": node} for node in hair], "colliderGroups": [0],
                     "center": HEAD}],
    }  # fmt: skip


def test_springs_of_vrm0_are_all_nodes_below_those_it_names(tmp_path: Path) -> None:
    avatar = an_avatar(tmp_path, 0, spring_of_vrm0)
    rig = avatar.rig
    assert rig is not None
    assert not avatar.notes
    assert len(rig.joints) == 3
    first, leaf = rig.joints[0], rig.joints[2]
    # Unity's axes turned into a picture's: x over.
    assert first.gravity == (-0.5, -1.0, 0.25)
    assert (first.stiffness, first.drag, first.radius, first.center) == (0.0, 0.4, 0.02, -1)
    np.testing.assert_allclose(first.tail - rig.at[first.node], [0.0, -0.1, 0.0], atol=1e-6)
    # The last one is 7 cm long whatever it carries.
    np.testing.assert_allclose(leaf.tail - rig.at[leaf.node], [0.0, -0.07, 0.0], atol=1e-6)
    head = avatar.rest_joints[avatar.skeleton.bone_names.index("Head")] * [-1, 1, 1]
    ball = rig.colliders[first.colliders[0]]
    np.testing.assert_allclose(ball.start - head, [0.0, 0.1, 0.05], atol=1e-6)


def test_springs_of_vrm1_reach_from_joint_to_joint(tmp_path: Path) -> None:
    avatar = an_avatar(tmp_path, 1, spring_of_vrm1)
    rig = avatar.rig
    assert rig is not None
    assert not avatar.notes
    assert len(rig.joints) == 2
    assert len(rig.colliders) == 2
    assert rig.joints[0].gravity == (1.0, 0.0, 0.0)
    assert rig.joints[0].center == avatar.skeleton.bone_names.index("Head")
    np.testing.assert_allclose(rig.colliders[1].end - rig.colliders[1].start, [0, -0.1, 0], atol=1e-6)


@pytest.mark.parametrize(("version", "spring"), [(0, spring_of_vrm0), (1, spring_of_vrm1)])
def test_a_surface_on_hair_swings(tmp_path: Path, version: int, spring: Any) -> None:
    pull = {"gravityDir": {"x": -1, "y": 0, "z": 0}} if version == 0 else {}
    avatar = an_avatar(tmp_path, version, lambda document, hair: spring(document, hair, **pull))
    rest = avatar.placements(avatar.rest_joints, avatar.skeleton.rest_rotations)
    assert avatar.rig is not None
    springs = Springs(avatar.rig)
    for step in range(120):
        moved = springs.moved(rest, step * STEP)
    # Pulled along +x with all its length: its end hung 0.2 m below its root, and lies 0.2 m to the side.
    owner = int(avatar.surfaces[2].owners[0])
    end = avatar.rig.at[avatar.rig.joints[0].node] - [0.0, 0.2, 0.0]
    np.testing.assert_allclose(moved[owner] @ np.append(end, 1.0) - end, [0.2, 0.2, 0.0], atol=0.02)
    none = np.zeros(12, np.float32)
    before, after = (avatar.skins[2].pose(placements, none)[0] for placements in (rest, moved))
    swung = before @ moved[owner][:, :3].T + moved[owner][:, 3]
    np.testing.assert_allclose(after, swung, atol=1e-5)
    still, body = (avatar.skins[0].pose(placements, none[:0])[0] for placements in (rest, moved))
    np.testing.assert_allclose(still, body, atol=1e-6)


def test_a_twist_bone_rolls_with_the_hand(tmp_path: Path) -> None:
    hand = BONES.index("LeftHand") + 1
    arm = BONES.index("LeftLowerArm") + 1

    def constrain(document: Document, hair: list[int]) -> None:
        roll = {"roll": {"source": hand, "rollAxis": "X", "weight": 0.5}}
        extension = {"specVersion": "1.0", "constraint": roll}
        document["nodes"].append({"name": "Twist", "extensions": {"VRMC_node_constraint": extension}})
        document["nodes"][arm]["children"].append(len(document["nodes"]) - 1)

    avatar = an_avatar(tmp_path, 1, constrain)
    assert avatar.rig is not None
    (one,) = avatar.rig.constraints
    assert avatar.skeleton.bone_names[one.parent] == "LeftLowerArm"
    turns = avatar.skeleton.rest_rotations.copy()
    turns[avatar.skeleton.bone_names.index("LeftHand")] = [np.sin(0.4), 0.0, 0.0, np.cos(0.4)]
    made = avatar.placements(avatar.rest_joints, turns)[one.node]
    # 0.8 rad of the hand, half of it.
    assert float(np.arccos(made[1, 1])) == pytest.approx(0.4, abs=1e-6)


BROKEN = "Some of what should swing or turn by itself is damaged and stays still."


@pytest.mark.parametrize("values", [
    {"stiffness": NAN}, {"gravityPower": "much"}, {"gravityDir": [0, NAN, 0]}, {"hitRadius": float("inf")},
    {"node": 10**6}, {"dragForce": None},
])  # fmt: skip
def test_a_damaged_spring_stays_still_and_is_told(tmp_path: Path, values: Document) -> None:
    def spring(document: Document, hair: list[int]) -> None:
        spring_of_vrm1(document, hair)
        document["extensions"]["VRMC_springBone"]["springs"][0]["joints"][0].update(values)

    avatar = an_avatar(tmp_path, 1, spring)
    assert avatar.notes == (BROKEN,)
    assert avatar.rig is not None
    assert len(avatar.rig.joints) == 1


@pytest.mark.parametrize("constraint", [
    {"roll": {"source": 10**6, "rollAxis": "X"}}, {"roll": {"source": 1, "rollAxis": "W"}},
    {"aim": {"source": 1, "aimAxis": ""}}, {"rotation": {"source": 1, "weight": NAN}}, {},
])  # fmt: skip
def test_a_damaged_constraint_stays_still_and_is_told(tmp_path: Path, constraint: Document) -> None:
    def constrain(document: Document, hair: list[int]) -> None:
        extension = {"specVersion": "1.0", "constraint": constraint}
        document["nodes"][hair[0]]["extensions"] = {"VRMC_node_constraint": extension}

    avatar = an_avatar(tmp_path, 1, constrain)
    assert avatar.notes == (BROKEN,)
    assert avatar.rig is not None
    assert not avatar.rig.constraints


def test_more_springs_than_a_computer_moves_stay_still(tmp_path: Path) -> None:
    def grow(document: Document, hair: list[int]) -> None:
        nodes = document["nodes"]
        for _ in range(5000):
            nodes.append({"translation": [0.0, -0.01, 0.0]})
            nodes[hair[0]]["children"].append(len(nodes) - 1)
        spring_of_vrm0(document, hair)

    avatar = an_avatar(tmp_path, 0, grow)
    assert avatar.notes == (
        "Its hair and clothes stay still: they have more springs than the studio can move.",
    )
    assert avatar.rig is not None
    assert not avatar.rig.joints
    assert len(avatar.rig.parents) == len(BONES)


def test_what_an_avatar_wears_goes_into_a_glb_with_the_bone_it_hangs_from(tmp_path: Path) -> None:
    avatar = an_avatar(tmp_path, 0, spring_of_vrm0)
    owners = avatar.bone_owners(avatar.surfaces[2])
    assert [avatar.skeleton.bone_names[owner] for owner in owners] == ["Head"]


def leaves(value: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Where each value of a document lies."""
    inside = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [path, *(place for key, one in inside for place in leaves(one, (*path, key)))]


NONSENSE = (None, -1, 2.5, 1e308, NAN, float("inf"), "x", [], {}, True, [1], {"x": "a"}, 10**12)


@pytest.mark.parametrize(("version", "spring"), [(0, spring_of_vrm0), (1, spring_of_vrm1)])
def test_random_nonsense_never_gets_further_than_a_still_part(
    tmp_path: Path, version: int, spring: Any
) -> None:
    rng = random.Random(version)

    def damage(document: Document, hair: list[int]) -> None:
        spring(document, hair)
        extensions = document["extensions"]
        table = extensions["VRM"] if version == 0 else extensions
        name = "secondaryAnimation" if version == 0 else "VRMC_springBone"
        place = rng.choice(leaves(table[name], (name,)))
        for key in place[:-1]:
            table = table[key]
        table[place[-1]] = rng.choice(NONSENSE)

    for _ in range(40):
        avatar = an_avatar(tmp_path, version, damage)
        assert avatar.rig is not None
        made = Springs(avatar.rig).moved(
            avatar.placements(avatar.rest_joints, avatar.skeleton.rest_rotations), 0.0
        )
        assert np.isfinite(made).all()
