"""An avatar in a picture: dressed, ghostly, undressed, and with faces of other sets."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from studio import formats
from studio.motion import Skeleton
from studio.motion.avatar import Avatar
from studio.motion.channels import ARKIT_SHAPES
from studio.render.actors import has_body, height_of
from studio.render.camera import Orbit
from studio.render.face import fitted
from studio.render.mannequin import mannequin
from studio.render.palette import DARK, LIGHT
from studio.render.scene import BODY, GHOST, RenderScene
from studio.render.world_pose import WorldPose
from tests.formats.avatars import Maker
from tests.formats.examples import needs_data
from tests.formats.test_vrma import document_of, with_document
from tests.formats.vrm.test_rig import spring_of_vrm0, with_hair


@pytest.fixture(scope="module")
def scene():
    with RenderScene() as made:
        yield made


@pytest.fixture(scope="module")
def avatar(tmp_path_factory: pytest.TempPathFactory) -> Avatar:
    return formats.read_avatar(Maker(1).write(tmp_path_factory.mktemp("avatar") / "a.vrm"))


def picture(scene: RenderScene, shapes: dict[str, float], zoom: float = 1.0) -> np.ndarray:
    rest = WorldPose.at_rest(Skeleton.humanoid())
    scene.place(BODY, WorldPose(rest.skeleton, rest.joints, rest.turns, shapes))
    return np.array(scene.render(Orbit.preset("front", zoom), 320, 240)).astype(int)


def blue(pixels: np.ndarray) -> np.ndarray:
    """Where the avatar's clothes are; the stick figure's blue is lighter."""
    return (pixels[:, :, 2] > pixels[:, :, 0] + 60) & (pixels[:, :, 0] < 110)


def test_an_avatar_takes_the_figures_place_and_leaves_it(scene: RenderScene, avatar: Avatar) -> None:
    scene.set_avatar(None)
    stick = picture(scene, {})
    scene.set_avatar(avatar)
    assert blue(picture(scene, {})).sum() > 500 + 3 * blue(stick).sum()
    scene.set_avatar(None)
    assert (picture(scene, {}) == stick).all()


def test_every_expression_is_seen_on_the_face(scene: RenderScene, avatar: Avatar) -> None:
    scene.set_avatar(avatar)
    still = picture(scene, {}, 0.25)
    for name in ("A", "Joy", "Blink", "happy", "ou"):
        assert (picture(scene, {name: 1.0}, 0.25) != still).sum() > 50, name
    assert (picture(scene, {"LookUp": 1.0}, 0.25) == still).all()


def test_a_ghost_of_the_avatar_has_the_second_colour(scene: RenderScene, avatar: Avatar) -> None:
    scene.set_avatar(avatar)
    alone = picture(scene, {})
    rest = WorldPose.at_rest(Skeleton.humanoid())
    scene.place(GHOST, WorldPose(rest.skeleton, rest.joints + np.array([0.5, 0.0, 0.0]), rest.turns))
    both = picture(scene, {})
    orange = (both[:, :, 0] > both[:, :, 2] + 40) & (np.abs(both - alone).max(axis=2) > 20)
    assert orange.sum() > 200
    scene.hide(GHOST)
    assert (picture(scene, {}) == alone).all()


def test_avatars_of_any_size_fill_the_picture_alike(scene: RenderScene, tmp_path: Path) -> None:
    heights = []
    for size in (0.4, 1.0, 2.5):
        scene.set_avatar(formats.read_avatar(Maker(0, size).write(tmp_path / f"{size}.vrm")))
        rows = np.flatnonzero(blue(picture(scene, {})).any(axis=1))
        heights.append(int(np.ptp(rows)))
    assert np.ptp(heights) <= 3


def test_what_hangs_from_a_figure_is_seen_on_it_and_a_body_of_few_parts_alone(
    scene: RenderScene, avatar: Avatar
) -> None:
    planes = formats.read_avatar(needs_data("vrm") / "VRMC_materials_mtoon_UV_Animation_Test.vrm")
    assert has_body(planes)
    head = next(s for s in avatar.surfaces if s.name.startswith("Face"))
    mask = replace(avatar, surfaces=(head,))
    assert not has_body(mask)
    assert 1.4 < height_of(mask) < 1.9
    seen = []
    for worn in (planes, mask):
        scene.set_avatar(worn)
        pixels = picture(scene, {})
        seen.append(int(((pixels[:, :, 2] > pixels[:, :, 0] + 30) & (pixels[:, :, 0] > 80)).sum()))
    assert seen[0] == 0 < 300 < seen[1]


def test_shapes_the_avatar_has_no_names_for_still_move_its_face(avatar: Avatar) -> None:
    found = fitted(avatar, dict.fromkeys(ARKIT_SHAPES, 0.0) | {"JawOpen": 0.8, "EyeBlinkLeft": 1.0})
    assert found["A"] > 0.4
    assert (found["Blink_L"], found["Blink_R"]) == (1.0, 0.0)


def test_shapes_the_avatar_knows_are_left_alone(avatar: Avatar) -> None:
    shapes = {"A": 0.3, "Blink": 0.1, "MouthClose": 0.5}
    assert fitted(avatar, shapes) is shapes


def test_a_plain_body_moves_its_face_by_every_shape() -> None:
    body = mannequin(Skeleton.humanoid(), ("A", "Blink", "Joy", "Surprised", "JawOpen"))
    for name in ("A", "Blink", "Joy", "Surprised", "JawOpen"):
        weights = body.morph_weights({name: 1.0})
        moved = [
            float(np.abs(morph.offsets).max()) * weight
            for surface, own in zip(body.surfaces, weights, strict=True)
            for morph, weight in zip(surface.morphs, own, strict=True)
        ]
        assert max(moved) > 0.005, name


@pytest.fixture(scope="module")
def haired(tmp_path_factory: pytest.TempPathFactory) -> Avatar:
    """One whose second face hangs from its head by a spring."""
    file = Maker(0).write(tmp_path_factory.mktemp("haired") / "a.vrm")
    document = document_of(file)
    spring_of_vrm0(document, with_hair(document), stiffiness=0.3, colliderGroups=[])
    with_document(file, document)
    return formats.read_avatar(file)


def swaying(t: float) -> WorldPose:
    """Somebody who steps from side to side."""
    rest = WorldPose.at_rest(Skeleton.humanoid())
    return replace(rest, joints=rest.joints + np.array([0.2 * np.sin(12.0 * t), 0.0, 0.0]), t=t)


def frames(scene: RenderScene, times: list[float]) -> list[np.ndarray]:
    made = []
    for t in times:
        scene.place(BODY, swaying(t))
        made.append(np.array(scene.render(Orbit.preset("front"), 320, 240)).astype(int))
    return made


def test_hair_swings_alike_in_every_film(scene: RenderScene, haired: Avatar) -> None:
    scene.set_avatar(haired)
    times = [i / 30 for i in range(12)]
    scene.hide(BODY)
    first = frames(scene, times)
    scene.hide(BODY)
    again = frames(scene, times)
    assert all((a == b).all() for a, b in zip(first, again, strict=True))
    # In its midst it hangs still, where playing had it on the way.
    scene.hide(BODY)
    assert (frames(scene, times[-1:])[0] != first[-1]).sum() > 50


def test_hair_goes_on_swinging_in_other_colours(scene: RenderScene, haired: Avatar) -> None:
    scene.set_avatar(haired)
    times = [i / 30 for i in range(12)]
    scene.hide(BODY)
    last = frames(scene, times)[-1]
    scene.set_palette(LIGHT)
    scene.set_palette(DARK)
    assert (frames(scene, times[-1:])[0] == last).all()


def test_a_ghosts_hair_is_its_own(scene: RenderScene, haired: Avatar) -> None:
    scene.set_avatar(haired)
    scene.hide(BODY)
    alone = frames(scene, [0.0, 0.05, 0.1])[-1]
    scene.hide(BODY)
    for t in (0.0, 0.05, 0.1):
        scene.place(GHOST, swaying(t + 7.0))
        scene.place(BODY, swaying(t))
    scene.hide(GHOST)
    assert (np.array(scene.render(Orbit.preset("front"), 320, 240)).astype(int) == alone).all()
