"""Apache Parquet, for researchers: one row a frame, one column a number."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from studio.errors import RequestError, say
from studio.formats._table import check_suffix
from studio.formats._writing import checked
from studio.motion import Motion

TITLE = "Parquet table"
SUFFIX = ".parquet"
NOTE = (
    "For pandas, R and DuckDB: one row a frame, columns such as Time, A and HeadRotX, the root last. Unity "
    "axes, metres and seconds; no sound."
)
_PLACE = ("PosX", "PosY", "PosZ")
_TURN = ("RotX", "RotY", "RotZ", "RotW")


def write(path: Path, motion: Motion, audio: Path | None = None) -> tuple[Path, ...]:
    """Write all numbers of a motion as one table; the sound is not part of it.

    Returns:
        The file, read back and compared number by number.
    """
    import pyarrow as pa
    import pyarrow.parquet as pq

    check_suffix(path, SUFFIX)
    if not len(motion):
        raise RequestError(
            say("There is no motion to write to {name}.", name=path.name), "Choose a take with motion."
        )
    columns = [("Time", motion.times), *zip(motion.shape_names, motion.shapes.T, strict=True)]
    for j, bone in enumerate(motion.bone_names):
        columns += [(bone + axis, motion.positions[:, j, i]) for i, axis in enumerate(_PLACE)]
        columns += [(bone + axis, motion.rotations[:, j, i]) for i, axis in enumerate(_TURN)]
    columns += [("Root" + axis, motion.root_position[:, i]) for i, axis in enumerate(_PLACE)]
    columns += [("Root" + axis, motion.root_rotation[:, i]) for i, axis in enumerate(_TURN)]
    arrays = [pa.array(np.ascontiguousarray(values)) for _, values in columns]
    table = pa.Table.from_arrays(arrays, names=[name for name, _ in columns])

    def fits(beside: Path) -> bool:
        # As one file: its name is no partition's.
        with pq.ParquetFile(str(beside)) as file:
            return bool(file.read().equals(table))

    return checked(path, lambda beside: pq.write_table(table, str(beside), compression="zstd"), fits)
