"""Whether the window stays alive while it records: how long its event loop is ever held up.

A practice performer in a process of its own sends 120 frames a second and speaks through the sound device
while the Record tab draws figure, face and meters. The window's own timer notes when it gets its turn.
"""

from __future__ import annotations

import contextlib
import os
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from studio import virtual_devices

SECONDS = 20.0
FPS = 120
BEAT_MS = 2


def run() -> dict[str, Any]:
    """Longest and typical hold-ups in milliseconds, and what was recorded meanwhile."""
    with contextlib.ExitStack() as stack:
        if virtual_devices.sound_available():
            os.environ.update(stack.enter_context(virtual_devices.virtual_sound()))
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="saia-bench-")))
        os.environ["SAIA_SETTINGS"] = str(folder / "settings")
        return measure(folder)


def measure(folder: Path) -> dict[str, Any]:
    """Record for a while in the real window with a timer that watches the event loop."""
    from PySide6.QtCore import Qt, QTimer
    from PySide6.QtTest import QTest

    from studio import settings
    from studio.ui.app import build

    port = free_port()
    settings.save(settings.load().changed(vmc_port=port, countdown=0.0))
    _, window = build([])
    window.resize(1440, 900)
    window.show()
    window.start.create_project(folder / "Project")
    with performer(port):
        QTest.qWait(6_000)  # the performer prepares its speech, the figure makes its first picture
        window.room("record")[1].toggle()
        wait_for(lambda: window.session.rolling)
        beats: list[float] = []
        timer = QTimer()
        timer.setTimerType(Qt.TimerType.PreciseTimer)
        timer.timeout.connect(lambda: beats.append(time.perf_counter()))
        timer.start(BEAT_MS)
        before, start = time.process_time(), time.perf_counter()
        QTest.qWait(int(SECONDS * 1000))
        cpu, wall = time.process_time() - before, time.perf_counter() - start
        timer.stop()
        window.room("record")[1].toggle()
        wait_for(lambda: bool(window.session.project.takes))
    info = window.session.project.takes[-1].info
    window.close()
    gaps = 1000 * np.diff(beats)
    return {
        "seconds": wall,
        "longest_hold_up_ms": float(gaps.max()),
        "hold_up_p99_ms": float(np.percentile(gaps, 99)),
        "hold_up_median_ms": float(np.median(gaps)),
        "hold_ups_over_50_ms": int((gaps > 50).sum()),
        "cores_used_by_the_window": cpu / wall,
        "frames_sent_per_s": FPS,
        "frames_recorded_per_s": info.frames / info.duration,
        "frames_lost": info.frames_lost,
    }


@contextlib.contextmanager
def performer(port: int) -> Iterator[None]:
    """A practice performer in a process of its own for as long as this is open."""
    command = [sys.executable, "-m", "studio", "performer", "--to", f"127.0.0.1:{port}", "--fps", str(FPS)]
    child = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        yield
    finally:
        child.terminate()
        child.wait(10)


def wait_for(condition: Any, seconds: float = 30.0) -> None:
    """Let the window live until something is so."""
    from PySide6.QtTest import QTest

    deadline = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > deadline:
            raise TimeoutError("the window did not get there")
        QTest.qWait(20)


def free_port() -> int:
    """A UDP port nobody listens on."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])
