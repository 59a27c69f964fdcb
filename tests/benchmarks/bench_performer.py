"""The practice performer: how long it needs to speak, to move, and how true its schedule is."""

from __future__ import annotations

import socket
import statistics
import tempfile
import time
from pathlib import Path
from typing import Any

SENTENCES = 8
LIVE_SECONDS = 6.0


def run() -> dict[str, Any]:
    """Milliseconds a sentence for speech and for motion, seconds for the sample, lateness of live frames."""
    from studio.performer import espeak

    sources = ["bundled", *(["espeak"] if espeak.available() else [])]
    figures: dict[str, Any] = {}
    for source in sources:
        figures |= {f"{name}_{source}": value for name, value in _making(source).items()}
    return figures | _sample() | _live()


def _making(source: str) -> dict[str, float]:
    from studio.performer.performance import frame_times, move
    from studio.performer.script import Script

    script, speaking, moving = Script(0, voice_source=source), [], []
    for _ in range(SENTENCES):
        began = time.perf_counter()
        line = script.next_line()
        spoken = time.perf_counter()
        move(frame_times(line.start, line.end, 60.0), (line,), script.style)
        speaking.append(1000 * (spoken - began))
        moving.append(1000 * (time.perf_counter() - spoken))
    return {"speech_ms": statistics.median(speaking), "motion_ms": statistics.median(moving)}


def _sample() -> dict[str, float]:
    from studio.performer import make_sample

    with tempfile.TemporaryDirectory() as folder:
        began = time.perf_counter()
        make_sample(Path(folder) / "sample")
        return {"sample_s": time.perf_counter() - began}


def _live() -> dict[str, float]:
    """Frames at 60 Hz over loopback: arrival less the frame's own time, about its median."""
    from studio.performer import Broadcast
    from studio.vmc.assemble import FrameAssembler

    arrivals: list[tuple[float, bytes]] = []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as channel:
        channel.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4 << 20)
        channel.bind(("127.0.0.1", 0))
        channel.settimeout(0.2)
        port = int(channel.getsockname()[1])
        broadcast = Broadcast("127.0.0.1", port, device="none", seconds=LIVE_SECONDS)
        broadcast.start()
        while broadcast.alive:
            try:
                data = channel.recv(65536)
            except TimeoutError:
                continue
            arrivals.append((time.monotonic(), data))
    assembler = FrameAssembler()
    frames = [frame for arrival, data in arrivals for frame in assembler.feed(arrival, data)]
    late = [1000 * (frame.arrival - (frame.sender_time or 0.0)) for frame in frames]
    middle = statistics.median(late)
    apart = sorted(abs(value - middle) for value in late)
    return {
        "live_frames": len(frames),
        "live_frames_dropped": broadcast.frames_dropped,
        "live_lateness_p50_ms": apart[len(apart) // 2],
        "live_lateness_p99_ms": apart[int(0.99 * len(apart))],
    }
