"""The welcome page: say something before there is a project, and what it says of this computer."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import soundfile
from PySide6.QtWidgets import QLabel, QPushButton

from studio.capture.phrase import PAUSE_S
from studio.ipc.events import SystemCheckEvent
from studio.paths import resource
from studio.playback.player import Player
from studio.ui.main_window import MainWindow
from studio.ui.session import Session


@pytest.fixture
def window(qtbot):
    """The window on its welcome page, with the figure in."""
    window = MainWindow(Session())
    qtbot.addWidget(window)
    window.show()
    _ = window.start.hello
    yield window
    window.close()


def status(window: MainWindow) -> QLabel:
    return window.findChild(QLabel, "hello_status")


@pytest.mark.slow
def test_a_dropped_sound_moves_the_figure_without_a_project(window: MainWindow, qtbot) -> None:
    hello = window.start.hello
    before = hello.pane.figure.stance
    window.take_paths((resource("performer", "clip_00.ogg"),))
    qtbot.waitUntil(lambda: hello.motion is not None, timeout=180_000)
    assert hello.playing
    qtbot.waitUntil(lambda: hello.pane.figure.stance is not before)
    motion = hello.motion
    assert motion.shapes[:, motion.shape_names.index("A")].std() > 0.02, "the mouth moves"
    assert motion.duration == pytest.approx(
        soundfile.info(resource("performer", "clip_00.ogg")).duration, abs=0.1
    )
    assert window.session.project is None
    qtbot.waitUntil(lambda: not hello.playing)
    window.findChild(QPushButton, "hello_again").click()
    assert hello.playing
    assert window.findChild(QPushButton, "hello_record").isVisible()


@pytest.mark.slow
def test_what_is_spoken_is_heard_up_to_the_pause(virtual_audio: str, window: MainWindow, qtbot) -> None:
    clip = resource("performer", "clip_00.ogg")
    speak = window.findChild(QPushButton, "hello_speak")
    speak.click()
    qtbot.waitUntil(lambda: "Speak now" in status(window).text())
    voice = Player(clip)
    voice.play()
    # Nobody presses Stop: the pause behind the sentence ends it.
    qtbot.waitUntil(lambda: "base voice is listening" in status(window).text())
    voice.close()
    assert speak.text() == "Speak"
    sound, rate = soundfile.read(window.start.hello.sound)
    assert len(sound) / rate == pytest.approx(soundfile.info(clip).duration + PAUSE_S, abs=3.0)
    assert np.abs(sound).max() > 0.05


def test_what_cannot_be_said_is_told_in_a_sentence(
    window: MainWindow, qtbot, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("SAIA_ESPEAK", "none")
    window.welcome.hello.sentence.setText("Hello")
    window.findChild(QPushButton, "hello_say").click()
    qtbot.waitUntil(lambda: status(window).property("role") == "warn")
    assert status(window).text() == (
        "Typed sentences need espeak-ng, which is not installed. "
        "Use the microphone or a sound file, or install espeak-ng."
    )
    soundfile.write(tmp_path / "empty.wav", np.zeros(0, dtype=np.float32), 16_000)
    window.start.hello.say_file(tmp_path / "empty.wav")
    qtbot.waitUntil(lambda: "empty.wav is empty" in status(window).text())
    window.session.settings = window.session.settings.changed(audio_device="no such microphone")
    window.findChild(QPushButton, "hello_speak").click()
    qtbot.waitUntil(lambda: status(window).property("role") == "warn")
    assert window.findChild(QPushButton, "hello_speak").text() == "Speak"


def test_the_computer_is_one_line_unless_something_is_wrong(window: MainWindow, qtbot) -> None:
    line, page = window.findChild(QLabel, "check_line"), window.welcome
    page.show_checking()
    assert line.text() == "Checking this computer…"
    fine = SystemCheckEvent(name="sound", ok=True, what="Sound works.")
    page.show_checks((fine, fine))
    assert line.text() == "This computer is ready."
    assert "Sound works." not in shown(page)
    page.details.click()
    qtbot.waitUntil(lambda: "Sound works." in shown(page))
    page.details.click()
    assert "Sound works." not in shown(page)
    page.show_checks(
        (fine, SystemCheckEvent(name="port", ok=False, what="The port is taken.", remedy="Free it."))
    )
    assert line.text() == "A few things need attention on this computer."
    qtbot.waitUntil(lambda: "The port is taken.\nFree it." in shown(page))
    assert "Sound works." not in shown(page), "what is fine is a detail"


def shown(page) -> list[str]:
    return [one.text() for one in page.findChildren(QLabel) if one.isVisible()]


def test_without_a_microphone_a_sentence_is_offered_first(window: MainWindow) -> None:
    page = window.welcome
    deaf = SystemCheckEvent("sound in", False, "There is no microphone.", "Connect a microphone.")
    taken = SystemCheckEvent(
        "motion", False, "Port 1 is used.", "Choose another (or with --port).", "Choose another."
    )
    page.show_checks((deaf, taken))
    assert (page.hello.speak.property("role"), page.hello.say.property("role")) == ("", "primary")
    assert "Port 1 is used.\nChoose another." in shown(page)
    page.show_checks((SystemCheckEvent("sound in", True, "1 microphone: USB."),))
    assert (page.hello.speak.property("role"), page.hello.say.property("role")) == ("primary", "")
