"""VRM Animations, judged by real files and by three.js and three-vrm in Node."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from studio.errors import RequestError, StudioError
from studio.formats import vrma
from studio.motion import Motion, rotation
from studio.motion.channels import vrm1_bone
from tests.formats.examples import a_motion, assert_same_motion, needs_data
from tests.formats.foreign_node import ask
from tests.world import world_of

MIRROR = np.array([-1.0, 1.0, 1.0])
MIRROR_TURN = np.array([1.0, -1.0, -1.0, 1.0])


def seen_by_three(file: Path, times: Any, *avatar: Path) -> dict[str, Any]:
    """What three.js and three-vrm see in a VRMA."""
    return ask("read_vrma.mjs", str(file), json.dumps(list(times)), *map(str, avatar))


@pytest.mark.slow
def test_three_js_sees_every_bone_where_the_motion_has_it(tmp_path: Path) -> None:
    motion = a_motion(40)
    (file,) = vrma.write(tmp_path / "x.vrma", motion)
    seen = seen_by_three(file, motion.times[:-1])
    assert seen["errors"] == []
    assert seen["duration"] == pytest.approx(motion.times[-1], abs=1e-5)
    positions, rotations = world_of(motion)
    names = [name for name in motion.bone_names if name not in vrma.EYES]
    assert set(seen["world"]) == {vrm1_bone(name) for name in names}
    for name in names:
        j, there = motion.bone_names.index(name), seen["world"][vrm1_bone(name)]
        far = np.abs(np.array(there["positions"]) - positions[:-1, j] * MIRROR).max()
        turned = rotation.angle_between(there["rotations"], rotations[:-1, j] * MIRROR_TURN).max()
        assert far < 0.001, name
        assert np.degrees(turned) < 0.1, name
    np.testing.assert_allclose(
        seen["expressions"]["aa"], motion.shapes[:-1, motion.shape_names.index("A")], atol=1e-4
    )
    assert not {"lookUp", "lookDown", "lookLeft", "lookRight"} & set(seen["expressions"])
    assert seen["restHips"][1] == pytest.approx(0.95, abs=0.06)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("avatar", "mirror"),
    [
        ("VRMC_materials_mtoon_UV_Animation_Test.vrm", (1, 1, 1, 1)),
        ("cryptovoxels.vrm", (-1, 1, -1, 1)),
    ],
)
def test_three_vrm_turns_an_avatars_bones_alike(tmp_path: Path, avatar: str, mirror: tuple[int, ...]) -> None:
    model = needs_data("vrm") / avatar
    motion = a_motion(20)
    (file,) = vrma.write(tmp_path / "x.vrma", motion)
    seen = seen_by_three(file, motion.times[:-1], model)["avatar"]
    assert len(seen["rotations"]) > 15
    by_name = {vrm1_bone(name): j for j, name in enumerate(motion.bone_names)}
    for name, there in seen["rotations"].items():
        wanted = motion.rotations[:-1, by_name[name]] * MIRROR_TURN * np.array(mirror)
        assert np.degrees(rotation.angle_between(there, wanted).max()) < 0.1, name


@pytest.mark.slow
@pytest.mark.parametrize("name", ["test.vrma", "idle_loop.vrma"])
def test_real_files_are_read_as_three_vrm_plays_them(tmp_path: Path, name: str) -> None:
    file = needs_data("vrm") / name
    motion = vrma.read(file).motion
    assert motion is not None
    (copy,) = vrma.write(tmp_path / "copy.vrma", motion)
    times = motion.times[1:-1:7]
    model = needs_data("vrm") / "VRMC_materials_mtoon_UV_Animation_Test.vrm"
    first = seen_by_three(file, times, model)
    again = seen_by_three(copy, times, model)
    for bone, there in first["avatar"]["rotations"].items():
        same = rotation.angle_between(there, again["avatar"]["rotations"][bone])
        # The file's own keys are seldom where ours are: between keys a turn is a straight line.
        assert np.degrees(same.max()) < 0.3, bone
    for shape, weights in first["expressions"].items():
        np.testing.assert_allclose(weights, again["expressions"][shape], atol=0.02)


def test_it_reads_back_in_unity_axes_and_metres(tmp_path: Path) -> None:
    motion = a_motion()
    (file,) = vrma.write(tmp_path / "x.vrma", motion)
    back = vrma.read(file).motion
    assert back is not None
    bones = [j for j, name in enumerate(motion.bone_names) if name not in vrma.EYES]
    body = Motion.build(
        motion.times, (), None, tuple(motion.bone_names[j] for j in bones),
        motion.positions[:, bones], motion.rotations[:, bones],
    )  # fmt: skip
    assert_same_motion(back, body, atol=1e-5)
    for shape in ("A", "Joy", "Blink_L"):
        got = back.shapes[:, back.shape_names.index(vrma.expression_of(shape))]
        np.testing.assert_allclose(got, motion.shapes[:, motion.shape_names.index(shape)], atol=1e-6)


def test_the_gaze_of_both_eyes_comes_back(tmp_path: Path) -> None:
    turn = rotation.from_euler_yxz(np.radians([0.0, 20.0]), np.radians([0.0, -10.0]), [0.0, 0.0])
    eyes = Motion.build(
        [0.0, 0.1], (), None, ("Head", *vrma.EYES), None,
        np.stack([np.tile(rotation.IDENTITY, (2, 1)), turn, turn], axis=1),
    )  # fmt: skip
    (file,) = vrma.write(tmp_path / "x.vrma", eyes)
    back = vrma.read(file).motion
    assert back is not None
    for eye in vrma.EYES:
        got = back.rotations[:, back.bone_names.index(eye)]
        assert np.degrees(rotation.angle_between(got, turn).max()) < 0.01


def test_a_face_alone_gets_a_figure_at_rest(tmp_path: Path) -> None:
    motion = Motion.build([0.0, 0.1], ("JawOpen", "aa"), [[0.0, 0.0], [1.0, 0.5]])
    (file,) = vrma.write(tmp_path / "x.vrma", motion)
    back = vrma.read(file).motion
    assert back is not None
    assert set(vrma.REQUIRED) <= set(back.bone_names)
    np.testing.assert_allclose(back.shapes[1, back.shape_names.index("JawOpen")], 1.0)
    np.testing.assert_allclose(back.shapes[1, back.shape_names.index("aa")], 0.5)


def test_nodes_stand_as_univrm_takes_them(tmp_path: Path) -> None:
    (file,) = vrma.write(tmp_path / "x.vrma", a_motion(3))
    document = document_of(file)
    extension = document["extensions"]["VRMC_vrm_animation"]
    bones = {name: place["node"] for name, place in extension["humanoid"]["humanBones"].items()}
    assert not {"leftEye", "rightEye"} & set(bones)
    faces = [place["node"] for place in extension["expressions"]["preset"].values()]
    assert min(faces) > max(*bones.values(), extension["lookAt"]["node"])
    moved = [
        (channel["target"]["node"], channel["target"]["path"])
        for channel in document["animations"][0]["channels"]
    ]
    assert moved[-len(faces) :] == [(node, "translation") for node in sorted(faces)]
    assert [node for node, path in moved if path == "translation"] == [bones["hips"], *sorted(faces)]
    assert document["scenes"][0]["nodes"] == [0, *sorted(faces)]


def test_no_motion_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RequestError) as error:
        vrma.write(tmp_path / "x.vrma", Motion.build([]))
    assert error.value.what == "There is no motion to write to x.vrma."
    assert not (tmp_path / "x.vrma").exists()


def document_of(file: Path) -> dict[str, Any]:
    data = file.read_bytes()
    (length,) = struct.unpack_from("<I", data, 12)
    document: dict[str, Any] = json.loads(data[20 : 20 + length])
    return document


def with_document(file: Path, document: dict[str, Any]) -> None:
    """Put another document into a GLB."""
    data = file.read_bytes()
    (length,) = struct.unpack_from("<I", data, 12)
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    rest = data[20 + length :]
    total = 20 + len(text) + len(rest)
    file.write_bytes(
        struct.pack("<4sII", b"glTF", 2, total) + struct.pack("<I4s", len(text), b"JSON") + text + rest
    )


def hang_in_a_circle(document: dict[str, Any]) -> None:
    document["nodes"][2]["children"] = [1]
    document["nodes"][0]["children"] = []


def claim_a_huge_array(document: dict[str, Any]) -> None:
    document["accessors"][1]["count"] = 2**40


def leave_out_the_extension(document: dict[str, Any]) -> None:
    del document["extensions"]


def point_nowhere(document: dict[str, Any]) -> None:
    document["extensions"]["VRMC_vrm_animation"]["humanoid"]["humanBones"]["hips"]["node"] = 9999


def hold_text_for_numbers(document: dict[str, Any]) -> None:
    document["nodes"][1]["translation"] = ["a", "b", "c"]


def stop_moving(document: dict[str, Any]) -> None:
    document["animations"] = []


@pytest.mark.parametrize(
    ("damage", "what"),
    [
        (hang_in_a_circle, "x.vrma is damaged."),
        (claim_a_huge_array, "x.vrma is cut short or damaged."),
        (leave_out_the_extension, "x.vrma is not a VRM Animation."),
        (point_nowhere, "x.vrma is damaged."),
        (hold_text_for_numbers, "x.vrma is damaged."),
        (stop_moving, "x.vrma holds no motion."),
    ],
)
def test_hostile_files_are_one_sentence(tmp_path: Path, damage: Any, what: str) -> None:
    (file,) = vrma.write(tmp_path / "x.vrma", a_motion(3))
    document = document_of(file)
    damage(document)
    with_document(file, document)
    with pytest.raises(StudioError) as error:
        vrma.read(file)
    assert error.value.what == what


def test_a_small_file_that_claims_to_last_all_day_is_refused(tmp_path: Path) -> None:
    even = a_motion(2)
    (file,) = vrma.write(tmp_path / "x.vrma", even)
    data = file.read_bytes()
    (length,) = struct.unpack_from("<I", data, 12)
    start = 20 + length + 8
    file.write_bytes(data[:start] + struct.pack("<2f", 0.0, 80000.0) + data[start + 8 :])
    with pytest.raises(StudioError) as error:
        vrma.read(file)
    assert error.value.what == "x.vrma claims to last 80000 s, with 2 keys only."
