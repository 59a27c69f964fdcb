"""SAIA's layout, as the client, the notebook and people with other locales write it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from studio.errors import StudioError
from studio.formats import saia_csv
from studio.motion import Motion
from studio.motion.channels import BONES, VRM0_SHAPES
from tests.formats.examples import a_motion, a_sound, assert_same_motion, needs_data

PARTS = ("PosX", "PosY", "PosZ", "RotX", "RotY", "RotZ", "RotW")


def write_layout(
    folder: Path, motion: Motion, attribute_major: bool = False, bone_rows: int | None = None
) -> Path:
    """The layout as text, written without the code under test; gives the Blendshapes file."""
    (folder / "Blendshapes").mkdir(parents=True)
    (folder / "Bones").mkdir()
    lines = [",".join(["Time", *motion.shape_names])]
    lines += [
        ",".join(f"{v:.7f}" for v in [t, *row]) for t, row in zip(motion.times, motion.shapes, strict=True)
    ]
    (folder / "Blendshapes" / "x.csv").write_text("\n".join(lines) + "\n")
    if attribute_major:
        head = [bone + part for part in PARTS for bone in motion.bone_names]
    else:
        head = [bone + part for bone in motion.bone_names for part in PARTS]
    values = np.concatenate([motion.positions, motion.rotations], axis=-1).reshape(len(motion), -1)
    lines = [",".join(["Time", *head])]
    lines += [",".join(f"{v:.7f}" for v in [t, *row]) for t, row in zip(motion.times, values, strict=True)]
    (folder / "Bones" / "x.csv").write_text("\n".join(lines[: None if bone_rows is None else bone_rows + 1]))
    return folder / "Blendshapes" / "x.csv"


def test_client_files_are_read_by_their_headers(tmp_path: Path) -> None:
    motion = a_motion()
    path = write_layout(tmp_path, motion)
    a_sound(tmp_path / "Audio" / "x.wav")
    imported = saia_csv.read(path)
    assert_same_motion(imported.motion, motion)
    assert imported.audio == tmp_path / "Audio" / "x.wav"
    assert imported.notes == ()


def test_notebook_files_are_read_bone_by_bone_and_said_so(tmp_path: Path) -> None:
    motion = a_motion()
    a_sound(tmp_path / "Audio" / "x.wav")
    imported = saia_csv.read(write_layout(tmp_path, motion, attribute_major=True))
    assert_same_motion(imported.motion, motion)
    assert imported.notes == (
        "x.csv has the notebook's headers, which do not fit its values; it was read bone by bone.",
    )


def test_reading_from_the_bones_file_finds_the_shapes(tmp_path: Path) -> None:
    motion = a_motion()
    write_layout(tmp_path, motion)
    assert_same_motion(saia_csv.read(tmp_path / "Bones" / "x.csv").motion, motion)


def test_written_columns_stand_in_the_clients_order_under_right_headers(tmp_path: Path) -> None:
    shapes, bones = tuple(reversed(VRM0_SHAPES)), a_motion()
    motion = Motion.build(bones.times, shapes, bones.shapes, BONES, bones.positions, bones.rotations)
    shapes_file, bones_file = saia_csv.write(tmp_path / "x.csv", motion)
    assert shapes_file.read_text().splitlines()[0] == "Time," + ",".join(VRM0_SHAPES)
    header = bones_file.read_text().splitlines()[0].split(",")
    assert header == ["Time", *(bone + part for bone in BONES for part in PARTS)]
    assert len(VRM0_SHAPES) + len(header) - 1 == 396
    first = [float(cell) for cell in bones_file.read_text().splitlines()[1].split(",")]
    assert first[1:4] == pytest.approx(bones.positions[0, 0], abs=1e-6)
    assert first[4:8] == pytest.approx(bones.rotations[0, 0], abs=1e-6)


def test_face_only_files_are_imported_as_they_are(tmp_path: Path) -> None:
    path = tmp_path / "face.csv"
    path.write_text("Time,jawOpen,笑顔\n0,0,0.5\n0.1,1,0.25\n", encoding="utf-8")
    motion = saia_csv.read(path).motion
    assert motion is not None
    assert motion.shape_names == ("jawOpen", "笑顔")
    assert motion.bone_names == ()
    np.testing.assert_allclose(motion.shapes, [[0, 0.5], [1, 0.25]])


@pytest.mark.parametrize(
    "text",
    [
        "Time;A;I\n0,00;0,50;0,25\n0,10;1,00;0,75\n",
        "Time,A,I\n0,00,0,50,0,25\n0,10,1,00,0,75\n",
        'Time,A,I\n"0,00","0,50","0,25"\n"0,10","1,00","0,75"\n',
        "Time\tA\tI\n0,00\t0,50\t0,25\n0,10\t1,00\t0,75\n",
    ],
    ids=["semicolons", "commas for both", "quoted", "tabs"],
)
def test_decimal_commas_are_read_and_said_so(tmp_path: Path, text: str) -> None:
    path = tmp_path / "x.csv"
    path.write_text(text)
    imported = saia_csv.read(path)
    assert imported.motion is not None
    np.testing.assert_allclose(imported.motion.times, [0.0, 0.1])
    np.testing.assert_allclose(imported.motion.shapes, [[0.5, 0.25], [1.0, 0.75]])
    assert "x.csv is written with decimal commas; they were read as such." in imported.notes


def test_negative_numbers_between_doubled_commas_keep_their_sign(tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    path.write_text("Time,A\n0,0,-0,5\n0,1,0,5\n")
    motion = saia_csv.read(path).motion
    assert motion is not None
    np.testing.assert_allclose(motion.shapes[:, 0], [-0.5, 0.5])


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "cp932"])
def test_other_encodings_are_read(tmp_path: Path, encoding: str) -> None:
    path = tmp_path / "x.csv"
    path.write_bytes("Time,あ\r\n0,0.5\r\n0.1,1\r\n".encode(encoding))
    motion = saia_csv.read(path).motion
    assert motion is not None
    assert motion.shape_names == ("あ",)
    np.testing.assert_allclose(motion.shapes[:, 0], [0.5, 1.0])


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("", "x.csv holds no rows."),
        ("Time,A\n", "x.csv holds no rows."),
        ("A,B\n0,1\n", "x.csv has no Time column."),
        ("Time,A,B\n0,1,2\n1,2\n", "Row 3 of x.csv has 2 values where the header names 3 columns."),
        ("Time,A\n0,1\n1,abc\n", "x.csv has 'abc' where a number should be, in column A, row 3."),
        ("Time,A,A\n0,1,2\n", "x.csv has two columns called A."),
        ("Time\n0\n1\n", "x.csv has no blend shapes."),
        ("Time,A\n3,1\n2,1\n1,1\n", "The times in x.csv do not rise."),
    ],
)
def test_what_cannot_be_read_is_one_sentence(tmp_path: Path, text: str, what: str) -> None:
    path = tmp_path / "x.csv"
    path.write_text(text)
    with pytest.raises(StudioError) as error:
        saia_csv.read(path)
    assert error.value.what == what


def test_commas_for_everything_with_whole_numbers_are_refused_with_a_remedy(tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    path.write_text("Time,A\n0,0\n0,1,0,5\n")
    with pytest.raises(StudioError) as error:
        saia_csv.read(path)
    assert error.value.what == "Row 3 of x.csv has 4 values where the header names 2 columns."
    assert error.value.remedy == "If it has decimal commas, save it with semicolons or decimal points."


def test_unequal_lengths_meet_where_both_are(tmp_path: Path) -> None:
    motion = a_motion(30)
    imported = saia_csv.read(write_layout(tmp_path, motion, bone_rows=20))
    assert imported.motion is not None
    assert len(imported.motion) == 20
    assert_same_motion(imported.motion, motion.between(0, 19.5 / 60))
    assert imported.notes[0] == (
        "Blend shapes have 30 rows and bones 20; bones were read at the times of the shapes, 0.32 s in all."
    )


def test_a_bone_without_its_whole_rotation_is_left_out_and_said_so(tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    head = ",".join(["Time", *(f"Head{p}" for p in PARTS), "NeckPosX", "NeckRotX", "Comment"])
    path.write_text(head + "\n0,0,1,0,0,0,0,1,5,0,9\n0.1,0,1,0,0,0,0,1,5,0,9\n")
    imported = saia_csv.read(path)
    assert imported.motion is not None
    assert imported.motion.bone_names == ("Head",)
    assert "x.csv: 1 column left out, such as Comment: no bones." in imported.notes
    assert "x.csv: bones without a whole rotation were left out: Neck." in imported.notes


def test_a_bone_without_a_position_stands_where_the_skeleton_has_it(tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    path.write_text("Time,HeadRotX,HeadRotY,HeadRotZ,HeadRotW\n0,0,0,0,1\n0.1,0,0,0,1\n")
    imported = saia_csv.read(path)
    assert imported.motion is not None
    assert imported.motion.positions[0, 0, 1] > 1.0
    assert "x.csv: 1 bone without a position put where the built-in skeleton has it." in imported.notes


def test_rows_whose_time_stands_still_are_left_out_and_said_so(tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    path.write_text("Time,A\n0,0\n0.1,1\n0.1,0\n0.2,1\n")
    imported = saia_csv.read(path)
    assert imported.motion is not None
    np.testing.assert_allclose(imported.motion.times, [0, 0.1, 0.2])
    assert "x.csv: 1 row with a wrong time left out." in imported.notes


def test_empty_cells_take_the_value_above(tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    path.write_text("Time,A\n0,0.5\n0.1,\n0.2,NaN\n0.3,1\n")
    imported = saia_csv.read(path)
    assert imported.motion is not None
    np.testing.assert_allclose(imported.motion.shapes[:, 0], [0.5, 0.5, 0.5, 1.0])
    assert "x.csv has 2 empty cells; the value above was taken." in imported.notes


def test_percent_and_milliseconds_are_guessed_and_said_so(tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    path.write_text("Time,A\n0,0\n33,50\n66,100\n")
    imported = saia_csv.read(path)
    assert imported.motion is not None
    np.testing.assert_allclose(imported.motion.times, [0, 0.033, 0.066])
    np.testing.assert_allclose(imported.motion.shapes[:, 0], [0, 0.5, 1])
    assert "The values in x.csv reach 100; they were taken as percent." in imported.notes
    assert "The times in x.csv look like milliseconds and were read as such." in imported.notes


def test_the_sound_is_written_beside_with_its_own_bytes(tmp_path: Path) -> None:
    audio = a_sound(tmp_path / "in.wav", rate=48000, channels=2)
    files = saia_csv.write(tmp_path / "out" / "x.csv", a_motion(), audio)
    assert [str(f.relative_to(tmp_path / "out")) for f in files] == [
        "Blendshapes/x.csv",
        "Bones/x.csv",
        "Audio/x.wav",
    ]
    assert files[2].read_bytes() == audio.read_bytes()


@pytest.mark.slow
def test_a_million_lines_are_read(tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    rows = 1_000_000
    with path.open("w") as file:
        file.write("Time,A,I\n")
        file.writelines(f"{i / 60:.5f},0.{i % 10},0.5\n" for i in range(rows))
    motion = saia_csv.read(path).motion
    assert motion is not None
    assert len(motion) == rows
    assert motion.shapes[9, 0] == pytest.approx(0.9)


def test_the_real_takes_are_read_whole() -> None:
    folder = needs_data("facegood")
    imported = saia_csv.read(folder / "Blendshapes" / "2_04.csv")
    assert imported.motion is not None
    assert len(imported.motion) == 3377
    assert len(imported.motion.shape_names) == 37
    assert imported.motion.fps == pytest.approx(30, abs=0.01)
    assert imported.audio == folder / "Audio" / "2_04.wav"
    assert imported.notes == ()
