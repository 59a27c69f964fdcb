"""Eyes follow a gaze: by bones or by expressions, from bones, ARKit's shapes or VRM's own."""

from __future__ import annotations

import numpy as np
import pytest

from studio.motion import Skeleton, rotation
from studio.motion.avatar import MIRROR_TURN, Avatar
from studio.motion.expression import Expression
from studio.motion.look_at import WIDEST, LookAt, gaze_between, gaze_of, mapped, turned_by
from studio.render.world_pose import WorldPose

NAMES = ("Hips", "Neck", "Head", "LeftEye", "RightEye")
MAPS = {"inner": (90.0, 8.0), "outer": (90.0, 12.0), "down": (90.0, 10.0), "up": (90.0, 14.0)}


def an_avatar(look_at: LookAt, names: tuple[str, ...] = NAMES, **more: object) -> Avatar:
    return Avatar("Mia", Skeleton.humanoid(names), look_at=look_at, **more)  # type: ignore[arg-type]


def looked(avatar: Avatar, shapes: dict[str, float], source: Skeleton | None = None) -> WorldPose:
    rest = WorldPose.at_rest(source or Skeleton.humanoid(("Hips", "Neck", "Head")))
    return WorldPose(rest.skeleton, rest.joints, rest.turns, shapes).retargeted_to(avatar)


def eye_of(pose: WorldPose, side: str) -> tuple[float, float]:
    assert pose.turns is not None
    head, eye = (pose.turns[pose.skeleton.bone_names.index(name)] for name in ("Head", f"{side}Eye"))
    return gaze_between(head * MIRROR_TURN, eye * MIRROR_TURN)


def test_a_range_ends_at_its_largest_angle() -> None:
    assert [mapped((90.0, 10.0), angle) for angle in (-5.0, 0.0, 45.0, 90.0, 300.0)] == [0, 0, 5, 10, 10]
    assert mapped((0.0, 10.0), 20.0) == 0.0


@pytest.mark.parametrize(("yaw", "pitch"), [(20.0, 0.0), (0.0, -15.0), (-30.0, 25.0)])
def test_a_gaze_is_what_a_turn_was_made_of(yaw: float, pitch: float) -> None:
    head = rotation.from_euler_yxz(0.7, -0.2, 0.3)
    eye = rotation.multiply(head, turned_by(yaw, pitch))
    assert gaze_between(head, eye) == pytest.approx((yaw, pitch), abs=1e-9)


def test_arkits_shapes_look_to_both_sides() -> None:
    left = {"eyelookoutleft": 1.0, "eyelookinright": 1.0, "eyelookdownleft": 0.5, "eyelookupright": 1.0}
    assert gaze_of(left, "left") == (WIDEST[0], 0.5 * WIDEST[1])
    assert gaze_of(left, "right") == (WIDEST[0], -WIDEST[1])


def test_shapes_turn_eye_bones_by_the_avatars_own_ranges() -> None:
    avatar = an_avatar(LookAt(True, **MAPS))
    pose = looked(avatar, {"EyeLookOutLeft": 1.0, "EyeLookInRight": 1.0, "EyeLookUpLeft": 1.0})
    left, right = eye_of(pose, "Left"), eye_of(pose, "Right")
    assert left == pytest.approx((12.0 * WIDEST[0] / 90.0, -14.0 * WIDEST[1] / 90.0), abs=1e-6)
    # To the left the right eye looks to the nose.
    assert right == pytest.approx((8.0 * WIDEST[0] / 90.0, 0.0), abs=1e-6)


@pytest.mark.parametrize("name", ["LookLeft", "lookLeft"])
def test_vrms_own_shapes_turn_eye_bones_as_far_as_they_go(name: str) -> None:
    avatar = an_avatar(LookAt(True, **MAPS), expressions=(Expression("lookleft", ()),))
    pose = looked(avatar, {name: 1.0})
    assert (eye_of(pose, "Left")[0], eye_of(pose, "Right")[0]) == pytest.approx((12.0, 8.0), abs=1e-6)


def test_shapes_that_the_avatar_shows_itself_turn_no_bones() -> None:
    own = (Expression("EyeLookOutLeft", ((0, 0, 1.0),)), Expression("lookup", ((0, 0, 1.0),)))
    avatar = an_avatar(LookAt(), expressions=own)
    pose = looked(avatar, {"EyeLookOutLeft": 1.0, "LookUp": 1.0})
    assert eye_of(pose, "Left") == pytest.approx((0.0, 0.0), abs=1e-9)


def a_source_looking(yaw: float, pitch: float) -> WorldPose:
    source = Skeleton.humanoid()
    turns = source.rest_rotations.copy()
    for side in ("Left", "Right"):
        turns[source.bone_names.index(f"{side}Eye")] = turned_by(yaw, pitch) * MIRROR_TURN
    return WorldPose(source, *source.forward(source.rest_positions, turns), {"EyeLookUpLeft": 1.0})


def test_eye_bones_that_move_are_followed_as_they_are() -> None:
    pose = a_source_looking(7.0, 3.0).retargeted_to(an_avatar(LookAt(True, **MAPS)))
    assert eye_of(pose, "Left") == pytest.approx((7.0, 3.0), abs=1e-6)


@pytest.mark.parametrize(("yaw", "pitch", "name", "weight"), [
    (45.0, 0.0, "LookLeft", 0.5), (-45.0, 0.0, "LookRight", 0.5), (0.0, 30.0, "LookDown", 0.5),
    (0.0, -60.0, "LookUp", 1.0),
])  # fmt: skip
def test_an_avatar_that_looks_by_expressions_follows_eye_bones(
    yaw: float, pitch: float, name: str, weight: float
) -> None:
    maps = {"inner": (90.0, 1.0), "outer": (90.0, 1.0), "down": (60.0, 1.0), "up": (60.0, 1.0)}
    pose = a_source_looking(yaw, pitch).retargeted_to(an_avatar(LookAt(False, **maps), ("Hips", "Head")))
    found = {key: value for key, value in pose.shapes.items() if key.startswith("Look") and value > 1e-6}
    assert found == {name: pytest.approx(weight, abs=1e-6)}


def test_an_avatar_that_looks_by_expressions_follows_arkits_shapes() -> None:
    pose = looked(an_avatar(LookAt(False, outer=(45.0, 1.0))), {"EyeLookOutLeft": 1.0, "EyeLookInRight": 1.0})
    assert pose.shapes["LookLeft"] == pytest.approx(1.0)
    # Somebody who sends VRM's own shapes has done so.
    own = looked(an_avatar(LookAt(False)), {"LookLeft": 0.2, "EyeLookInLeft": 1.0})
    assert dict(own.shapes) == {"LookLeft": 0.2, "EyeLookInLeft": 1.0}


def test_an_expression_that_takes_the_gazes_place_straightens_the_eyes() -> None:
    sleepy = Expression("relaxed", ((0, 0, 1.0),), overrides={"lookAt": "blend"})
    avatar = an_avatar(LookAt(True, **MAPS), expressions=(sleepy,))
    whole = eye_of(a_source_looking(8.0, 0.0).retargeted_to(avatar), "Left")[0]
    pose = a_source_looking(8.0, 0.0)
    half = WorldPose(pose.skeleton, pose.joints, pose.turns, {"relaxed": 0.5}).retargeted_to(avatar)
    assert (whole, eye_of(half, "Left")[0]) == pytest.approx((8.0, 4.0), abs=1e-6)


def test_nothing_is_asked_of_eyes_that_look_ahead() -> None:
    avatar = an_avatar(LookAt())
    turns = np.array(avatar.skeleton.rest_rotations)
    assert avatar.looking(turns, {"A": 1.0}, {"left": (0.0, 0.01)})[0] is turns
