"""BVH files, judged by a golden file, by kinematics of our own from the text, and by a foreign reader."""

from __future__ import annotations

import json
import math
import warnings
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from studio.errors import RequestError, StudioError
from studio.formats import bvh
from studio.motion import Motion, Skeleton, rotation
from tests.formats.examples import a_motion, assert_same_motion
from tests.formats.foreign_node import ask
from tests.world import world_of

GOLDEN = Path(__file__).resolve().parent.parent / "golden" / "three_frames.bvh"
MIRROR = np.array([-1.0, 1.0, 1.0])


def three_frames() -> Motion:
    """Hips walk, the left arm lifts and the head nods: numbers a person can follow in the golden file."""
    names = ("Head", "Hips", "LeftHand", "LeftLowerArm", "LeftUpperArm", "Spine")
    rest = Skeleton.humanoid(names).rest_positions
    positions = np.tile(rest, (3, 1, 1))
    positions[:, 1] += [[0, 0, 0], [0.1, 0, 0.2], [0.2, 0.05, 0.4]]
    rotations = np.tile(rotation.IDENTITY, (3, len(names), 1))
    rotations[1:, 4] = rotation.from_axis_angle([0.0, 0.0, 1.0], np.radians([-45.0, -90.0]))
    rotations[1:, 0] = rotation.from_axis_angle([1.0, 0.0, 0.0], np.radians([10.0, 20.0]))
    rotations[:, 1] = rotation.from_axis_angle([0.0, 1.0, 0.0], np.radians([0.0, 15.0, 30.0]))
    return Motion.build(np.arange(3) / 60, (), None, names, positions, rotations)


def world_from_text(text: str) -> tuple[list[str], NDArray[np.float64]]:
    """Joint names and world positions (T, J, 3) in cm, by matrices straight from the text."""
    words = text.split()
    names: list[str] = []
    parents: list[int] = []
    offsets: list[list[float]] = []
    channels: list[list[str]] = []
    stack: list[int] = []
    i, end = 0, False
    while words[i] != "MOTION":
        if words[i] in ("ROOT", "JOINT"):
            names.append(words[i + 1])
            parents.append(stack[-1] if stack else -1)
            stack.append(len(names) - 1)
        elif words[i] == "End":
            end = True
        elif words[i] == "OFFSET" and not end:
            offsets.append([float(w) for w in words[i + 1 : i + 4]])
        elif words[i] == "CHANNELS":
            channels.append(words[i + 2 : i + 2 + int(words[i + 1])])
        elif words[i] == "}":
            if not end:
                stack.pop()
            end = False
        i += 1
    frames = int(words[i + 2])
    numbers = np.array([float(w) for w in words[i + 6 :]]).reshape(frames, -1)
    world = np.zeros((frames, len(names), 3))
    for f in range(frames):
        turns: list[NDArray[np.float64]] = []
        column = 0
        for j, parent in enumerate(parents):
            local, place = np.eye(3), np.array(offsets[j])
            for channel in channels[j]:
                value = numbers[f, column]
                column += 1
                if channel.endswith("position"):
                    place["XYZ".index(channel[0])] = value
                else:
                    local = local @ turn("XYZ".index(channel[0]), math.radians(value))
            up = turns[parent] if parent >= 0 else np.eye(3)
            world[f, j] = (world[f, parent] if parent >= 0 else 0) + up @ place
            turns.append(up @ local)
    return names, world


def turn(axis: int, angle: float) -> NDArray[np.float64]:
    matrix = np.eye(3)
    a, b = [(1, 2), (2, 0), (0, 1)][axis]
    matrix[a, a] = matrix[b, b] = math.cos(angle)
    matrix[a, b], matrix[b, a] = -math.sin(angle), math.sin(angle)
    return matrix


def expected(motion: Motion, names: list[str]) -> NDArray[np.float64]:
    """Where the bones stand, in the axes and unit of a BVH."""
    world = world_of(motion)[0] * MIRROR * 100
    return world[:, [motion.bone_names.index(name) for name in names]]


def test_the_golden_file(tmp_path: Path) -> None:
    (file,) = bvh.write(tmp_path / "three_frames.bvh", three_frames())
    assert file.read_text() == GOLDEN.read_text()


def test_every_joint_stands_where_the_motion_has_it(tmp_path: Path) -> None:
    motion = a_motion(12)
    (file,) = bvh.write(tmp_path / "x.bvh", motion)
    names, world = world_from_text(file.read_text())
    assert set(names) == set(motion.bone_names)
    np.testing.assert_allclose(world, expected(motion, names), atol=0.01)


def test_a_foreign_reader_sees_the_same_figure(tmp_path: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # bvhio's own imports of PyGLM are deprecated
        bvhio = pytest.importorskip("bvhio")
        motion = a_motion(6)
        (file,) = bvh.write(tmp_path / "x.bvh", motion)
        root = bvhio.readAsHierarchy(str(file))
        for frame in range(len(motion)):
            root.loadPose(frame)
            joints = [joint for joint, _, _ in root.layout()]
            got = np.array([tuple(joint.PositionWorld) for joint in joints])
            wanted = expected(motion, [joint.Name for joint in joints])[frame]
            np.testing.assert_allclose(got, wanted, atol=0.02)


@pytest.mark.slow
def test_three_js_sees_every_joint_where_the_motion_has_it(tmp_path: Path) -> None:
    motion = a_motion(20)
    (file,) = bvh.write(tmp_path / "名前 x.bvh", motion)
    rows = [0, 7, 18]
    seen = ask("read_bvh.mjs", str(file), json.dumps(motion.times[rows].tolist()))
    positions, turns = world_of(motion)
    for frame, row in zip(seen["frames"], rows, strict=True):
        assert set(frame) == set(motion.bone_names)
        at = np.array([frame[name]["at"] for name in motion.bone_names]) / 100  # centimetres
        assert np.linalg.norm(at - positions[row] * [-1.0, 1.0, 1.0], axis=1).max() < 0.001
        turned = [frame[name]["turned"] for name in motion.bone_names]
        far = rotation.angle_between(turned, turns[row] * [1.0, -1.0, -1.0, 1.0])
        assert np.degrees(far.max()) < 0.1


def test_it_reads_back_in_unity_axes_and_metres(tmp_path: Path) -> None:
    motion = a_motion()
    (file,) = bvh.write(tmp_path / "x.bvh", motion)
    body = Motion.build(motion.times, (), None, motion.bone_names, motion.positions, motion.rotations)
    assert_same_motion(bvh.read(file).motion, body, atol=1e-4)


def test_the_root_moves_the_hips(tmp_path: Path) -> None:
    still = three_frames()
    motion = Motion.build(
        still.times, (), None, still.bone_names, still.positions, still.rotations,
        root_position=np.tile([1.0, 0.0, 2.0], (3, 1)),
        root_rotation=np.tile(rotation.from_axis_angle([0.0, 1.0, 0.0], 0.7), (3, 1)),
    )  # fmt: skip
    (file,) = bvh.write(tmp_path / "x.bvh", motion)
    names, world = world_from_text(file.read_text())
    np.testing.assert_allclose(world, expected(motion, names), atol=0.01)


def test_uneven_frames_land_on_an_even_grid_from_the_sounds_start(tmp_path: Path) -> None:
    even = a_motion(61, fps=30.0)
    times = even.times + np.where(np.arange(61) % 2, 0.004, 0.0) + 0.5
    uneven = Motion.build(
        times, even.shape_names, even.shapes, even.bone_names, even.positions, even.rotations
    )
    (file,) = bvh.write(tmp_path / "x.bvh", uneven)
    back = bvh.read(file).motion
    assert back is not None
    assert back.times[-1] == pytest.approx(2.5, abs=1 / 25)
    at = 1.3
    names = list(back.bone_names)
    got = world_of(back.at([at]))[0][0] * MIRROR * 100
    np.testing.assert_allclose(got, expected(uneven.at([at]), names)[0], atol=0.3)


def test_hips_without_a_height_are_lifted(tmp_path: Path) -> None:
    motion = three_frames()
    flat = motion.positions.copy()
    flat[:, motion.bone_names.index("Hips")] = 0
    (file,) = bvh.write(
        tmp_path / "x.bvh", Motion.build(motion.times, (), None, motion.bone_names, flat, motion.rotations)
    )
    names, world = world_from_text(file.read_text())
    assert world[0, names.index("Hips"), 1] == pytest.approx(95.0)


def test_a_head_alone_gets_hips_to_hang_on(tmp_path: Path) -> None:
    nod = rotation.from_axis_angle([1.0, 0.0, 0.0], np.radians([[0.0], [30.0]]))
    motion = Motion.build([0.0, 0.1], (), None, ("Head",), None, nod)
    (file,) = bvh.write(tmp_path / "x.bvh", motion)
    names, world = world_from_text(file.read_text())
    assert names == ["Hips", "Head"]
    assert world[0, 1, 1] > world[0, 0, 1] > 0


def test_a_face_alone_is_refused(tmp_path: Path) -> None:
    motion = Motion.build([0.0, 0.1], ("A",), [[0.0], [1.0]])
    with pytest.raises(RequestError) as error:
        bvh.write(tmp_path / "x.bvh", motion)
    assert error.value.what == "There is no body motion to write to x.bvh."
    assert error.value.remedy == "Export it as SAIA CSV instead."
    assert not (tmp_path / "x.bvh").exists()


@pytest.mark.parametrize(
    ("text", "what"),
    [
        (
            "HIERARCHY\nROOT Hips\n{\nMOTION\nFrames: 1\nFrame Time: 0.1\n0\n",
            "The skeleton in x.bvh is damaged.",
        ),
        (
            "HIERARCHY\nROOT Hips\n{\nOFFSET 0 0 0\nCHANNELS 3 Xrotation Yrotation Zrotation\n"
            "JOINT Head\n{\nOFFSET 0 1 0\nCHANNELS 3 Xrotation Yrotation Zrotation\n}\n}\n"
            "MOTION\nFrames: 3\nFrame Time: 0.1\n0 0 0 0 0 0\n",
            "x.bvh ends after 1 of 3 frames.",
        ),
        (
            "HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 3 Xrotation Yrotation Zrotation\n}\n"
            "MOTION\nFrames: 1\nFrame Time: 0.1\n0 0 0\n",
            "The joints of x.bvh are not named as a humanoid's (Hips, Spine, Head, ...).",
        ),
    ],
)
def test_damage_is_one_sentence(tmp_path: Path, text: str, what: str) -> None:
    path = tmp_path / "x.bvh"
    path.write_text(text)
    with pytest.raises(StudioError) as error:
        bvh.read(path)
    assert error.value.what == what


def test_joints_that_are_no_bones_are_folded_into_those_below(tmp_path: Path) -> None:
    path = tmp_path / "x.bvh"
    turns = "CHANNELS 3 Zrotation Xrotation Yrotation"
    lines = [
        "HIERARCHY", "ROOT hips {", "OFFSET 0 0 0",
        "CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation",
        "JOINT twist {", "OFFSET 0 10 0", turns,
        "JOINT head {", "OFFSET 0 40 0", turns, "End Site {", "OFFSET 0 5 0", "}", "}", "}", "}",
        "MOTION", "Frames: 1", "Frame Time: 0.0333333", "0\t100 0  0 0 0  90 0 0  0 0 0 \r\n",
    ]  # fmt: skip
    path.write_text("\n".join(lines))
    imported = bvh.read(path)
    assert imported.motion is not None
    assert imported.motion.bone_names == ("Hips", "Head")
    world = world_of(imported.motion)[0][0]
    # A quarter turn about Z of the joint between puts the head 40 cm to the side, X reversed.
    np.testing.assert_allclose(world[1], [0.4, 1.1, 0.0], atol=1e-6)
    assert imported.notes[0] == "x.bvh: 1 joint folded into the others, such as twist."


@pytest.mark.parametrize(
    ("rest", "sentence"),
    [
        ("", "broken.bvh is damaged: it ends without its frames (there is no line MOTION)."),
        (
            "MOTION\nFrames: x\n",
            "broken.bvh is damaged: after MOTION in line 3, Frames or Frame Time is missing.",
        ),
    ],
)
def test_a_broken_file_is_called_damaged_not_of_another_kind(
    tmp_path: Path, rest: str, sentence: str
) -> None:
    path = tmp_path / "broken.bvh"
    path.write_text(f"HIERARCHY\nROOT a\n{rest}")
    with pytest.raises(StudioError) as caught:
        bvh.read(path)
    assert caught.value.what == sentence
