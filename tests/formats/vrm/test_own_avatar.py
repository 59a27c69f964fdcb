"""The avatar that the studio brings along: complete, and seen by others as by the studio."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from studio import formats
from studio.formats import _glb
from studio.motion.avatar import Avatar, Skin
from studio.motion.channels import ALL_BONES, ARKIT_SHAPES
from studio.project.avatars import OWN
from tests.formats.vrm.test_avatar import compare, posed
from tests.formats.vrm.test_moving import by_three_vrm, by_us

PRESETS = ("aa", "ih", "ou", "ee", "oh", "blink", "blinkLeft", "blinkRight",
           "happy", "angry", "sad", "relaxed",
           "surprised", "lookUp", "lookDown", "lookLeft", "lookRight")  # fmt: skip
LIPS, LIDS = "lips", "lids"
MOUTH, EYES = 1.239, 1.286
"""How high they are, metres."""


@pytest.fixture(scope="module")
def avatar() -> Avatar:
    return formats.read_avatar(OWN)


def vertices(avatar: Avatar, material: str, shapes: dict[str, float]) -> np.ndarray:
    """Where the face's vertices of one material are with a face."""
    names = [one["name"] for one in _glb.read(OWN).document["materials"]]
    joints, turns = avatar.skeleton.forward(avatar.skeleton.rest_positions, avatar.skeleton.rest_rotations)
    weights = avatar.morph_weights(shapes)
    for surface, own in zip(avatar.surfaces, weights, strict=True):
        if names[surface.material] == material:
            count = len(avatar.skeleton.bone_names)
            placements = avatar.placements(joints, turns)
            return np.asarray(Skin(surface, max(count, len(placements) - 1)).pose(placements, own)[0])
    raise AssertionError(material)


def test_it_is_whole_small_and_free(avatar: Avatar) -> None:
    assert OWN.stat().st_size < 4_000_000
    assert avatar.notes == ()
    assert set(ALL_BONES) - {"Jaw"} <= set(avatar.skeleton.bone_names) | {"LeftEye", "RightEye"}
    names = {one.name for one in avatar.expressions}
    assert {name[0].lower() + name[1:] for name in ARKIT_SHAPES} | set(PRESETS) <= names
    assert avatar.rig is not None
    assert len(avatar.rig.joints) > 20
    assert all(joint.colliders for joint in avatar.rig.joints)
    assert avatar.licence.line == "By Saia Studio. Free for any use (CC0)."


@pytest.mark.parametrize("shape", ARKIT_SHAPES)
def test_every_shape_is_seen(avatar: Avatar, shape: str) -> None:
    weights = avatar.morph_weights({shape: 1.0})
    moved = max(
        float(np.linalg.norm(surface.morphs[i].offsets, axis=1).max(initial=0.0))
        for surface, own in zip(avatar.surfaces, weights, strict=True)
        for i in np.flatnonzero(own)
    )
    assert moved > 0.0015, f"{shape} moves {1000 * moved:.1f} mm at most"


def test_lids_meet_and_open_lips_close_again(avatar: Avatar) -> None:
    def gap(material: str, shapes: dict[str, float], x: float, middle: float) -> float:
        """How far apart the edges of an opening are at some place across the face."""
        rest, now = vertices(avatar, material, {}), vertices(avatar, material, shapes)
        near, y = np.abs(rest[:, 0] - x) < 0.004, rest[:, 1] - middle
        upper, lower = near & (y > 0.002) & (y < 0.04), near & (y < -0.002) & (y > -0.04)
        return float(now[upper, 1].min() - now[lower, 1].max())

    assert gap(LIDS, {}, 0.036, EYES) > 0.02
    assert gap(LIDS, {"eyeBlinkLeft": 1.0}, 0.036, EYES) < 0.002
    shut = gap(LIPS, {}, 0.0, MOUTH)
    assert gap(LIPS, {"jawOpen": 1.0}, 0.0, MOUTH) > shut + 0.02
    assert gap(LIPS, {"jawOpen": 1.0, "mouthClose": 1.0}, 0.0, MOUTH) < shut + 0.001


@pytest.mark.slow
def test_the_script_makes_the_file_that_lies_there(tmp_path: Path) -> None:
    script = OWN.parents[2] / "packaging" / "avatar"
    made = tmp_path / "again.vrm"
    subprocess.run([sys.executable, script, made], check=True, capture_output=True, timeout=120)
    new, kept = _glb.read(made), _glb.read(OWN)
    assert new.document["materials"] == kept.document["materials"]
    assert new.document["extensions"] == kept.document["extensions"]
    for one, other in zip(formats.read_avatar(made).surfaces, formats.read_avatar(OWN).surfaces, strict=True):
        # Processors round sines differently.
        np.testing.assert_allclose(one.vertices, other.vertices, atol=1e-5)
        np.testing.assert_array_equal(one.triangles, other.triangles)


@pytest.mark.slow
def test_three_vrm_poses_it_alike_and_the_validator_has_nothing_against_it(tmp_path: Path) -> None:
    for avatar, motion, seen in posed([OWN], tmp_path):
        assert seen["errors"] == []
        compare(avatar, motion, seen)


@pytest.mark.slow
def test_its_hair_swings_as_in_three_vrm(avatar: Avatar, tmp_path: Path) -> None:
    document, rig = _glb.read(OWN).document, avatar.rig
    assert rig is not None
    hair = [str(node["name"]) for node in document["nodes"] if str(node.get("name")).startswith("hair")]
    names = tuple(name for name in hair if not name.endswith("3"))  # which are the ends of the locks
    (told,) = by_three_vrm({OWN: names}, tmp_path)
    for i, made in by_us(avatar).items():
        found = np.einsum("nij,nj->ni", made[:-1, :, :3], rig.at) + made[:-1, :, 3]
        wanted = np.array([there["at"] for there in told[str(i)]])
        apart = np.linalg.norm(found[:, None] - wanted[None], axis=2).min(axis=0)
        assert float(apart.max()) < 1e-3, names[int(apart.argmax())]
