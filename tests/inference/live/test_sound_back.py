"""The sound server is killed and started again while somebody is live: all sound comes back."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from studio import virtual_devices
from studio.project import Project
from tests.inference.live.runs import add_run
from tests.patience import until


class Performer:
    """`saia live` in a process of its own, on a sound server of this test."""

    def __init__(self, project: Project, environment: dict[str, str]) -> None:
        command = [
            sys.executable,
            "-m",
            "studio",
            "live",
            str(project.folder),
            "balanced_001",
            "--to",
            "none",
        ]
        self.events: list[dict[str, Any]] = []
        self.process = subprocess.Popen(
            [*command, "--voice-to", "default", "--json"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            encoding="utf-8",
            env={**os.environ, **environment, "PULSE_SINK": virtual_devices.SECOND},
        )
        self._reader = threading.Thread(target=self._read)
        self._reader.start()

    def _read(self) -> None:
        assert self.process.stdout is not None
        self.events.extend(json.loads(line) for line in self.process.stdout)

    def said(self, what: str) -> bool:
        return any(what in event.get("what", "") for event in list(self.events))

    @property
    def state(self) -> dict[str, Any]:
        return next((e for e in reversed(list(self.events)) if e["event"] == "state"), {"frames": 0})

    def end(self) -> int:
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.process.stdin.close()
        code = self.process.wait(60)
        self._reader.join(60)
        self.process.stdout.close()
        return code


@pytest.mark.slow
def test_microphone_and_delayed_voice_come_back(
    make_toy_project: Callable[..., Project], request: pytest.FixtureRequest
) -> None:
    if not virtual_devices.sound_available():
        pytest.skip("pulseaudio is not installed")
    project = make_toy_project()
    add_run(project)
    servers: list[tuple[subprocess.Popen[bytes], Path]] = []

    def started(folder: Path) -> subprocess.Popen[bytes]:
        servers.append((virtual_devices.start_pulseaudio(folder), folder))
        return servers[-1][0]

    with virtual_devices.virtual_sound(started) as environment:
        live = Performer(project, environment)
        request.addfinalizer(live.process.kill)
        until(lambda: live.state["frames"] > 10)
        server, folder = servers[0]
        server.kill()
        server.wait()
        until(lambda: live.said("default stopped giving sound."))
        (folder / "native").unlink(missing_ok=True)
        again = virtual_devices.start_pulseaudio(folder)
        request.addfinalizer(again.kill)
        until(lambda: live.said("default is back."))
        before = live.state["frames"]
        until(lambda: live.state["frames"] > before + 10 and not live.state["lost"])
        until(lambda: live.said("The sound output takes your voice again."))
        assert live.end() == 0
        virtual_devices.end(again)
    assert live.events[-1]["event"] == "done"
