"""Files for researchers, opened as a researcher opens them."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from studio.errors import RequestError
from studio.formats import npz, parquet
from studio.motion import Motion
from tests.formats.examples import a_motion


def test_numpy_opens_what_was_written_without_pickle(tmp_path: Path) -> None:
    motion = a_motion(10)
    (file,) = npz.write(tmp_path / "x.npz", motion)
    with np.load(file, allow_pickle=False) as data:
        np.testing.assert_array_equal(data["times"], motion.times)
        np.testing.assert_array_equal(data["rotations"], motion.rotations)
        assert tuple(data["shape_names"]) == motion.shape_names
        head = list(data["bone_names"]).index("Head")
        assert data["bone_names"][data["parents"][head]] == "Neck"


def test_a_table_has_a_row_a_frame_and_a_column_a_number(tmp_path: Path) -> None:
    import pyarrow.parquet as pq

    motion = a_motion(10)
    (file,) = parquet.write(tmp_path / "x.parquet", motion)
    table = pq.ParquetFile(str(file)).read()
    assert table.shape == (10, 1 + 18 + 54 * 7 + 7)
    np.testing.assert_array_equal(table.column("A").to_numpy(), motion.shapes[:, 0])
    head = motion.bone_names.index("Head")
    np.testing.assert_array_equal(table.column("HeadRotW").to_numpy(), motion.rotations[:, head, 3])


@pytest.mark.parametrize("module", [npz, parquet])
def test_no_motion_is_refused(module: ModuleType, tmp_path: Path) -> None:
    path = tmp_path / f"x{module.SUFFIX}"
    with pytest.raises(RequestError) as error:
        module.write(path, Motion.build([]))
    assert error.value.what == f"There is no motion to write to {path.name}."
    assert not path.exists()
