"""Whether a microphone is set well."""

import math
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from studio.capture import input_tests
from studio.capture.input_tests import LevelStats
from studio.capture.recorder import Recorder
from studio.motion import Motion, Skeleton, rotation
from studio.motion.channels import BONES
from studio.sound.sound_file import Sound
from studio.vmc.encode import SendOptions, encode_frame
from studio.vmc.stream import Sender
from tests.patience import PATIENCE, nearest


@pytest.mark.parametrize(
    ("looks", "verdict"),
    [
        ([(-12.0, -60.0, False), (-9.0, -20.0, False)], "good"),
        ([(-1.0, -60.0, False)], "loud"),
        ([(-12.0, -60.0, True), (-12.0, -60.0, False)], "clipped"),
        ([(-25.0, -65.0, False)], "quiet"),
        ([(-58.0, -70.0, False)], "silent"),
        ([], "silent"),
        ([(-10.0, -25.0, False)], "noisy"),
    ],
)
def test_what_was_heard_has_a_verdict(looks: list[tuple[float, float, bool]], verdict: str) -> None:
    heard = LevelStats()
    for peak, rms, clipped in looks:
        heard = heard.with_look(peak, rms, clipped)
    assert heard.verdict == verdict


def test_how_far_to_turn_it() -> None:
    assert LevelStats(peak_dbfs=-25.0).change_db == 16.0
    assert LevelStats(peak_dbfs=-1.0).change_db == -8.0


RATE = 16_000
SAID = np.array([0.8, 1.9, 2.7, 4.1, 5.0, 5.9])
"""When the performer says "pa" or claps, seconds."""


def bursts(at: np.ndarray, seconds: float = 7.0, length: float = 0.12) -> Sound:
    rng = np.random.default_rng(1)
    n = np.arange(int(seconds * RATE)) / RATE
    loud = sum(np.clip(1 - (n - t) / length, 0, 1) * (n >= t) for t in at)
    return Sound((0.4 * loud * rng.normal(0, 0.5, len(n)))[:, None].astype(np.float32), RATE)


def opening(at: np.ndarray, seconds: float = 7.0, fps: float = 60.0) -> Motion:
    t = np.arange(int(seconds * fps)) / fps
    jaw = np.clip(sum(np.clip(1 - (t - m) / 0.12, 0, 1) * (t >= m) for m in at), 0, 1)
    return Motion.build(t, ("JawOpen", "EyeBlinkLeft"), np.stack([jaw, 0 * jaw], axis=1), (), None, None)


def clapping(at: np.ndarray, seconds: float = 7.0, fps: float = 60.0) -> Motion:
    """Both arms swing so that the hands are nearest at each moment."""
    t = np.arange(int(seconds * fps)) / fps
    near = np.clip(sum(np.exp(-(((t - m) / 0.07) ** 2)) for m in at), 0, 1)
    turns = np.tile(rotation.IDENTITY, (len(t), len(BONES), 1))
    for bone, sign in (("LeftUpperArm", 1.0), ("RightUpperArm", -1.0)):
        axis = np.array([[0.0, sign, 0.0]])
        turns[:, BONES.index(bone)] = rotation.from_axis_angle(axis, 1.2 * near)
    positions = np.tile(Skeleton.humanoid(BONES).rest_positions, (len(t), 1, 1))
    return Motion.build(t, (), None, BONES, positions, turns)


@pytest.mark.parametrize("late_ms", [-60, 0, 40, 130])
def test_a_mouth_that_is_late_is_measured(late_ms: int) -> None:
    found = input_tests.measure(bursts(SAID), opening(SAID + late_ms / 1000))
    assert found.by == "mouth"
    assert found.ms == pytest.approx(late_ms, abs=12)


@pytest.mark.parametrize("late_ms", [0, 90])
def test_hands_that_clap_are_measured(late_ms: int) -> None:
    found = input_tests.measure(bursts(SAID, length=0.04), clapping(SAID + late_ms / 1000))
    assert found.by == "hands"
    assert found.ms == pytest.approx(late_ms, abs=25)


def test_what_cannot_be_told_is_said() -> None:
    silence = Sound(np.zeros((7 * RATE, 1), np.float32), RATE)
    assert input_tests.measure(silence, opening(SAID)).why_not == "silent"
    assert input_tests.measure(bursts(SAID), opening(np.array([-5.0]))).why_not == "still"
    elsewhere = np.random.default_rng(5).uniform(0, 7, 40)
    assert input_tests.measure(bursts(SAID), opening(elsewhere)).ms is None


def test_limits_are_those_people_notice() -> None:
    assert [input_tests.grade(ms) for ms in (15, 16, 45, 46, -45, -46, -125, -126)] == [
        "good", "warn", "warn", "bad", "good", "warn", "warn", "bad",
    ]  # fmt: skip


def test_each_pair_keeps_its_own() -> None:
    kept = input_tests.with_pair((), "Mic", "VMC :39539", 80.0)
    kept = input_tests.with_pair(kept, "桜のマイク", "VMC :39539", -20.0)
    kept = input_tests.with_pair(kept, "Mic", "VMC :39539", 82.5)
    assert len(kept) == 2
    assert input_tests.remembered(kept, "Mic", "VMC :39539") == 82.5
    assert input_tests.remembered(kept, "桜のマイク", "VMC :39539") == -20.0
    assert input_tests.remembered((*kept, "rubbish", "[1]"), "Mic", "iFacialMocap :49983") is None


def test_the_sender_is_the_one_with_the_mouth() -> None:
    body = Sender("127.0.0.1:5", 39539, "VMC", ("Hips", "Head"), ())
    face = Sender("192.168.0.9:5", 49983, "iFacialMocap", ("Head",), ("JawOpen",))
    assert input_tests.sender_of([body, face]) == "iFacialMocap :49983 192.168.0.9"
    assert input_tests.sender_of([body]) == "VMC :39539"
    assert input_tests.sender_of([]) == ""


@pytest.fixture
def recorder(tmp_path: Path) -> Iterator[Recorder]:
    made = Recorder(tmp_path / "takes")
    yield made
    made.close()


@pytest.mark.slow
@pytest.mark.parametrize("late", [0.0, 0.12])
def test_over_real_sound_and_udp(recorder: Recorder, virtual_audio: str, late: float) -> None:
    """A voice is played, its mouth is sent so much later than the voice leaves the loudspeaker.

    To 20 ms, which a machine that stumbles spoils now and then.
    """
    recorder.open_audio(virtual_audio)
    recorder.open_motion(0)
    assert abs(nearest(lambda: measured(recorder, late) - late, 0.0, good=0.02, tries=4)) < 0.05


def measured(recorder: Recorder, late: float) -> float:
    """Seconds that the sync test says the mouth is later by; NaN where it could not tell."""
    import socket

    import sounddevice

    port = recorder.snapshot().port
    assert port is not None
    sound, motion = bursts(SAID), opening(SAID)
    samples = np.interp(
        np.arange(7 * 48_000) / 48_000, np.arange(len(sound.samples)) / RATE, sound.samples[:, 0]
    ).astype(np.float32)
    begun: list[float] = []
    leads, at = threading.Event(), [0]

    def fill(out: np.ndarray, count: int, moment: object, _status: object) -> None:
        # The first buffers of a stream run ahead of its clock, so the voice begins after them.
        out[:] = 0
        if at[0] >= 24_000:
            leaves = time.monotonic() - stream.time + moment.outputBufferDacTime  # type: ignore[attr-defined]
            begun.append(leaves - (at[0] - 24_000) / 48_000)
            leads.set()
            part = samples[at[0] - 24_000 :][:count]
            out[: len(part)] = part[:, None]
        at[0] += count

    stream = sounddevice.OutputStream(samplerate=48_000, channels=2, latency=0.2, callback=fill)
    with stream, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        assert leads.wait(PATIENCE)
        for k, t in enumerate(motion.times):
            time.sleep(max(0.0, begun[0] + t + late - time.monotonic()))
            options = SendOptions(names="as_is")
            for datagram in encode_frame(motion.pose(float(t)), motion.shape_names, (), k / 60, options):
                out.sendto(datagram, ("127.0.0.1", port))
        heard = recorder.recent(7.0)
    assert heard is not None
    found = input_tests.measure(*heard)
    # A busy machine may make the playing stumble, which moves all of the voice after it.
    stumbled = begun[0] - float(np.median(begun))
    return found.ms / 1e3 - stumbled if found.ms is not None and found.by == "mouth" else math.nan
