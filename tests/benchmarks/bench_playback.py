"""The sender's steadiness, and how far picture and sound are apart at a listener.

A click track plays on a virtual sound device while its motion (a mouth that opens with the sound's
position) is sent over UDP; the clicks are heard on the device's monitor, the frames by a socket. Half a
minute; SAIA_BENCH_SECONDS=600 measures ten. On a machine that others keep busy run it, and its pulseaudio,
under `chrt -r 10`: the sender is measured, not the others. A short loop after it shows that the sender's time
only rises.
"""

from __future__ import annotations

import os
import socket
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np

SECONDS = float(os.environ.get("SAIA_BENCH_SECONDS", "30"))
LOOP_SECONDS, LOOPS = 1.0, 4
RATE = 48_000


def run() -> dict[str, Any]:
    """Figures at 60 frames a second with 54 bones and 18 shapes."""
    from studio import virtual_devices

    with tempfile.TemporaryDirectory() as folder:
        if not virtual_devices.sound_available():
            return {"skipped": "pulseaudio is not installed"}
        with virtual_devices.virtual_sound() as environment:
            return _measure(Path(folder), environment)


def _measure(folder: Path, environment: dict[str, str]) -> dict[str, Any]:
    os.environ.update(environment)
    import sounddevice
    import soundfile

    from studio.capture.microphone import input_devices
    from studio.playback.player import Player
    from studio.playback.sound_output import StreamClock
    from studio.vmc.sender import Destination, PoseSource, VmcTarget

    input_devices(refresh=True)
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
    source = PoseSource(motion.named_pose, lambda: player.position)
    cpu = time.process_time()
    with sounddevice.InputStream(samplerate=RATE, channels=1, device="default", latency=0.06, callback=hear):
        time.sleep(0.3)
        player.play()
        target.start(Destination(port=frames.port), source)
        while player.playing:
            time.sleep(0.05)
        time.sleep(0.3)
        cpu = time.process_time() - cpu
        load, state, whole = os.getloadavg(), target.state, len(frames.heard)
        # Still in the stream: the clock it keeps is read below.
        clicked, hearing = np.concatenate(ear), time.monotonic()
        first_frame = clock.frame_at(hearing)
        player.set_loop((0.5, 0.5 + LOOP_SECONDS))
        player.seek(0.5)
        player.play()
        time.sleep(LOOPS * LOOP_SECONDS)
    target.stop(fade=False)
    player.close()
    frames.close()
    clicks = hearing + (np.flatnonzero(clicked > 0.4) - first_frame) / RATE
    figures = _figures(frames.heard[:whole], clicks, state.dropped, cpu)
    steps = np.diff([message.params[0] for _, message in _messages(frames.heard, "/VMC/Ext/T")])
    return figures | {
        "loops_after": LOOPS,
        "sender_time_smallest_step_ms": round(1000 * float(steps.min()), 3),
        "realtime_priority": hasattr(os, "sched_getscheduler") and os.sched_getscheduler(0) != os.SCHED_OTHER,
        "load_average_1_5_15": [round(one, 1) for one in load],
    }


def _messages(heard: list[tuple[float, bytes]], address: str) -> list[tuple[float, Any]]:
    """Messages of an address and when they came."""
    from pythonosc.osc_packet import OscPacket

    wanted = address.encode()
    return [
        (when, timed.message)
        for when, data in heard
        if wanted in data
        for timed in OscPacket(data).messages
        if timed.message.address == address
    ]


def _figures(
    heard: list[tuple[float, bytes]], clicks: np.ndarray, dropped: int, cpu: float
) -> dict[str, Any]:
    """Jitter of the frames' beat, and the position each frame shows against the sound heard then."""
    ends = [when for when, _ in _messages(heard, "/VMC/Ext/T")]
    mouth = [(t, m.params[1]) for t, m in _messages(heard, "/VMC/Ext/Blend/Val") if m.params[0] == "A"]
    at, positions = [t for t, _ in mouth], np.array([value * SECONDS for _, value in mouth])
    beat = np.diff(np.array(ends))
    inside = [t for t in clicks if at[5] < t < at[-5]]
    picture = np.interp(inside, at, positions)
    offset_ms = 1000 * (picture - (np.round(picture - 0.5) + 0.5))
    off_beat_ms = 1000 * np.abs(beat - np.median(beat))
    return {
        "seconds": SECONDS,
        "frames": len(ends),
        "frames_dropped": dropped,
        "fps_median": round(1 / float(np.median(beat)), 2),
        "jitter_p50_ms": round(float(np.percentile(off_beat_ms, 50)), 3),
        "jitter_p99_ms": round(float(np.percentile(off_beat_ms, 99)), 3),
        "clicks": len(inside),
        "figure_to_sound_median_ms": round(float(np.median(offset_ms)), 3),
        "figure_to_sound_p99_ms": round(float(np.percentile(np.abs(offset_ms), 99)), 3),
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
            now = time.monotonic()
            if b"/VMC/Ext/T" in data or b"/VMC/Ext/Blend/Val" in data:  # bones are not looked at
                self.heard.append((now, data))
