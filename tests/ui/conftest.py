"""What UI tests share: a project small enough to train on in seconds."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import soundfile
from PySide6.QtCore import QCoreApplication, QEvent, QThreadPool
from PySide6.QtWidgets import QWidget
from pytestqt.qtbot import QtBot

from studio.dataset import edits
from studio.motion import Motion, rotation
from studio.project import Project
from studio.settings import Settings
from studio.take import TakeInfo
from studio.ui import theme
from studio.ui.session import Session

PATIENCE_MS = 60_000


class PatientBot(QtBot):
    """Waits a minute for what a test hopes for, whatever it asks: a machine that is held up is no failure."""

    def waitUntil(self, callback: Callable[[], bool | None], *, timeout: int = 0) -> None:
        super().waitUntil(callback, timeout=max(timeout, PATIENCE_MS))

    def waitSignal(self, signal: Any, *, timeout: int = 0, raising: bool | None = None, **more: Any) -> Any:
        patience = timeout if raising is False else max(timeout, PATIENCE_MS)
        return super().waitSignal(signal, timeout=patience, raising=raising, **more)

    def waitExposed(self, widget: Any, *, timeout: int = 0) -> Any:
        return super().waitExposed(widget, timeout=max(timeout, PATIENCE_MS))


@pytest.hookimpl(wrapper=True, trylast=True)
def pytest_runtest_teardown() -> Iterator[None]:
    """Take a test's windows down with it, and what they wait for: without an event loop of its own Qt leaves
    what is to be deleted alive, and its timers and results would come in the tests after it."""
    yield
    QThreadPool.globalInstance().waitForDone(PATIENCE_MS)
    QCoreApplication.processEvents()
    QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete.value)


@pytest.fixture
def qtbot(qapp: Any, request: pytest.FixtureRequest) -> PatientBot:
    """pytest-qt's, with more patience."""
    return PatientBot(request)


RATE, FPS = 16_000, 30.0
SHAPES, BONES = ("A", "Blink", "Joy"), ("Hips", "Spine", "Head", "RightUpperArm", "RightLowerArm")


@pytest.fixture
def window(qtbot: PatientBot, qapp: Any) -> QWidget:
    """An empty window in the studio's dress, for what lies over any window."""
    theme.apply(qapp)
    made = QWidget()
    qtbot.addWidget(made)
    made.resize(900, 600)
    made.show()
    return made


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


@pytest.fixture
def session(toy_project: Project) -> Session:
    """What every tab is given, with the toy project open."""
    session = Session(Settings())
    session.project = toy_project
    return session


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
