"""What capture promises: nothing lost, little CPU, sound and motion on one clock, a kill survived.

Environment: SAIA_BENCH_SECONDS shortens the recordings (60 where unset). Real parts: UDP on loopback, a
PulseAudio null sink through PortAudio, the sender in a process of its own. Simulated and named so: the
ten-minute take, whose device clock is off by 100 ppm, goes through the real journal and the real saving.
"""

from __future__ import annotations

import json
import os
import signal
import statistics
import subprocess
import sys
import tempfile
import textwrap
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from pythonosc.dispatcher import Dispatcher
from pythonosc.osc_packet import OscPacket

from studio import virtual_devices
from studio.capture.microphone import SoundBlock, input_devices
from studio.capture.recorder import Recorder
from studio.capture.recovery import complete, recover
from studio.capture.roll import Roll
from studio.motion import Pose, Skeleton
from studio.motion.channels import BONES, VRM0_SHAPES
from studio.sound.sound_file import read_sound
from studio.take.motion_file import read_motion
from studio.take.take import Take
from studio.vmc.assemble import FrameAssembler
from studio.vmc.encode import SendOptions, encode_frame
from studio.vmc.rows import ChannelLayout, RowBlock

ROOT = Path(__file__).resolve().parents[2]
SECONDS = float(os.environ.get("SAIA_BENCH_SECONDS", "60"))
FPS = 60

SENDER = textwrap.dedent("""
    # Sends frames and plays a click a second; tells when each frame was sent and when each click left.
    import json, socket, sys, time
    import numpy as np
    from studio.vmc.encode import SendOptions, encode_frame
    from studio.motion import Pose, Skeleton
    from studio.motion.channels import BONES, VRM0_SHAPES

    port, frames, bundle, sound = (int(word) for word in sys.argv[1:5])
    fps = 60
    rest = Skeleton.humanoid(BONES).rest_positions.astype("f")
    identity = np.array([0, 0, 0, 1], "f")
    sent, clicks, played, stream = [], [], [0], None
    if sound:
        import sounddevice

        def fill(out, count, moment, status):
            out[:] = 0
            at = -played[0] % 48000
            if at < count:
                out[at : at + 20] = 0.8
                clicks.append(time.monotonic() - stream.time + moment.outputBufferDacTime + at / 48000)
            played[0] += count

        stream = sounddevice.OutputStream(samplerate=48000, channels=2, latency=0.1, callback=fill)
        stream.start()
    begin = time.monotonic() + 0.2
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        for k in range(frames):
            turn = 0.3 * np.sin(k / 30)
            rotations = np.tile(np.array([0, 0, np.sin(turn), np.cos(turn)], "f"), (54, 1))
            pose = Pose(np.full(18, k % 100 / 100, "f"), rest, rotations, np.zeros(3, "f"), identity)
            datagrams = encode_frame(pose, VRM0_SHAPES, BONES, k / fps, SendOptions(bundle=bool(bundle)))
            time.sleep(max(0.0, begin + k / fps - time.monotonic()))
            sent.append(time.monotonic())
            for datagram in datagrams:
                out.sendto(datagram, ("127.0.0.1", port))
    if stream is not None:
        stream.close()
    print(json.dumps({"sent": sent, "clicks": clicks}))
""")

VICTIM = textwrap.dedent("""
    import sys, time
    from pathlib import Path
    from studio.capture.recorder import Recorder

    recorder = Recorder(Path(sys.argv[1]))
    recorder.open_motion(0)
    recorder.open_audio()
    while recorder.snapshot().audio_seconds < 0.5:
        time.sleep(0.01)
    recorder.start("Killed")
    print(recorder.snapshot().port, flush=True)
    while True:
        time.sleep(0.01)
        print(recorder.snapshot().elapsed, recorder.snapshot().frames, flush=True)
""")


def run() -> dict[str, Any]:
    """All figures of capture; the recording ones on a sound device of their own."""
    figures: dict[str, Any] = {"recording_seconds": SECONDS}
    with tempfile.TemporaryDirectory() as name, virtual_devices.virtual_sound() as environment:
        os.environ.update(environment)
        input_devices(refresh=True)
        folder = Path(name)
        figures |= recording(folder / "bundled", bundle=True)
        figures |= recording(folder / "unbundled", bundle=False)
        figures |= killed(folder / "killed")
        figures |= simulated_ten_minutes(folder / "long")
        input_devices(refresh=True)
    return figures | decoding(bundle=True) | decoding(bundle=False)


def recording(takes: Path, bundle: bool) -> dict[str, Any]:
    """One take of voice and motion: losses, CPU of this process, and clicks against frames."""
    recorder = Recorder(takes)
    recorder.open_audio()
    recorder.open_motion(0)
    wait_for(lambda: recorder.snapshot().audio_seconds > 1)
    recorder.start("Bench")
    frames = int(SECONDS * FPS)
    child = sender(recorder.snapshot().port or 0, frames, bundle, sound=True)
    cpu, wall = time.process_time(), time.monotonic()
    told = json.loads(child.communicate()[0])
    cpu, wall = time.process_time() - cpu, time.monotonic() - wall
    time.sleep(0.3)
    begin = time.monotonic()
    take = recorder.stop()
    stopped = time.monotonic() - begin
    recorder.close()
    key = "bundled" if bundle else "unbundled"
    return {
        f"{key}_frames_sent": frames,
        f"{key}_frames_lost": frames - take.info.frames,
        f"{key}_cpu_of_a_core": cpu / wall,
        f"{key}_stop_s": stopped,
        **{f"{key}_{name}": value for name, value in alignment(take, told).items()},
    }


def alignment(take: Take, told: dict[str, list[float]]) -> dict[str, Any]:
    """How far each click lies from where the frames sent around it say it should be, on the take's clock."""
    times = read_motion(take.folder / "motion.arrow").times
    if len(times) != len(told["sent"]):
        return {"click_error_max_ms": None}
    sent, clicks = np.array(told["sent"]), np.array(told["clicks"])
    shift = float(np.median(times - sent))
    late = np.abs(times - sent - shift) * 1e3
    clicks = clicks[(clicks > sent[0]) & (clicks < sent[-1])]
    expected = np.interp(clicks, sent, times)
    assert take.audio_path is not None
    sound = read_sound(take.audio_path)
    loud = np.flatnonzero(sound.mono() > 0.4)
    heard = loud[np.concatenate([[True], np.diff(loud) > 4800])] / sound.sample_rate
    errors = np.array([heard[np.argmin(np.abs(heard - e))] - e for e in expected]) * 1e3
    return {
        "stamp_error_p99_ms": float(np.percentile(late, 99)),
        "click_error_first_ms": float(errors[0]),
        "click_error_last_ms": float(errors[-1]),
        "click_error_max_ms": float(np.abs(errors).max()),
        "drift_ppm": take.info.drift_ppm,
    }


def killed(takes: Path) -> dict[str, Any]:
    """A recording killed with no warning, three times: what the recovered take lacks of what was recorded."""
    lost_sound, lost_motion, seconds = [], [], []
    for turn in range(3):
        words = [sys.executable, "-c", VICTIM, str(takes / str(turn))]
        with subprocess.Popen(words, stdout=subprocess.PIPE, text=True, cwd=ROOT) as child:
            assert child.stdout is not None
            other = sender(int(child.stdout.readline()), 100_000, True, sound=False)
            elapsed, frames = 0.0, 0
            for line in child.stdout:
                elapsed, frames = float(line.split()[0]), int(line.split()[1])
                if elapsed > 3.0 + 0.07 * turn:
                    break
            os.kill(child.pid, signal.SIGKILL)
            other.kill()
            other.communicate()
        begin = time.monotonic()
        (take,) = recover(takes / str(turn))
        seconds.append(time.monotonic() - begin)
        lost_sound.append(elapsed - take.info.audio_seconds)
        lost_motion.append((frames - take.info.frames) / FPS)
    return {
        "kill_lost_sound_max_s": max(lost_sound),
        "kill_lost_motion_max_s": max(lost_motion),
        "recover_s": statistics.median(seconds),
    }


def simulated_ten_minutes(takes: Path) -> dict[str, Any]:
    """Ten minutes at once: a sound device 100 ppm slow whose stamps waver by 3 ms, a clap at both ends."""
    rng, rate, block, minutes = np.random.default_rng(3), 48_000, 480, 10
    names = ChannelLayout(VRM0_SHAPES, BONES)
    total = minutes * 60 * rate
    claps = (int(1.0 * rate), total - rate)
    rolled = Roll(takes / "Long_001", "Long", 1, 1000.0, (rate, 1))
    values = rng.normal(0, 0.1, (600, names.width)).astype(np.float32)
    values[:, -1] = 1.0
    true_time: Callable[[int], float] = lambda sample: 1000.0 + sample / rate * (1 + 100e-6)  # noqa: E731
    k = 0
    for at in range(0, total, block):
        samples = np.zeros((block, 1), dtype=np.float32)
        for clap in claps:
            if at <= clap < at + block:
                samples[clap - at] = 0.9
        rolled.add_block(SoundBlock(true_time(at) + rng.normal(0, 0.003), samples, False, 0.0))
        while 1000.0 + k / FPS < true_time(at):
            arrival = 1000.0 + k / FPS
            stamps = np.array([(arrival, k / FPS)])
            rolled.add_rows(RowBlock(names, stamps, values[k % 600][None]))
            k += 1
        if at % (block * 20) == 0:
            rolled.flush({})
    rolled.flush({})
    rolled.close()
    begin = time.monotonic()
    take = complete(rolled.folder)
    saved = time.monotonic() - begin
    motion = read_motion(take.folder / "motion.arrow")
    arrivals = 1000.0 + np.arange(k) / FPS
    arrivals = arrivals[len(arrivals) - len(motion) :]
    errors = [float(np.interp(true_time(c), arrivals, motion.times) - c / rate) * 1e3 for c in claps]
    return {
        "simulated_10_min_clap_error_first_ms": errors[0],
        "simulated_10_min_clap_error_last_ms": errors[1],
        "simulated_10_min_drift_found_ppm": take.info.drift_ppm,
        "simulated_10_min_save_s": saved,
    }


def decoding(bundle: bool) -> dict[str, Any]:
    """Packets to frames here, and packets to handlers in python-osc's dispatcher, which builds no frames."""
    rest = Skeleton.humanoid(BONES).rest_positions.astype(np.float32)
    turned = np.tile(np.array([0, 0, 0.6, 0.8], dtype=np.float32), (len(BONES), 1))
    identity = np.array([0, 0, 0, 1], dtype=np.float32)
    packets = []
    for k in range(120):
        pose = Pose(np.full(18, k / 120, np.float32), rest, turned, np.zeros(3, np.float32), identity)
        packets += [
            (k / FPS, d) for d in encode_frame(pose, VRM0_SHAPES, BONES, k / FPS, SendOptions(bundle=bundle))
        ]
    count = 120 * (54 + 18 + 4)
    ours = statistics.median(seconds_of(lambda: by_us(packets)) for _ in range(5)) / count
    theirs = statistics.median(seconds_of(lambda: by_python_osc(packets)) for _ in range(5)) / count
    key = "bundled" if bundle else "unbundled"
    return {
        f"{key}_decode_us_a_message": ours * 1e6,
        f"{key}_python_osc_us_a_message": theirs * 1e6,
        f"{key}_decode_times_faster": theirs / ours,
    }


def by_us(packets: list[tuple[float, bytes]]) -> None:
    """Whole frames out."""
    assembler = FrameAssembler()
    frames = [frame for arrival, packet in packets for frame in assembler.feed(arrival, packet)]
    assert len(frames) + len(assembler.flush(1e6)) == 120


def by_python_osc(packets: list[tuple[float, bytes]]) -> None:
    """What its servers do with a packet: parse, look the handlers up, call them."""
    heard: list[tuple[Any, ...]] = []
    dispatcher = Dispatcher(strict_timing=False)
    for address in ("Bone/Pos", "Blend/Val", "Blend/Apply", "OK", "T", "Root/Pos"):
        dispatcher.map(f"/VMC/Ext/{address}", lambda _address, *values: heard.append(values))
    for _, packet in packets:
        for timed in OscPacket(packet).messages:
            for handler in dispatcher.handlers_for_address(timed.message.address):
                handler.invoke(("127.0.0.1", 0), timed.message)
    assert len(heard) == 120 * (54 + 18 + 4)


def seconds_of(work: Callable[[], None]) -> float:
    """Wall time of one call."""
    begin = time.perf_counter()
    work()
    return time.perf_counter() - begin


def sender(port: int, frames: int, bundle: bool, sound: bool) -> subprocess.Popen[str]:
    """A sender in a process of its own."""
    words = [sys.executable, "-c", SENDER, str(port), str(frames), str(int(bundle)), str(int(sound))]
    return subprocess.Popen(words, stdout=subprocess.PIPE, text=True, cwd=ROOT)


def wait_for(condition: Callable[[], bool]) -> None:
    """Until it holds, 20 s at most."""
    until = time.monotonic() + 20
    while not condition():
        if time.monotonic() > until:
            raise TimeoutError("waited in vain")
        time.sleep(0.01)
