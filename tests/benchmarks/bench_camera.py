"""A webcam as a tracker: the core it takes, what it loses, how true its stamps are; and videos imported.

Two hours of a video are smoothed, too, as rows of what was tracked, for the memory that takes.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import psutil

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from tests.tracking.faces import MODEL, Look, bursts, picture, write_video

LIVE_SECONDS, WARM_SECONDS = 20.0, 3.0
FILM_SECONDS = 60.0
BODY_FPS = 60.0
HOURS = 2.0


def run() -> dict[str, Any]:
    """Share of a core, frames and losses at 640x480, stamps' error, and import speed at 720p."""
    if not MODEL.is_file():
        return {"skipped": f"no face model at {MODEL}"}
    os.environ["SAIA_FACE_MODEL"] = str(MODEL)
    with tempfile.TemporaryDirectory() as folder:
        os.environ["XDG_CACHE_HOME"] = folder
        return _webcam(Path(folder)) | _import(Path(folder)) | _mouth() | _smoothing()


def _film(path: Path, seconds: float, width: int, height: int) -> Path:
    """A face that rolls, nods and speaks; some hundred pictures there and back, again and again."""
    t = np.arange(90) / 30
    some = [
        picture(
            Look(
                roll=8 * np.sin(2 * np.pi * s / 3), yaw=6 * np.sin(4 * np.pi * s / 3),
                open=16 * max(np.sin(2 * np.pi * 2 * s), 0), scale=height / 270,
            ),
            width, height,
        )
        for s in t
    ]  # fmt: skip
    count = round(seconds * 30)
    order = iter([*range(90), *range(89, -1, -1)] * (count // 180 + 1))
    sound = bursts(seconds, np.arange(0.5, seconds, 1.0))
    return write_video(path, [Look()] * count, sound, shape=(width, height), draw=lambda _: some[next(order)])


def _webcam(folder: Path) -> dict[str, float]:
    """The real command beside a body at 60 frames a second, both into one receiver."""
    from studio import clock
    from studio.capture.inputs import MotionInput
    from studio.performer import Broadcast

    film = _film(folder / "vga.mp4", 20.0, 640, 480)
    ear = MotionInput([(0, "127.0.0.1")])
    to = f"127.0.0.1:{ear.port}"
    body = Broadcast("127.0.0.1", ear.port, BODY_FPS, "none", 0)
    command = [sys.executable, "-m", "studio", "camera", "--to", to, "--device", str(film), "--json"]
    status: dict[str, Any] = {}
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as child:
        assert child.stdin is not None
        assert child.stdout is not None
        child.stdout.readline()
        time.sleep(WARM_SECONDS)
        body.start()
        process = psutil.Process(child.pid)
        before, began = sum(process.cpu_times()[:2]), time.perf_counter()
        ends = clock.now() + LIVE_SECONDS
        while clock.now() < ends:
            ear.poll(clock.now())
            status = json.loads(child.stdout.readline())
        share = (sum(process.cpu_times()[:2]) - before) / (time.perf_counter() - began)
        memory = process.memory_info().rss / 1e6
        lost, packets_lost = ear.stats.frames_lost, ear.stats.packets_lost
        body.stop()
        child.stdin.write("stop\n")
        child.stdin.close()
        child.stdout.read()
    stamps = _stamps(film)
    ear.close()
    return {
        "webcam_core_share": share,
        "webcam_fps": status["fps"],
        "webcam_delay_ms": status["delay_ms"],
        "webcam_memory_mb": memory,
        "body_frames_lost_beside_it": lost,
        "body_packets_lost_beside_it": packets_lost,
        **stamps,
    }


def _stamps(film: Path) -> dict[str, float]:
    """How far the recorder's stamps are from the moments the pictures were due, milliseconds."""
    from studio import clock
    from studio.capture.inputs import MotionInput
    from studio.tracking.camera import CameraReader
    from studio.tracking.webcam import Webcam

    ear = MotionInput([(0, "127.0.0.1")])
    webcam = Webcam(CameraReader(str(film)), MODEL, "127.0.0.1", ear.port)
    blocks, ends = [], clock.now() + 8.0
    while clock.now() < ends:
        webcam.step()
        blocks += ear.poll(clock.now())
    webcam.close()
    ear.close()
    stamps = np.concatenate([block.stamps for block in blocks])[10:]
    # The pictures are due every 30th of a second from one moment on.
    apart = stamps[:, 0] * 30
    error = np.abs(apart - np.median(apart % 1) - np.round(apart - np.median(apart % 1))) / 30 * 1e3
    return {"stamp_error_median_ms": float(np.median(error)), "stamp_error_worst_ms": float(error.max())}


def _import(folder: Path) -> dict[str, float]:
    """`saia import` of a minute at 720p, as a child."""
    film = _film(folder / "hd.mp4", FILM_SECONDS, 1280, 720)
    command = [sys.executable, "-m", "studio", "import", str(folder / "P"), str(film), "--json"]
    began, most = time.perf_counter(), 0.0
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as child:
        assert child.stdout is not None
        process = psutil.Process(child.pid)
        halfway = 0.0
        for line in child.stdout:
            event = json.loads(line)
            if event["event"] == "progress":
                most = max(most, process.memory_info().rss / 1e6)
                halfway = halfway if halfway or event["fraction"] < 0.5 else most
    wall = time.perf_counter() - began
    return {
        "import_times_real_time_720p": FILM_SECONDS / wall,
        "import_memory_mb": most,
        "import_memory_second_half_mb": most - halfway,
    }


def _mouth() -> dict[str, float]:
    """What looking whether the mouth is seen adds to a picture, milliseconds."""
    from studio.tracking.landmarker import FaceLandmarker
    from studio.tracking.mouth import redness

    landmarker = FaceLandmarker(MODEL)
    shown = picture(Look(), 640, 480)
    (face,) = landmarker.detect(shown, 0.0)
    landmarker.close()
    began = time.process_time()
    for _ in range(500):
        redness(shown, face)
    return {"mouth_look_ms": (time.process_time() - began) / 500 * 1e3}


def _smoothing() -> dict[str, float]:
    """Two hours of rows smoothed into a motion, in a process of its own: what it takes beside the rows."""
    code = "from tests.benchmarks.bench_camera import smooth_hours; smooth_hours()"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


def smooth_hours() -> None:
    """Print how much memory and time the rows of HOURS take to become a motion."""
    from studio.motion import rotation
    from studio.tracking.face import Calibration, motion_of
    from studio.tracking.smoothing import smooth

    count = round(HOURS * 3600 * 30)
    times, rows = np.arange(count) / 30, np.arange(count)
    rng = np.random.default_rng(1)
    weights = rng.random((count, 52), np.float32)
    turns = rotation.from_euler_yxz(0.2 * np.sin(times), 0.1 * np.cos(times), 0.0 * times).astype(np.float32)
    process = psutil.Process()
    before, most, ended = process.memory_info().rss, [0], threading.Event()

    def watch() -> None:
        while not ended.wait(0.02):
            most[0] = max(most[0], process.memory_info().rss)

    watcher = threading.Thread(target=watch)
    watcher.start()
    began = time.process_time()
    smooth(times, weights, turns, rows)
    motion = motion_of(times, weights, turns, rows, Calibration())
    took = time.process_time() - began
    ended.set()
    watcher.join()
    parts = (motion.shapes, motion.positions, motion.rotations, motion.root_position, motion.root_rotation)
    result = {
        "two_hours_smoothed_s": took,
        "two_hours_added_mb": (most[0] - before) / 1e6,
        "two_hours_motion_mb": sum(part.nbytes for part in parts) / 1e6,
    }
    print(json.dumps(result))
