"""NumPy's NPZ, for researchers: the arrays of a motion by name, exactly."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from studio.errors import RequestError, say
from studio.formats._table import check_suffix
from studio.formats._writing import checked
from studio.motion import Motion

TITLE = "NumPy arrays"
SUFFIX = ".npz"
NOTE = (
    "For numpy.load: times, shapes, positions, rotations (x y z w), the root, and their names. Unity axes, "
    "metres and seconds; no sound."
)


def write(path: Path, motion: Motion, audio: Path | None = None) -> tuple[Path, ...]:
    """Write all arrays of a motion, compressed; the sound is not part of it.

    Returns:
        The file, read back and compared number by number.
    """
    check_suffix(path, SUFFIX)
    if not len(motion):
        raise RequestError(
            say("There is no motion to write to {name}.", name=path.name), "Choose a take with motion."
        )
    arrays = {
        "times": motion.times,
        "shape_names": np.array(motion.shape_names, dtype=np.str_),
        "shapes": motion.shapes,
        "bone_names": np.array(motion.bone_names, dtype=np.str_),
        "parents": np.array(motion.skeleton.parents, dtype=np.int64),
        "positions": motion.positions,
        "rotations": motion.rotations,
        "root_position": motion.root_position,
        "root_rotation": motion.root_rotation,
    }

    def put(beside: Path) -> None:
        with beside.open("wb") as file:
            np.savez_compressed(file, allow_pickle=False, **arrays)

    def fits(beside: Path) -> bool:
        with np.load(beside, allow_pickle=False) as back:
            same = (np.array_equal(back[name], values) for name, values in arrays.items())
            return set(back.files) == set(arrays) and all(same)

    return checked(path, put, fits)
