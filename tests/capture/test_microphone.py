"""A sound device, opened and closed while others look for devices or let go of it."""

import json
import subprocess
import sys
import textwrap
import threading
import time
from pathlib import Path

import pytest

from studio import virtual_devices
from studio.capture import microphone as audio
from studio.capture.microphone import AudioInput, SoundWatch, find_output, input_devices, output_names
from studio.errors import InputError, StudioError


def _heard(microphone: AudioInput, seconds: float = 30.0) -> bool:
    """Whether a block comes from now on."""
    microphone.drain()
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        if microphone.drain():
            return True
        time.sleep(0.01)
    return False


def test_looking_for_devices_anew_cuts_off_no_open_input(virtual_audio: str) -> None:
    microphone = AudioInput()
    microphone.start()
    try:
        assert _heard(microphone)
        assert microphone.device in input_devices(refresh=True)
        assert _heard(microphone)
        assert not microphone.ended
    finally:
        microphone.stop()


def test_two_threads_may_let_go_of_it_at_once_and_it_opens_again(virtual_audio: str) -> None:
    for _ in range(3):
        microphone = AudioInput()
        microphone.start()
        threads = [threading.Thread(target=microphone.stop) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(30)
        assert not any(thread.is_alive() for thread in threads)
        assert not microphone.ended
    assert input_devices(refresh=True)


def test_without_a_microphone_window_and_terminal_each_say_what_can_be_done_there() -> None:
    with pytest.raises(InputError) as caught:
        audio.find_device(None, ())
    check = "Check that a microphone is plugged in and allowed"
    assert caught.value.what == "This computer has no sound input."
    assert caught.value.remedy == f"{check}. Without one, record takes --device none and live takes --file."
    assert caught.value.in_window == f"{check}, then refresh the list of devices."


def test_an_output_offered_in_several_ways_is_opened_in_the_quickest(monkeypatch: pytest.MonkeyPatch) -> None:
    cable = "CABLE Input (VB-Audio Virtual Cable)"
    ways = [("CABLE Input (VB-Audio Virtual C", 0.09), (cable, 0.12), (cable, 0.003), ("Mic", 0.001)]
    listed = [
        {"name": name, "index": i, "max_output_channels": 0 if name == "Mic" else 2,
         "default_low_output_latency": latency}
        for i, (name, latency) in enumerate(ways)
    ]  # fmt: skip
    monkeypatch.setattr("sounddevice.query_devices", lambda *_: listed)
    assert output_names() == ("CABLE Input (VB-Audio Virtual C", cable)
    assert find_output(cable) == 2
    assert find_output("CABLE Input (VB-Audio Virtual C") == 0
    with pytest.raises(StudioError, match="There is no sound output called Speakers"):
        find_output("Speakers")


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
    from studio import virtual_devices
    from studio.capture.recorder import Recorder
    from studio.vmc.encode import message

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
    def started(folder):
        servers.append((virtual_devices.start_pulseaudio(folder), folder))
        return servers[-1][0]
    with virtual_devices.virtual_sound(started) as environment:
        os.environ.update(environment)
        recorder = Recorder(Path(sys.argv[1]))
        recorder.sound_watch.every = 0.2
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
        again = virtual_devices.start_pulseaudio(folder)
        until(lambda: recorder.snapshot().audio_alive)
        until(lambda: recorder.snapshot().audio_seconds > kept + 1.0)
        take = recorder.stop()
        recorder.close()
        virtual_devices.end(again)
        print(json.dumps({"kept": kept, "sound": take.info.audio_seconds, "duration": take.info.duration,
                          "frames": take.info.frames, "sent": count, "notes": take.info.notes}), flush=True)
""")


@pytest.mark.slow
def test_a_take_goes_on_with_a_microphone_that_is_back(tmp_path: Path) -> None:
    """The sound server is killed and started again while a take rolls, in a process of its own."""
    if not virtual_devices.sound_available():
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
