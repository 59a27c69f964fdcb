"""The stage without a window: what the MP4 export draws with."""

from __future__ import annotations

import numpy as np
import pytest

from studio.motion import Motion, Skeleton, rotation
from studio.render.camera import Orbit
from studio.render.palette import LIGHT
from studio.render.scene import BODY, GHOST, RenderScene
from studio.render.world_pose import WorldPose
from tests.world import world_of


@pytest.fixture(scope="module")
def scene():
    with RenderScene() as made:
        yield made


def picture(scene: RenderScene, size: tuple[int, int] = (320, 240)) -> np.ndarray:
    return np.array(scene.render(Orbit.preset("front"), *size))


def bright(pixels: np.ndarray) -> np.ndarray:
    return pixels[:, :, :3].mean(axis=2) > 90


def test_a_picture_has_the_size_asked_for_and_its_head_at_the_top(scene: RenderScene) -> None:
    scene.place(BODY, WorldPose.at_rest(Skeleton.humanoid()))
    pixels = picture(scene, (322, 242))
    assert pixels.shape == (242, 322, 4)
    rows = np.flatnonzero(bright(pixels).any(axis=1))
    widths = bright(pixels).sum(axis=1)
    assert rows[0] > 0
    assert widths[:121].max() > 150 > widths[121:].max()  # the arms are in the upper half


def test_a_ghost_comes_and_goes(scene: RenderScene) -> None:
    at_rest = WorldPose.at_rest(Skeleton.humanoid())
    scene.place(BODY, at_rest)
    alone = picture(scene)
    scene.place(GHOST, WorldPose(at_rest.skeleton, at_rest.joints + np.array([0.3, 0.0, 0.0])))
    assert (picture(scene) != alone).any()
    scene.hide(GHOST)
    assert (picture(scene) == alone).all()


def test_other_colours_keep_the_figure(scene: RenderScene) -> None:
    scene.place(BODY, WorldPose.at_rest(Skeleton.humanoid()))
    dark = picture(scene)
    scene.set_palette(LIGHT)
    scene.place(BODY, WorldPose.at_rest(Skeleton.humanoid()))
    assert picture(scene)[0, 0, :3].mean() > dark[0, 0, :3].mean() + 100


def test_a_stance_is_the_motion_in_the_world() -> None:
    turn = rotation.from_euler_yxz(np.radians(90.0), 0.0, 0.0)
    motion = Motion.build(
        [0.0, 1.0], ("A",), [[0.0], [1.0]], ("Hips", "Head"), None, None,
        np.tile([1.0, 0.0, 0.0], (2, 1)), np.tile(turn, (2, 1)),
    )  # fmt: skip
    stance = WorldPose.of(motion, 0.5)
    positions, rotations = world_of(motion)
    np.testing.assert_allclose(stance.joints, positions[0], atol=1e-6)
    assert stance.turns is not None
    assert rotation.angle_between(stance.turns, rotations[0]).max() < 1e-5
    assert stance.shapes == {"A": pytest.approx(0.5)}
    assert stance.usable


def test_a_stance_without_bones_or_with_nan_is_not_usable() -> None:
    assert not WorldPose.of(Motion.build([0.0], ("A",), [[1.0]]), 0.0).usable
    skeleton = Skeleton.humanoid()
    assert not WorldPose(skeleton, np.full((len(skeleton.bone_names), 3), np.nan)).usable
