"""Live Link Face files, real ones and small ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from studio.errors import StudioError
from studio.formats import livelink
from tests.formats.examples import needs_data

HEAD = "Timecode,BlendShapeCount,EyeBlinkLeft,jawopen,HeadYaw,HeadPitch,HeadRoll\n"


def write(path: Path, *rows: str) -> Path:
    path.write_text(HEAD + "".join(f"{row}\n" for row in rows))
    return path


def test_a_timecode_counts_frames_of_sixty_with_fractions_of_a_frame(tmp_path: Path) -> None:
    path = write(
        tmp_path / "x.csv", "10:13:39:58.500,61,0,0,0,0,0", "10:13:39:59.500,61,0,1,0,0,0",
        "10:13:40:00.500,61,0,1,0,0,0",
    )  # fmt: skip
    motion = livelink.read(path).motion
    assert motion is not None
    np.testing.assert_allclose(motion.times, [0, 1 / 60, 2 / 60], atol=1e-9)


def test_midnight_does_not_end_a_take(tmp_path: Path) -> None:
    path = write(tmp_path / "x.csv", "23:59:59:30.000,61,0,0,0,0,0", "00:00:00:00.000,61,0,0,0,0,0")
    motion = livelink.read(path).motion
    assert motion is not None
    np.testing.assert_allclose(motion.times, [0, 0.5], atol=1e-9)


def test_one_wrong_timecode_costs_its_own_row(tmp_path: Path) -> None:
    codes = [f"10:13:39:{frame:02d}.000" for frame in range(20)]
    codes[7] = "23:13:39:07.000"
    path = write(tmp_path / "x.csv", *(f"{code},61,0,0,0,0,0" for code in codes))
    imported = livelink.read(path)
    assert imported.motion is not None
    np.testing.assert_allclose(imported.motion.times, np.delete(np.arange(20), 7) / 60, atol=1e-9)
    assert "x.csv: 1 row with a wrong time left out." in imported.notes


@pytest.mark.parametrize("code", ["24:00:00:00.000", "10:60:00:00.000", f"10:00:00:{'9' * 5000}"])
def test_a_timecode_that_cannot_be_is_one_sentence(tmp_path: Path, code: str) -> None:
    path = write(tmp_path / "x.csv", "10:00:00:00.000,61,0,0,0,0,0", f"{code},61,0,0,0,0,0")
    with pytest.raises(StudioError) as error:
        livelink.read(path)
    assert error.value.what == f"x.csv has the timecode {code[:20]!r} in row 3."


@pytest.mark.parametrize("end", [b"\n\xd8", b"\n1,\xff\n00:00:00:02.000,61,0,0,0,0,0\n"])
def test_bytes_that_are_no_text_are_one_sentence(
    tmp_path: Path, end: bytes, capfd: pytest.CaptureFixture[str]
) -> None:
    path = write(
        tmp_path / "x.csv", "00:00:00:00.000,61,0.25,0.5,0,0,0", *["00:00:00:01.000,61,0,0,0,0,0"] * 50_000
    )
    with path.open("ab") as file:
        file.write(end)
    with pytest.raises(StudioError) as error:
        livelink.read(path)
    assert error.value.what == "x.csv is damaged: not all of it is text."
    assert capfd.readouterr() == ("", "")


def test_names_are_spelt_as_arkit_spells_them(tmp_path: Path) -> None:
    path = write(tmp_path / "x.csv", "00:00:00:00.000,61,0.25,0.5,0,0,0", "00:00:00:01.000,61,0,0,0,0,0")
    motion = livelink.read(path).motion
    assert motion is not None
    assert motion.shape_names == ("EyeBlinkLeft", "JawOpen")
    np.testing.assert_allclose(motion.shapes[0], [0.25, 0.5])


def test_the_head_turns_and_it_is_said_how_it_was_read(tmp_path: Path) -> None:
    path = write(tmp_path / "x.csv", "00:00:00:00.000,61,0,0,0,0.5,0", "00:00:00:01.000,61,0,0,0.5,0,0")
    imported = livelink.read(path)
    assert imported.motion is not None
    assert imported.motion.bone_names == ("Head",)
    np.testing.assert_allclose(imported.motion.rotations[0, 0], [np.sin(0.25), 0, 0, np.cos(0.25)], atol=1e-6)
    np.testing.assert_allclose(
        imported.motion.rotations[1, 0], [0, -np.sin(0.25), 0, np.cos(0.25)], atol=1e-6
    )
    assert "The turns of head and eyes were read as radians." in imported.notes


def test_frames_without_a_face_are_left_out_and_said_so(tmp_path: Path) -> None:
    path = write(
        tmp_path / "x.csv",
        "00:00:00:00.000,61,0,0,0,0,0",
        "00:00:00:01.000,0",
        "00:00:00:02.000,61,1,0,0,0,0",
    )
    imported = livelink.read(path)
    assert imported.motion is not None
    assert len(imported.motion) == 2
    assert "x.csv: 1 row without values left out." in imported.notes


def test_a_timecode_that_makes_no_sense_is_one_sentence(tmp_path: Path) -> None:
    path = write(tmp_path / "x.csv", "00:00:00:00.000,61,0,0,0,0,0", "noon,61,0,0,0,0,0")
    with pytest.raises(StudioError) as error:
        livelink.read(path)
    assert error.value.what == "x.csv has the timecode 'noon' in row 3."


def test_the_real_recording() -> None:
    folder = needs_data("livelink_pair")
    imported = livelink.read(folder / "testset.csv", folder / "audio.wav")
    assert imported.motion is not None
    assert len(imported.motion.shape_names) == 52
    assert imported.motion.bone_names == ("Head", "LeftEye", "RightEye")
    assert imported.motion.fps == pytest.approx(59.9, abs=0.2)
    assert imported.motion.duration == pytest.approx(20.4, abs=0.2)


def test_the_real_recordings_with_lost_faces() -> None:
    folder = needs_data("livelink_face")
    imported = livelink.read(folder / "apfel.csv")
    assert imported.motion is not None
    assert len(imported.motion) == 1926 - 35
    assert "apfel.csv: 35 rows without values left out." in imported.notes
