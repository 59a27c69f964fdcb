"""How much sooner a mouth opens where a voice begins, and what it costs: real takes, left out of a Quick run.

Performed on a clock of its own, as a microphone that trembles by milliseconds would hear it, with noise of a
room under the voice, which the takes lack: once as the network has it, once with the mouth opened early.
Counted at each word that follows a silence: when the jaw has passed a third of its rise. Then the same room
without a voice, mouse clicks, and typing.
"""

from __future__ import annotations

import contextlib
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

RATE, BLOCK_S = 16_000, 0.005
ROOM_DBFS, DEVICE_S, TREMBLE_S = -58.0, 0.004, 0.003
LEFT_OUT = ("2_04", "3_15")
JAW = "mouth_stretch_c"
FPS, SECONDS = 60, 60.0


def run() -> dict[str, Any]:
    """Figures of each take left out, and what opens by mistake a minute."""
    from studio.project import Project
    from studio.sound.sound_file import read_sound
    from studio.take.motion_file import load_motion
    from studio.training.checkpoint import BEST, load_model
    from tests.benchmarks.bench_learning import DATA, TAKES, saia

    found: dict[str, Any] = {"false_openings_a_minute": false_openings()}
    if not (DATA / "Audio").is_dir():
        return found | {"skipped": f"{DATA.name} is not here; set SAIA_DATA to the folder that holds it"}
    with tempfile.TemporaryDirectory() as folder:
        project = Path(folder) / "Facegood"
        saia("import", str(project), str(DATA))
        for test in LEFT_OUT:
            saia("split", str(project), "--train", *(one for one in TAKES if one != test), "--test", test)
            run_id = saia("train", str(project), "--recipe", "quick", "--set", "seed=1")["run"]
            with contextlib.closing(Project.open(project)) as opened:
                take, selection = opened.take(test), opened.dataset[test]
                assert take.audio_path is not None
                captured = load_motion(take, selection.offset)
                assert captured is not None
                voice = read_sound(take.audio_path, RATE).mono()[: round(SECONDS * RATE)]
                model = load_model(opened.run(run_id).folder / BEST)
            jaw = captured.shapes[:, captured.shape_names.index(JAW)]
            found[test] = beside(model, voice, (captured.times, jaw))
    return found


def beside(model: Any, voice: np.ndarray, captured: tuple[np.ndarray, np.ndarray]) -> dict[str, Any]:
    """Figures without and with early opening, beside the captured jaw (times, how far open)."""
    from tests.inference.live.test_early_opening import room

    begins = beginnings(voice)
    sound = voice + room(len(voice) / RATE, ROOM_DBFS)[: len(voice)]
    rows: dict[str, Any] = {"words": len(begins)}
    for name, on in (("as_predicted", False), ("open_early", True)):
        times, mouth, latency = performed(model, sound, on)
        at = np.arange(3.0, times[-1] - 0.5, 1 / FPS)
        held = mouth[np.searchsorted(times, at, side="right") - 1]
        opened = [opening(times, mouth, begin) for begin in begins]
        rows[name] = {
            "latency_ms": round(1000 * latency, 1),
            "opens_after_the_sound_ms": round(1000 * float(np.nanmedian(opened)), 1),
            "jaw_r_at_its_latency": round(
                float(np.corrcoef(held, np.interp(at - latency, *captured))[0, 1]), 3
            ),
            "jaw_r_beside_the_sound": round(float(np.corrcoef(held, np.interp(at, *captured))[0, 1]), 3),
        }
    return rows


class _Given:
    """A microphone on a clock that is set by hand, which hands its blocks over a little late and unevenly."""

    name, ended, unheard = "given", False, ""

    def __init__(self, sound: np.ndarray, now: list[float]) -> None:
        self._now, self._size, self._next = now, round(BLOCK_S * RATE), 0
        self._blocks = sound[: len(sound) // self._size * self._size].reshape(-1, self._size)
        self._captured = now[0] + BLOCK_S * np.arange(len(self._blocks))
        late = DEVICE_S + np.random.default_rng(1).exponential(TREMBLE_S, len(self._blocks))
        self._arrive = np.maximum.accumulate(self._captured + BLOCK_S + late)

    @property
    def next_at(self) -> float:
        """When the next block arrives."""
        return float(self._arrive[self._next]) if self._next < len(self._arrive) else float("inf")

    def start(self) -> None: ...

    def stop(self) -> None: ...

    def wait(self, seconds: float) -> None: ...

    def problems(self) -> list[Any]:
        return []

    def blocks(self) -> list[Any]:
        """Those that have arrived."""
        from studio.inference.live.audio_source import AudioBlock

        found = []
        while self.next_at <= self._now[0]:
            i = self._next
            found.append(AudioBlock(self._blocks[i], RATE, float(self._captured[i]), restarted=i == 0))
            self._next += 1
        return found


def performed(model: Any, sound: np.ndarray, on: bool) -> tuple[np.ndarray, np.ndarray, float]:
    """When frames leave (T,), how far the jaw is open in each (T,), and the latency, all in seconds."""
    from studio.inference.live.early_opening import EarlyOpening
    from studio.inference.live.performance import Performance, mean_motion, rest_motion
    from studio.inference.live.pose_layers import PoseLayers
    from studio.inference.live.preprocess import AudioPreprocessor, Gain, Gate
    from studio.inference.live.steps import look_ahead_of

    now = [1000.0]
    began, end, source = now[0], now[0] + len(sound) / RATE, _Given(sound, now)
    rest = rest_motion(model)
    live = Performance(
        model, look_ahead_of(model), source, AudioPreprocessor(RATE, Gain(-26.0, RATE, on=False), Gate()),
        PoseLayers(rest), opening=EarlyOpening(rest, mean_motion(model), RATE, on), prompt=True,
        now=lambda: now[0], awake=lambda: now[0],
    )  # fmt: skip
    jaw, times, mouth = rest.shape_names.index(JAW), [], []
    due = now[0] + 1 / FPS
    while now[0] < end:
        now[0] = min(due, source.next_at)
        frames = live.facts.frames
        live.poll()
        # A frame leaves with each pose, and between two poses; as studio/vmc/pace.py has it.
        if live.facts.frames != frames or now[0] >= due:
            due = now[0] + 1 / FPS
            times.append(now[0] - began)
            mouth.append(float(live.pose_at(live.position()).shapes[jaw]))
    return np.array(times), np.array(mouth), live.late


def beginnings(voice: np.ndarray) -> np.ndarray:
    """When words begin that follow 0.4 s of silence, seconds: from the clean sound and what comes after."""
    frames = voice[: len(voice) // 80 * 80].reshape(-1, 80)
    level = 10 * np.log10(np.square(frames, dtype=np.float64).mean(axis=1) + 1e-12)
    floor = np.percentile(level, 10)
    loud, soft = level > max(floor + 20, -55), level < max(floor + 14, -60)
    found, i = [], 600
    while i < len(level) - 30:
        if loud[i] and soft[i - 80 : i - 4].mean() > 0.97 and loud[i : i + 30].mean() > 0.7:
            begin = i
            while begin > i - 20 and level[begin - 1] > max(floor + 8, -62):
                begin -= 1
            found.append(begin * BLOCK_S)
            i += 110
        i += 1
    return np.array(found)


def opening(times: np.ndarray, mouth: np.ndarray, begin: float) -> float:
    """Seconds after a beginning until the mouth has passed a third of its rise; NaN where it hardly does."""
    around = (times > begin - 0.12) & (times < begin + 0.45)
    before = (times > begin - 0.22) & (times <= begin - 0.10)
    if not before.any() or mouth[around].max() - mouth[before].mean() < 0.04:
        return float("nan")
    third = mouth[before].mean() + (mouth[around].max() - mouth[before].mean()) / 3
    return float(times[np.flatnonzero(around & (mouth > third))[0]] - begin)


def false_openings() -> dict[str, float]:
    """How often something begins in five minutes of what is no voice, a minute."""
    from tests.inference.live.test_early_opening import beginnings as known
    from tests.inference.live.test_early_opening import clicks, room

    sounds = {f"room_at_minus_{-dbfs}_dbfs": room(300.0, dbfs) for dbfs in (-60, -50, -40)}
    sounds |= {"mouse_clicks": clicks(300.0, keys=False), "typing": clicks(300.0, keys=True)}
    return {name: round(len(known(sound)) / 5, 2) for name, sound in sounds.items()}
