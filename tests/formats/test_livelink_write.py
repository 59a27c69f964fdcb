"""Writing Live Link Face files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from studio import formats
from studio.errors import RequestError
from studio.formats import livelink
from studio.motion import Motion, rotation
from studio.motion.channels import ARKIT_SHAPES
from tests.formats.examples import a_motion, needs_data


def test_arkit_shapes_come_back_exactly(tmp_path: Path) -> None:
    motion = a_motion(30, shapes=ARKIT_SHAPES)
    (file,) = livelink.write(tmp_path / "x.livelink.csv", motion)
    back = livelink.read(file).motion
    assert back is not None
    np.testing.assert_allclose(back.shapes, motion.shapes, atol=1e-7)
    np.testing.assert_allclose(back.times, motion.times, atol=1e-4)


def test_the_header_and_timecodes_are_those_of_the_app(tmp_path: Path) -> None:
    motion = Motion.build(np.arange(0, 62, 0.5) + 0.0, ("JawOpen",), np.zeros((124, 1)))
    (file,) = livelink.write(tmp_path / "x.livelink.csv", motion)
    lines = file.read_text().splitlines()
    columns = lines[0].split(",")
    assert columns[:3] == ["Timecode", "BlendshapeCount", "EyeBlinkLeft"]
    assert columns[-9:] == [
        f"{bone}{angle}" for bone in ("Head", "LeftEye", "RightEye") for angle in ("Yaw", "Pitch", "Roll")
    ]
    assert len(columns) == 63
    assert lines[1].startswith("00:00:00:00.000,61,0.0000000000,")
    assert lines[-1].startswith("00:01:01:30.000,61,")


def test_vrm_expressions_become_something_near(tmp_path: Path) -> None:
    motion = Motion.build([0.0, 0.1], ("A", "Blink_L", "LookLeft"), [[1.0, 0.0, 0.0], [0.0, 1.0, 0.5]])
    (file,) = livelink.write(tmp_path / "x.livelink.csv", motion)
    back = livelink.read(file).motion
    assert back is not None
    by_name = dict(zip(back.shape_names, back.shapes.T, strict=True))
    assert by_name["JawOpen"][0] > 0.5 > by_name["JawOpen"][1]
    assert by_name["EyeBlinkLeft"][1] == pytest.approx(1.0)
    assert by_name["EyeBlinkRight"].max() == 0
    assert by_name["EyeLookOutLeft"][1] == by_name["EyeLookInRight"][1] == pytest.approx(0.5)
    assert "approximate" in livelink.NOTE


def test_the_neck_counts_as_the_head(tmp_path: Path) -> None:
    half = rotation.from_axis_angle([0.0, 1.0, 0.0], np.radians([[0.0, 0.0], [10.0, 10.0]]))
    motion = Motion.build([0.0, 0.1], ("JawOpen",), None, ("Head", "Neck"), None, half)
    (file,) = livelink.write(tmp_path / "x.livelink.csv", motion)
    back = livelink.read(file).motion
    assert back is not None
    got = back.rotations[1, back.bone_names.index("Head")]
    assert rotation.angle_between(got, rotation.from_axis_angle([0.0, 1.0, 0.0], np.radians(20.0))) < 1e-5


def test_a_real_recording_is_written_as_it_was(tmp_path: Path) -> None:
    motion = livelink.read(needs_data("livelink_pair") / "testset.csv").motion
    assert motion is not None
    (file,) = livelink.write(tmp_path / "x.livelink.csv", motion)
    back = livelink.read(file).motion
    assert back is not None
    wanted = motion.at(back.times).shapes[:, [motion.shape_names.index(name) for name in ARKIT_SHAPES]]
    # A timecode counts thousandths of a frame, so a moment is read back up to half of one away: a shape may
    # differ by what it moves in that time.
    half_a_step = 0.5 / 1000 / livelink.TIMECODE_FPS
    steepest = np.abs(np.diff(motion.shapes, axis=0) / np.diff(motion.times)[:, None]).max()
    np.testing.assert_allclose(back.shapes, wanted, atol=1e-6 + half_a_step * steepest)


def test_a_body_alone_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RequestError) as error:
        livelink.write(tmp_path / "x.livelink.csv", a_motion(3, shapes=()))
    assert error.value.what == "There is no face to write to x.livelink.csv."
    assert error.value.remedy == "Export the body as BVH instead."


def test_its_ending_chooses_it_and_a_plain_csv_stays_saias() -> None:
    assert formats.writer_for(Path("take.livelink.csv")).TITLE == livelink.TITLE
    assert formats.writer_for(Path("take.csv")).TITLE != livelink.TITLE
