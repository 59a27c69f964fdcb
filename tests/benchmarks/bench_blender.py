"""What Blender sees in the files we write: how far its bones and shape keys are from the motion's.

Blender's `bpy` is large and not among our dependencies: SAIA_BLENDER_PYTHON names a Python that has it.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from tests.world import world_of

READER = Path(__file__).resolve().parent / "foreign" / "read_in_blender.py"
ROWS = (0, 7, 18)


def run() -> dict[str, Any]:
    """Largest distance in millimetres and of a shape's weight, for GLB and BVH."""
    python = os.environ.get("SAIA_BLENDER_PYTHON", "")
    if not python:
        return {"skipped": "SAIA_BLENDER_PYTHON names no Python with bpy"}
    sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # motions are made by the tests' examples
    from studio.formats import bvh, glb
    from tests.formats.examples import a_motion

    motion = a_motion(20)
    with tempfile.TemporaryDirectory() as folder:
        glb.write(Path(folder) / "x.glb", motion)
        bvh.write(Path(folder) / "x.bvh", motion)
        # Blender counts a BVH's frames from 1, and a glTF's from the time 0.
        of_glb = _seen(python, Path(folder) / "x.glb", ROWS)
        of_bvh = _seen(python, Path(folder) / "x.bvh", tuple(row + 1 for row in ROWS))
    return {
        "blender": of_glb["version"],
        "glb_worst_mm": _worst_mm(motion, of_glb),
        "bvh_worst_mm": _worst_mm(motion, of_bvh),
        "glb_worst_weight": max(
            abs(frame["shapes"][name] - float(motion.shapes[row, s]))
            for frame, row in zip(of_glb["frames"], ROWS, strict=True)
            for s, name in enumerate(motion.shape_names)
        ),
    }


def _seen(python: str, file: Path, frames: tuple[int, ...]) -> dict[str, Any]:
    done = subprocess.run(
        [python, str(READER), str(file), json.dumps(frames)],
        capture_output=True, text=True, check=True, timeout=300,
    )  # fmt: skip
    line = next(line for line in done.stdout.splitlines() if line.startswith("SEEN "))
    seen: dict[str, Any] = json.loads(line.removeprefix("SEEN "))
    return seen


def _worst_mm(motion: Any, seen: dict[str, Any]) -> float:
    """The largest distance of a bone; Blender is right-handed with Z up."""
    positions, _ = world_of(motion)
    worst = 0.0
    for frame, row in zip(seen["frames"], ROWS, strict=True):
        x, y, z = positions[row].T
        wanted = np.stack([-x, -z, y], axis=1)
        got = np.array([frame["bones"][name] for name in motion.bone_names])
        worst = max(worst, float(np.linalg.norm(got - wanted, axis=1).max()))
    return worst * 1000
