"""Motion as columns: what is learnt, what is carried, and back again."""

from __future__ import annotations

import json

import numpy as np
import pytest

from studio.errors import StudioError
from studio.features.motion import BODY, FACE, HIPS, Layout, fit
from studio.motion import Motion, rotation

BONES = ("Hips", "Spine", "Head", "LeftHand")
RNG = np.random.default_rng(5)


def lively(
    frames: int = 90, shapes: tuple[str, ...] = ("A", "Joy"), bones: tuple[str, ...] = BONES
) -> Motion:
    t = np.arange(frames) / 30
    weights = np.zeros((frames, len(shapes)))
    if "A" in shapes:
        weights[:, shapes.index("A")] = 0.5 + 0.5 * np.sin(9 * t)
    if "Joy" in shapes:
        weights[:, shapes.index("Joy")] = 0.25  # never moves
    turns = np.tile(rotation.IDENTITY, (frames, len(bones), 1))
    if "Head" in bones:
        turns[:, bones.index("Head")] = rotation.from_axis_angle(np.array([[1.0, 0, 0]]), 0.4 * np.sin(3 * t))
    if "LeftHand" in bones:
        turns[:, bones.index("LeftHand")] = rotation.from_axis_angle(
            np.array([[0, 1.0, 0]]), np.full(frames, 0.7)
        )
    motion = Motion.build(t, shapes, weights, bones, None, turns)
    if "Hips" in bones:
        motion.positions[:, bones.index("Hips"), 0] += 0.02 * np.sin(2 * t)
    return motion


def test_what_never_moves_is_carried_not_learnt() -> None:
    layout = fit([lively()])
    assert [layout.shape_names[i] for i in layout.learnt_shapes] == ["A"]
    assert [layout.bone_names[i] for i in layout.learnt_bones] == ["Head"]
    assert layout.learns_hips
    assert layout.width == 1 + 6 + 3
    assert layout.groups.tolist() == [FACE] + [BODY] * 6 + [HIPS] * 3
    made = layout.motion(np.zeros((2, layout.width)), np.array([0, 1 / 30]))
    np.testing.assert_allclose(made.shapes[:, 1], 0.25)
    np.testing.assert_allclose(made.rotations[:, 3], lively().rotations[:2, 3], atol=1e-6)


@pytest.mark.parametrize("scaling", ["group", "minmax", "none"])
def test_columns_give_the_motion_back(scaling: str) -> None:
    motion = lively()
    layout = fit([motion], scaling)
    columns, mask = layout.columns(motion)
    assert mask.all()
    back = layout.motion(layout.scaled(columns), motion.times)
    np.testing.assert_allclose(back.shapes, motion.shapes, atol=1e-5)
    np.testing.assert_allclose(back.rotations, motion.rotations, atol=1e-5)
    np.testing.assert_allclose(back.positions, motion.positions, atol=1e-5)


def test_minmax_lies_between_0_and_1() -> None:
    layout = fit([lively()], "minmax")
    scaled = layout.scaled(layout.columns(lively())[0])
    assert scaled.min() >= -1e-5
    assert scaled.max() <= 1 + 1e-5


def test_channels_a_take_lacks_are_masked() -> None:
    face, body = lively(bones=()), lively(shapes=())
    layout = fit([face, body])
    _, of_face = layout.columns(face)
    _, of_body = layout.columns(body)
    assert of_face.tolist() == [1] + [0] * 9
    assert of_body.tolist() == [0] + [1] * 9


def test_predicted_rotations_are_always_unit() -> None:
    layout = fit([lively()])
    wild = layout.motion(RNG.normal(0, 50, (40, layout.width)), np.arange(40) / 30)
    np.testing.assert_allclose(np.linalg.norm(wild.rotations, axis=-1), 1, atol=1e-5)
    assert wild.shapes.min() >= 0
    assert wild.shapes.max() <= 1


def test_motion_without_movement_is_refused() -> None:
    still = Motion.build(np.arange(60) / 30, ("A",), np.zeros((60, 1)))
    with pytest.raises(StudioError) as caught:
        fit([still])
    assert str(caught.value) == (
        "Nothing moves in the training takes. Check that the tracker was sending while they were recorded."
    )


def test_a_layout_survives_json() -> None:
    layout = fit([lively()])
    again = Layout.from_dict(json.loads(json.dumps(layout.as_dict())))
    assert again.shape_names == layout.shape_names
    for name in ("mean", "offset", "scale", "rest_positions", "rest_rotations", "shape_limits"):
        np.testing.assert_array_equal(getattr(again, name), getattr(layout, name))
