"""MikuMikuDance motions, judged by the bytes and by where an arm points."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from studio.errors import RequestError, StudioError
from studio.formats import vmd
from studio.motion import Motion, Skeleton, rotation
from tests.formats.examples import a_motion
from tests.world import world_of

ARM = ("Hips", "Spine", "LeftShoulder", "LeftUpperArm", "LeftLowerArm", "LeftHand")


def parsed(
    path: Path,
) -> tuple[dict[str, list[tuple[int, tuple[float, ...]]]], dict[str, list[tuple[int, float]]]]:
    """Bones and morphs by name, straight from the bytes."""
    data = path.read_bytes()
    bones: dict[str, list[tuple[int, tuple[float, ...]]]] = {}
    morphs: dict[str, list[tuple[int, float]]] = {}
    (count,) = struct.unpack_from("<I", data, 50)
    for i in range(count):
        name, frame, *values = struct.unpack_from("<15sI7f", data, 54 + 111 * i)
        bones.setdefault(name.rstrip(b"\0").decode("shift_jis"), []).append((frame, tuple(values)))
    start = 54 + 111 * count
    (count,) = struct.unpack_from("<I", data, start)
    for i in range(count):
        name, frame, weight = struct.unpack_from("<15sIf", data, start + 4 + 23 * i)
        morphs.setdefault(name.rstrip(b"\0").decode("shift_jis"), []).append((frame, weight))
    assert data[start + 4 + 23 * count :] == bytes(12)
    return bones, morphs


def test_the_face_is_morphs_by_their_japanese_names(tmp_path: Path) -> None:
    t = np.arange(5) / 30
    weights = np.stack([np.linspace(0, 1, 5), np.full(5, 0.25)], axis=1)
    (file,) = vmd.write(tmp_path / "歌.vmd", Motion.build(t, ("A", "blink"), weights))
    assert file.read_bytes().startswith(b"Vocaloid Motion Data 0002\0\0\0\0\0")
    _, morphs = parsed(file)
    assert morphs["あ"] == [(i, pytest.approx(i / 4)) for i in range(5)]
    assert morphs["まばたき"] == [(0, 0.25), (4, 0.25)]


def test_an_arm_at_mmds_rest_has_no_turn(tmp_path: Path) -> None:
    down = rotation.from_axis_angle([0.0, 0.0, 1.0], np.radians(35.0))  # Unity: the left arm is along -X
    turns = np.tile(rotation.IDENTITY, (2, len(ARM), 1))
    turns[:, ARM.index("LeftUpperArm")] = down
    (file,) = vmd.write(tmp_path / "x.vmd", Motion.build([0.0, 0.1], (), None, ARM, None, turns))
    bones, _ = parsed(file)
    for name in ("左肩", "左腕", "左ひじ", "左手首", "上半身", "下半身"):
        np.testing.assert_allclose(bones[name][0][1][3:], [0, 0, 0, 1], atol=1e-6, err_msg=name)


def test_a_lifted_arm_points_up_in_mmds_axes(tmp_path: Path) -> None:
    turns = np.tile(rotation.IDENTITY, (2, len(ARM), 1))
    turns[:, ARM.index("LeftUpperArm")] = rotation.from_axis_angle([0.0, 0.0, 1.0], np.radians(-90.0))
    motion = Motion.build([0.0, 0.1], (), None, ARM, None, turns)
    hand = world_of(motion)[0][0, ARM.index("LeftHand")] - world_of(motion)[0][0, ARM.index("LeftUpperArm")]
    assert hand[1] > 0.4
    (file,) = vmd.write(tmp_path / "x.vmd", motion)
    turn = parsed(file)[0]["左腕"][0][1][3:]
    rest = np.array([np.cos(np.radians(35)), -np.sin(np.radians(35)), 0.0])  # an MMD model's left arm
    np.testing.assert_allclose(rotation.rotate(turn, rest), [0.0, 1.0, 0.0], atol=1e-6)


def test_leaning_forward_is_forward_for_a_model_that_faces_minus_z(tmp_path: Path) -> None:
    turns = np.tile(rotation.from_axis_angle([1.0, 0.0, 0.0], np.radians(30.0)), (2, 1, 1))
    (file,) = vmd.write(tmp_path / "x.vmd", Motion.build([0.0, 0.1], (), None, ("Spine",), None, turns))
    turn = parsed(file)[0]["上半身"][0][1][3:]
    assert rotation.rotate(turn, [0.0, 1.0, 0.0])[2] == pytest.approx(-0.5, abs=1e-6)


def test_body_and_face_come_back(tmp_path: Path) -> None:
    motion = a_motion(60, fps=30.0)
    (file,) = vmd.write(tmp_path / "x.vmd", motion)
    back = vmd.read(file).motion
    assert back is not None
    kept = [j for j, name in enumerate(motion.bone_names) if name in vmd.BONES_KEPT]
    wanted = world_of(motion)[1][:, kept]
    places = [back.bone_names.index(motion.bone_names[j]) for j in kept]
    assert np.degrees(rotation.angle_between(world_of(back)[1][:, places], wanted).max()) < 0.1
    for shape in ("A", "Blink_R", "Sorrow"):
        np.testing.assert_allclose(
            back.shapes[:, back.shape_names.index(shape)],
            motion.shapes[:, motion.shape_names.index(shape)], atol=1e-5,
        )  # fmt: skip


def test_what_the_centre_moves_is_metres(tmp_path: Path) -> None:
    rest = Skeleton.humanoid(("Hips", "Head")).rest_positions
    positions = np.tile(rest, (2, 1, 1))
    positions[1, 0] += [0.08, 0.0, 0.16]
    (file,) = vmd.write(
        tmp_path / "x.vmd", Motion.build([0.0, 1 / 30], (), None, ("Hips", "Head"), positions)
    )
    moved = np.array([values[:3] for _, values in parsed(file)[0]["センター"]])
    np.testing.assert_allclose(moved[1] - moved[0], [-1.0, 0.0, -2.0], atol=1e-4)


def test_keys_are_not_repeated_while_nothing_moves(tmp_path: Path) -> None:
    still = Motion.build(np.arange(300) / 30, ("A",), np.zeros((300, 1)), ("Head",))
    (file,) = vmd.write(tmp_path / "x.vmd", still)
    bones, morphs = parsed(file)
    assert [frame for frame, _ in bones["頭"]] == [0, 299]
    assert [frame for frame, _ in morphs["あ"]] == [0, 299]


@pytest.mark.parametrize("frame", [524_288, 2**32 - 1])
def test_one_wrong_frame_number_does_not_make_hours_of_a_dance(tmp_path: Path, frame: int) -> None:
    (file,) = vmd.write(tmp_path / "x.vmd", a_motion(90, 30.0))
    data = bytearray(file.read_bytes())
    struct.pack_into("<I", data, 54 + 111 * 70 + 15, frame)
    file.write_bytes(data)
    found = vmd.read(file)
    assert found.motion is not None
    assert len(found.motion) == 90
    assert found.notes[0] == f"x.vmd: 1 key left out, at {frame / 30:.0f} s, far behind all others."


def a_vmd(path: Path, morph: bytes, frame: int, weight: float) -> Path:
    key = struct.pack("<15sIf", morph, frame, weight)
    path.write_bytes(
        b"Vocaloid Motion Data 0002".ljust(50, b"\0") + struct.pack("<II", 0, 1) + key + bytes(12)
    )
    return path


def test_a_name_cut_within_a_letter_is_still_read(tmp_path: Path) -> None:
    name = "口角がとても上がる".encode("shift_jis")[:15]
    motion = vmd.read(a_vmd(tmp_path / "x.vmd", name, 1, 1.0)).motion
    assert motion is not None
    assert motion.shape_names == ("口角がとても上",)


@pytest.mark.parametrize(
    ("frame", "weight", "what"),
    [
        (2**32 - 1, 1.0, "x.vmd claims to last 143165576 s."),
        (1, float("nan"), "x.vmd is damaged."),
    ],
)
def test_hostile_numbers_are_one_sentence(tmp_path: Path, frame: int, weight: float, what: str) -> None:
    with pytest.raises(StudioError) as error:
        vmd.read(a_vmd(tmp_path / "x.vmd", b"A", frame, weight))
    assert error.value.what == what


def test_a_count_beyond_the_file_is_one_sentence(tmp_path: Path) -> None:
    path = tmp_path / "x.vmd"
    path.write_bytes(b"Vocaloid Motion Data 0002".ljust(50, b"\0") + struct.pack("<I", 2**32 - 1))
    with pytest.raises(StudioError) as error:
        vmd.read(path)
    assert error.value.what == "x.vmd is cut short or damaged."


def test_no_motion_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RequestError) as error:
        vmd.write(tmp_path / "x.vmd", Motion.build([]))
    assert error.value.what == "There is no motion to write to x.vmd."
    assert not (tmp_path / "x.vmd").exists()
