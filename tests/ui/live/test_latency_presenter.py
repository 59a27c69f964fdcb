"""The delayed voice: chosen, remembered, told to the performance, and heard."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QCoreApplication
from pytestqt.qtbot import QtBot

from studio import virtual_devices
from studio.capture.microphone import AudioInput
from studio.ipc.commands import Command
from studio.ipc.events import VoiceEvent
from studio.project import Project
from studio.settings import Settings
from studio.ui import tasks
from studio.ui.live.latency_presenter import DelayedVoicePresenter, LatencyPresenter
from studio.ui.live.latency_view import NOBODY, SYSTEM, LatencyCard, LookAheadOption, VoiceRow
from studio.ui.live.model import LiveModel
from studio.ui.session import Session
from tests.inference.live.runs import add_run
from tests.inference.live.test_steps import speech
from tests.ui.live.children import FakeChild, Room, ready, state

Voice = tuple[VoiceRow, DelayedVoicePresenter, LiveModel, Session]


@pytest.fixture
def voice(qtbot: QtBot, child: FakeChild) -> Callable[..., Voice]:
    """A row of its own with a performance that is ready to be told where the voice goes."""

    def build(**settings: object) -> Voice:
        row, session = VoiceRow(), Session(Settings().changed(**settings))
        qtbot.addWidget(row)
        model = LiveModel(session, row, child)  # type: ignore[arg-type]
        made = DelayedVoicePresenter(row, model, session)
        model.task.start([])
        return row, made, model, session

    return build


def choose(row: VoiceRow, value: str) -> None:
    row.outputs.setCurrentIndex(row.outputs.findData(value))
    row.outputs.activated.emit(row.outputs.currentIndex())


def test_a_choice_is_told_at_once_and_remembered(voice: Callable[..., Voice], child: FakeChild) -> None:
    row, _, model, session = voice()
    assert row.value == NOBODY
    row.show_outputs(["CABLE Input"], NOBODY)
    choose(row, "CABLE Input")
    assert child.commands == [Command("voice-to", "CABLE Input")]
    assert session.settings.live_voice == "CABLE Input"
    child.commands.clear()
    model.activate()
    model.use_file(None)
    child.told.emit(ready(("A",), ()))
    assert Command("voice-to", "CABLE Input") in child.commands
    child.commands.clear()
    model.use_file(Path("voice.wav"))
    child.told.emit(ready(("A",), ()))
    assert child.commands == []
    choose(row, NOBODY)
    assert session.settings.live_voice == ""
    assert child.commands[-1] == Command("voice-to", "none")


def test_an_output_that_is_gone_is_named_and_one_that_cannot_be_is_off(
    voice: Callable[..., Voice], child: FakeChild, virtual_audio: str
) -> None:
    row, made, _, _ = voice(live_voice="CABLE Input")
    assert row.outputs.currentText() == "CABLE Input (not found)"
    child.told.emit(VoiceEvent(None))
    assert row.value == NOBODY
    made.refresh()  # as when the tab is shown again
    tasks.wait()
    QCoreApplication.processEvents()
    assert row.value == NOBODY
    child.end()
    assert row.value == "CABLE Input"
    child.told.emit(VoiceEvent(""))
    assert row.value == SYSTEM


def test_outputs_of_this_computer_are_listed(
    voice: Callable[..., Voice], virtual_audio: str, qtbot: QtBot
) -> None:
    row, made, _, _ = voice(live_voice="default")
    made.refresh()
    qtbot.waitUntil(lambda: row.outputs.count() > 2)
    assert row.value == SYSTEM
    tasks.wait()


def test_a_file_needs_none_and_the_advice_follows_the_choice(
    room: Callable[..., Room], toy_project: Project, child: FakeChild
) -> None:
    add_run(toy_project)
    view, _, _ = room(toy_project, child, live_voice="default")
    view.source.start.click()
    child.told.emit(ready(("A",), ("Head",)))
    child.told.emit(VoiceEvent(""))
    child.told.emit(state())
    assert "no Sync Offset needed" in view.latency.advice.text()
    assert not view.latency.copy.isVisible()
    child.told.emit(VoiceEvent(None))
    child.told.emit(state())
    assert "Sync Offset 100 ms" in view.latency.advice.text()
    assert view.latency.copy.isVisible()
    view.latency.voice.show_file(True)
    assert not view.latency.voice.outputs.isEnabled()


@pytest.mark.slow
def test_the_voice_is_heard_while_live(
    room: Callable[..., Room],
    toy_project: Project,
    qtbot: QtBot,
    virtual_audio: str,
    monkeypatch: pytest.MonkeyPatch,
    request: pytest.FixtureRequest,
) -> None:
    import sounddevice

    add_run(toy_project)
    view, live, _ = room(toy_project, live_voice=SYSTEM)
    sounddevice.play(np.tile(speech(2.0), 90) * 0.5, 16_000)
    request.addfinalizer(sounddevice.stop)
    monkeypatch.setenv("PULSE_SINK", virtual_devices.SECOND)  # the performance's alone: it begins after this
    view.source.start.click()
    qtbot.waitUntil(lambda: live.model.state is not None, timeout=60_000)
    monkeypatch.setenv("PULSE_SOURCE", f"{virtual_devices.SECOND}.monitor")
    ear = AudioInput(virtual_audio, 48_000, 1)
    ear.start()
    request.addfinalizer(ear.stop)
    qtbot.waitUntil(lambda: any(np.abs(block.samples).max() > 0.02 for block in ear.drain()), timeout=60_000)
    assert view.latency.voice.value == SYSTEM
    view.source.start.click()
    qtbot.waitUntil(lambda: not live.model.task.running, timeout=60_000)
    tasks.wait()


def test_with_a_file_one_sentence_says_that_nothing_is_waited_for(qtbot: QtBot, child: FakeChild) -> None:
    card, session = LatencyCard(), Session(Settings())
    qtbot.addWidget(card)
    model = LiveModel(session, card, child)  # type: ignore[arg-type]
    made = LatencyPresenter(card, model)
    card.show_look_aheads([LookAheadOption(90, 92.0)], 90)
    assert card.quality.text() == "Waits for 92 ms of your voice."
    model.use_file(Path("voice.wav"))
    assert card.words.text() == "A file is read ahead, so voice and lips are in sync."
    assert card.quality.text() == ""
    assert card.figure.isHidden()
    model.use_file(None)
    assert card.quality.text() == "Waits for 92 ms of your voice."
    assert not card.figure.isHidden()
    del made
