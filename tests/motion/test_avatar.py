"""An avatar wears a motion: its own proportions, bones that are missing on either side, and its face."""

from __future__ import annotations

import numpy as np
import pytest

from studio.motion import Skeleton, rotation
from studio.motion.avatar import Avatar, Morph, Skin, Surface
from studio.motion.expression import Expression, key


def an_avatar(names: tuple[str, ...], size: float = 1.0, **more: object) -> Avatar:
    rest = Skeleton.humanoid(names)
    sized = Skeleton(names, rest.parents, rest.rest_positions * size, rest.rest_rotations)
    return Avatar("Mia", sized, **more)  # type: ignore[arg-type]


def turned(source: Skeleton, bone: str, degrees: float) -> tuple[np.ndarray, np.ndarray]:
    turns = source.rest_rotations.copy()
    turns[source.bone_names.index(bone)] = rotation.from_euler_yxz(np.radians(degrees), 0.0, 0.0)
    return source.forward(source.rest_positions, turns)


def test_it_stands_on_the_ground_at_its_own_size() -> None:
    avatar, source = an_avatar(("Hips", "Spine", "Head"), 0.5), Skeleton.humanoid()
    joints, _ = avatar.retargeted(source, *source.forward(source.rest_positions, source.rest_rotations))
    np.testing.assert_allclose(joints, avatar.rest_joints, atol=1e-9)


def test_a_bone_the_avatar_lacks_is_in_its_childrens_turns() -> None:
    avatar, source = an_avatar(("Hips", "Spine", "Head")), Skeleton.humanoid()
    _, turns = avatar.retargeted(source, *turned(source, "Neck", 30.0))
    degrees = np.degrees(rotation.angle_between(turns, np.tile(rotation.IDENTITY, (3, 1))))
    np.testing.assert_allclose(degrees, [0.0, 0.0, 30.0], atol=1e-6)


def test_a_bone_the_source_lacks_follows_its_parent() -> None:
    avatar, source = an_avatar(("Hips", "Spine", "Chest", "Head")), Skeleton.humanoid(("Hips", "Spine"))
    _, turns = avatar.retargeted(source, *turned(source, "Spine", 30.0))
    degrees = np.degrees(rotation.angle_between(turns, np.tile(rotation.IDENTITY, (4, 1))))
    np.testing.assert_allclose(degrees, [0.0, 30.0, 30.0, 30.0], atol=1e-6)


def test_arms_that_nobody_tracks_hang_and_others_do_as_they_are_told() -> None:
    bones = ("Hips", "Spine", "Head", "LeftUpperArm", "LeftLowerArm", "RightUpperArm", "RightLowerArm")
    avatar = an_avatar(bones)
    face, arm = Skeleton.humanoid(("Head",)), Skeleton.humanoid(("Head", "LeftLowerArm"))
    places, _ = avatar.retargeted(face, *turned(face, "Head", 10.0))
    rest = avatar.rest_joints
    for upper, lower in ((3, 4), (5, 6)):
        down = places[lower] - places[upper]
        assert down[1] < -0.9 * np.linalg.norm(rest[lower] - rest[upper])
    places, _ = avatar.retargeted(arm, *turned(arm, "Head", 10.0))
    np.testing.assert_allclose(places[4] - places[3], rest[4] - rest[3], atol=1e-6)


def test_hips_move_as_far_as_their_height_asks_for() -> None:
    avatar, source = an_avatar(("Hips", "Spine", "Head"), 0.5), Skeleton.humanoid()
    positions = source.rest_positions.copy()
    positions[source.bone_names.index("Hips")] += [0.2, -0.1, 0.4]
    joints, _ = avatar.retargeted(source, *source.forward(positions, source.rest_rotations))
    np.testing.assert_allclose(joints[0] - avatar.rest_joints[0], [0.1, -0.05, 0.2], atol=1e-9)


def test_somebody_who_sat_all_the_time_is_no_giant() -> None:
    sitting = Skeleton.humanoid()
    offsets = sitting.rest_positions.copy()
    offsets[sitting.bone_names.index("Hips"), 1] = 0.45
    sitting = Skeleton(sitting.bone_names, sitting.parents, offsets, sitting.rest_rotations)
    avatar = an_avatar(("Hips", "Spine", "Head"))
    assert avatar.scale_from(sitting) == pytest.approx(1.0, abs=0.05)


def test_many_frames_at_once_are_the_same_as_one_by_one() -> None:
    avatar, source = an_avatar(("Hips", "Spine", "Neck", "Head"), 0.8), Skeleton.humanoid()
    poses = [turned(source, "Neck", degrees) for degrees in (0.0, 20.0, 70.0)]
    joints, turns = avatar.retargeted(
        source, np.stack([p for p, _ in poses]), np.stack([q for _, q in poses])
    )
    for t, pose in enumerate(poses):
        one = avatar.retargeted(source, *pose)
        np.testing.assert_allclose(joints[t], one[0], atol=1e-9)
        np.testing.assert_allclose(turns[t], one[1], atol=1e-9)


def a_surface(morphs: int = 0, binds: np.ndarray | None = None) -> Surface:
    """Two vertices, one on each of the first two bones."""
    binds = np.tile(np.eye(4)[:3], (2, 1, 1)) if binds is None else binds
    moved, second = np.array([[0.0, 0.1, 0.0]], np.float32), np.array([1], np.int32)
    return Surface(
        "S", np.array([[0, 1, 0], [0, 1.2, 0]], np.float32), np.array([[0, 0, 1]] * 2, np.float32), None,
        np.array([[0, 1, 1]], np.int32), np.array([[0], [1]], np.int32), np.ones((2, 1), np.float32), binds,
        np.array([0, 1], np.int32), tuple(Morph(second, moved * (i + 1)) for i in range(morphs)),
    )  # fmt: skip


def test_a_surface_at_rest_is_where_its_file_has_it() -> None:
    avatar = an_avatar(("Hips", "Head"))
    skin = Skin(a_surface(), 2)
    placements = avatar.placements(avatar.rest_joints, avatar.skeleton.rest_rotations)
    np.testing.assert_allclose(
        skin.pose(placements, np.zeros(0, np.float32))[0], a_surface().vertices, atol=1e-6
    )


def test_binds_that_differ_are_each_their_own() -> None:
    binds = np.tile(np.eye(4)[:3], (2, 1, 1))
    binds[1, :, 3] = [0.5, 0.0, 0.0]
    avatar = an_avatar(("Hips", "Head"))
    placements = avatar.placements(avatar.rest_joints, avatar.skeleton.rest_rotations)
    vertices, _ = Skin(a_surface(binds=binds), 2).pose(placements, np.zeros(0, np.float32))
    np.testing.assert_allclose(vertices, [[0, 1, 0], [0.5, 1.2, 0]], atol=1e-6)


def test_a_face_moves_by_names_of_any_set() -> None:
    expressions = (Expression("joy", ((0, 0, 1.0),)), Expression("a", ((0, 1, 0.5),)))
    avatar = an_avatar(("Hips", "Head"), surfaces=(a_surface(2),), expressions=expressions)
    for name in ("Joy", "happy", "HAPPY", "joy"):
        np.testing.assert_allclose(avatar.morph_weights({name: 0.5})[0], [0.5, 0.0])
    np.testing.assert_allclose(avatar.morph_weights({"aa": 2.0, "unknown": 1.0})[0], [0.0, 0.5])
    vertices, _ = Skin(avatar.surfaces[0], 2).pose(
        avatar.placements(avatar.rest_joints, avatar.skeleton.rest_rotations),
        np.array([1.0, 0.5], np.float32),
    )
    np.testing.assert_allclose(vertices[:, 1], [1.0, 1.2 + 0.1 + 0.5 * 0.2], atol=1e-6)


@pytest.mark.parametrize(
    ("way", "happy", "mouth"),
    [("block", 0.2, 0.0), ("blend", 0.25, 0.75), ("blend", 1.0, 0.0), ("none", 1.0, 1.0)],
)
def test_an_expression_takes_the_place_of_the_mouth_as_vrm_says(way: str, happy: float, mouth: float) -> None:
    overrides = {"mouth": way} if way != "none" else {}
    expressions = (
        Expression("happy", ((0, 0, 1.0),), overrides=overrides),
        Expression("aa", ((0, 1, 1.0),)),
    )
    avatar = an_avatar(("Hips", "Head"), surfaces=(a_surface(2),), expressions=expressions)
    weights = avatar.morph_weights({"happy": happy, "aa": 1.0})[0]
    np.testing.assert_allclose(weights, [happy, mouth], atol=1e-6)


def test_an_expression_that_is_on_or_off_has_nothing_between() -> None:
    expressions = (Expression("joy", ((0, 0, 1.0),), binary=True),)
    avatar = an_avatar(("Hips", "Head"), surfaces=(a_surface(1),), expressions=expressions)
    assert [avatar.morph_weights({"Joy": w})[0][0] for w in (0.4, 0.6)] == [0.0, 1.0]


def test_both_sets_names_are_one() -> None:
    assert key("Blink_L") == key("blinkLeft") == key("BLINKLEFT")
    assert key("JawOpen") == "jawopen"
