"""Opening, editing, importing and exporting: what a person waits for."""

from __future__ import annotations

import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from studio.dataset import edits
from studio.formats import bvh, saia_csv
from studio.motion import Motion, Skeleton, rotation
from studio.motion.channels import BONES, VRM0_SHAPES
from studio.project import Project
from studio.take import TakeInfo

DATA = Path(os.environ.get("SAIA_DATA", Path(__file__).resolve().parents[3] / "shared" / "data"))
TAKES = 1000


def run() -> dict[str, Any]:
    """Seconds for each, and ratios to numpy's own text reader and writer in the same run."""
    with tempfile.TemporaryDirectory(prefix="saia-bench-") as name:
        folder = Path(name)
        return {**_thousand_takes(folder), **_exports(folder), **_import(folder)}


def _thousand_takes(folder: Path) -> dict[str, Any]:
    project = Project.create(folder / "many")
    for number in range(1, TAKES + 1):
        info = TakeInfo(
            "Hello", number, duration=60.0, frames=3600, fps=60.0, shape_names=VRM0_SHAPES, bone_names=BONES
        )
        take = project.takes_folder / f"Hello_{number:04d}"
        take.mkdir()
        (take / "take.json").write_text(json.dumps(asdict(info)), encoding="utf-8")
    project.refresh()
    project.edit("Star", edits.set_stars(project.dataset, [s.id for s in project.dataset.selections], 3))
    project.close()
    opening = _median(lambda: Project.open(folder / "many", read_only=True), 5)
    project = Project.open(folder / "many")
    offsets = iter(range(1, 100))

    def edit() -> None:
        project.edit("Move", edits.set_offset(project.dataset, ["Hello_0500"], next(offsets) / 1000))

    return {f"open_{TAKES}_takes_s": opening, f"one_edit_of_{TAKES}_takes_saved_s": _median(edit, 9)}


def _exports(folder: Path) -> dict[str, Any]:
    motion = _ten_minutes()
    bvh_s = _median(lambda: bvh.write(folder / "x.bvh", motion), 3)
    csv_s = _median(lambda: saia_csv.write(folder / "x.csv", motion), 3)
    read_s = _median(lambda: saia_csv.read(folder / "Bones" / "x.csv"), 3)
    part = folder / "Bones" / "part.csv"
    with (folder / "Bones" / "x.csv").open() as file:
        part.write_text("".join(next(file) for _ in range(2001)))
    values = np.loadtxt(part, delimiter=",", skiprows=1)
    rows = len(motion) / len(values)
    loadtxt_s = _median(lambda: np.loadtxt(part, delimiter=",", skiprows=1), 3) * rows
    savetxt_s = _median(lambda: np.savetxt(folder / "y.csv", values, delimiter=","), 3) * rows
    return {
        "export_10_minutes_60_fps_bvh_read_back_s": bvh_s,
        "export_10_minutes_60_fps_csv_read_back_s": csv_s,
        "read_10_minutes_60_fps_csv_s": read_s,
        "numpy_loadtxt_bones_alone_s": loadtxt_s,
        "numpy_savetxt_bones_alone_s": savetxt_s,
        "csv_export_and_read_back_vs_savetxt_alone": csv_s / savetxt_s,
        "csv_read_vs_loadtxt_bones_alone": read_s / loadtxt_s,
    }


def _import(folder: Path) -> dict[str, Any]:
    source = DATA / "facegood"
    if not source.is_dir():
        return {"import_facegood_s": None}

    def whole() -> None:
        shutil.rmtree(folder / "fg", ignore_errors=True)
        words = [sys.executable, "-m", "studio", "import", str(folder / "fg"), str(source), "--json"]
        subprocess.run(words, check=True, capture_output=True)

    return {"import_facegood_8_minutes_whole_command_s": _median(whole, 3)}


def _ten_minutes() -> Motion:
    rng = np.random.default_rng(0)
    # As recorded: frames never come quite evenly, so BVH has to resample them.
    t = np.arange(36000) / 60 + rng.uniform(0, 0.002, 36000)
    axes = rng.normal(size=(len(BONES), 3))
    axes /= np.linalg.norm(axes, axis=-1, keepdims=True)
    turns = rotation.from_axis_angle(axes[None], 0.5 * np.sin(2 * t[:, None] + rng.uniform(0, 6, len(BONES))))
    positions = np.tile(Skeleton.humanoid(BONES).rest_positions, (len(t), 1, 1))
    return Motion.build(t, VRM0_SHAPES, rng.random((len(t), 18)), BONES, positions, turns)


def _median(work: Callable[[], object], times: int) -> float:
    spent = []
    for _ in range(times):
        start = time.perf_counter()
        work()
        spent.append(time.perf_counter() - start)
    return statistics.median(spent)
