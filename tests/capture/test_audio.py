"""A sound device, opened and closed while others look for devices or let go of it."""

import threading
import time

import pytest

from studio.capture import audio
from studio.capture.audio import AudioInput, find_output, input_devices, output_names
from studio.capture.input_error import InputError
from studio.errors import StudioError


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


def test_without_a_microphone_window_and_terminal_each_say_what_can_be_done_there(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(audio, "input_devices", lambda: ())
    with pytest.raises(InputError) as caught:
        audio.find_device(None)
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
