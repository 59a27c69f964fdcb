"""The stage without a window: what the MP4 export draws with."""

from __future__ import annotations

import numpy as np
import pytest

from studio.motion import Motion, Skeleton, rotation
from studio.render.background import composed
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


VIEWS = (Orbit.preset("front"), Orbit.preset("three_quarter", 0.5), Orbit(0.0, 2.0, 0.25))


def standing(x: float = 0.0) -> WorldPose:
    at_rest = WorldPose.rest_pose(Skeleton.humanoid())
    return WorldPose(at_rest.skeleton, at_rest.joints + np.array([x, 0.0, 0.0]))


@pytest.mark.parametrize("orbit", VIEWS)
def test_the_performers_part_over_the_empty_room_is_the_whole_picture(
    scene: RenderScene, orbit: Orbit
) -> None:
    scene.place(BODY, standing())
    scene.place(GHOST, standing(0.3))
    whole = np.array(scene.render(orbit, 320, 240))
    whole[..., 3] = 255
    room = np.array(scene.room(orbit, 320, 240))
    room[..., 3] = 255
    layer = scene.figure(orbit, 320, 240, shadow=True)
    if orbit.zoom == 1.0:
        assert layer.pixels.shape[1] < 200
    apart = np.abs(composed(room, layer).astype(int) - whole).max(axis=-1)
    # An edge may fall to the other side of a pixel, and what is see-through is rounded twice.
    assert (apart > 8).sum() <= 30
    scene.hide(GHOST)


@pytest.mark.parametrize(("finer", "size"), [(1.5, (320, 240)), (1.5, (321, 241)), (2.0, (320, 240))])
def test_nothing_is_behind_a_figure_and_its_edges_are_smooth(
    scene: RenderScene, finer: float, size: tuple[int, int]
) -> None:
    scene.place(BODY, standing())
    layer, plain = scene.figure(VIEWS[0], *size, finer), scene.figure(VIEWS[0], *size)
    places = [
        np.argwhere(one.pixels[..., 3] > 127).mean(axis=0) + np.array([one.y, one.x])
        for one in (layer, plain)
    ]
    assert np.abs(places[0] - places[1]).max() < 0.5, "in the same place"
    alpha = layer.pixels[..., 3]
    assert alpha[[0, 0, -1, -1], [0, -1, 0, -1]].max() == 0
    assert (alpha == 255).sum() > 1000
    assert ((alpha > 0) & (alpha < 255)).sum() > 100
    assert (layer.pixels[alpha == 0] == 0).all()


def test_a_close_camera_goes_with_a_head_that_leaves_and_not_with_one_that_nods(scene: RenderScene) -> None:
    close, far = VIEWS[2], VIEWS[0]
    scene.place(BODY, standing())
    cameras = []
    for x in (0.02, 0.4):
        before = scene.camera(close), scene.camera(far)
        scene.place(BODY, standing(x))
        cameras.append((scene.camera(close) == before[0], scene.camera(far) == before[1]))
    assert cameras == [(True, True), (False, True)]
    layer = scene.figure(close, 320, 240)
    columns = np.flatnonzero((layer.pixels[: 60 - layer.y, :, 3] > 0).any(axis=0)) + layer.x
    assert 110 < columns.mean() < 210, "the head is in the picture's middle"
    scene.place(BODY, standing())


def test_who_bends_is_as_large_as_before(scene: RenderScene) -> None:
    scene.place(BODY, standing())
    size = scene.scale
    bent = standing()
    joints = bent.joints.copy()
    joints[bent.skeleton.bone_names.index("Head"), 1] -= 0.04
    scene.place(BODY, WorldPose(bent.skeleton, joints))
    assert scene.scale == size
    scene.place(BODY, WorldPose(bent.skeleton, bent.joints * 2.0))
    assert scene.scale == pytest.approx(2.0 * size, rel=0.05)
    scene.place(BODY, standing())


def test_poses_that_look_alike_are_told() -> None:
    first, later = (
        standing(),
        WorldPose(*[getattr(standing(), name) for name in ("skeleton", "joints")], t=2.0),
    )
    assert first.looks_like(later, moves=False)
    assert not first.looks_like(later, moves=True)
    assert not first.looks_like(standing(0.1), moves=False)
    assert not first.looks_like(WorldPose(first.skeleton, first.joints, None, {"A": 1.0}), moves=False)
