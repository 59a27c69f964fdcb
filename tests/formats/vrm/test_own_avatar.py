"""The avatar that the studio brings along: complete, and seen by others as by the studio."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from studio import formats
from studio.formats import _glb
from studio.motion import rotation
from studio.motion.avatar import Avatar, Skin
from studio.motion.channels import ALL_BONES, ARKIT_SHAPES
from studio.motion.springs import STEP, Springs
from studio.project.avatars import OWN
from tests.formats.foreign_node import ask
from tests.formats.vrm.test_avatar import compare, posed

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
def test_its_hair_swings_as_in_three_vrm(avatar: Avatar) -> None:
    seen = ask("swing_avatar.mjs", str(OWN), "35", "1", "2")
    assert avatar.rig is not None
    springs, skeleton = Springs(avatar.rig), avatar.skeleton
    turned = skeleton.rest_rotations.copy()
    head = skeleton.bone_names.index("Head")
    # Unity's axes are left-handed: a turn to the left is one about -Y.
    turned[head] = rotation.multiply(turned[head], rotation.from_euler_yxz(-np.radians(35.0), 0.0, 0.0))
    rest = avatar.placements(*skeleton.forward(skeleton.rest_positions, skeleton.rest_rotations))
    now = avatar.placements(*skeleton.forward(skeleton.rest_positions, turned))
    for step in range(601):
        made = springs.moved(rest, step * STEP)
    ends = np.array([joint.tail for joint in avatar.rig.joints])
    for step in range(1, 121):
        made = springs.moved(now, 10.0 + step * STEP)
        if (there := seen.get(f"{step * STEP:.3g}")) is not None:
            wanted = np.array(list(there.values()))
            nodes = np.array([joint.node for joint in avatar.rig.joints])
            found = np.einsum("nij,nj->ni", made[nodes][:, :, :3], ends) + made[nodes][:, :, 3]
            apart = np.linalg.norm(found[:, None] - wanted[None], axis=2)
            assert apart.min(axis=0).max() < 0.002, (
                f"{1000 * apart.min(axis=0).max():.1f} mm after {step * STEP:.2f} s"
            )
