"""What UI tests share: a project small enough to train on in seconds."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import soundfile

from studio.dataset import edits
from studio.motion import Motion, rotation
from studio.project import Project
from studio.take import TakeInfo

RATE, FPS = 16_000, 30.0
SHAPES, BONES = ("A", "Blink", "Joy"), ("Hips", "Spine", "Head", "RightUpperArm", "RightLowerArm")


@pytest.fixture
def toy_project(tmp_path: Path) -> Project:
    """Three takes of six seconds, toy_001..., the last kept for validation: loudness opens the mouth and
    nods the head."""
    folder = tmp_path / "おもちゃ project"
    project = Project.create(folder, "Toy")
    for number in (1, 2, 3):
        _add(project, number, 6.0, folder)
    project.edit("Keep one for validation", edits.set_split(project.dataset, ["toy_003"], "val"))
    return project


def _add(project: Project, number: int, seconds: float, folder: Path) -> None:
    random = np.random.default_rng(number)
    t = np.arange(int(seconds * RATE)) / RATE
    loud = np.clip(np.sin(2 * np.pi * (1.5 + 0.2 * number) * t), 0, 1)
    path = folder / "voice.wav"
    soundfile.write(path, (0.3 * loud * random.normal(size=len(t))).astype(np.float32), RATE)
    times = np.arange(int(seconds * FPS)) / FPS
    mouth = np.interp(times, t, loud)
    blink = ((times % 2.0) < 0.1).astype(float)
    rotations = np.tile(rotation.IDENTITY, (len(times), len(BONES), 1))
    rotations[:, 2] = rotation.from_axis_angle(np.array([1.0, 0.0, 0.0]), 0.3 * mouth)
    motion = Motion.build(times, SHAPES, np.stack([mouth, blink, 0.5 * mouth], 1), BONES, None, rotations)
    info = TakeInfo(
        slate="toy", number=number, duration=seconds, audio_file="audio.wav", sample_rate=RATE,
        audio_channels=1, audio_seconds=seconds, motion_file="motion.arrow", frames=len(motion),
        fps=FPS, shape_names=SHAPES, bone_names=BONES, source="performer",
    )  # fmt: skip
    project.add_take(f"toy_{number:03d}", info, motion, path, move_audio=True)
