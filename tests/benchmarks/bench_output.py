"""Exports of ten minutes, films against real time, and an hour of motion: opened, scrubbed, sought.

Wall time is what a person waits; processor time says what a machine without other work needs (both cores of
a machine share the drawing and the encoding of a film).
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

FPS = 60.0
EXPORTED = ("bvh", "saia_csv", "vrma", "npz")


def run() -> dict[str, Any]:
    """All figures; bones as a tracker sends them, standing and gesturing."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        return {
            "export_10_minutes": _exports(folder),
            "film_1280x720_30": _film(folder),
            "motion_60_minutes": _hour(folder),
        }


def _timed(work: Callable[[], object]) -> dict[str, float]:
    wall, cpu = time.perf_counter(), time.process_time()
    work()
    return {"wall_s": time.perf_counter() - wall, "processor_s": time.process_time() - cpu}


def _exports(folder: Path) -> dict[str, Any]:
    from studio import formats

    motion = _motion(600.0)
    sound = _sound(folder / "ten.wav", 600.0)
    found = {}
    for name in EXPORTED:
        module = formats.load(name)
        target = folder / f"ten{formats.written_suffix(module)}"
        found[name] = _timed(lambda module=module, target=target: module.write(target, motion, sound))
    return found


def _film(folder: Path, seconds: float = 20.0) -> dict[str, Any]:
    from studio.formats import mp4
    from studio.render.drawing import Drawing, Painter

    motion, sound = _motion(seconds), _sound(folder / "film.wav", seconds)
    drawing = Drawing(fps=30.0)
    with Painter(motion, drawing) as painter:  # the first start of OpenGL is no part of it
        painter.picture(0.0)
    found = _timed(lambda: mp4.write(folder / "film.mp4", motion, sound, drawing))
    return {
        **found,
        "times_real_time": seconds / found["wall_s"],
        "times_real_time_if_two_cores_were_free": 2 * seconds / found["processor_s"],
    }


def _hour(folder: Path) -> dict[str, Any]:
    from studio.playback.layers import Tuning, tuned
    from studio.render.camera import Orbit
    from studio.render.scene import BODY, RenderScene
    from studio.render.world_pose import WorldPose
    from studio.take.motion_file import read_motion, write_motion

    path = folder / "hour.arrow"
    write_motion(path, _motion(3600.0))
    start = time.perf_counter()
    motion = read_motion(path)
    read = time.perf_counter()
    motion = tuned(motion, Tuning())
    WorldPose.of(motion, 0.0)
    opened = time.perf_counter()
    spots = np.random.default_rng(1).uniform(0, 3600, 60)
    scrub, seek = [], []
    with RenderScene() as scene:
        scene.warm_up(800, 600)
        for t in spots:
            began = time.perf_counter()
            stance = WorldPose.of(motion, float(t))
            scrub.append(time.perf_counter() - began)
            scene.place(BODY, stance)
            scene.render(Orbit(), 800, 600)
            seek.append(time.perf_counter() - began)
    return {
        "megabytes": path.stat().st_size / 1e6,
        "read_s": read - start,
        "open_to_first_pose_s": opened - start,
        "pose_anywhere_ms": 1000 * float(np.median(scrub)),
        "seek_to_picture_median_ms": 1000 * float(np.median(seek)),
        "seek_to_picture_worst_ms": 1000 * max(seek),
    }


def _motion(seconds: float) -> Any:
    """54 bones and 18 shapes: arms lowered, head and hands moving."""
    from studio.motion import Motion, rotation
    from studio.motion.channels import BONES, VRM0_SHAPES

    t = np.arange(round(seconds * FPS)) / FPS
    turns = np.tile(rotation.IDENTITY, (len(t), len(BONES), 1)).astype(np.float32)
    for bone, axis, rest, swing in (
        ("Head", (1.0, 0.0, 0.0), 0.0, 0.2), ("Spine", (0.0, 1.0, 0.0), 0.0, 0.1),
        ("LeftUpperArm", (0.0, 0.0, 1.0), 1.1, 0.2), ("RightUpperArm", (0.0, 0.0, 1.0), -1.1, 0.2),
    ):  # fmt: skip
        angles = rest + swing * np.sin(1.7 * t)
        turns[:, BONES.index(bone)] = rotation.from_axis_angle(np.array([axis]), angles)
    shapes = 0.5 + 0.5 * np.sin(t[:, None] * 3 + np.arange(len(VRM0_SHAPES)))
    return Motion.build(t, VRM0_SHAPES, shapes, BONES, None, turns)


def _sound(path: Path, seconds: float) -> Path:
    import soundfile

    noise = np.random.default_rng(0).normal(0, 0.1, round(seconds * 48_000)).astype(np.float32)
    soundfile.write(path, noise, 48_000)
    return path
