"""The stand-ins themselves: a screen and a sound device that really work."""

import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from studio import virtual_devices
from studio.errors import StudioError
from tests.patience import PATIENCE, nearest

linux_only = pytest.mark.skipif(sys.platform != "linux", reason="other systems have a screen and sound")


@linux_only
def test_a_virtual_screen_takes_a_free_number_and_ends_with_its_context() -> None:
    with virtual_devices.virtual_screen() as first, virtual_devices.virtual_screen() as second:
        assert first != second
        assert os.path.exists(f"/tmp/.X11-unix/X{first[1:]}")  # noqa: PTH110
    assert not os.path.exists(f"/tmp/.X11-unix/X{first[1:]}")  # noqa: PTH110


def test_without_xvfb_the_sentence_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    with pytest.raises(StudioError) as caught, virtual_devices.virtual_screen():
        pass
    assert caught.value.what == "There is no screen and no virtual one."
    assert caught.value.remedy == "Install the package xvfb, or start this in a window."


def test_without_pulseaudio_the_sentence_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    with pytest.raises(StudioError) as caught, virtual_devices.virtual_sound():
        pass
    assert caught.value.what == "There is no virtual sound device here."
    assert caught.value.remedy == "Install the package pulseaudio."


@linux_only
def test_a_sound_server_ends_with_its_context() -> None:
    with virtual_devices.virtual_sound() as environment:
        socket = environment["PULSE_SERVER"].removeprefix("unix:")
        command = ["pactl", "--server", environment["PULSE_SERVER"], "info"]
        assert subprocess.run(command, capture_output=True, check=False).returncode == 0
    assert not os.path.exists(socket)  # noqa: PTH110


@linux_only
@pytest.mark.skipif(not shutil.which("setpriv"), reason="needs util-linux")
def test_a_stage_does_not_outlive_a_crash() -> None:
    code = (
        "import os, subprocess, sys; from studio import virtual_devices\n"
        "with virtual_devices.virtual_screen() as display:\n"
        "    print(display, flush=True)\n"
        "    os.abort()"
    )
    crashed = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    socket = Path(f"/tmp/.X11-unix/X{crashed.stdout.strip()[1:]}")
    deadline = time.monotonic() + PATIENCE
    while socket.exists() and time.monotonic() < deadline:
        time.sleep(0.02)
    assert not socket.exists()


@pytest.mark.slow
def test_what_is_played_is_heard(virtual_audio: str) -> None:
    # Noise matches nothing else (0.02); a busy machine may drop a block, so 1.0 is not asked for.
    assert nearest(lambda: likeness(virtual_audio), 1.0, good=0.5) > 0.5


def likeness(virtual_audio: str) -> float:
    """How much of what is played is heard, 0..1."""
    import sounddevice

    rate = 48000
    rng = np.random.default_rng(1)
    played = (rng.uniform(-0.5, 0.5, rate // 2)).astype(np.float32)
    heard: list[np.ndarray] = []
    sent = 0

    def listen(block: np.ndarray, frames: int, times: object, status: object) -> None:
        heard.append(block[:, 0].copy())

    def play(block: np.ndarray, frames: int, times: object, status: object) -> None:
        nonlocal sent
        part = played[sent : sent + frames]
        block[:] = 0
        block[: len(part)] = part[:, None]
        sent += len(part)
        if sent >= len(played) and not len(part):
            raise sounddevice.CallbackStop

    with sounddevice.InputStream(rate, device=virtual_audio, channels=1, callback=listen, latency="high"):
        stream = sounddevice.OutputStream(
            rate, device=virtual_audio, channels=2, callback=play, latency="high"
        )
        with stream:
            while stream.active:
                sounddevice.sleep(50)
            sounddevice.sleep(400)
    recording = np.concatenate(heard)
    size = len(recording) + len(played)
    match = np.fft.irfft(np.fft.rfft(recording, size) * np.conj(np.fft.rfft(played, size)), size)
    energy = np.linalg.norm(played) * np.linalg.norm(recording)
    return float(match.max() / energy)
