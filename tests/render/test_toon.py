"""How surfaces look, by the pixels: unlit, glowing, toon shading, outlines, masks and moving pictures."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from studio import formats
from studio.formats._glb import Glb
from studio.formats._vrm.material import read_materials
from studio.motion.avatar import Avatar, Surface
from studio.motion.expression import Expression
from studio.motion.material import MaterialBind, Outline, SurfaceMaterial, Toon, UvMotion
from studio.motion.skeleton import Skeleton
from studio.render.camera import Orbit
from studio.render.scene import BODY, RenderScene
from studio.render.toon import uv_at
from studio.render.world_pose import WorldPose
from tests.formats.examples import needs_data

SIZE = 200
SRGB_HALF = 0.2140411
"""What is 128 of 255 on the screen."""
GREY = (SRGB_HALF, SRGB_HALF, SRGB_HALF)


@pytest.fixture(scope="module")
def scene():
    with RenderScene() as made:
        yield made


def ball(material: SurfaceMaterial) -> Avatar:
    """A ball of half a metre before a figure's chest."""
    import pyvista as pv

    made = pv.Sphere(radius=0.5, theta_resolution=48, phi_resolution=48)
    points = np.asarray(made.points, dtype=np.float32)
    count = len(points)
    uv = np.column_stack([points[:, 0] + 0.5, 0.5 - points[:, 1]]).astype(np.float32)
    skeleton = Skeleton.humanoid()
    place = np.eye(4)[None, :3].copy()
    place[0, :, 3] = (0.0, 1.0, 0.0)
    surface = Surface(
        "ball", points, 2.0 * points, uv, np.asarray(made.faces).reshape(-1, 4)[:, 1:].astype(np.int32),
        np.zeros((count, 1), np.int32), np.ones((count, 1), np.float32), place, np.array([0], np.int32),
    )  # fmt: skip
    return Avatar("ball", skeleton, (surface,), (material,))


def seen(scene: RenderScene, material: SurfaceMaterial, t: float = 0.0) -> np.ndarray:
    scene.set_avatar(ball(material))
    scene.place(BODY, replace(WorldPose.at_rest(Skeleton.humanoid()), t=t))
    return np.array(scene.render(Orbit.preset("front"), SIZE, SIZE))[:, :, :3].astype(int)


def middle(pixels: np.ndarray, right: int = 0, down: int = 0) -> np.ndarray:
    """The colour at some pixels from the ball's middle."""
    return pixels[SIZE * 35 // 100 + down, SIZE // 2 + right]


def test_unlit_is_seen_as_it_is(scene: RenderScene) -> None:
    pixels = seen(scene, SurfaceMaterial((*GREY, 1.0), unlit=True))
    for right in (-40, 0, 40):
        assert middle(pixels, right) == pytest.approx([128, 128, 128], abs=1)


def test_what_glows_is_seen_in_the_dark(scene: RenderScene) -> None:
    half = seen(scene, SurfaceMaterial((0.0, 0.0, 0.0, 1.0), glow=GREY))
    assert middle(half) == pytest.approx([128, 128, 128], abs=3)
    bright = seen(scene, SurfaceMaterial((0.0, 0.0, 0.0, 1.0), glow=(2.0, 0.0, 0.0)))
    assert middle(bright) == pytest.approx([255, 0, 0], abs=20)  # black shines a little, too


def test_a_toon_has_a_lit_side_a_shade_and_a_line_between(scene: RenderScene) -> None:
    toon = Toon(shade=(0.0, 0.0, 1.0), toony=0.95)
    pixels = seen(scene, SurfaceMaterial((1.0, 0.0, 0.0, 1.0), toon=toon))
    assert middle(pixels, -20, -20) == pytest.approx([255, 0, 0], abs=2)
    assert middle(pixels, 36, 36) == pytest.approx([0, 0, 255], abs=2)
    column = pixels[:, SIZE // 2]
    both = (column[:, 0] > 40) & (column[:, 2] > 40) & (column[:, 1] < 10)
    assert both.sum() <= 6, "the line is hard"
    soft = replace(toon, toony=0.0)
    column = seen(scene, SurfaceMaterial((1.0, 0.0, 0.0, 1.0), toon=soft))[:, SIZE // 2]
    assert ((column[:, 0] > 40) & (column[:, 2] > 40) & (column[:, 1] < 10)).sum() > 30


def test_a_rim_lies_on_the_edge_alone(scene: RenderScene) -> None:
    dark = Toon(shade=(0.0, 0.0, 0.0), rim=(0.0, 1.0, 0.0), rim_power=4.0)
    pixels = seen(scene, SurfaceMaterial((0.0, 0.0, 0.0, 1.0), toon=dark))
    assert middle(pixels)[1] < 10
    green = pixels[SIZE * 35 // 100, :, 1]
    assert green.max() > 120


@pytest.mark.parametrize("on_screen", [False, True])
def test_an_outline_lies_around_it(scene: RenderScene, on_screen: bool) -> None:
    plain = seen(scene, SurfaceMaterial((1.0, 1.0, 1.0, 1.0), toon=Toon(shade=(1.0, 1.0, 1.0))))
    line = Outline(0.02, on_screen, (1.0, 0.0, 0.0), 0.0)
    toon = Toon(shade=(1.0, 1.0, 1.0), outline=line)
    pixels = seen(scene, SurfaceMaterial((1.0, 1.0, 1.0, 1.0), toon=toon))
    red = (pixels[:, :, 0] > 200) & (pixels[:, :, 1] < 60)
    assert not ((plain[:, :, 0] > 200) & (plain[:, :, 1] < 60)).any()
    row = np.flatnonzero(red[SIZE * 35 // 100])
    assert 2 <= len(row) <= 2 * 6, "a line on either side"
    assert (plain[red] < 150).all(), "beside the ball and not on it"


@pytest.mark.parametrize("on_screen", [False, True])
def test_an_outline_is_as_wide_as_its_picture_has_it(scene: RenderScene, on_screen: bool) -> None:
    widths = np.full((2, 2, 4), 255, np.uint8)
    widths[:, 1, 1] = 0  # none at the right
    line = Outline(0.02, on_screen, (1.0, 0.0, 0.0), 0.0, widths)
    toon = Toon(shade=(1.0, 1.0, 1.0), outline=line)
    pixels = seen(scene, SurfaceMaterial((1.0, 1.0, 1.0, 1.0), toon=toon))
    row = np.flatnonzero(((pixels[:, :, 0] > 200) & (pixels[:, :, 1] < 60))[SIZE * 35 // 100])
    assert len(row)
    assert row.max() < SIZE // 2


def test_a_mask_cuts_and_a_blend_shows_what_is_behind(scene: RenderScene) -> None:
    picture = np.full((2, 2, 4), 255, np.uint8)
    picture[:, 0, 3] = 0
    cut = seen(scene, SurfaceMaterial(picture=picture.repeat(32, 0).repeat(32, 1), mode="MASK", unlit=True))
    assert middle(cut, 25).min() > 250
    assert middle(cut, -25).max() < 120
    through = seen(scene, SurfaceMaterial((1.0, 1.0, 1.0, 0.5), mode="BLEND", unlit=True))
    assert 120 < middle(through)[0] < 220


def test_a_picture_moves_with_the_time(scene: RenderScene) -> None:
    picture = np.zeros((32, 32, 4), np.uint8)
    picture[:, :, 3] = 255
    picture[:, :16, 0] = picture[:, 16:, 2] = 255
    scrolled = SurfaceMaterial(picture=picture, unlit=True, uv=UvMotion(scroll=(0.5, 0.0)))
    assert middle(seen(scene, scrolled, 0.0), -25)[0] > 200
    assert middle(seen(scene, scrolled, 1.0), -25)[2] > 200
    assert (seen(scene, scrolled, 2.0) == seen(scene, scrolled, 0.0)).all(), (
        "the same moment, the same picture"
    )


def test_texture_coordinates_turn_about_the_picture_s_middle() -> None:
    matrix, offset = uv_at(UvMotion(spin=math.pi), 1.0)
    assert (matrix[0] * 0.2 + matrix[1] * 0.3 + offset[0]) == pytest.approx(0.8)
    assert (matrix[2] * 0.2 + matrix[3] * 0.3 + offset[1]) == pytest.approx(0.7)


def test_what_makers_wrote_is_read() -> None:
    new = {
        "shadeColorFactor": [0.5, 0.25, 0.1], "shadingShiftFactor": -0.2, "shadingToonyFactor": 0.7,
        "outlineWidthMode": "screenCoordinates", "outlineWidthFactor": 0.004,
        "outlineColorFactor": [0.1, 0, 0], "parametricRimColorFactor": [0.3, 0.3, 0.3],
        "uvAnimationScrollYSpeedFactor": 2.0,
    }  # fmt: skip
    old = {
        "shader": "VRM/MToon", "floatProperties": {
            "_ShadeShift": -0.5, "_ShadeToony": 0.8, "_BlendMode": 1.0, "_Cutoff": 0.3, "_CullMode": 0.0,
            "_OutlineWidthMode": 1.0, "_OutlineWidth": 0.5, "_OutlineColorMode": 1.0,
            "_OutlineLightingMix": 0.5},
        "vectorProperties": {
            "_Color": [0.5, 0.5, 0.5, 1], "_ShadeColor": [1, 1, 1, 1], "_EmissionColor": [0.5, 0, 0, 1]},
    }  # fmt: skip
    glow = {"KHR_materials_emissive_strength": {"emissiveStrength": 3.0}, "KHR_materials_unlit": {}}
    document = {
        "materials": [
            {"extensions": {"VRMC_materials_mtoon": new, "KHR_materials_unlit": {}}},
            {},
            {"extensions": glow, "emissiveFactor": [1, 0.5, 0]},
        ]
    }
    glb = Glb(Path("avatar.vrm"), document, b"")
    found, notes = read_materials(glb, {"materialProperties": [{}, old, {}]})
    first, second, third, plain = found
    assert notes == ()
    assert first.toon is not None
    assert second.toon is not None
    assert (first.unlit, first.toon.shade, first.toon.shift, first.toon.toony) == (
        False,
        (0.5, 0.25, 0.1),
        -0.2,
        0.7,
    )
    line = first.toon.outline
    assert line is not None
    assert (line.width, line.on_screen, line.colour, line.lit) == (0.004, True, (0.1, 0.0, 0.0), 1.0)
    assert first.uv.scroll == (0.0, 2.0)
    assert second.colour[:3] == pytest.approx(GREY, abs=1e-3)
    assert second.toon.toony == pytest.approx(0.85)
    assert second.toon.shift == pytest.approx(0.5 - 0.15)
    assert (second.mode, second.cutoff, second.two_sided) == ("MASK", 0.3, True)
    assert second.toon.outline is not None
    assert (second.toon.outline.width, second.toon.outline.lit) == (pytest.approx(0.005), 0.5)
    assert second.glow == pytest.approx((GREY[0], 0.0, 0.0), abs=1e-3)
    assert (third.unlit, third.glow) == (True, (3.0, 1.5, 0.0))
    assert (plain.toon, plain.unlit) == (None, False)


def test_a_file_of_both_makers_shows_its_colours(scene: RenderScene) -> None:
    scene.set_avatar(formats.read_avatar(needs_data("vrm") / "EmissionMigration_v0.107.0.vrm"))
    scene.place(BODY, WorldPose.at_rest(Skeleton.humanoid()))
    pixels = np.array(scene.render(Orbit.preset("front"), 320, 320))[:, :, :3].astype(int)
    grey = (np.ptp(pixels, axis=2) <= 3) & (np.abs(pixels[:, :, 0] - 128) <= 4)
    white = (pixels > 250).all(axis=2)
    assert grey.sum() > 2000, "unlit and glowing at one half are one grey"
    assert white.sum() > 2000


def test_an_expression_colours_a_material_and_lets_it_glow(scene: RenderScene) -> None:
    looks = (
        MaterialBind(0, "colour", (1.0, 0.0, 0.0, 1.0)),
        MaterialBind(0, "glow", (0.0, SRGB_HALF, 0.0)),
        MaterialBind(0, "offset", (0.5, 0.0)),
    )
    picture = np.full((8, 8, 4), 255, np.uint8)
    picture[:, 4:, 2] = 0
    material = SurfaceMaterial((0.0, 0.0, 1.0, 1.0), picture, unlit=True)
    scene.set_avatar(replace(ball(material), expressions=(Expression("angry", (), looks=looks),)))
    found = []
    for weight in (0.0, 1.0, 0.0):
        rest = WorldPose.at_rest(Skeleton.humanoid())
        scene.place(BODY, replace(rest, shapes={"Angry": weight}))
        pixels = np.array(scene.render(Orbit.preset("front"), SIZE, SIZE))[:, :, :3].astype(int)
        found.append(middle(pixels, -20))
    assert found[0] == pytest.approx([0, 0, 255], abs=2)
    assert found[1] == pytest.approx([255, 128, 0], abs=2)
    assert found[2] == pytest.approx([0, 0, 255], abs=2)
