"""Avatars: read as three-vrm reads them, and broken ones told in one sentence."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from studio import formats
from studio.motion import Motion, Skeleton, rotation
from studio.motion.avatar import MIRROR, MIRROR_TURN, Avatar, Skin
from studio.motion.channels import vrm1_bone
from tests.formats.avatars import Maker
from tests.formats.examples import a_motion, needs_data
from tests.formats.foreign_node import ask

FACES: dict[str, float] = {"aa": 0.7, "blinkLeft": 1.0, "happy": 0.4}
REAL = ("cryptovoxels.vrm", "sphere.vrm", "VRMC_materials_mtoon_UV_Animation_Test.vrm",
        "EmissionMigration_v0.107.0.vrm")  # fmt: skip


def poses_of(motion: Motion, scale: float) -> list[dict[str, Any]]:
    """A motion's frames as three-vrm takes poses; the face moves from the second frame on."""
    hips = motion.bone_names.index("Hips")
    return [
        {
            "bones": {
                vrm1_bone(name): (motion.rotations[t, j] * MIRROR_TURN).tolist()
                for j, name in enumerate(motion.bone_names)
            },
            "hips": (motion.positions[t, hips] * MIRROR * scale).tolist(),
            "expressions": FACES if t else {},
        }
        for t in range(len(motion))
    ]


def worn(avatar: Avatar, motion: Motion, t: int) -> tuple[Any, Any]:
    return avatar.retargeted(
        motion.skeleton, *motion.skeleton.forward(motion.positions[t], motion.rotations[t])
    )


def only(motion: Motion, names: tuple[str, ...]) -> Motion:
    """A motion of the bones that an avatar has too: three-vrm folds the others nowhere."""
    keep = [j for j, name in enumerate(motion.bone_names) if name in names]
    kept = tuple(motion.bone_names[j] for j in keep)
    rest = Skeleton.humanoid(kept).rest_positions
    positions = np.tile(rest, (len(motion), 1, 1))
    return Motion.build(motion.times, (), None, kept, positions, motion.rotations[:, keep])


def compare(avatar: Avatar, motion: Motion, seen: dict[str, Any]) -> None:
    """Whether every bone and vertex is where three-vrm has it."""
    for t, there in enumerate(seen["seen"]):
        joints, turns = worn(avatar, motion, t)
        names = [vrm1_bone(name) for name in avatar.skeleton.bone_names]
        at = np.array([there["bones"][name]["at"] for name in names])
        assert np.linalg.norm(at - joints * MIRROR, axis=1).max() < 0.001, t
        turned = np.array([there["bones"][name]["turned"] for name in names])
        far = rotation.angle_between(turned, turns * MIRROR_TURN)
        assert np.degrees(far.max()) < 0.1, names[int(far.argmax())]
        weights = avatar.morph_weights(FACES if t else {})
        for surface, own, wanted in zip(avatar.surfaces, weights, there["vertices"], strict=True):
            placements = avatar.placements(joints, turns)
            vertices, _ = Skin(surface, len(placements) - 1).pose(placements, own)
            assert len(wanted) > 3
            for vertex in wanted:
                same = np.linalg.norm(surface.vertices - vertex["rest"], axis=1) < 1e-6
                assert np.linalg.norm(vertices[same] - vertex["at"], axis=1).min() < 0.001, surface.name


def posed(files: list[Path], tmp_path: Path) -> list[tuple[Avatar, Motion, dict[str, Any]]]:
    """Each avatar with a motion of its bones, and what three-vrm makes of the two."""
    found, jobs = [], []
    for file in files:
        avatar = formats.read_avatar(file)
        motion = only(a_motion(3), avatar.skeleton.bone_names)
        jobs.append({"file": str(file), "poses": poses_of(motion, avatar.scale_from(motion.skeleton))})
        found.append((avatar, motion))
    words = tmp_path / "jobs.json"
    words.write_text(json.dumps(jobs), encoding="utf-8")
    seen = ask("pose_avatar.mjs", str(words))
    return [(avatar, motion, one) for (avatar, motion), one in zip(found, seen, strict=True)]


@pytest.mark.slow
def test_bones_faces_and_vertices_are_where_three_vrm_has_them(tmp_path: Path) -> None:
    files = [
        Maker(0, 0.7).write(tmp_path / "名前 with space.vrm"),
        Maker(1, 1.3).write(tmp_path / "one.vrm"),
    ]
    for version, (avatar, motion, seen) in zip("01", posed(files, tmp_path), strict=True):
        assert seen["version"] == version
        assert seen["errors"] == []
        assert len(avatar.expressions) == 12
        assert {"aa", "blinkLeft", "happy"} <= set(seen["expressions"])
        compare(avatar, motion, seen)


@pytest.mark.slow
def test_real_avatars_stand_as_three_vrm_has_them(tmp_path: Path) -> None:
    for avatar, motion, seen in posed([needs_data("vrm") / name for name in REAL], tmp_path):
        compare(avatar, motion, seen)
