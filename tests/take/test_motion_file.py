"""The motion file: exact, and damage is a sentence."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest

from studio.errors import StudioError
from studio.motion import Motion
from studio.motion.channels import BONES
from studio.take.motion_file import read_motion, read_times, write_motion
from tests.formats.examples import a_motion

PARTS = ("times", "shapes", "positions", "rotations", "root_position", "root_rotation")


@pytest.mark.parametrize(
    "motion",
    [
        a_motion(10_000),
        Motion.build([0.0, 0.5], ("笑顔",), [[0.1], [0.2]]),
        Motion.build([0.0], (), None, ("Hips",)),
        Motion.build([], ("A",), None, BONES),
        Motion.build([]),
    ],
    ids=["several batches", "face only", "one frame", "no frame", "nothing"],
)
def test_everything_comes_back_exactly(tmp_path: Path, motion: Motion) -> None:
    write_motion(tmp_path / "m.arrow", motion)
    back = read_motion(tmp_path / "m.arrow")
    assert (back.shape_names, back.bone_names) == (motion.shape_names, motion.bone_names)
    for part in PARTS:
        np.testing.assert_array_equal(getattr(back, part), getattr(motion, part))
        assert getattr(back, part).dtype == getattr(motion, part).dtype


def test_any_arrow_reader_opens_it(tmp_path: Path) -> None:
    write_motion(tmp_path / "m.arrow", a_motion(5))
    table = pa.ipc.open_file(tmp_path / "m.arrow").read_all()
    assert table.num_rows == 5
    assert table.column("time").to_pylist()[1] == pytest.approx(1 / 60)
    assert len(table.column("rotations")[0]) == 54 * 4


@pytest.mark.parametrize("keep", [0, 10, 2000])
def test_a_file_cut_short_is_damaged(tmp_path: Path, keep: int) -> None:
    path = tmp_path / "m.arrow"
    write_motion(path, a_motion())
    path.write_bytes(path.read_bytes()[:keep])
    with pytest.raises(StudioError) as error:
        read_motion(path)
    assert error.value.what == f"m.arrow in {tmp_path.name} is damaged."


def test_the_times_alone_are_those_of_the_whole(tmp_path: Path) -> None:
    path = tmp_path / "m.arrow"
    write_motion(path, a_motion(9000))
    np.testing.assert_array_equal(read_times(path), read_motion(path).times)


def test_a_foreign_arrow_file_is_damaged(tmp_path: Path) -> None:
    table = pa.table({"x": [1, 2]})
    with pa.ipc.new_file(tmp_path / "m.arrow", table.schema) as writer:
        writer.write_table(table)
    with pytest.raises(StudioError) as error:
        read_motion(tmp_path / "m.arrow")
    assert error.value.what == f"m.arrow in {tmp_path.name} is damaged."


def test_names_nested_deeper_than_python_reads_are_damage(tmp_path: Path) -> None:
    write_motion(tmp_path / "m.arrow", a_motion(2))
    table = pa.ipc.open_file(tmp_path / "m.arrow").read_all()
    table = table.replace_schema_metadata({**table.schema.metadata, b"shape_names": b"[" * 100_000})
    with pa.ipc.new_file(tmp_path / "n.arrow", table.schema) as writer:
        writer.write_table(table)
    with pytest.raises(StudioError) as error:
        read_motion(tmp_path / "n.arrow")
    assert error.value.what == f"n.arrow in {tmp_path.name} is damaged."


def test_a_newer_file_says_so(tmp_path: Path) -> None:
    write_motion(tmp_path / "m.arrow", a_motion(2))
    table = pa.ipc.open_file(tmp_path / "m.arrow").read_all()
    table = table.replace_schema_metadata({**table.schema.metadata, b"saia_motion_version": b"9"})
    with pa.ipc.new_file(tmp_path / "n.arrow", table.schema) as writer:
        writer.write_table(table)
    with pytest.raises(StudioError) as error:
        read_motion(tmp_path / "n.arrow")
    assert error.value.what == f"n.arrow in {tmp_path.name} was written by a newer Saia Studio."
