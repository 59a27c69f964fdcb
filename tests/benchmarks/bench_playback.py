"""The sender's steadiness, and how far picture and sound are apart at a listener.

A click track plays on a virtual sound device while its motion (a mouth that opens with the sound's
position) is sent over UDP; the clicks are heard on the device's monitor, the frames by a socket.
"""

from __future__ import annotations

import socket
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np

SECONDS = 30.0
RATE = 48_000


def run() -> dict[str, Any]:
    """Figures over half a minute at 60 frames a second with 54 bones and 18 shapes."""
    from studio import stage

    with tempfile.TemporaryDirectory() as folder:
        if not stage.sound_available():
            return {"skipped": "pulseaudio is not installed"}
        with stage.virtual_sound() as environment:
            return _measure(Path(folder), environment)


def _measure(folder: Path, environment: dict[str, str]) -> dict[str, Any]:
    import os

    os.environ.update(environment)
    import sounddevice
    import soundfile

    sounddevice._terminate()
    sounddevice._initialize()
    from studio.playback.heard import StreamClock
    from studio.playback.player import Player
    from studio.playback.vmc_target import Destination, PoseSource, VmcTarget

    samples = np.zeros(int(SECONDS * RATE), dtype=np.float32)
    samples[RATE // 2 :: RATE] = 0.9
    soundfile.write(folder / "clicks.wav", samples, RATE)
    motion = _motion()
    ear, clock, taken = [], StreamClock(RATE), [0]

    def hear(block: np.ndarray, frames: int, info: Any, _status: object) -> None:
        clock.report(taken[0], time.monotonic() + info.inputBufferAdcTime - info.currentTime)
        ear.append(block[:, 0].copy())
        taken[0] += frames

    frames = _Frames()
    target = VmcTarget()
    player = Player(folder / "clicks.wav", device="default")
    source = PoseSource(motion.shape_names, motion.bone_names, motion.pose, lambda: player.position)
    cpu = time.process_time()
    with sounddevice.InputStream(samplerate=RATE, channels=1, device="default", latency=0.06, callback=hear):
        time.sleep(0.3)
        player.play()
        target.start(Destination(port=frames.port), source)
        while player.playing:
            time.sleep(0.05)
        time.sleep(0.3)
    cpu = time.process_time() - cpu
    state = target.state
    target.stop(fade=False)
    player.close()
    frames.close()
    now = time.monotonic()
    heard = np.flatnonzero(np.concatenate(ear) > 0.4)
    clicks = now + (heard - clock.frame_at(now)) / RATE
    return _figures(frames, clicks, state.dropped, cpu)


def _figures(frames: _Frames, clicks: np.ndarray, dropped: int, cpu: float) -> dict[str, Any]:
    """Jitter of the frames' beat, and the position each frame shows against the sound heard then."""
    from pythonosc.osc_message import OscMessage
    from pythonosc.osc_packet import OscPacket

    at, shown, ends = [], [], []
    for when, data in frames.heard:
        for timed in OscPacket(data).messages:
            message: OscMessage = timed.message
            if message.address == "/VMC/Ext/T":
                ends.append(when)
            elif message.address == "/VMC/Ext/Blend/Val" and message.params[0] == "A":
                at.append(when)
                shown.append(float(message.params[1]) * SECONDS)
    beat = np.diff(np.array(ends))
    positions = np.array(shown)
    inside = [t for t in clicks if at[5] < t < at[-5]]
    picture = np.interp(inside, at, positions)
    offset_ms = 1000 * (picture - (np.round(picture - 0.5) + 0.5))
    off_beat_ms = 1000 * np.abs(beat - np.median(beat))
    return {
        "frames": len(ends),
        "frames_dropped": dropped,
        "fps_median": round(1 / float(np.median(beat)), 2),
        "jitter_p50_ms": round(float(np.percentile(off_beat_ms, 50)), 3),
        "jitter_p99_ms": round(float(np.percentile(off_beat_ms, 99)), 3),
        "clicks": len(inside),
        "figure_to_sound_median_ms": round(float(np.median(offset_ms)), 3),
        "figure_to_sound_worst_ms": round(float(np.abs(offset_ms).max()), 3),
        "cpu_share_of_one_core": round(cpu / SECONDS, 3),
    }


def _motion() -> Any:
    """54 bones and 18 shapes; the shape A is the position over the whole length."""
    from studio.motion import Motion
    from studio.motion.channels import BONES, VRM0_SHAPES

    times = np.arange(int(SECONDS * 60) + 1) / 60
    shapes = np.zeros((len(times), len(VRM0_SHAPES)))
    shapes[:, VRM0_SHAPES.index("A")] = times / SECONDS
    return Motion.build(times, VRM0_SHAPES, shapes, BONES)


class _Frames:
    """A listener of its own thread."""

    def __init__(self) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4 << 20)
        self._socket.bind(("127.0.0.1", 0))
        self._socket.settimeout(0.1)
        self.port: int = self._socket.getsockname()[1]
        self.heard: list[tuple[float, bytes]] = []
        self._open = True
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop listening."""
        self._open = False
        self._thread.join()
        self._socket.close()

    def _run(self) -> None:
        while self._open:
            try:
                data = self._socket.recv(65536)
            except TimeoutError:
                continue
            self.heard.append((time.monotonic(), data))
