"""The Live tab with a real child, a real sound device and a real listener; and what it says without them."""

from __future__ import annotations

import os
import platform
import socket
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QGuiApplication
from PySide6.QtWidgets import QMessageBox
from pytestqt.qtbot import QtBot

from studio.errors import StudioError
from studio.ipc.events import ChannelsEvent, LookAheadEvent
from studio.project import Project
from studio.ui.live.latency_presenter import look_aheads_of
from studio.ui.live.latency_view import LatencyCard, LookAheadOption
from studio.ui.live.model import PendingSwitches
from tests.inference.live.runs import add_run
from tests.inference.live.test_steps import speech
from tests.ui.live.children import FakeChild, Room, pose, ready, state

FIGURES = [
    {"ms": 0, "reach_ms": -8.3, "rmse": 0.05, "pearson_mouth": 0.6},
    {"ms": 100, "reach_ms": 91.7, "rmse": 0.04, "pearson_mouth": 0.8},
    {"ms": 500, "reach_ms": 491.7, "rmse": 0.09, "rmse_face": 0.039, "pearson_mouth": None},
]


def test_before_the_first_take_the_base_voice_is_ready_to_go_live(
    room: Callable[..., Room], tmp_path: Path
) -> None:
    view, presenter, _ = room(Project.create(tmp_path / "New"))
    assert view.source.run.run.currentText() == "Base voice"
    assert view.source.run.wanted.run == presenter.model.selection.run == "base_voice"
    assert view.source.start.isEnabled()


def test_a_run_that_is_trained_meanwhile_performs_unless_a_person_chose(
    room: Callable[..., Room], toy_project: Project
) -> None:
    view, presenter, session = room(toy_project)
    assert view.source.run.wanted.run == "base_voice"
    first = add_run(toy_project)
    session.runs_changed.emit()
    assert view.source.run.wanted.run == first.id
    presenter.model.choose_run(replace(presenter.model.selection, run="base_voice"))
    add_run(toy_project)
    session.runs_changed.emit()
    assert presenter.model.selection.run == "base_voice"


def test_the_newest_run_is_ready_to_go_live_and_its_look_aheads_show_their_quality(
    room: Callable[..., Room], toy_project: Project
) -> None:
    add_run(toy_project)
    run = add_run(toy_project, look_aheads=FIGURES)
    view, _, _ = room(toy_project)
    assert view.source.run.wanted.run == run.id
    names = [view.source.run.run.itemText(i) for i in range(view.source.run.run.count())]
    assert names[-1] == "Base voice"
    assert view.source.start.isEnabled()
    assert view.source.start.text() == "Go live"
    assert not view.controls.button("neutral").isEnabled()
    assert view.latency.slider.maximum() == 2
    assert view.latency.chosen == LookAheadOption(100, 91.7, 0.04, 0.8)
    assert view.latency.quality.text() == (
        "Waits for 92 ms of your voice. On takes it had not heard, it follows your mouth closely."
    )
    view.latency.slider.setValue(2)
    assert view.latency.quality.text() == "Waits for 492 ms of your voice."
    assert view.latency.quality.toolTip() == "On takes it had not heard: error 0.0390"


def test_a_run_that_still_learns_is_not_the_one_to_go_live_with(
    room: Callable[..., Room], toy_project: Project
) -> None:
    done = add_run(toy_project)
    add_run(toy_project, status="running", pid=os.getpid(), host=platform.node())
    view, _, _ = room(toy_project)
    assert view.source.run.wanted.run == done.id


def test_the_usual_look_ahead_hears_about_60_ms_on_whatever_its_name(
    room: Callable[..., Room], toy_project: Project
) -> None:
    sooner = {"ms": 67, "reach_ms": 58.3, "rmse": 0.041, "pearson_mouth": 0.79}
    add_run(toy_project, look_aheads=[FIGURES[0], sooner, *FIGURES[1:]])
    view, presenter, _ = room(toy_project)
    assert view.latency.chosen == LookAheadOption(67, 58.3, 0.041, 0.79)
    assert presenter.model.look_ahead_ms is None
    view.latency.slider.setValue(2)
    assert presenter.model.look_ahead_ms == 100


def test_a_run_that_knows_speech_says_why_it_leaves_no_choice(
    room: Callable[..., Room], toy_project: Project
) -> None:
    add_run(toy_project, form="speech")
    view, _, _ = room(toy_project)
    assert not view.latency.slider.isVisibleTo(view)
    assert view.latency.quality.text() == "Waits for about 200 ms of your voice, to know your words."
    assert "go live with Quick look" in view.latency.quality.toolTip()


def test_a_report_that_makes_no_sense_offers_nothing(toy_project: Project) -> None:
    run = add_run(toy_project, look_aheads=[{"ms": "x"}, 7, {"reach_ms": 1}, *FIGURES[:1]])
    assert [one.ms for one in look_aheads_of(run)] == [0]
    assert look_aheads_of(add_run(toy_project, look_aheads="all")) == ()


def test_the_latency_is_said_in_words_and_as_what_to_type_into_obs(qtbot: QtBot) -> None:
    card = LatencyCard()
    qtbot.addWidget(card)
    card.show_latency(141.2, "minded", 140)
    assert card.figure.text() == "141 ms"
    assert card.words.text() == "Viewers will notice this delay. Delay your voice to match."
    assert card.advice.text() == "In OBS: Advanced Audio Properties, your microphone, Sync Offset 140 ms."
    card.show_latency(220.0, "minded", 220, settled=False)
    assert card.advice.text() == "Settling… The Sync Offset for OBS stands here in a moment."
    assert (card.copy.text(), card.copy.isEnabled()) == ("Settling…", False)
    card.show_latency(141.2, "minded", 140)
    card.copy.click()
    assert QGuiApplication.clipboard().text() == "140"
    card.show_latency(40.0, "unseen", 0)
    assert card.words.text() == "The lips follow so quickly that nobody notices."
    assert not card.advice.isVisibleTo(card)
    assert not card.copy.isVisibleTo(card)


def test_options_become_the_words_of_the_command(room: Callable[..., Room], toy_project: Project) -> None:
    add_run(toy_project, styles=["toy_001"], style="toy_001")
    view, presenter, _ = room(toy_project)
    view.source.gain.setChecked(False)
    assert view.source.early.isChecked()
    view.source.early.setChecked(False)
    view.source.gate.setChecked(False)
    view.source.noise.setChecked(True)
    view.latency.look_ahead_chosen.emit(200)
    assert presenter.source.args == [
        "--look-ahead",
        "200",
        "--no-gain",
        "--no-gate",
        "--no-early",
        "--suppress-noise",
    ]


def test_poses_are_seen_whatever_channels_a_tuning_leaves(performing: Room, child: FakeChild) -> None:
    view, _, _ = performing
    child.told.emit(ready(("A",), ("Hips", "Head")))
    child.told.emit(pose(1, 2))
    child.told.emit(pose(2, 0))  # of channels it does not know yet
    assert view.meters.shown_names == ("A",)
    child.told.emit(ChannelsEvent(("A", "Joy"), (), ()))
    child.told.emit(pose(2, 0))
    assert view.meters.shown_names == ("A", "Joy")


@pytest.mark.parametrize(
    ("how", "said"),
    [
        ({"lost": True}, "No sound from Mic. Live resumes when sound returns."),
        ({"speaking": True}, "Live: Mic is heard."),
        ({"idling": 1.0}, "Live. You are silent, so the avatar idles."),
        ({}, "Live. You are silent."),
    ],
)
def test_the_status_says_what_is_heard(
    how: dict[str, object], said: str, performing: Room, child: FakeChild
) -> None:
    view, _, _ = performing
    child.told.emit(ready(("A",), ()))
    child.told.emit(state(**how))
    assert view.status.text() == said


@pytest.fixture
def speak(virtual_audio: str) -> Iterator[Callable[[], None]]:
    """Begins to speak for two minutes; silent when the test is over, however it ends."""
    import sounddevice

    yield lambda: sounddevice.play(np.tile(speech(2.0), 60) * 0.5, 16_000)
    sounddevice.stop()


@pytest.mark.slow
def test_going_live_moves_the_figure_sends_and_heeds_the_panic_key(
    room: Callable[..., Room], toy_project: Project, qtbot: QtBot, speak: Callable[[], None]
) -> None:
    add_run(toy_project, "look_aheads=0 100 200 500")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listener:
        listener.bind(("127.0.0.1", 0))
        listener.setblocking(False)
        view, presenter, session = room(toy_project, send_targets=(f"127.0.0.1:{listener.getsockname()[1]}",))
        facts: list[tuple[str, str, str]] = []
        session.status_changed.connect(lambda *fact: facts.append(fact))
        view.source.start.click()
        assert view.source.start.text() == "Starting…"
        speak()
        qtbot.waitUntil(lambda: view.source.start.text() == "Stop")
        qtbot.waitUntil(lambda: _received(listener))
        qtbot.waitUntil(lambda: view.latency.figure.text().endswith(" ms"))
        qtbot.waitUntil(lambda: bool(view.meters.shown_names))
        assert view.latency.slider.maximum() == 3
        assert facts[-1] == ("live", "Live", "good")
        view.controls.button("neutral").click()
        qtbot.waitUntil(lambda: view.status.text().startswith("Neutral:"))
        presenter.deactivate()  # another tab is shown: it goes on
        qtbot.waitUntil(lambda: _received(listener))
        presenter.activate()
        qtbot.waitUntil(lambda: presenter.model.state is not None and presenter.model.state.seconds > 2.0)
        view.stream.keep.click()
        qtbot.waitUntil(lambda: "Live_001" in toy_project.dataset)
        assert toy_project.dataset["Live_001"].split == ""  # a guess is nothing to learn from
        view.source.start.click()
        qtbot.waitUntil(lambda: not presenter.model.task.running)
    assert not view.stream.keep.isEnabled()
    assert view.source.start.text() == "Go live"
    assert view.status.text() == "Not live. Press Go live and speak."
    assert facts[-1] == ("live", "", "")


def _received(listener: socket.socket) -> bool:
    try:
        return b"/VMC/Ext/" in listener.recv(65_536)
    except BlockingIOError:
        return False


@pytest.mark.slow
def test_a_microphone_that_is_not_there_is_a_sentence(
    room: Callable[..., Room], toy_project: Project, qtbot: QtBot, virtual_audio: str
) -> None:
    from studio.ui.messages import Toast

    add_run(toy_project)
    view, presenter, _ = room(toy_project)
    view.source.show_devices((), "Old one")
    view.source.start.click()
    qtbot.waitUntil(lambda: not presenter.model.task.running)
    said = " ".join(toast.text.text() for toast in view.window().findChildren(Toast))
    assert "There is no sound input called Old one." in said
    assert view.source.start.text() == "Go live"


def test_the_keys_work_where_a_list_or_a_number_has_the_keyboard(
    room: Callable[..., Room], toy_project: Project, qtbot: QtBot
) -> None:
    add_run(toy_project)
    view, _, _ = room(toy_project)
    view.controls.show_live(True)
    switched: list[tuple[str, bool]] = []
    view.controls.switched.connect(lambda name, on: switched.append((name, on)))
    tuning, row = view.source.tuning, view.send.rows[0]
    qtbot.waitUntil(lambda: tuning.findText("Mouth only") >= 0)
    before = tuning.currentIndex(), row.preset.currentIndex()
    for box, key, name in (
        (tuning, Qt.Key.Key_M, "mute"),
        (row.preset, Qt.Key.Key_N, "neutral"),
        (row.port, Qt.Key.Key_F, "freeze"),
    ):
        qtbot.keyClick(box, key)
        assert switched.pop() == (name, True)  # at once
        assert not switched
    assert (tuning.currentIndex(), row.preset.currentIndex()) == before


def test_the_tab_key_leads_through_the_targets_before_their_options(
    room: Callable[..., Room], toy_project: Project
) -> None:
    add_run(toy_project)
    view, _, _ = room(toy_project)
    row, seen = view.send.rows[0], []
    widget = row.preset.nextInFocusChain()
    while widget is not view.send.add:
        seen.append(widget)
        widget = widget.nextInFocusChain()
    assert row.wave in seen
    assert view.send.fps not in seen


def test_closing_asks_while_it_is_live(
    room: Callable[..., Room], toy_project: Project, child: FakeChild, monkeypatch: pytest.MonkeyPatch
) -> None:
    add_run(toy_project)
    view, presenter, _ = room(toy_project, child)
    asked: list[str] = []

    def stay(box: QMessageBox) -> int:
        asked.append(box.text())
        next(button for button in box.buttons() if button.text() == "Cancel").click()
        return 0

    monkeypatch.setattr(QMessageBox, "exec", stay)
    assert presenter.may_close()
    assert not asked
    view.source.start.click()
    assert not presenter.may_close()
    assert asked == ["You are live."]


def test_a_state_under_way_presses_no_switch_back(performing: Room, child: FakeChild) -> None:
    view, presenter, _ = performing
    presenter.model.switches = PendingSwitches(lambda: 0.0)  # no time passes, however slow the machine is
    child.told.emit(ready(("A",), ()))
    child.told.emit(state())
    mute, gain = view.controls.button("mute"), view.source.gain
    view.controls.show_live(True)
    mute.click()
    gain.click()
    child.told.emit(state())  # written before the child heard of it
    assert mute.isChecked()
    assert not gain.isChecked()
    child.told.emit(state(muted=True, gain_on=False))
    assert mute.isChecked()
    assert not gain.isChecked()


def test_the_switches_show_what_the_child_says(performing: Room, child: FakeChild) -> None:
    view, _, _ = performing
    child.told.emit(ready(("A",), ()))
    child.told.emit(state(gain_on=False, idles=False, neutral=True))
    assert not view.source.gain.isChecked()
    assert not view.source.gate.isChecked()
    assert view.controls.button("neutral").isChecked()
    child.told.emit(state())
    assert view.source.gain.isChecked()
    assert view.source.gate.isChecked()
    assert not view.controls.button("neutral").isChecked()


def test_after_a_failure_no_old_value_stays(performing: Room, child: FakeChild) -> None:
    view, _, _ = performing
    child.told.emit(ready(("A",), ("Hips", "Head")))
    child.told.emit(state(clipped=True))
    child.told.emit(pose(1, 2))
    assert view.source.meter.values is not None
    assert not view.stage.figure.empty
    child.end(StudioError("It broke.", "Try again."))
    assert view.source.meter.values is None
    assert not view.source.meter.clipped
    assert view.meters.shown_names == ()
    assert view.latency.figure.text() == "-"
    assert view.stage.figure.empty
    assert view.source.start.text() == "Go live"
    assert not view.controls.button("mute").isEnabled()


def test_a_performance_that_says_nothing_is_told_of(performing: Room, child: FakeChild) -> None:
    view, presenter, _ = performing
    child.told.emit(ready(("A",), ()))
    child.told.emit(state(speaking=True))
    presenter.model.task.silent.emit()
    assert view.status.text() == (
        "Live is not responding because this computer is very busy. Wait, or press Stop."
    )
    child.told.emit(state(speaking=True))
    assert view.status.text() == "Live: Mic is heard."


def test_the_fastest_setting_is_kept_when_going_live(
    room: Callable[..., Room], toy_project: Project, child: FakeChild
) -> None:
    add_run(toy_project, look_aheads=FIGURES)
    view, _, _ = room(toy_project, child)
    view.latency.slider.setValue(0)
    fastest = view.latency.chosen
    assert fastest is not None
    assert fastest.ms == 0
    view.source.start.click()
    args = child.started[0]
    assert args[args.index("--look-ahead") + 1] == "0"
    child.told.emit(LookAheadEvent(0, -8.0))
    assert view.latency.chosen == fastest


def test_what_holds_the_avatar_is_seen_from_every_tab(performing: Room, child: FakeChild) -> None:
    view, _, session = performing
    told: list[tuple[str, str, str]] = []
    session.status_changed.connect(lambda *status: told.append(status))
    child.told.emit(ready(("A",), ("Head",)))
    child.told.emit(state(muted=True, neutral=True))
    assert told[-1] == ("live", "Live, neutral", "warn")
    assert "Muted too (M)." in view.status.text()
    child.told.emit(state(muted=True))
    assert told[-1] == ("live", "Live, muted", "warn")
