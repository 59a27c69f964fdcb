"""Whether the window loses a frame: 120 Hz x (54 bones + 52 shapes) while it draws and a network trains.

The sender is a process of its own that counts what it sends and how late it is itself, so that its stalls on
a busy machine are not taken for losses of ours. Every datagram and every frame it sent has to be in the
take's counters. A flood of 50,000 packets a second to a second port of the same recording comes last.

Run alone with `python -m tests.benchmarks.bench_capture_window --long [SECONDS]` for 30 minutes (unbundled,
the hardest); its result goes to results/capture_window_long.json.
"""

from __future__ import annotations

import contextlib
import json
import os
import socket
import subprocess
import sys
import tempfile
import textwrap
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from studio import virtual_devices
from studio.take.motion_file import read_motion
from tests.benchmarks.__main__ import machine

ROOT = Path(__file__).resolve().parents[2]
RESULT = Path(__file__).resolve().parent / "results" / "capture_window_long.json"
SECONDS = float(os.environ.get("SAIA_BENCH_SECONDS", "30"))
LONG_SECONDS = 1800.0
FPS = 120
FLOOD_PER_S = 50_000
BEAT_MS = 5

SENDER = textwrap.dedent("""
    # Sends frames of 54 bones and 52 shapes; tells when each was due, when it left, and how many datagrams.
    import json, socket, sys, time
    import numpy as np
    from studio.vmc.encode import SendOptions, encode_frame
    from studio.motion import Pose, Skeleton
    from studio.motion.channels import ARKIT_SHAPES, BONES

    port, seconds, bundle, out_path = int(sys.argv[1]), float(sys.argv[2]), sys.argv[3] == "1", sys.argv[4]
    fps = 120
    rest = Skeleton.humanoid(BONES).rest_positions.astype("f")
    identity = np.array([0, 0, 0, 1], "f")
    options = SendOptions(names="as_is", bundle=bundle)
    cycle = []
    for k in range(600):
        half = 0.3 * np.sin(k / 600 * 2 * np.pi)
        rotations = np.tile(np.array([0, 0, np.sin(half), np.cos(half)], "f"), (54, 1))
        shapes = np.full(52, k % 100 / 100, "f")
        cycle.append((Pose(shapes, rest, rotations, np.zeros(3, "f"), identity)))
    ready = [encode_frame(pose, ARKIT_SHAPES, BONES, 0.0, SendOptions("as_is", bundle, sender_time=False))
             for pose in cycle]
    head = b"/VMC/Ext/T\\0\\0,f\\0\\0"
    due, sent, left, datagrams = [], [], [], 0
    begin = time.monotonic() + 0.3
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        out.connect(("127.0.0.1", port))
        for k in range(int(seconds * fps)):
            due.append(begin + k / fps)
            time.sleep(max(0.0, due[-1] - time.monotonic()))
            sent.append(time.monotonic())
            out.send(ready[k % 600][0])
            left.append(time.monotonic())
            for datagram in ready[k % 600][1:]:
                out.send(datagram)
            out.send(head + np.array(k / fps, ">f4").tobytes())
            datagrams += len(ready[k % 600]) + 1
    with open(out_path, "w") as file:
        json.dump({"due": due, "sent": sent, "left": left, "datagrams": datagrams}, file)
""")

FLOOD = textwrap.dedent("""
    import socket, sys, time
    port, seconds, rate = int(sys.argv[1]), float(sys.argv[2]), int(sys.argv[3])
    body = (b"/VMC/Ext/Blend/Val\\0\\0,sf\\0A\\0\\0\\0\\0\\0\\0\\0",
            b"/VMC/Ext/Blend/Apply\\0\\0\\0\\0,\\0\\0\\0", b"rubbish|#")
    begin, sent = time.monotonic(), 0
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        out.connect(("127.0.0.1", port))
        while time.monotonic() - begin < seconds:
            while sent < (time.monotonic() - begin) * rate:
                try:
                    out.send(body[sent % 3])
                except OSError:
                    pass
                sent += 1
            time.sleep(0.001)
    print(sent)
""")


def run(seconds: float = SECONDS, bundles: tuple[bool, ...] = (True, False)) -> dict[str, Any]:
    """Losses, stamps, memory and hold-ups of the window, recording bundled and unbundled motion."""
    with contextlib.ExitStack() as stack:
        if not virtual_devices.has_screen() and virtual_devices.screen_available():
            os.environ["DISPLAY"] = stack.enter_context(virtual_devices.virtual_screen())
        if virtual_devices.sound_available():
            os.environ.update(stack.enter_context(virtual_devices.virtual_sound()))
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="saia-bench-")))
        os.environ["SAIA_SETTINGS"] = str(folder / "settings")
        return measure(folder, seconds, bundles)


def measure(folder: Path, seconds: float, bundles: tuple[bool, ...]) -> dict[str, Any]:
    """All of it in one window that stays open."""
    from PySide6.QtTest import QTest

    from studio import settings
    from studio.ui.app import build

    port, other = free_port(), free_port()
    chosen = settings.load().changed(vmc_port=port, countdown=0.0, slate="Bench", more_ports=(str(other),))
    settings.save(chosen)
    _, window = build([])
    window.resize(1440, 900)
    window.show()
    window.start.create_project(folder / "Project")
    figures: dict[str, Any] = {"seconds": seconds, "fps": FPS, "channels": "54 bones + 52 shapes"}
    with training(folder / "trained"):
        QTest.qWait(4_000)
        figures["load_before"] = os.getloadavg()[0]
        for bundle in bundles:
            told = recorded(window, port, seconds, bundle, folder / "told.json")
            figures |= {f"{'bundled' if bundle else 'unbundled'}_{k}": v for k, v in told.items()}
        figures |= flooded(window, other)
        figures["load_after"] = os.getloadavg()[0]
    window.close()
    return figures


def recorded(window: Any, port: int, seconds: float, bundle: bool, told: Path) -> dict[str, Any]:
    """One take in the window, against what the sender says it sent."""
    before = len(window.session.project.takes)
    toggle(window, rolling=True)
    with Beats() as beats:
        words = [sys.executable, "-c", SENDER, str(port), str(seconds), str(int(bundle)), str(told)]
        child = subprocess.Popen(words, cwd=ROOT)
        early: list[float] = []
        late: list[float] = []
        begin = time.monotonic()
        while child.poll() is None:
            beats.wait(250)
            into = time.monotonic() - begin
            (early if into < 0.35 * seconds else late).append(memory_mb())
        beats.wait(500)
    lost_packets = window.room("record")[1].model.recorder.snapshot().packets_lost
    toggle(window, rolling=False)
    wait_for(lambda: len(window.session.project.takes) > before)
    take = max(window.session.project.takes, key=lambda one: one.info.created)
    said = json.loads(told.read_text())
    due, sent = np.array(said["due"]), np.array(said["sent"])
    times = read_motion(take.folder / "motion.arrow").times
    found = {
        "frames_sent": len(sent),
        "frames_missing_from_the_take": len(sent) - take.info.frames,
        "frames_lost_as_shown": take.info.frames_lost,
        "datagrams_sent": said["datagrams"],
        "datagrams_missing": said["datagrams"] - take.info.packets,
        "datagrams_dropped_as_shown": lost_packets,
        "sender_late_p99_ms": float(np.percentile(sent - due, 99)) * 1e3,
        "sender_late_max_ms": float((sent - due).max()) * 1e3,
        "memory_early_mb": float(np.median(early[len(early) // 2 :])),
        "memory_late_mb": float(np.median(late[-len(late) // 4 :])),
        **beats.figures(),
    }
    if len(times) == len(sent):
        found |= stamp_errors(times, sent, np.array(said["left"]))
    return found


def stamp_errors(times: np.ndarray, sent: np.ndarray, left: np.ndarray) -> dict[str, float]:
    """How far stamps lie outside what the sender knows of the true moment.

    A frame's first datagram leaves between two readings of the sender's clock. Where the sender is held up
    between them they lie apart, and nobody knows more: that is no error of the stamp, and is told beside it.

    Args:
        times: of the take's frames. sent, left: the sender's clock before and after, seconds (T,).
    """
    stamps = times - np.median(times - 0.5 * (sent + left))
    errors = np.maximum(np.maximum(sent - stamps, stamps - left), 0.0)
    return {
        "stamp_error_p99_ms": float(np.percentile(errors, 99)) * 1e3,
        "stamp_error_max_ms": float(errors.max()) * 1e3,
        "sender_unsure_p99_ms": float(np.percentile(left - sent, 99)) * 1e3,
    }


def flooded(window: Any, port: int, seconds: float = 8.0) -> dict[str, Any]:
    """The window while another port is flooded."""
    before = memory_mb()
    with Beats() as beats:
        words = [sys.executable, "-c", FLOOD, str(port), str(seconds), str(FLOOD_PER_S)]
        child = subprocess.Popen(words, stdout=subprocess.PIPE, text=True, cwd=ROOT)
        rates = []
        while child.poll() is None:
            beats.wait(250)
            rates.append(window.room("record")[1].model.recorder.snapshot().packets_per_s)
    assert child.stdout is not None
    snap = window.room("record")[1].model.recorder.snapshot()
    return {
        "flood_sent_per_s": int(child.stdout.read()) / seconds,
        "flood_taken_per_s_shown": float(np.median(rates)),
        "flood_dropped_shown": snap.packets_lost,
        "flood_refused_shown": snap.packets_bad,
        "flood_memory_grown_mb": memory_mb() - before,
        **{f"flood_{name}": value for name, value in beats.figures().items()},
    }


class Beats:
    """A timer of the window that notes when it gets its turn."""

    def __enter__(self) -> Beats:
        from PySide6.QtCore import Qt, QTimer

        self._at: list[float] = []
        self._timer = QTimer()
        self._timer.setTimerType(Qt.TimerType.PreciseTimer)
        self._timer.timeout.connect(lambda: self._at.append(time.perf_counter()))
        self._timer.start(BEAT_MS)
        return self

    def __exit__(self, *_: object) -> None:
        self._timer.stop()

    def wait(self, milliseconds: int) -> None:
        """Let the window live."""
        from PySide6.QtTest import QTest

        QTest.qWait(milliseconds)

    def figures(self) -> dict[str, float]:
        """How long it was held up."""
        gaps = 1e3 * np.diff(self._at)
        return {
            "hold_up_p99_ms": float(np.percentile(gaps, 99)),
            "hold_up_max_ms": float(gaps.max()),
            "hold_ups_over_50_ms": int((gaps > 50).sum()),
        }


@contextlib.contextmanager
def training(folder: Path) -> Iterator[None]:
    """A network that trains for as long as this is open, as the Train room would have it."""
    words = [sys.executable, "-m", "studio"]
    quiet: dict[str, Any] = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "cwd": ROOT}
    subprocess.run([*words, "performer", "--sample", str(folder)], check=True, **quiet)
    env = {**os.environ, "OMP_NUM_THREADS": "1"}
    forever = ["train", str(folder), "--recipe", "balanced", "--set", "training.epochs=100000"]
    child = subprocess.Popen([*words, *forever], env=env, stdin=subprocess.PIPE, **quiet)
    try:
        time.sleep(8)
        if child.poll() is not None:
            raise RuntimeError("the training did not run")
        yield
        if child.poll() is not None:
            raise RuntimeError("the training ended before the recording did")
    finally:
        child.terminate()
        child.wait(20)


def toggle(window: Any, rolling: bool) -> None:
    """Press the one key until it has done its work."""
    window.room("record")[1].toggle()
    wait_for(lambda: window.session.rolling is rolling)


def wait_for(condition: Any, seconds: float = 60.0) -> None:
    """Let the window live until something is so."""
    from PySide6.QtTest import QTest

    until = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > until:
            raise TimeoutError("the window did not get there")
        QTest.qWait(20)


def memory_mb() -> float:
    """What this process keeps in memory."""
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith("VmRSS"):
            return int(line.split()[1]) / 1024
    return 0.0


def free_port() -> int:
    """A UDP port nobody listens on."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def main() -> None:
    """The long form."""
    words = sys.argv[1:]
    if "--long" not in words:
        sys.stdout.write(json.dumps(run(), indent=2) + "\n")
        return
    seconds = float(words[-1]) if words[-1] != "--long" else LONG_SECONDS
    figures = run(seconds, bundles=(False,))
    content = {
        "benchmark": "capture_window_long",
        "measured": time.strftime("%Y-%m-%d"),
        "machine": machine(),
        "figures": figures,
    }
    RESULT.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
