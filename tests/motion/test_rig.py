"""Nodes that copy, roll with or aim at others, by the formulas of VRMC_node_constraint 1.0."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from studio.motion import rotation
from studio.motion.rig import Constraint, Rig, combined, inverted

RNG = np.random.default_rng(4)
TURNS = rotation.normalised(RNG.normal(size=(6, 4)))
"""How nodes rest in the world: parent and self of the source, of the node, and two spare."""
AT = np.array([[0.0, 1.0, 0.0], [0.3, 1.2, 0.1], [-0.2, 1.4, 0.3]])


def a_rig(kind: str, weight: float = 1.0, source: int = 1) -> Rig:
    """Bone 0, bone 1 below it as the source, and node 2 below bone 0 that is constrained."""
    axis = np.array([0.0, 0.0, 1.0] if kind == "roll" else [1.0, 0.0, 0.0])
    one = Constraint(
        kind, 2, 0, TURNS[2], TURNS[3], axis, source, 0, AT[1], TURNS[0], TURNS[1], weight
    )  # fmt: skip
    return Rig((-1, 0, 0), AT, 2, (one,))


def placed(turns: np.ndarray) -> np.ndarray:
    """Bones turned from rest (2, 4) about where they are, the second carried by the first."""
    made = np.tile(np.eye(4)[:3], (3, 1, 1))
    for bone in range(2):
        matrix = rotation.to_matrix(turns[bone])
        made[bone] = np.column_stack([matrix, AT[bone] - matrix @ AT[bone]])
    made[1] = combined(made[0], made[1])
    return made


def local_now(made: np.ndarray, node: int, parent: int, own: np.ndarray, above: np.ndarray) -> np.ndarray:
    """A node's rotation against its parent, as glTF has it."""
    turns = [rotation.from_matrix(made[i][:, :3]) for i in (parent, node)]
    world_above, world = rotation.multiply(turns[0], above), rotation.multiply(turns[1], own)
    return rotation.multiply(rotation.inverse(world_above), world)


def local_rest(own: np.ndarray, above: np.ndarray) -> np.ndarray:
    return rotation.multiply(rotation.inverse(above), own)


def product(*turns: np.ndarray) -> np.ndarray:
    made = rotation.IDENTITY
    for turn in turns:
        made = rotation.multiply(made, turn)
    return made


def arc(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return rotation.normalised(np.array([*np.cross(a, b), 1.0 + a @ b]))


BONES = np.array([rotation.from_euler_yxz(0.4, -0.3, 0.2), rotation.from_euler_yxz(-0.7, 0.5, 0.9)])


def same(a: np.ndarray, b: np.ndarray) -> None:
    assert float(rotation.angle_between(a, b)) == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("weight", [0.0, 0.4, 1.0])
def test_a_rotation_is_copied_as_the_source_turns_from_its_rest(weight: float) -> None:
    made = a_rig("rotation", weight).posed(placed(BONES))
    source, own = local_rest(TURNS[0], TURNS[1]), local_rest(TURNS[2], TURNS[3])
    change = product(rotation.inverse(source), local_now(made, 1, 0, TURNS[0], TURNS[1]))
    expected = rotation.slerp(own, product(own, change), weight)
    same(local_now(made, 2, 0, TURNS[2], TURNS[3]), expected)


@pytest.mark.parametrize("weight", [0.5, 1.0])
def test_a_roll_takes_the_turn_about_one_axis_alone(weight: float) -> None:
    made, axis = a_rig("roll", weight).posed(placed(BONES)), np.array([0.0, 0.0, 1.0])
    source, own = local_rest(TURNS[0], TURNS[1]), local_rest(TURNS[2], TURNS[3])
    change = product(rotation.inverse(source), local_now(made, 1, 0, TURNS[0], TURNS[1]))
    in_parent = product(source, change, rotation.inverse(source))
    in_own = product(rotation.inverse(own), in_parent, own)
    swing = arc(axis, rotation.rotate(in_own, axis))
    expected = rotation.slerp(own, product(own, rotation.inverse(swing), in_own), weight)
    now = local_now(made, 2, 0, TURNS[2], TURNS[3])
    same(now, expected)
    # About the axis alone: it stays where it is.
    turned = product(rotation.inverse(own), now)
    np.testing.assert_allclose(rotation.rotate(turned, axis), axis, atol=1e-6)


@pytest.mark.parametrize("weight", [0.5, 1.0])
def test_an_aim_points_at_the_source(weight: float) -> None:
    made, axis = a_rig("aim", weight).posed(placed(BONES)), np.array([1.0, 0.0, 0.0])
    own = local_rest(TURNS[2], TURNS[3])
    above = product(rotation.from_matrix(made[0][:, :3]), TURNS[3])
    towards = made[1] @ np.append(AT[1], 1.0) - made[2] @ np.append(AT[2], 1.0)
    turn = arc(rotation.rotate(product(above, own), axis), towards / np.linalg.norm(towards))
    expected = rotation.slerp(own, product(rotation.inverse(above), turn, above, own), weight)
    same(local_now(made, 2, 0, TURNS[2], TURNS[3]), expected)


def test_a_constrained_node_stays_where_it_hangs() -> None:
    made = a_rig("rotation").posed(placed(BONES))
    hangs = made[0] @ np.append(AT[2], 1.0)
    np.testing.assert_allclose(made[2] @ np.append(AT[2], 1.0), hangs, atol=1e-9)


def test_what_a_constraint_depends_on_is_worked_out_first() -> None:
    first = a_rig("rotation").constraints[0]
    second = replace(first, node=3, source=2, source_at=AT[2], source_turn=TURNS[2], source_above=TURNS[3])
    rig = Rig((-1, 0, 0, 0), np.vstack([AT, AT[2:]]), 2, (second, first))
    assert [one.node for one in rig.ordered_constraints] == [2, 3]
    made = rig.posed(placed(BONES))
    assert float(rotation.angle_between(*(rotation.from_matrix(made[i][:, :3]) for i in (0, 3)))) > 0.1


def test_constraints_in_a_circle_are_left_out() -> None:
    first = a_rig("rotation", source=3).constraints[0]
    second = replace(first, node=3, source=2)
    rig = Rig((-1, 0, 0, 0), np.vstack([AT, AT[2:]]), 2, (first, second))
    assert len(rig.ordered_constraints) == 1
    assert np.isfinite(rig.posed(placed(BONES))).all()
    alone = Rig((-1, 0, 0), AT, 2, (replace(first, source=2),))
    np.testing.assert_allclose(alone.posed(placed(BONES))[2], placed(BONES)[0], atol=1e-9)


def test_bones_below_a_constrained_bone_go_with_it() -> None:
    # Bone 1 copies bone 0, and bone 2 hangs from it.
    one = Constraint(
        "rotation", 1, 0, rotation.IDENTITY, rotation.IDENTITY, np.zeros(3), 0, -1, AT[0],
        rotation.IDENTITY, rotation.IDENTITY,
    )  # fmt: skip
    rig = Rig((-1, 0, 1), AT, 3, (one,))
    turn = rotation.to_matrix(BONES[0])
    body = np.column_stack([turn, AT[0] - turn @ AT[0]])
    made = rig.posed(np.stack([body, body, body, np.eye(4)[:3]]))
    np.testing.assert_allclose(made[1][:, :3], turn @ turn, atol=1e-9)
    np.testing.assert_allclose(made[2], made[1], atol=1e-9)


def test_a_placement_has_a_way_back() -> None:
    one = placed(BONES)[1]
    np.testing.assert_allclose(combined(inverted(one), one), np.eye(4)[:3], atol=1e-12)
