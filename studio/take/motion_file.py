"""The motion file: one row a frame in Apache Arrow's file format, channels named in its metadata.

Columns: `time` float64; `shapes`, `positions`, `rotations`, `root_position`, `root_rotation` as lists of
float32 of one fixed size; a column without channels is left out. Any Arrow reader opens it.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from studio.errors import StudioError, say
from studio.files import atomic
from studio.motion import Motion
from studio.motion.sanitize import sanitized
from studio.take.take import Take

if TYPE_CHECKING:
    import pyarrow as pa

Array = NDArray[np.float64]

SUFFIX = ".arrow"
TIME = "time"
FORMAT_VERSION = 1
ROWS_PER_BATCH = 4096
NO_MOTION_S = 1.0
"""Seconds without a frame from which sound has no motion to be learnt with it."""


def write_motion(path: Path, motion: Motion) -> None:
    """Write a motion in one piece; the values come back exactly."""
    with atomic.written(path) as beside:
        put_motion(beside, motion)


def put_motion(path: Path, motion: Motion) -> None:
    """Write a motion to a path as it stands; OSError where the disk does not take it."""
    import pyarrow as pa

    facts = {
        "saia_motion_version": str(FORMAT_VERSION),
        "shape_names": json.dumps(motion.shape_names, ensure_ascii=False),
        "bone_names": json.dumps(motion.bone_names, ensure_ascii=False),
        "units": "seconds, metres, quaternions xyzw, Unity axes (left-handed, Y up, +Z forward)",
    }
    columns: dict[str, Any] = {TIME: pa.array(np.asarray(motion.times, dtype=np.float64))}
    for name, values in _columns(motion).items():
        width = int(np.prod(values.shape[1:]))
        if width:
            # Arrow takes the buffer as it is, so hours are written without a copy for each row.
            flat = np.ascontiguousarray(values, dtype=np.float32).reshape(-1)
            columns[name] = pa.FixedSizeListArray.from_arrays(pa.array(flat), width)
    table = pa.table(columns).replace_schema_metadata(facts)
    options = pa.ipc.IpcWriteOptions(compression="lz4")
    with (
        pa.OSFile(str(path), "wb") as file,
        pa.ipc.new_file(file, table.schema, options=options) as writer,
    ):
        # In batches, so that other readers can show a part without the whole.
        writer.write_table(table, max_chunksize=ROWS_PER_BATCH)


def load_motion(take: Take, offset: float = 0.0, span: tuple[float, float] | None = None) -> Motion | None:
    """A take's motion as everybody sees, learns and exports it: read, sanitized, moved and cut.

    Args:
        take: the take.
        offset: seconds by which the motion is moved later against the sound.
        span: (start, end) on the sound's clock, both included; the result's times are from the start. All of
            the take, on its own clock, where None.

    Returns:
        None where the take has no motion.

    Raises:
        StudioError: the file is missing, damaged or of a newer version.
    """
    if take.motion_path is None:
        return None
    # Sanitized first: one wrong time would be moved and cut as if it were true.
    motion = load_motion_file(take.motion_path)
    motion = motion.shifted(offset) if offset else motion
    return motion if span is None else motion.cut(*span)


def load_motion_file(path: Path) -> Motion:
    """A motion file's content, sanitized: for motion of no take, such as what Review hands to an export.

    Raises:
        StudioError: as read_motion.
    """
    return sanitized(read_motion(path))[0]


def without_motion(times: Array, duration: float) -> tuple[tuple[float, float], ...]:
    """Stretches (start, end) of a take of this duration that have no motion for longer than NO_MOTION_S.

    Args:
        times: of its frames (T,), seconds.
        duration: seconds.
    """
    times = times[np.isfinite(times)]
    edges = np.concatenate([[0.0], np.sort(times.clip(0.0, duration)), [duration]])
    found = np.flatnonzero(np.diff(edges) > NO_MOTION_S)
    return tuple((round(float(edges[i]), 3), round(float(edges[i + 1]), 3)) for i in found)


def read_motion(path: Path) -> Motion:
    """A motion file's content exactly as it was written, damage included; load_motion gives what is used.

    Raises:
        StudioError: the file is missing, damaged or of a newer version.
    """
    table, facts = _read(path)
    try:
        return _motion(table, tuple(json.loads(facts["shape_names"])), tuple(json.loads(facts["bone_names"])))
    except (KeyError, ValueError, TypeError, AttributeError, RecursionError) as error:
        raise atomic.damaged(path) from error


def read_times(path: Path) -> Array:
    """The times of a motion file's frames (T,), seconds, as they were written; of an hour in milliseconds.

    Raises:
        StudioError: as read_motion.
    """
    table, _ = _read(path, only=TIME)
    try:
        return _times(table)
    except (KeyError, ValueError, TypeError) as error:
        raise atomic.damaged(path) from error


def _read(path: Path, only: str = "") -> tuple[pa.Table, dict[str, str]]:
    """All columns of a motion file, or one, and what it says of itself."""
    import pyarrow as pa

    try:
        with pa.OSFile(str(path), "rb") as file:
            reader = pa.ipc.open_file(file)
            if only:
                options = pa.ipc.IpcReadOptions(included_fields=[reader.schema.get_field_index(only)])
                file.seek(0)
                reader = pa.ipc.open_file(file, options=options)
            table = reader.read_all()
    except FileNotFoundError as error:
        raise StudioError(
            say("{name} is missing in {folder}.", name=path.name, folder=path.parent.name), "Restore it."
        ) from error
    except (pa.ArrowException, OSError) as error:
        raise atomic.damaged(path) from error
    try:
        facts = {key.decode(): value.decode() for key, value in (table.schema.metadata or {}).items()}
    except UnicodeDecodeError as error:
        raise atomic.damaged(path) from error
    version = facts.get("saia_motion_version", "")
    # Looked at before the columns: a newer file may hold others, and is not damaged.
    if version.isdigit() and int(version) > FORMAT_VERSION:
        raise atomic.newer(path)
    return table, facts


def _times(table: pa.Table) -> Array:
    return np.asarray(table.column(TIME).to_numpy().astype(np.float64))


def _columns(motion: Motion) -> dict[str, Any]:
    return {
        "shapes": motion.shapes,
        "positions": motion.positions,
        "rotations": motion.rotations,
        "root_position": motion.root_position,
        "root_rotation": motion.root_rotation,
    }


def _motion(table: pa.Table, shape_names: tuple[str, ...], bone_names: tuple[str, ...]) -> Motion:
    frames, bones = table.num_rows, len(bone_names)

    def column(name: str, *shape: int) -> np.ndarray[Any, np.dtype[np.float32]]:
        if 0 in shape:
            return np.zeros((frames, *shape), dtype=np.float32)
        lists: list[Any] = table.column(name).chunks
        flat = [part.flatten().to_numpy(zero_copy_only=False) for part in lists] or [np.zeros(0)]
        values = np.concatenate(flat).astype(np.float32, copy=False)
        values[np.isnan(values)] = np.nan  # a damaged file may hold NaNs that signal on every later use
        return values.reshape(frames, *shape)

    return Motion(
        _times(table),
        shape_names,
        column("shapes", len(shape_names)),
        bone_names,
        column("positions", bones, 3),
        column("rotations", bones, 4),
        column("root_position", 3),
        column("root_rotation", 4),
    )
