"""glTF files, judged by the Khronos validator and by three.js in Node."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from studio import formats
from studio.errors import RequestError
from studio.formats import glb
from studio.formats.vrma import REQUIRED
from studio.motion import Motion, rotation
from studio.motion.avatar import MIRROR, MIRROR_TURN, Avatar, Skin
from studio.motion.channels import ARKIT_SHAPES
from tests.formats.avatars import Maker
from tests.formats.examples import a_motion, needs_data
from tests.formats.foreign_node import ask
from tests.formats.test_vrma import document_of
from tests.world import world_of


def seen_by_three(file: Path, times: Any) -> dict[str, Any]:
    seen = ask("read_glb.mjs", str(file), json.dumps(list(times)))
    assert seen["errors"] == []
    return seen


def compare_bones(seen: dict[str, Any], names: tuple[str, ...], positions: Any, turns: Any) -> None:
    """Whether three.js has every bone where forward kinematics has it."""
    for frame, p, q in zip(seen["frames"], positions, turns, strict=True):
        at = np.array([frame["world"][name]["at"] for name in names])
        assert np.linalg.norm(at - p * MIRROR, axis=1).max() < 0.001
        turned = [frame["world"][name]["turned"] for name in names]
        assert np.degrees(rotation.angle_between(turned, q * MIRROR_TURN).max()) < 0.1


@pytest.mark.slow
def test_three_js_plays_the_plain_body_as_the_motion_has_it(tmp_path: Path) -> None:
    motion = a_motion(20)
    (file,) = glb.write(tmp_path / "名前 x.glb", motion)
    rows = [0, 7, 18]
    seen = seen_by_three(file, motion.times[rows])
    assert seen["warnings"] == []
    assert seen["duration"] == pytest.approx(motion.times[-1], abs=1e-5)
    positions, turns = world_of(motion)
    compare_bones(seen, motion.bone_names, positions[rows], turns[rows])
    eyes = [surface["name"] for surface in seen["frames"][0]["surfaces"]].index("Eyes")
    assert seen["targets"][eyes] == list(motion.shape_names)
    for frame, row in zip(seen["frames"], rows, strict=True):
        np.testing.assert_allclose(frame["surfaces"][eyes]["weights"], motion.shapes[row], atol=1e-4)


def worn(avatar: Avatar, motion: Motion) -> tuple[Any, Any]:
    return avatar.retargeted(motion.skeleton, *motion.skeleton.forward(motion.positions, motion.rotations))


def compare_surfaces(seen: dict[str, Any], avatar: Avatar, motion: Motion, rows: list[int]) -> None:
    """Whether three.js has the vertices of every surface where the studio draws them."""
    moved = worn(avatar, motion)
    for frame, row in zip(seen["frames"], rows, strict=True):
        p, q = moved[0][row], moved[1][row]
        shapes = dict(zip(motion.shape_names, motion.shapes[row].tolist(), strict=True))
        weights = avatar.morph_weights(shapes)
        for i, surface in enumerate(avatar.surfaces):
            vertices, _ = Skin(surface, len(p)).pose(avatar.placements(p, q), weights[i])
            there = np.array(frame["surfaces"][i]["vertices"])
            far = np.linalg.norm(vertices[there[:, 0].astype(int)] - there[:, 1:], axis=1)
            assert far.max() < 0.001, (surface.name, row)


@pytest.mark.slow
@pytest.mark.parametrize("which", ["vrm1", "cryptovoxels.vrm"])
def test_three_js_plays_an_avatar_as_the_studio_draws_it(tmp_path: Path, which: str) -> None:
    generated = which == "vrm1"
    file = Maker(1, 1.2).write(tmp_path / "a.vrm") if generated else needs_data("vrm") / which
    motion, rows = a_motion(12), [0, 5, 10]
    avatar = formats.read_avatar(file)
    (out,) = glb.write(tmp_path / "x.glb", motion, avatar=file)
    seen = seen_by_three(out, motion.times[rows])
    positions, turns = worn(avatar, motion)
    compare_bones(seen, avatar.skeleton.bone_names, positions[rows], turns[rows])
    compare_surfaces(seen, avatar, motion, rows)


def test_a_face_alone_gets_a_body_at_rest(tmp_path: Path) -> None:
    motion = Motion.build([0.0, 0.1, 0.2], ARKIT_SHAPES, np.tile(np.linspace(0, 1, 3)[:, None], (1, 52)))
    (file,) = glb.write(tmp_path / "x.glb", motion)
    document = document_of(file)
    names = document["meshes"][-1]["extras"]["targetNames"]
    assert names == list(ARKIT_SHAPES)
    bones = {node["name"] for node in document["nodes"]}
    assert set(REQUIRED) <= bones


def test_shapes_that_never_move_are_no_weight_in_the_file(tmp_path: Path) -> None:
    weights = np.zeros((3, 2))
    weights[1, 0] = 1.0
    (file,) = glb.write(tmp_path / "x.glb", Motion.build([0.0, 0.1, 0.2], ("A", "O"), weights))
    assert document_of(file)["meshes"][-1]["extras"]["targetNames"] == ["A"]


def test_a_motion_without_a_face_has_no_morph_targets(tmp_path: Path) -> None:
    (file,) = glb.write(tmp_path / "x.glb", a_motion(3, shapes=()))
    assert not any("weights" in mesh for mesh in document_of(file)["meshes"])


def test_no_motion_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RequestError) as error:
        glb.write(tmp_path / "x.glb", Motion.build([]))
    assert error.value.what == "There is no motion to write to x.glb."
    assert not (tmp_path / "x.glb").exists()
