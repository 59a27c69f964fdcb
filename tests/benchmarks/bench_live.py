"""Live, end to end: how long after a sound at the microphone the datagram with its mouth shape leaves.

Clicks and vowels are played into a virtual sound device, `saia live` hears them there in a process of its
own, and a socket takes its datagrams. This process hears the device too, so it knows when each sound was
captured; the motion that belongs to it is generated from that recording as from a file, and the datagrams
are laid over it in time: the shift that fits best is the latency. The run learnt the practice performer.
How good Quick is beside one that hears further on is measured on real face captures that were left out
(SAIA_DATA, as in bench_learning), and how much sooner mouths open at their onsets in bench_opening.

`python -m tests.benchmarks.bench_live --long [SECONDS]` performs for hours (7200) and keeps memory, drift,
latency and dropouts along the way in results/live_long.json.
"""

from __future__ import annotations

import contextlib
import json
import os
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

RATE = 48_000
SECONDS = 40.0
LONG_S = 7200.0
USUAL_MS = 67
SOAK_MS, PIECE_S, MEASURE_EACH_S = 100, 20.0, 300.0
FPS = 60.0
SHAPE = "A"
_SO_TIMESTAMPNS = 35


def run() -> dict[str, Any]:
    """Figures over some forty seconds of clicks and vowels, at each look-ahead the run offers."""
    from studio import virtual_devices

    if not virtual_devices.sound_available():
        return {"skipped": "pulseaudio is not installed"}
    with tempfile.TemporaryDirectory() as folder, _stage() as output:
        project, run_id = trained(Path(folder))
        offered = look_aheads(project, run_id)
        figures: dict[str, Any] = {"load_before": os.getloadavg()[0], "look_aheads_ms": offered}
        for ms in offered:
            figures |= {f"{name}_{ms}": value for name, value in measure(project, run_id, ms, output).items()}
        early = measure(project, run_id, USUAL_MS, output, early=True)
        figures |= {"click_to_datagram_ms_open_early": early["click_to_datagram_ms"]}
        with_voice = measure(project, run_id, SOAK_MS, output, delayed_voice=True)
        figures |= {f"{name}_{SOAK_MS}_with_delayed_voice": value for name, value in with_voice.items()}
        figures |= {"speech": speech_form(Path(folder), output)}
        return figures | {"load_after": os.getloadavg()[0], "quality": quality(Path(folder))}


def speech_form(folder: Path, output: str) -> dict[str, Any]:
    """The same of the form that knows speech, which waits for as much sound as its encoder's chunks need."""
    from studio.features.encoders import has_whisper, whisper_remedy

    if not has_whisper():
        return {"skipped": f"Whisper is not installed. {whisper_remedy()}"}
    project, run_id = trained(folder, "form=speech", "training.epochs=3", name="Speech")
    (ms,) = look_aheads(project, run_id)
    return measure(project, run_id, ms, output)


def quality(folder: Path) -> dict[str, Any]:
    """Quick as it is beside one that hears 33 ms further, on real takes left out in turn, with ratios."""
    from tests.benchmarks.bench_learning import DATA, TAKES, fold, saia

    if not (DATA / "Audio").is_dir():
        return {"skipped": f"{DATA.name} is not here; set SAIA_DATA to the folder that holds it"}
    project = str(folder / "Facegood")
    saia("import", project, str(DATA))
    known: dict[str, dict[str, Any]] = {take: {} for take in TAKES}
    kinds = {"58": "quick", "92": "quick look_ahead_ms=67"}
    folds = {ms: [fold(project, words, 1, take, known) for take in TAKES] for ms, words in kinds.items()}
    names = ("pearson_mouth", "pearson_jaw", "rmse")
    means = {ms: {name: float(np.mean([row[name] for row in rows])) for name in names}
             for ms, rows in folds.items()}  # fmt: skip
    ratios = {name: round(means["58"][name] / means["92"][name], 3) for name in names}
    return {"takes_left_out": TAKES, "at_58_ms": means["58"], "at_92_ms": means["92"], "ratios": ratios}


@contextlib.contextmanager
def _stage() -> Iterator[str]:
    """A sound device of our own, named for PortAudio."""
    from studio import virtual_devices

    with virtual_devices.virtual_sound() as environment:
        os.environ.update(environment)
        from studio.capture.microphone import input_devices

        input_devices(refresh=True)
        yield "default"


def trained(folder: Path, *changes: str, name: str = "Live") -> tuple[Path, str]:
    """The sample project with a short training of `balanced`, changed; its folder and the run's id."""
    from studio.features.encoders import with_resolved_encoder
    from studio.performer.sample import make_sample
    from studio.project import Project
    from studio.training.loop import train
    from studio.training.recipe import load_recipe

    place = folder / name
    make_sample(place)
    recipe = load_recipe("balanced").with_overrides(changes or ["training.epochs=8"])
    recipe = replace(recipe, sound=with_resolved_encoder(recipe.sound))
    with contextlib.closing(Project.open(place)) as project:
        return place, train.train(project, recipe, on_event=lambda _: None).id


def look_aheads(project: Path, run_id: str) -> list[int]:
    """What the run offers, milliseconds."""
    from studio.inference.live.steps import look_aheads as offered
    from studio.training.checkpoint import BEST, load_model

    return list(offered(load_model(project / "runs" / run_id / BEST)))


def measure(
    project: Path,
    run_id: str,
    look_ahead_ms: int,
    output: str,
    delayed_voice: bool = False,
    early: bool = False,
) -> dict[str, Any]:
    """One performance of clicks and vowels, the voice handed on or not, the mouth opened early or not."""
    sound, frames = clicks_and_vowels(SECONDS), Frames()
    options = ["--no-gate", "--no-gain", *(["--voice-to", "default"] if delayed_voice else [])]
    options += [] if early else ["--no-early"]
    with _live(project, run_id, look_ahead_ms, frames.port, *options) as live, _second_ear() as ear:
        live.wait_ready()
        heard = play_and_hear(sound, output)
        live.stop()
    frames.close()
    truth = offline(project, run_id, look_ahead_ms, heard)
    latency = frames.behind(*truth)
    first = first_movement(heard, truth, frames, latency)
    intervals = np.diff(frames.times)
    return {
        "reach_ms": live.ready["reach_ms"],
        "latency_ms": round(1000 * latency, 1),
        "over_look_ahead_ms": round(1000 * latency - live.ready["look_ahead_ms"], 1),
        "said_latency_ms": live.done["latency_ms"],
        "click_to_datagram_ms": first,
        "voice_handed_on_ms": round(1000 * behind(heard, ear.heard), 1) if delayed_voice else None,
        "interval_ms_p50": round(1000 * float(np.median(intervals)), 3),
        "jitter_ms_p99": round(1000 * float(np.percentile(np.abs(intervals - 1 / FPS), 99)), 3),
        "load": round(os.getloadavg()[0], 1),
        "poses_late": live.done["late"],
        "poses": live.done["frames"],
        "frames_dropped": live.done["dropped"],
        "process_share_of_a_core": round(live.cpu / live.wall, 3),
        "steps_share_of_a_core": live.load,
    }


def clicks_and_vowels(seconds: float) -> np.ndarray:
    """A click, then half a second of a vowel, then silence, again and again at uneven distances, (N,)."""
    rng, rate = np.random.default_rng(3), RATE
    out = np.zeros(int(seconds * rate), dtype=np.float32)
    at = int(1.5 * rate)
    while at + rate < len(out):
        t = np.arange(int(rng.uniform(0.2, 0.6) * rate)) / rate
        pitch = rng.uniform(110, 220)
        vowel = sum(np.sin(2 * np.pi * pitch * k * t) * _formants(pitch * k) for k in range(1, 30))
        vowel = 0.25 * vowel / np.abs(vowel).max() * np.minimum(1, np.minimum(t, t[::-1]) / 0.02)
        out[at] = 0.9
        out[at + 40 : at + 40 + len(t)] += vowel.astype(np.float32)
        at += len(t) + int(rng.uniform(0.3, 0.9) * rate)
    return out


class _Ear:
    """What a process of its own heard of the second output."""

    heard: tuple[np.ndarray, float]


@contextlib.contextmanager
def _second_ear() -> Iterator[_Ear]:
    from studio.virtual_devices import SECOND

    ear = _Ear()
    with tempfile.TemporaryDirectory() as folder:
        kept = Path(folder) / "heard.npz"
        environment = {**os.environ, "PULSE_SOURCE": f"{SECOND}.monitor"}
        command = [sys.executable, "-m", "tests.benchmarks.bench_live", "--hear", str(kept)]
        listener = subprocess.Popen(command, stdin=subprocess.PIPE, env=environment)
        yield ear
        listener.communicate(timeout=60)
        found = np.load(kept)
        ear.heard = found["samples"], float(found["began"])


def hear(kept: Path) -> None:
    """Listen until stdin ends, and keep what was heard and when it began."""
    ended = threading.Event()
    threading.Thread(target=lambda: (sys.stdin.read(), ended.set()), daemon=True).start()
    samples, began = _heard_until(ended, "default")
    np.savez(kept, samples=samples, began=began)


def behind(first: tuple[np.ndarray, float], second: tuple[np.ndarray, float]) -> float:
    """Seconds by which the same sound is later in the second of two recordings (samples, beginning)."""
    from scipy.signal import correlate

    (a, began_a), (b, began_b) = first, second
    lag = int(np.argmax(correlate(b, a, mode="full", method="fft"))) - (len(a) - 1)
    return began_b + lag / RATE - began_a


def speech(project: Path, seconds: float) -> np.ndarray:
    """The voice of the project's first takes, (N,) at RATE: what opens a voice gate."""
    from studio.project import Project
    from studio.sound.sound_file import sound_blocks

    with contextlib.closing(Project.open(project)) as opened:
        paths = [take.audio_path for _, take in opened.selected() if take.audio_path is not None]
    blocks = [block for path in paths for block in sound_blocks(path, RATE, seconds)]
    return np.concatenate(blocks)[: round(seconds * RATE)]


def _formants(hz: float) -> float:
    """How loud a harmonic of an open vowel is: formants at 800, 1200 and 2500 Hz."""
    return sum(
        a / (1 + ((hz - f) / w) ** 2) for f, w, a in ((800, 90, 1), (1200, 110, 0.6), (2500, 160, 0.2))
    )


def play_and_hear(sound: np.ndarray, output: str) -> tuple[np.ndarray, float]:
    """Play it while hearing the same device; what was heard (N,) and the moment of its first sample."""
    import sounddevice

    done = threading.Event()
    place = [0]

    def give(block: np.ndarray, count: int, _moment: Any, _status: object) -> None:
        part = sound[place[0] : place[0] + count]
        block[:, 0] = 0
        block[: len(part), 0] = part
        place[0] += count
        if place[0] > len(sound) + RATE:
            done.set()

    with sounddevice.OutputStream(samplerate=RATE, channels=1, device=output, latency=0.06, callback=give):
        return _heard_until(done, output)


def _heard_until(done: threading.Event, device: str) -> tuple[np.ndarray, float]:
    """What a device hears until an event, (N,), and the moment of its first sample."""
    from studio.capture.microphone import AudioInput

    # Short blocks: a server hands long ones over late, and not every driver's stamps know that.
    ear = AudioInput(device, sample_rate=RATE, channels=1, latency=0.01)
    ear.start()
    blocks, moments, began, taken = [], [], [], 0
    while not done.wait(0.02):
        for block in ear.drain():
            moments.append((taken, block.captured))
            # No block can have been captured later than it was handed over, whatever the driver says of it.
            began.append(block.arrived - (taken + len(block.samples)) / RATE)
            blocks.append(block.samples[:, 0])
            taken += len(block.samples)
    ear.stop()
    at, captured = np.array(moments).T
    return np.concatenate(blocks), min(float(np.median(captured - at / RATE)), min(began))


def offline(
    project: Path, run_id: str, look_ahead_ms: int, heard: tuple[np.ndarray, float]
) -> tuple[np.ndarray, np.ndarray]:
    """When each pose of the sound belongs (T,), and how far the mouth is open in it (T,)."""
    from studio.inference.live.steps import LiveSteps, look_ahead_of
    from studio.sound.resample import Resampler
    from studio.training.checkpoint import BEST, load_model

    samples, began = heard
    model = load_model(project / "runs" / run_id / BEST)
    sound = Resampler(RATE, model.recipe.sound.sample_rate).feed(samples)
    values = np.concatenate([v for _, v in LiveSteps(model, look_ahead_of(model, look_ahead_ms)).feed(sound)])
    times = np.arange(len(values)) / float(model.fps)
    motion = model.layout.motion(values, times)
    return began + times, motion.shapes[:, motion.shape_names.index(SHAPE)]


def first_movement(
    heard: tuple[np.ndarray, float], truth: tuple[np.ndarray, np.ndarray], frames: Frames, latency: float
) -> float | None:
    """Milliseconds from a click to the first datagram in which the mouth is a third open, the median."""
    samples, began = heard
    at = np.flatnonzero(samples > 0.7)
    clicks = began + at[np.diff(at, prepend=-RATE) > RATE // 10] / RATE
    times, mouth = np.array(frames.times), np.array(frames.mouth)
    open_ = mouth.min() + (np.percentile(mouth, 98) - mouth.min()) / 3
    found = []
    for click in clicks:
        here = np.flatnonzero((times > click) & (times < click + 0.6) & (mouth > open_))
        before = mouth[(times > click - 0.05) & (times < click)]
        if len(here) and len(before) and before.max() < open_:
            found.append(1000 * (times[here[0]] - click))
    return round(float(np.median(found)), 1) if found else None


class Frames:
    """A socket that keeps when each frame came, and how far its mouth was open."""

    def __init__(self) -> None:
        self.times: list[float] = []
        self.mouth: list[float] = []
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4 << 20)
        self._socket.bind(("127.0.0.1", 0))
        self._socket.settimeout(0.2)
        # The kernel's stamps: this process may be held up on a busy machine.
        self._socket.setsockopt(socket.SOL_SOCKET, _SO_TIMESTAMPNS, 1)
        self.port: int = self._socket.getsockname()[1]
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        from studio.clock import WallClock

        wall = WallClock()
        mark = b"/VMC/Ext/Blend/Val\x00\x00,sf\x00" + f"{SHAPE}\x00\x00\x00".encode()
        while not self._ended.is_set():
            try:
                data, extra, _, _ = self._socket.recvmsg(65_536, 64)
            except TimeoutError:
                continue
            seconds, nanoseconds = struct.unpack("qq", extra[0][2][:16])
            now = seconds + nanoseconds * 1e-9 - wall.ahead()
            place = data.find(mark)
            if place >= 0:
                self.times.append(now)
                self.mouth.append(struct.unpack_from(">f", data, place + len(mark))[0])

    def close(self) -> None:
        """No more."""
        self._ended.set()
        self._thread.join()
        self._socket.close()

    def behind(self, moments: np.ndarray, mouth: np.ndarray) -> float:
        """Seconds by which the frames lie behind a curve (T,) of moments (T,): the shift that fits best."""
        count = len(self.mouth)  # appended last, on another thread
        times, seen = np.array(self.times[:count]), np.array(self.mouth[:count])
        inside = (times > moments[0] + 1.0) & (times < moments[-1])
        times, seen = times[inside], seen[inside]

        def error(shift: float) -> float:
            return float(np.mean((np.interp(times - shift, moments, mouth) - seen) ** 2))

        coarse = np.arange(-0.1, 1.6, 0.005)
        best = coarse[int(np.argmin([error(shift) for shift in coarse]))]
        fine = np.arange(best - 0.005, best + 0.005, 0.0002)
        return float(fine[int(np.argmin([error(shift) for shift in fine]))])


class _Child:
    """`saia live` in a process of its own."""

    def __init__(self, command: list[str], environment: dict[str, str]) -> None:
        self.process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            encoding="utf-8",
            env=environment,
        )
        self.ready: dict[str, Any] = {}
        self.done: dict[str, Any] = {}
        self.states: list[dict[str, Any]] = []
        self.notices: list[str] = []
        self.cpu = self.wall = 0.0
        self._cpu_at = self._wall_at = 0.0
        self._got = threading.Event()
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    @property
    def load(self) -> float:
        """Share of a core the steps took, the median of what it said."""
        return round(float(np.median([one["load"] for one in self.states] or [0.0])), 3)

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            event = json.loads(line)
            kind = event["event"]
            if kind == "ready":
                self.ready = event
                self._got.set()
            elif kind == "state":
                self.states.append(event)
            elif kind == "notice":
                self.notices.append(event["what"])
            elif kind == "done":
                self.done = event

    def wait_ready(self) -> None:
        """Until it hears."""
        if not self._got.wait(120):
            raise RuntimeError("saia live did not start")
        self._cpu_at, self._wall_at = self.cpu_seconds(), time.monotonic()

    def cpu_seconds(self) -> float:
        """Processor seconds it has used."""
        fields = Path(f"/proc/{self.process.pid}/stat").read_text().rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def memory_mb(self) -> float:
        """What it holds in memory now."""
        pages = int(Path(f"/proc/{self.process.pid}/statm").read_text().split()[1])
        return pages * os.sysconf("SC_PAGE_SIZE") / 1e6

    def stop(self) -> None:
        """End it well."""
        self.cpu, self.wall = self.cpu_seconds() - self._cpu_at, time.monotonic() - self._wall_at
        assert self.process.stdin is not None
        self.process.stdin.write("stop\n")
        self.process.stdin.flush()
        self.process.wait(60)
        self._reader.join(10)


@contextlib.contextmanager
def _live(project: Path, run_id: str, look_ahead_ms: int, port: int, *more: str) -> Iterator[_Child]:
    command = [
        sys.executable, "-m", "studio", "live", str(project), run_id, "--to", f"127.0.0.1:{port}",
        "--look-ahead", str(look_ahead_ms), "--json", *more,
    ]  # fmt: skip
    from studio.virtual_devices import SECOND

    child = _Child(command, {**os.environ, "PULSE_SINK": SECOND})
    try:
        yield child
    finally:
        if child.process.poll() is None:
            child.process.kill()
            child.process.wait()


def soak(seconds: float, given: tuple[Path, str] | None = None) -> dict[str, Any]:
    """Perform for a long time: memory, drift, latency and dropouts along the way.

    Args:
        seconds: how long.
        given: a project and its run; one is trained where None.
    """
    with tempfile.TemporaryDirectory() as folder, _stage() as output:
        project, run_id = given or trained(Path(folder))
        frames, looks = Frames(), []
        with _live(project, run_id, SOAK_MS, frames.port) as live:
            live.wait_ready()
            began = measured_at = time.monotonic()
            piece, measured = speech(project, PIECE_S), None
            while time.monotonic() - began < seconds:
                heard = play_and_hear(piece, output)
                if measured is None or time.monotonic() - measured_at > MEASURE_EACH_S:
                    measured_at = time.monotonic()
                    measured = round(1000 * frames.behind(*offline(project, run_id, SOAK_MS, heard)), 1)
                state = live.states[-1]
                looks.append(
                    {
                        "s": round(time.monotonic() - began), "memory_mb": round(live.memory_mb(), 1),
                        "latency_ms": state["latency_ms"], "measured_latency_ms": measured,
                        "late": state["late"], "gain_db": state["gain_db"], "speaking": state["speaking"],
                        "drift_ppm": state["drift_ppm"], "load": state["load"],
                        "machine_load": os.getloadavg()[0],
                    }
                )  # fmt: skip
                print(looks[-1], flush=True)
            live.stop()
        frames.close()
        intervals = np.diff(frames.times)
        minute = max(len(looks) // 20, 1)
        return {
            "seconds": round(seconds),
            "memory_mb_after_a_twentieth": looks[minute]["memory_mb"],
            "memory_mb_at_the_end": looks[-1]["memory_mb"],
            "look_ahead_ms": SOAK_MS,
            "latency_ms_first_and_last": [looks[1]["latency_ms"], looks[-1]["latency_ms"]],
            "measured_latency_ms_least_and_most": [
                pick(one["measured_latency_ms"] for one in looks) for pick in (min, max)
            ],
            "poses": live.done["frames"],
            "poses_expected": round(live.done["seconds"] * live.ready["fps"]),
            "poses_late": live.done["late"],
            "frames_received": len(frames.times),
            "frames_dropped": live.done["dropped"],
            "longest_pause_ms": round(1000 * float(intervals.max()), 1),
            "jitter_ms_p99": round(1000 * float(np.percentile(np.abs(intervals - 1 / FPS), 99)), 3),
            "process_share_of_a_core": round(live.cpu / live.wall, 3),
            "notices": live.notices[:20],
            "looks": looks[:: max(len(looks) // 60, 1)],
        }


if __name__ == "__main__":
    if "--hear" in sys.argv:
        hear(Path(sys.argv[2]))
        sys.exit()
    LENGTH = float(sys.argv[2]) if len(sys.argv) > 2 else LONG_S
    KEPT = Path(__file__).resolve().parent / "results" / "live_long.json"
    FOUND = soak(LENGTH) if "--long" in sys.argv else run()
    print(json.dumps(FOUND, indent=1))
    if "--long" in sys.argv:
        KEPT.write_text(json.dumps(FOUND, indent=1) + "\n", encoding="utf-8")
