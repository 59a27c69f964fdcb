"""`saia record` as a person and a program call it."""

import argparse
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from studio import cli
from studio.capture.recorder import Recorder
from studio.capture.snapshot import RecorderState
from studio.cli import record
from studio.cli._output import Output
from studio.motion import Pose, Skeleton
from studio.motion.channels import BONES, VRM0_SHAPES
from studio.project import Project
from studio.sound.sound_file import read_sound
from studio.take.folder import load_take
from studio.vmc.encode import encode_frame
from tests.capture import floods
from tests.patience import in_one, until
from tests.ports import free_port
from tests.small_disk import small_disk

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def sending() -> Iterator[int]:
    """A port to which a whole body is sent all the time; gives its number."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asking:
        asking.bind(("127.0.0.1", 0))
        port: int = asking.getsockname()[1]
    rest = Skeleton.humanoid(BONES).rest_positions.astype(np.float32)
    identity = np.array([0, 0, 0, 1], dtype=np.float32)
    end = threading.Event()

    def send() -> None:
        k = 0
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
            while not end.wait(1 / 60):
                weights = np.full(18, k % 50 / 50, dtype=np.float32)
                pose = Pose(weights, rest, np.tile(identity, (54, 1)), np.zeros(3, np.float32), identity)
                # At once: a frame that a pause tore in two would count as a lost one.
                with suppress(ConnectionError):  # nobody listens yet
                    out.sendto(in_one(encode_frame(pose, VRM0_SHAPES, BONES, k / 60)), ("127.0.0.1", port))
                k += 1

    thread = threading.Thread(target=send, daemon=True)
    thread.start()
    yield port
    end.set()
    thread.join()


def events(text: str) -> list[dict[str, object]]:
    return [json.loads(line) for line in text.splitlines()]


def test_a_take_is_recorded_and_chosen(
    tmp_path: Path, sending: int, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = str(tmp_path / "My 桜")
    words = ["record", folder, "--slate", "Hello", "--seconds", "0.9", "--device", "none", "--json"]
    assert cli.main([*words, "--port", str(sending)]) == 0
    told = events(capsys.readouterr().out)
    kinds = [e["event"] for e in told]
    assert (kinds[0], set(kinds[1:-1]) | {"state"}, kinds[-1]) == ("rolling", {"state"}, "done")
    done = told[-1]
    assert done["take"] == "Hello_001"
    promised = {
        "take",
        "seconds",
        "frames",
        "frames_lost",
        "packets",
        "packets_bad",
        "audio_seconds",
        "drift_ppm",
    }
    assert promised <= set(done)
    assert isinstance(done["frames"], int)
    assert done["frames"] > 0
    assert (done["frames_lost"], done["packets_bad"], done["audio_seconds"]) == (0, 0, 0)
    assert (done["cut_off"], done["reason"]) == (False, None)
    assert not done["verified"], "no microphone, no sound"
    assert str(done["proof"]).startswith("No sound was recorded. ")
    project = Project.open(tmp_path / "My 桜")
    assert [s.take for s in project.dataset.selections] == ["Hello_001"]
    assert project.take("Hello_001").info.frames == done["frames"]
    project.close()


@pytest.mark.slow
def test_what_a_flood_costs_is_told_while_it_happens_and_at_the_end(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Junk beside a body; the body ends early, and the take with it."""
    recorder = Recorder(tmp_path / "takes")
    recorder.open_motion(0)
    port = recorder.snapshot().port
    assert port is not None
    over = threading.Event()

    def send() -> None:
        floods.perform(port, 20)
        while not over.is_set():
            floods.flood(port, "junk", 300, per_s=3000)

    def told() -> str:
        record.tell_state(recorder.snapshot(), set(), Output(as_json=True))
        state = events(capsys.readouterr().out)[-1]
        return str(state["problems"]) if state["refused_per_s"] else ""

    sending = threading.Thread(target=send, daemon=True)
    try:
        recorder.start("Flood")
        sending.start()
        until(lambda: recorder.snapshot().frames >= 20)
        until(lambda: "packets a second are thrown away" in told())
        until(lambda: recorder.snapshot().elapsed > 1.6)
        last = recorder.snapshot()
        over.set()
        take = recorder.stop()
    finally:
        over.set()
        recorder.close()
    record.tell_outcome(take, last, 1.6, None, Output(as_json=True))
    done = events(capsys.readouterr().out)[-1]
    assert int(str(done["frames"])) >= 20  # the first may be torn by a pause of the sender
    assert isinstance(done["packets_refused"], int)
    assert 100 < done["packets_refused"] <= int(str(done["packets_bad"]))
    assert (done["packets_lost"], done["frames_thinned"]) == (0, 0)
    record.tell_outcome(take, last, 1.6, None, Output())
    said = capsys.readouterr().out
    assert f"{done['packets_refused']:,} packets of another program, no motion, were thrown away." in said
    assert f"Nothing came in after {take.info.duration:.1f} s of the 1.6 s asked for." in said


@pytest.mark.slow
def test_voice_and_motion_together(
    tmp_path: Path, sending: int, virtual_audio: str, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["record", str(tmp_path / "P"), "--slate", "Both", "--seconds", "1.5", "--json"]
    assert cli.main([*words, "--port", str(sending), "--device", virtual_audio]) == 0
    done = events(capsys.readouterr().out)[-1]
    assert isinstance(done["audio_seconds"], float)
    assert isinstance(done["seconds"], float)
    assert 0.5 < done["audio_seconds"] <= done["seconds"] + 0.01
    assert isinstance(done["frames"], int)
    assert done["frames"] > 0


@pytest.mark.slow
@pytest.mark.parametrize("how", ["stop", "signal"])
def test_a_wish_to_stop_saves_the_take(tmp_path: Path, sending: int, how: str) -> None:
    words = [sys.executable, "-m", "studio", "--json", "record", str(tmp_path / "P"), "--slate", "Open"]
    words += ["--device", "none", "--port", str(sending)]
    pipe = subprocess.PIPE
    with subprocess.Popen(words, stdin=pipe, stdout=pipe, text=True, cwd=ROOT) as child:
        assert child.stdout is not None
        assert child.stdin is not None
        for line in child.stdout:
            if json.loads(line)["event"] == "state":
                break
        if how == "stop":
            child.stdin.write("stop\n")
            child.stdin.flush()
        else:
            os.kill(child.pid, signal.SIGINT)
        last = events(child.stdout.read())[-1]
    assert child.returncode == 0
    assert last["event"] == "done"
    assert last["take"] == "Open_001"


@pytest.mark.slow
def test_what_an_earlier_session_left_is_recovered_first(tmp_path: Path, sending: int) -> None:
    words = [sys.executable, "-m", "studio", "--json", "record", str(tmp_path / "P"), "--slate", "Left"]
    words += ["--device", "none", "--port", str(sending)]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stdin=subprocess.PIPE, text=True, cwd=ROOT) as child:
        assert child.stdout is not None
        for line in child.stdout:
            if json.loads(line).get("frames", 0) > 60:
                break
        child.kill()
    again = subprocess.run(
        [*words, "--seconds", "0.7"],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        cwd=ROOT,
        check=True,
    )
    told = events(again.stdout)
    assert (told[0]["event"], told[0]["take"]) == ("recovered", "Left_001")
    assert told[-1]["take"] == "Left_002"


def test_a_take_that_a_full_disk_ends_is_told_and_kept(
    tmp_path: Path, sending: int, capsys: pytest.CaptureFixture[str]
) -> None:
    recorder = Recorder(tmp_path / "takes")

    def fill() -> None:
        while recorder.snapshot().state != RecorderState.ROLLING or recorder.snapshot().frames < 20:
            time.sleep(0.01)
        recorder.reserve_bytes = 2**62  # what no disk has stands for a disk with nothing left

    filling = threading.Thread(target=fill, daemon=True)
    filling.start()
    asked = argparse.Namespace(host="127.0.0.1", device="none", slate="Full", seconds=None)
    try:
        take, _ = record.record_take(recorder, asked, sending, Output(as_json=False))
    finally:
        recorder.close()
    filling.join()
    assert take.info.frames >= 20
    assert "The disk is full. Recording ended at" in capsys.readouterr().out


def test_a_disk_that_is_full_from_the_first_is_the_sentence(
    tmp_path: Path, sending: int, capsys: pytest.CaptureFixture[str]
) -> None:
    with small_disk(tmp_path / "tiny", "6m") as tiny:
        words = ["record", str(tiny / "P"), "--slate", "F", "--device", "none", "--port", str(sending)]
        assert cli.main([*words, "--json"]) == 1
        assert not any(tiny.iterdir())
    shown = capsys.readouterr()
    last, what = events(shown.out)[-1], "The disk is full. Nothing of F_001 was recorded."
    assert (last["event"], last["what"]) == ("error", what)
    assert shown.err == f"{what} Free some space, then record again.\n"


def remove(project: Path) -> None:
    shutil.rmtree(project)


def move(project: Path) -> None:
    project.rename(project.with_name("Elsewhere"))


@pytest.mark.skipif(os.name != "posix", reason="Windows lets nobody move a folder with open files")
@pytest.mark.parametrize(("vanish", "reason"), [(move, "folder_moved"), (remove, "folder_gone")])
@pytest.mark.parametrize("made_before", [False, True])
def test_a_folder_that_vanishes_in_mid_take_is_the_sentence(
    tmp_path: Path,
    sending: int,
    capsys: pytest.CaptureFixture[str],
    vanish: Callable[[Path], None],
    reason: str,
    made_before: bool,
) -> None:
    folder = tmp_path / "P"
    if made_before:
        Project.create(folder).close()

    def later() -> None:
        journal = folder / "takes" / "V_001" / "journal.bin"
        until(lambda: journal.is_file() and journal.stat().st_size > 30_000)
        vanish(folder)

    vanishing = threading.Thread(target=later, daemon=True)
    vanishing.start()
    words = ["record", str(folder), "--slate", "V", "--device", "none", "--port", str(sending), "--json"]
    assert cli.main(words) == 1
    vanishing.join()
    shown = capsys.readouterr()
    told = events(shown.out)
    done = told[-1]
    assert (done["event"], done["cut_off"], done["reason"]) == ("done", True, reason)
    kept = Path(str(done["folder"]))
    assert load_take(kept).info.frames == done["frames"]
    assert done["frames"]
    problems = told[-2]["problems"]
    assert isinstance(problems, list)
    assert problems[0]["what"].startswith(("The folder of V_001 was ", "The folder or disk of V_001 was "))
    assert shown.err == ""
    assert not folder.exists()
    if reason == "folder_moved":
        assert [take.id for take in Project.open(tmp_path / "Elsewhere").takes] == ["V_001"]


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--port", "http"], "http is not a port. Give a number up to 65535, or none."),
        (["--port", "99999"], "99999 is not a port. Give a number up to 65535, or none."),
        (["--seconds", "-1"], "-1 is no length of a take. Give seconds from 0 to 86400."),
        (["--seconds", "nan"], "nan is no length of a take. Give seconds from 0 to 86400."),
        (["--port", "none", "--device", "none"], "There is nothing to record. Give a port or a microphone."),
    ],
)
def test_a_wrong_request_is_one_sentence(
    tmp_path: Path, words: list[str], sentence: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["record", str(tmp_path / "P"), "--slate", "X", *words]) == 2
    assert capsys.readouterr().err.strip() == sentence
    assert not (tmp_path / "P").exists()


def test_a_taken_port_is_one_sentence(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        port = other.getsockname()[1]
        words = ["record", str(tmp_path / "P"), "--slate", "X", "--device", "none", "--port", str(port)]
        assert cli.main([*words, "--json"]) == 1
    last = events(capsys.readouterr().out)[-1]
    assert last["what"] == f"Port {port} is used by another program, such as VSeeFace or a second studio."
    assert last["remedy"] == "Close it, or choose another port in Record (or with --port)."


def test_nothing_coming_in_is_said_at_the_end(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["record", str(tmp_path / "P"), "--slate", "X", "--device", "none", "--port", "0"]
    assert cli.main([*words, "--seconds", "0.3", "--json"]) == 1
    assert events(capsys.readouterr().out)[-1]["what"] == "Nothing came in while X_001 was recorded."


@pytest.mark.slow
def test_the_practice_performer_of_another_terminal_is_recorded_without_a_sound_device(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Two commands as they are typed, but for ports that no other test uses."""
    motion, voice = free_port(), free_port()
    command = [sys.executable, "-m", "studio", "performer", "--to", f"127.0.0.1:{motion}", "--device", "none"]
    command += ["--voice", "bundled", "--voice-to", str(voice)]
    performer = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    try:
        assert performer.stdout is not None
        for line in performer.stdout:
            if line.startswith("  "):
                break  # its first sentence
        # Longer than any pause between two sentences: on a busy machine the take may begin in one.
        words = ["record", str(tmp_path / "P"), "--slate", "A", "--seconds", "5", "--json"]
        assert cli.main([*words, "--port", str(motion), "--device", f"performer:{voice}"]) == 0
    finally:
        performer.terminate()
        performer.communicate(timeout=60)
    done = events(capsys.readouterr().out)[-1]
    assert done["verified"]
    project = Project.open(tmp_path / "P")
    take = project.take("A_001")
    project.close()
    assert take.info.device == "Practice performer"
    assert take.audio_path is not None
    assert np.abs(read_sound(take.audio_path).samples).max() > 0.01
