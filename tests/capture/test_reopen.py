"""A microphone that vanished is opened again when it is back, and a take that rolls goes on with it."""

import json
import subprocess
import sys
import textwrap
import threading
from pathlib import Path

import pytest

from studio import stage
from studio.capture.reopen import SoundWatch
from studio.errors import StudioError

ROOT = Path(__file__).resolve().parents[2]


def test_it_is_tried_until_it_is_there_and_no_longer() -> None:
    armed, back, calm = threading.Event(), threading.Event(), threading.Event()
    tries: list[bool] = []

    def reopen(refresh: bool) -> None:
        tries.append(refresh)
        if len(tries) == 1:
            raise StudioError("It is not there.", "Plug it in.")
        if len(tries) == 2:
            raise OSError("the sound system stumbled")
        back.set()

    def is_lost() -> bool:
        if back.is_set():
            calm.set()
        return armed.is_set() and not back.is_set()

    watch = SoundWatch(is_lost, reopen, every=0.01)
    watch.may_refresh = lambda: False
    armed.set()
    assert back.wait(30)
    assert calm.wait(30)
    watch.stop()
    assert tries == [False, False, False]


REPLUG = textwrap.dedent("""
    import json, os, signal, socket, subprocess, sys, time
    from pathlib import Path
    from studio import stage
    from studio.capture import reopen
    from studio.capture.recorder import Recorder
    from studio.capture.vmc import message

    reopen.EVERY_S = 0.2

    def until(condition, seconds=60):
        end = time.monotonic() + seconds
        while not condition():
            assert time.monotonic() < end, recorder.snapshot()
            send()
            time.sleep(0.01)

    count = 0
    def send():
        global count
        count += 1
        for part in (message("/VMC/Ext/Blend/Val", "A", count % 100 / 100), message("/VMC/Ext/Blend/Apply")):
            out.sendto(part, ("127.0.0.1", port))

    def pactl(*words):
        subprocess.run(["pactl", *words], check=True, stdout=subprocess.DEVNULL)

    out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    servers = []
    start = stage._start_pulseaudio
    def started(folder):
        servers.append((start(folder), folder))
        return servers[-1][0]
    stage._start_pulseaudio = started
    with stage.virtual_sound() as environment:
        os.environ.update(environment)
        recorder = Recorder(Path(sys.argv[1]))
        recorder.sound_watch._every = 0.2
        recorder.open_motion(0)
        port = recorder.snapshot().port
        recorder.open_audio()
        until(lambda: recorder.snapshot().audio_seconds > 0.3)
        recorder.start("Replugged")
        until(lambda: recorder.snapshot().audio_seconds > 0.5 and recorder.snapshot().frames > 10)
        server, folder = servers[0]
        server.kill()
        server.wait()
        until(lambda: not recorder.snapshot().audio_alive)
        kept = recorder.snapshot().audio_seconds
        (folder / "native").unlink(missing_ok=True)
        again = start(folder)
        until(lambda: recorder.snapshot().audio_alive)
        until(lambda: recorder.snapshot().audio_seconds > kept + 1.0)
        take = recorder.stop()
        recorder.close()
        stage._end(again)
        print(json.dumps({"kept": kept, "sound": take.info.audio_seconds, "duration": take.info.duration,
                          "frames": take.info.frames, "sent": count, "notes": take.info.notes}), flush=True)
""")


@pytest.mark.slow
def test_a_take_goes_on_with_a_microphone_that_is_back(tmp_path: Path) -> None:
    """The sound server is killed and started again while a take rolls, in a process of its own."""
    if not stage.sound_available():
        pytest.skip("pulseaudio is not installed")
    words = [sys.executable, "-c", REPLUG, str(tmp_path / "takes")]
    done = subprocess.run(words, capture_output=True, text=True, cwd=ROOT, timeout=240, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    told = json.loads(done.stdout.splitlines()[-1])
    assert told["sound"] > told["kept"] + 0.5
    assert told["frames"] > 0
    notes = " ".join(told["notes"])
    assert "default stopped giving sound at" in notes
    assert "default was back at" in notes
    assert "and is silent there" in notes
