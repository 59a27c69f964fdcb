"""Whole recordings: real UDP on loopback, and a real sound device where one is named."""

import json
import math
import os
import signal
import socket
import subprocess
import sys
import textwrap
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from studio import virtual_devices
from studio.capture.recorder import Recorder
from studio.capture.recovery import recover
from studio.capture.snapshot import RecorderState
from studio.errors import StudioError
from studio.motion import Pose, Skeleton
from studio.motion.channels import BONES, VRM0_SHAPES
from studio.sound.sound_file import read_sound
from studio.take.folder import load_take, next_number
from studio.take.motion_file import read_motion
from studio.vmc.encode import SendOptions, encode_frame
from tests.patience import PATIENCE, nearest

ROOT = Path(__file__).resolve().parents[2]
REST = Skeleton.humanoid(BONES).rest_positions.astype(np.float32)
FPS = 60


def pose_at(k: int) -> Pose:
    """A pose whose numbers tell which frame it is: shape A counts through 0..1."""
    half = 0.3 * np.sin(k / 30)
    rotations = np.tile(np.array([0, 0, np.sin(half), np.cos(half)], dtype=np.float32), (len(BONES), 1))
    shapes = np.full(len(VRM0_SHAPES), (k % 100) / 100, dtype=np.float32)
    return Pose(shapes, REST, rotations, np.zeros(3, np.float32), np.array([0, 0, 0, 1], np.float32))


class Sender:
    """Sends frames to a port at a steady rate from a thread of its own."""

    def __init__(self, port: int, options: SendOptions) -> None:
        self.sent = 0
        self._to = ("127.0.0.1", port)
        self._options = options
        self._stop = threading.Event()
        self.left: list[float] = []
        """When each frame had left, seconds of the monotonic clock."""
        self._thread = threading.Thread(target=self._send, daemon=True)
        self._thread.start()

    def _send(self) -> None:
        begin = time.monotonic()
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
            while not self._stop.wait(max(0.0, begin + self.sent / FPS - time.monotonic())):
                datagrams = encode_frame(
                    pose_at(self.sent), VRM0_SHAPES, BONES, self.sent / FPS, self._options
                )
                for datagram in datagrams:
                    out.sendto(datagram, self._to)
                self.left.append(time.monotonic())
                self.sent += 1

    def stop(self) -> None:
        self._stop.set()
        self._thread.join()


def wait_for(condition: Callable[[], bool], seconds: float = PATIENCE) -> None:
    until = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < until, "waited in vain"
        time.sleep(0.005)


@pytest.fixture
def recorder(tmp_path: Path) -> Iterator[Recorder]:
    made = Recorder(tmp_path / "takes")
    yield made
    made.close()


@pytest.fixture
def send() -> Iterator[Callable[..., Sender]]:
    started: list[Sender] = []

    def start(port: int | None, options: SendOptions = SendOptions()) -> Sender:  # noqa: B008
        assert port is not None
        started.append(Sender(port, options))
        return started[-1]

    yield start
    for sender in started:
        sender.stop()


def test_states_follow_what_is_open(recorder: Recorder, send: Callable[..., Sender]) -> None:
    assert recorder.snapshot().state is RecorderState.IDLE
    recorder.open_motion(0)
    assert recorder.snapshot().state is RecorderState.ARMED
    send(recorder.snapshot().port)
    wait_for(lambda: recorder.snapshot().motion_alive)
    recorder.start("Hello")
    assert recorder.snapshot().state is RecorderState.ROLLING
    wait_for(lambda: recorder.snapshot().frames > 5)
    recorder.stop()
    assert recorder.snapshot().state is RecorderState.ARMED
    recorder.close_motion()
    assert recorder.snapshot().state is RecorderState.IDLE


@pytest.mark.parametrize("bundle", [True, False])
def test_every_frame_sent_is_in_the_take(
    recorder: Recorder, send: Callable[..., Sender], bundle: bool
) -> None:
    recorder.open_motion(0)
    recorder.start("Hello")
    sender = send(recorder.snapshot().port, SendOptions(bundle=bundle))
    wait_for(lambda: sender.sent >= 60)
    sender.stop()
    wait_for(lambda: recorder.snapshot().frames >= sender.sent)
    take = recorder.stop()
    assert take.id == "Hello_001"
    assert (take.info.frames, take.info.packets_bad) == (sender.sent, 0)
    assert take.info.audio_file is None
    assert take.info.notes == ("There is no sound in this take.",)
    motion = read_motion(take.folder / "motion.arrow")
    assert motion.shapes[:, 0] == pytest.approx([(k % 100) / 100 for k in range(sender.sent)], abs=1e-6)
    assert set(motion.bone_names) == set(BONES)
    assert np.diff(motion.times).min() > 0
    assert motion.times[0] > 0
    assert sorted(p.name for p in take.folder.iterdir()) == ["motion.arrow", "take.json"]


def test_a_snapshot_shows_what_comes_in(recorder: Recorder, send: Callable[..., Sender]) -> None:
    recorder.open_motion(0)
    send(recorder.snapshot().port)
    wait_for(lambda: recorder.snapshot().frames > 90)
    wait_for(lambda: recorder.snapshot().motion_alive)
    now = recorder.snapshot()
    wait_for(lambda: recorder.snapshot().frames_per_s > 0 and recorder.snapshot().packets_per_s > 0)
    assert set(now.shapes) == set(VRM0_SHAPES)
    assert now.pose is not None
    assert now.pose.rotations.shape == (54, 4)
    assert [sender.rpartition(":")[0] for sender in now.senders] == ["127.0.0.1"]
    assert now.disk_free_bytes > 0


def test_pre_roll_keeps_what_was_seen_before(recorder: Recorder, send: Callable[..., Sender]) -> None:
    recorder.open_motion(0)
    sender = send(recorder.snapshot().port)
    wait_for(lambda: recorder.snapshot().frames > 90)
    now = time.monotonic()
    recorder.start("Early", pre_roll=10.0)
    take = recorder.stop()
    assert take.info.extra["pre_roll"] == "10.0"
    motion = read_motion(take.folder / "motion.arrow")
    seen = sum(now - 9.0 < t for t in sender.left[:90])
    assert sum(motion.times < 10.0) >= seen


def test_numbers_count_up_and_names_are_made_safe(recorder: Recorder, send: Callable[..., Sender]) -> None:
    recorder.open_motion(0)
    send(recorder.snapshot().port)
    ids = []
    for number in (None, None, 7, None):
        wait_for(lambda: recorder.snapshot().motion_alive)
        recorder.start("a/b 桜", number)
        wait_for(lambda: recorder.snapshot().frames > 3)
        ids.append(recorder.stop().id)
    assert ids == ["a_b 桜_001", "a_b 桜_002", "a_b 桜_007", "a_b 桜_008"]
    assert load_take(recorder.takes_folder / ids[0]).info.slate == "a/b 桜"
    with pytest.raises(StudioError) as caught:
        recorder.start("a/b 桜", 7)
    assert str(caught.value) == "There is a take a_b 桜_007 already. Choose another slate or number."
    assert recorder.snapshot().state is RecorderState.ARMED
    assert next_number(recorder.takes_folder, "other") == 1


def test_discard_leaves_nothing(recorder: Recorder, send: Callable[..., Sender]) -> None:
    recorder.open_motion(0)
    send(recorder.snapshot().port)
    recorder.start("Hello")
    wait_for(lambda: recorder.snapshot().frames > 3)
    recorder.discard()
    assert list(recorder.takes_folder.iterdir()) == []
    assert recorder.snapshot().state is RecorderState.ARMED


@pytest.mark.skipif(os.name != "posix", reason="Windows lets nobody move files that are open")
def test_discard_removes_nothing_but_what_was_recorded(
    recorder: Recorder, send: Callable[..., Sender], tmp_path: Path
) -> None:
    """Whoever moves a take's files out of its folder in mid-take may move them among files of their own."""
    recorder.open_motion(0)
    send(recorder.snapshot().port)
    recorder.start("Hello")
    wait_for(lambda: recorder.snapshot().frames > 3)
    desktop = tmp_path / "Desktop"
    desktop.mkdir()
    (desktop / "thesis.txt").write_text("ten years")
    (recorder.takes_folder / "Hello_001" / "journal.bin").rename(desktop / "journal.bin")
    recorder.discard()
    assert [path.name for path in desktop.iterdir()] == ["thesis.txt"]


def test_what_makes_no_sense_is_a_sentence(recorder: Recorder) -> None:
    with pytest.raises(StudioError) as caught:
        recorder.start("Hello")
    assert caught.value.what == "Nothing to record: there is no motion and no microphone."
    with pytest.raises(StudioError) as caught:
        recorder.stop()
    assert caught.value.what == "No take is being recorded."
    recorder.open_motion(0)
    recorder.start("Hello")
    with pytest.raises(StudioError) as caught:
        recorder.start("Hello")
    assert (
        str(caught.value) == "Another take cannot begin while a take is being recorded. Stop the take first."
    )
    with pytest.raises(StudioError) as caught:
        recorder.stop()
    assert str(caught.value) == (
        "Nothing came in while Hello_001 was recorded. Check the microphone and the sender."
    )
    assert not (recorder.takes_folder / "Hello_001").exists()


def test_a_folder_that_cannot_be_made_is_a_sentence(tmp_path: Path) -> None:
    (tmp_path / "takes").write_text("a file where the folder should be")
    recorder = Recorder(tmp_path / "takes")
    recorder.open_motion(0)
    with pytest.raises(StudioError, match=r"Hello_001 could not be written"):
        recorder.start("Hello")
    assert recorder.snapshot().state is RecorderState.ARMED
    recorder.close()


def test_a_taken_port_leaves_the_recorder_usable(recorder: Recorder) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        with pytest.raises(StudioError, match="is used by another program"):
            recorder.open_motion(other.getsockname()[1])
    recorder.open_motion(0)
    assert recorder.snapshot().state is RecorderState.ARMED


def test_hostile_packets_do_not_end_a_take(recorder: Recorder, send: Callable[..., Sender]) -> None:
    recorder.open_motion(0)
    port = recorder.snapshot().port
    sender = send(port)
    recorder.start("Hello")
    rng = np.random.default_rng(0)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        for _ in range(500):
            out.sendto(rng.bytes(int(rng.integers(0, 300))), ("127.0.0.1", port))
            out.sendto(b"#bundle\x00" + rng.bytes(40), ("127.0.0.1", port))
    wait_for(lambda: recorder.snapshot().packets_bad >= 1000 and recorder.snapshot().frames > 20)
    sender.stop()
    take = recorder.stop()
    assert take.info.packets_bad == 1000
    assert take.info.frames > 20


def test_a_full_disk_ends_the_take_and_keeps_it(tmp_path: Path, send: Callable[..., Sender]) -> None:
    """A reserve that no disk has stands for a disk with nothing left."""
    recorder = Recorder(tmp_path / "takes", reserve_bytes=2**62)
    recorder.open_motion(0)
    send(recorder.snapshot().port)
    wait_for(lambda: recorder.snapshot().frames > 30)
    recorder.start("Hello", pre_roll=10.0)
    wait_for(lambda: any("The disk is full." in what for what, _ in recorder.snapshot().problems))
    ended = recorder.snapshot()
    assert ended.problems[0][1] == "What came until then is being saved."
    assert ended.state == RecorderState.SAVING  # nobody may take it for a recording that goes on
    wait_for(lambda: recorder.snapshot() is not ended)
    assert recorder.snapshot().elapsed == ended.elapsed
    take = recorder.stop()
    assert take.info.frames > 0
    assert any(note.startswith("The disk is full. Recording ended at") for note in take.info.notes)
    recorder.close()


@pytest.mark.skipif(sys.platform == "win32", reason="file size limits are POSIX")
def test_a_write_that_fails_in_mid_take_keeps_what_is_there(
    recorder: Recorder, send: Callable[..., Sender]
) -> None:
    import resource

    recorder.open_motion(0)
    send(recorder.snapshot().port)
    recorder.start("Hello")
    journal = recorder.takes_folder / "Hello_001" / "journal.bin"
    a_row = 4 * (len(VRM0_SHAPES) + 7 * len(BONES))
    wait_for(lambda: recorder.snapshot().frames > 60 and journal.stat().st_size > 40 * a_row)
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    try:
        resource.setrlimit(resource.RLIMIT_FSIZE, (journal.stat().st_size, before[1]))
        wait_for(lambda: any("could not be written on" in what for what, _ in recorder.snapshot().problems))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, handler)
    take = recorder.stop()
    assert take.info.frames >= 30


def test_start_and_stop_from_many_threads_make_whole_takes(
    recorder: Recorder, send: Callable[..., Sender]
) -> None:
    recorder.open_motion(0)
    send(recorder.snapshot().port)
    wait_for(lambda: recorder.snapshot().motion_alive)
    taken, refused = [], []

    def toggle() -> None:
        for _ in range(3):
            try:
                recorder.start("Race", pre_roll=10.0)  # long enough for some motion in each
                taken.append(recorder.stop().id)
            except StudioError as error:
                refused.append(error.what)

    threads = [threading.Thread(target=toggle) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert taken
    assert len(taken) == len(set(taken))
    assert set(refused) <= {
        "Another take cannot begin while a take is being recorded.", "No take is being recorded."
    }  # fmt: skip
    assert recorder.snapshot().state is RecorderState.ARMED
    assert recover(recorder.takes_folder) == ()


def test_closing_while_rolling_saves_the_take(tmp_path: Path, send: Callable[..., Sender]) -> None:
    recorder = Recorder(tmp_path / "takes")
    recorder.open_motion(0)
    send(recorder.snapshot().port)
    recorder.start("Hello")
    wait_for(lambda: recorder.snapshot().frames > 10)
    recorder.close()
    assert load_take(tmp_path / "takes" / "Hello_001").info.frames > 5


def test_a_recorder_that_was_closed_opens_nothing_any_more(tmp_path: Path) -> None:
    """Inputs are opened on other threads, which may come to it when the project has been left."""
    recorder = Recorder(tmp_path / "takes")
    recorder.close()
    recorder.open_motion(0)
    recorder.open_audio()
    assert recorder.snapshot().state is RecorderState.IDLE
    assert recorder.snapshot().ports == ()


RECORDING = textwrap.dedent("""
    import sys, time
    from pathlib import Path
    from studio.capture.recorder import Recorder
    recorder = Recorder(Path(sys.argv[1]))
    recorder.open_motion(0)
    if sys.argv[2] == "sound":
        recorder.open_audio()
    recorder.start("Killed")
    print(recorder.snapshot().port, flush=True)
    while True:
        now = recorder.snapshot()
        print(time.monotonic(), now.frames, now.audio_seconds, flush=True)
        time.sleep(0.02)
""")


Told = tuple[float, int, float]
"""When, how many frames and how many seconds of sound."""


def kill_in_mid_take(takes: Path, sound: bool, frames: int) -> tuple[list[Told], Sender]:
    """Record in another process and kill it with no warning; gives what it told until then."""
    words = [sys.executable, "-c", RECORDING, str(takes), "sound" if sound else "none"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True, cwd=ROOT) as child:
        assert child.stdout is not None
        sender = Sender(int(child.stdout.readline()), SendOptions())
        told: list[Told] = []
        for line in child.stdout:
            when, had, heard = line.split()
            told.append((float(when), int(had), float(heard)))
            safe = safe_by_then(told)
            if safe[1] >= frames // 2 and (not sound or safe[2] > 0.2):
                break
        os.kill(child.pid, signal.SIGKILL)
        sender.stop()
    return told, sender


def safe_by_then(told: list[Told]) -> Told:
    """What it had a second of its own time before the kill: moments it was held up itself do not count."""
    own = 0.0
    for (before, *_), (after, *_), found in zip(told[-2::-1], told[:0:-1], told[-2::-1], strict=True):
        own += min(after - before, 0.05)
        if own >= 1.0:
            return found
    return told[0]


@pytest.mark.slow
def test_a_kill_in_mid_take_loses_less_than_a_second(tmp_path: Path) -> None:
    told, _ = kill_in_mid_take(tmp_path / "takes", sound=False, frames=120)
    assert not (tmp_path / "takes" / "Killed_001" / "take.json").exists()
    (take,) = recover(tmp_path / "takes")
    assert take.id == "Killed_001"
    assert take.info.frames >= safe_by_then(told)[1]
    assert take.info.notes[-1] == "The studio closed while recording; this take was recovered."
    assert load_take(take.folder) == take
    assert recover(tmp_path / "takes") == ()


@pytest.mark.slow
def test_a_killed_take_keeps_its_sound_and_clock(tmp_path: Path, virtual_audio: str) -> None:
    told, sender = kill_in_mid_take(tmp_path / "takes", sound=True, frames=90)
    (take,) = recover(tmp_path / "takes")
    _, had, heard = safe_by_then(told)
    assert take.info.audio_seconds >= heard
    assert take.info.frames >= had
    assert take.audio_path is not None
    assert read_sound(take.audio_path).duration == pytest.approx(take.info.audio_seconds)
    motion = read_motion(take.folder / "motion.arrow")
    # The first frame left this long after the first sample was captured, as sender and child tell it.
    first = round(float(motion.shapes[0, 0]) * 100)
    sound_began = min(when - seconds for when, _, seconds in told if seconds)
    assert motion.times[0] == pytest.approx(sender.left[first] - sound_began, abs=0.5)


def test_recovery_lets_be_what_is_still_rolling_and_sweeps_up_nothing(
    recorder: Recorder, send: Callable[..., Sender]
) -> None:
    recorder.open_motion(0)
    recorder.start("Rolling")
    empty = recorder.takes_folder / "Empty_001"
    empty.mkdir()
    (empty / "journal.bin").write_bytes(b"SAIAJRN1")
    os.utime(empty / "journal.bin", (1e9, 1e9))  # a young one may be about to begin
    foreign = recorder.takes_folder / "mine"
    foreign.mkdir()
    assert recover(recorder.takes_folder) == ()
    assert not empty.exists()
    assert foreign.exists()
    send(recorder.snapshot().port)
    wait_for(lambda: recorder.snapshot().frames > 3)
    assert recorder.stop().id == "Rolling_001"
    assert recover(recorder.takes_folder / "missing") == ()


def clap(at: float, rate: int) -> float:
    """Play silence with one clap in it; gives when the clap left, seconds of the monotonic clock."""
    import sounddevice

    left, played, position = [0.0], [0], int(at * rate)

    def fill(out: np.ndarray, frames: int, moment: object, _status: object) -> None:
        out[:] = 0
        here = position - played[0]
        if 0 <= here < frames:
            out[here : here + 20] = 0.8
            # Asked for now and not at the start, since a stream's first buffers are filled ahead of time.
            dac = moment.outputBufferDacTime  # type: ignore[attr-defined]
            left[0] = time.monotonic() - stream.time + dac + here / rate
        played[0] += frames

    stream = sounddevice.OutputStream(samplerate=rate, channels=2, latency=0.1, callback=fill)
    with stream:
        wait_for(lambda: played[0] > position + rate // 2)
    return left[0]


@pytest.mark.slow
def test_sound_and_motion_share_one_clock(recorder: Recorder, virtual_audio: str) -> None:
    """A clap is heard by the microphone and a packet is sent at the moment it leaves the speaker.

    To 10 ms, which a machine that stumbles spoils now and then; how true it is, the benchmark measures.
    """
    recorder.open_audio(virtual_audio)
    recorder.open_motion(0)
    wait_for(lambda: recorder.snapshot().audio_seconds > 0.5)
    assert abs(nearest(lambda: clapped(recorder), 0.0, good=0.01)) < 0.05


def clapped(recorder: Recorder) -> float:
    """How much later the packet is in a take than it should be beside the clap, seconds."""
    port = recorder.snapshot().port
    recorder.start("Clap")
    leaves = clap(1.0, recorder.snapshot().sample_rate)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        mark = time.monotonic()
        for datagram in encode_frame(pose_at(1), VRM0_SHAPES, BONES, 0.0):
            out.sendto(datagram, ("127.0.0.1", port))
    wait_for(lambda: recorder.snapshot().frames >= 1)
    take = recorder.stop()
    assert take.audio_path is not None
    sound = read_sound(take.audio_path)
    loud = np.flatnonzero(sound.mono() > 0.4)
    if not len(loud):
        return math.nan
    motion = read_motion(take.folder / "motion.arrow")
    # The packet left (mark - leaves) seconds after the clap; on the take's clock it must have come so too.
    return float(motion.times[0] - loud[0] / sound.sample_rate - (mark - leaves))


@pytest.mark.slow
def test_sound_alone_is_a_take(recorder: Recorder, virtual_audio: str) -> None:
    recorder.open_audio(virtual_audio)
    wait_for(lambda: recorder.snapshot().audio_seconds > 1.2)
    recorder.start("Voice", pre_roll=1.0)
    wait_for(lambda: recorder.snapshot().audio_seconds > 1.5)
    take = recorder.stop()
    assert take.info.motion_file is None
    assert take.info.notes == ("There is no motion in this take.",)
    assert take.info.audio_seconds >= 1.5
    assert take.info.device == virtual_audio


@pytest.mark.slow
@pytest.mark.parametrize(
    ("rate", "channels"), [(8_000, 1), (11_025, 2), (44_100, 2), (96_000, 1), (192_000, 2), (48_000, 4)]
)
def test_any_rate_and_channel_count_is_recorded_as_it_comes(
    recorder: Recorder, virtual_audio: str, rate: int, channels: int
) -> None:
    recorder.open_audio(virtual_audio, sample_rate=rate, channels=channels)
    wait_for(lambda: recorder.snapshot().audio_seconds > 0.1)
    recorder.start("Rate")
    wait_for(lambda: recorder.snapshot().audio_seconds > 0.3)
    take = recorder.stop()
    assert (take.info.sample_rate, take.info.audio_channels) == (rate, channels)
    assert take.audio_path is not None
    sound = read_sound(take.audio_path)
    assert (sound.sample_rate, sound.samples.shape[1]) == (rate, channels)
    assert len(sound.samples) / rate == pytest.approx(take.info.audio_seconds, abs=1e-3)


@pytest.mark.slow
def test_an_unknown_microphone_is_a_sentence(recorder: Recorder, virtual_audio: str) -> None:
    with pytest.raises(StudioError) as caught:
        recorder.open_audio("Blue Parrot")
    assert caught.value.what == "There is no sound input called Blue Parrot."
    assert caught.value.remedy.startswith("Choose one of: default")


UNPLUG = textwrap.dedent("""
    import json, os, signal, sys, time
    from pathlib import Path
    from studio import virtual_devices
    from studio.capture.recorder import Recorder

    def until(condition, seconds=60):
        end = time.monotonic() + seconds
        while not condition():
            assert time.monotonic() < end, recorder.snapshot()
            time.sleep(0.01)

    servers = []
    def started(folder):
        servers.append(virtual_devices.start_pulseaudio(folder))
        return servers[0]

    with virtual_devices.virtual_sound(started) as environment:
        os.environ.update(environment)
        recorder = Recorder(Path(sys.argv[1]))
        recorder.open_motion(0)
        recorder.open_audio()
        until(lambda: recorder.snapshot().audio_seconds > 0.3)
        recorder.start("Unplugged")
        print(recorder.snapshot().port, flush=True)
        until(lambda: recorder.snapshot().audio_seconds > 1.0 and recorder.snapshot().frames > 30)
        os.kill(servers[0].pid, getattr(signal, sys.argv[2]))
        until(lambda: not recorder.snapshot().audio_alive)
        frames = recorder.snapshot().frames
        until(lambda: recorder.snapshot().frames > frames + 90)
        until(lambda: any(what.startswith(sys.argv[3]) for what, _ in recorder.snapshot().problems))
        problems = recorder.snapshot().problems
        if sys.argv[2] == "SIGSTOP":
            os.kill(servers[0].pid, signal.SIGCONT)
        take = recorder.stop()
        cut = recorder.cut_off
        print(json.dumps({"frames": take.info.frames, "sound": take.info.audio_seconds,
                          "cut": cut and cut.reason,
                          "notes": take.info.notes, "problems": problems}), flush=True)
        recorder.close()
""")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("how", "says"), [("SIGKILL", "default is gone."), ("SIGSTOP", "No sound has come from default for")]
)
def test_a_microphone_that_vanishes_leaves_the_rest(tmp_path: Path, how: str, says: str) -> None:
    """The sound server is killed, or frozen without a word; both in a process of their own."""
    if not virtual_devices.sound_available():
        pytest.skip("pulseaudio is not installed")
    words = [sys.executable, "-c", UNPLUG, str(tmp_path / "takes"), how, says]
    with subprocess.Popen(
        words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=ROOT
    ) as child:
        assert child.stdout is not None
        sender = Sender(int(child.stdout.readline()), SendOptions())
        out, errors = child.communicate(timeout=240)
        sender.stop()
    assert child.returncode == 0, errors[-2000:]
    told = json.loads(out.splitlines()[-1])
    assert told["sound"] >= 0.9
    if how == "SIGKILL":  # one that is frozen may be back by the time the take ends
        assert told["cut"] == "sound_lost"
    assert told["frames"] > 120
    assert any("default stopped giving sound at" in note for note in told["notes"])
    assert any(what.startswith(says) for what, _ in told["problems"])
