"""Record: real packets and real sound become takes, with one key, whatever else goes on."""

import os
import socket
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from datetime import datetime
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QInputDialog, QMessageBox

from studio.errors import StudioError
from studio.motion import Motion
from studio.motion.channels import BONES, VRM0_SHAPES
from studio.performer.sample import PERFORMER_NAME
from studio.project import Project
from studio.settings import NO_MICROPHONE
from studio.sound.sound_file import read_sound
from studio.take import TakeInfo
from studio.take.check import check_take, proof_of
from studio.take.folder import load_take, save_take
from studio.take.motion_file import read_motion
from studio.ui import messages, tasks, theme
from studio.ui.messages import Toast
from studio.ui.record.inputs_view import OTHER, own_address
from studio.ui.record.presenter import RecordPresenter
from studio.ui.record.takes_presenter import of_today
from studio.ui.record.task import PracticeTask
from studio.ui.record.view import RecordView
from studio.ui.session import Session
from studio.vmc.encode import encode_frame
from tests.fakes import FakeChildTask
from tests.ports import free_port
from tests.ui.geometry import faults


class Sender:
    """A VMC sender of 54 bones and 18 shapes at 60 Hz on a thread of its own."""

    def __init__(self, port: int) -> None:
        self.frames = 0
        self._port = port
        self._going = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def stop(self) -> None:
        self._going.set()
        self._thread.join(5)

    def _run(self) -> None:
        motion = Motion.build([0.0, 1.0], VRM0_SHAPES, np.array([[0.25], [0.3]]).repeat(18, 1), BONES)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as channel:
            while not self._going.wait(1 / 60):
                pose = motion.pose(self.frames % 60 / 60)  # a sender that never moves counts as frozen
                for datagram in encode_frame(pose, VRM0_SHAPES, BONES, time.monotonic()):
                    with suppress(OSError):
                        channel.sendto(datagram, ("127.0.0.1", self._port))
                self.frames += 1


class Room:
    """The Record tab of a project, shown."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self.view = RecordView()
        self.presenter = RecordPresenter(self.view, session)
        self.model = self.presenter.model

    @property
    def project(self) -> Project:
        assert self.session.project is not None
        return self.session.project

    @property
    def ready(self) -> bool:
        return self.model.recorder is not None and self.view.slate_bar.record.isEnabled()


@pytest.fixture
def port() -> int:
    return free_port()


@pytest.fixture
def room(qtbot, qapp, tmp_path: Path, port: int) -> Iterator[Room]:
    theme.apply(qapp)
    session = Session()
    session.change_settings(
        vmc_port=port, audio_device=NO_MICROPHONE, countdown=0.0, pre_roll=0.0, slate="Hello"
    )
    session.create_project(tmp_path / "Project")
    made = Room(session)
    qtbot.addWidget(made.view)
    made.view.resize(1280, 750)
    made.view.show()
    made.presenter.activate()
    qtbot.waitUntil(lambda: made.ready, timeout=30_000)
    yield made
    made.presenter.close()
    tasks.wait()


@pytest.fixture
def sender(port: int) -> Iterator[Sender]:
    made = Sender(port)
    yield made
    made.stop()


def recorded(room: Room, seconds: float = 0.4, frames: int = 4) -> bool:
    """Whether so much of a take is in; a busy sender may be behind the clock."""
    now = room.model.recorder.snapshot()
    return now.elapsed >= seconds and now.frames >= frames


def record(room: Room, qtbot, seconds: float = 0.5, frames: int = 4) -> None:
    """One take, by the button."""
    before = len(room.project.takes)
    room.view.slate_bar.record.click()
    qtbot.waitUntil(lambda: room.session.rolling, timeout=30_000)
    qtbot.waitUntil(lambda: recorded(room, seconds, frames), timeout=30_000)
    room.view.slate_bar.record.click()
    qtbot.waitUntil(lambda: len(room.project.takes) > before, timeout=30_000)


def test_motion_is_seen_as_it_comes_in(room: Room, sender: Sender, qtbot) -> None:
    qtbot.waitUntil(lambda: not room.view.figure.empty, timeout=30_000)
    qtbot.waitUntil(lambda: room.view.inputs.motion_text.text() == "54 bones  18 shapes", timeout=30_000)
    assert set(room.view.shapes.shown_names) == set(VRM0_SHAPES)
    qtbot.waitUntil(lambda: "Motion looks good." in room.view.health.sentences, timeout=30_000)


def test_what_is_sent_becomes_a_take(room: Room, sender: Sender, qtbot) -> None:
    qtbot.waitUntil(lambda: not room.view.figure.empty, timeout=30_000)
    record(room, qtbot, 1.0, frames=30)
    take = room.project.takes[0]
    assert take.id == "Hello_001"
    assert take.info.frames >= 30
    assert take.info.packets_bad == 0
    motion = read_motion(take.motion_path)
    assert set(motion.bone_names) == set(BONES)
    assert 0.25 <= motion.shapes.min() < motion.shapes.max() <= 0.3001
    assert room.view.slate_bar.number.text() == "take 002"
    qtbot.waitUntil(lambda: room.view.takes.shown == ("Hello_001",), timeout=30_000)


def test_voice_and_motion_are_recorded_together(virtual_audio, room: Room, sender: Sender, qtbot) -> None:
    box = room.view.inputs.device
    qtbot.waitUntil(lambda: bool(box.toolTip()), timeout=30_000)
    box.setCurrentIndex(box.findData(""))
    box.activated.emit(box.currentIndex())
    recorder = room.model.recorder
    qtbot.waitUntil(lambda: recorder.snapshot().audio_alive, timeout=30_000)
    record(room, qtbot, 1.0)
    take = room.project.takes[0]
    assert take.audio_path is not None
    assert 0.5 < take.info.audio_seconds <= take.info.duration + 0.01


def test_the_frame_is_red_and_the_clock_runs_while_rolling(room: Room, sender: Sender, qtbot) -> None:
    room.view.activateWindow()
    qtbot.waitUntil(room.view.isActiveWindow, timeout=30_000)
    qtbot.keyClick(room.view.figure, Qt.Key.Key_Space)
    qtbot.waitUntil(lambda: room.session.rolling, timeout=30_000)
    assert room.session.rolling
    qtbot.waitUntil(lambda: room.view.slate_bar.elapsed.text() >= "00:00.2", timeout=30_000)
    assert room.view.figure.rolling
    assert room.view.slate_bar.record.text() == "Stop  F1"
    qtbot.waitUntil(lambda: not room.view.inputs.port.isEnabled(), timeout=30_000)
    qtbot.waitUntil(lambda: recorded(room), timeout=30_000)
    qtbot.keyClick(room.view.figure, Qt.Key.Key_Space)
    qtbot.waitUntil(lambda: bool(room.project.takes), timeout=30_000)
    assert not room.session.rolling


def test_a_countdown_can_be_cancelled(room: Room, qtbot) -> None:
    room.session.change_settings(countdown=30.0)
    room.view.slate_bar.record.click()
    qtbot.waitUntil(lambda: room.view.figure.overlay.isdigit(), timeout=30_000)
    assert room.view.slate_bar.record.text() == "Cancel  Esc"
    room.view.cancel_requested.emit()
    qtbot.waitUntil(lambda: room.view.figure.overlay == "", timeout=30_000)
    assert not room.session.rolling
    assert room.project.takes == ()


def test_the_space_bar_types_into_the_slate(room: Room, qtbot) -> None:
    slate = room.view.slate_bar.slate
    slate.setFocus()
    slate.clear()
    room.view.follow_focus(None, slate)
    qtbot.keyClicks(slate, "My take")
    assert slate.text() == "My take"
    assert not room.session.rolling


def test_a_recording_goes_on_while_another_room_is_shown(room: Room, sender: Sender, qtbot) -> None:
    room.view.slate_bar.record.click()
    qtbot.waitUntil(lambda: room.session.rolling, timeout=30_000)
    room.presenter.deactivate()
    room.view.hide()
    seen = room.model.recorder.snapshot().frames
    qtbot.waitUntil(lambda: recorded(room, 0.6, seen + 10), timeout=30_000)
    room.view.show()
    room.presenter.activate()
    room.presenter.toggle()
    qtbot.waitUntil(lambda: bool(room.project.takes), timeout=30_000)
    assert room.project.takes[0].info.frames >= seen + 10


def test_nothing_to_record_is_said_in_words(room: Room, qtbot) -> None:
    # The inputs are opened on a pool thread: what is not open yet cannot be closed.
    qtbot.waitUntil(lambda: room.model.recorder.snapshot().port is not None, timeout=30_000)
    room.model.recorder.close_motion()
    room.view.slate_bar.record.click()
    qtbot.waitUntil(lambda: room.view.findChild(Toast) is not None, timeout=30_000)
    toast = room.view.findChild(Toast)
    assert toast.text.text() == "Nothing to record: there is no motion and no microphone."
    assert not room.session.rolling
    qtbot.waitUntil(lambda: room.view.slate_bar.record.isEnabled(), timeout=30_000)


def test_a_port_that_is_taken_is_named_on_the_health_card(room: Room, qtbot) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        taken = other.getsockname()[1]
        room.view.inputs.port_chosen.emit(taken)
        wanted = f"Port {taken} is used by another program, such as VSeeFace or a second studio."
        qtbot.waitUntil(lambda: any(wanted in s for s in room.view.health.sentences), timeout=30_000)
        room.presenter.inputs.retry_every(50)
        room.presenter.inputs.retry()
        assert any(wanted in s for s in room.view.health.sentences)  # it stays until it is no longer so
        remedy = "Close it, or choose another port here."
        assert room.model.problems["motion"] == (wanted, remedy)
        qtbot.waitUntil(lambda: room.view.figure.empty_text == f"{wanted} {remedy}", timeout=30_000)
    qtbot.waitUntil(lambda: room.model.recorder.snapshot().port == taken, timeout=30_000)
    qtbot.waitUntil(lambda: not any(wanted in s for s in room.view.health.sentences), timeout=30_000)
    qtbot.waitUntil(
        lambda: (
            room.view.figure.empty_text
            == "Waiting for motion. Start your tracking app, or try the practice performer."
        ),
        timeout=30_000,
    )


def test_the_button_on_the_stage_stops_the_practice_performer_too(room: Room) -> None:
    button = room.view.figure.empty_button
    room.view.show_stage("", practising=True)
    assert button.text() == "Stop the practice performer"
    assert button.width() >= button.sizeHint().width()
    room.view.show_stage("", practising=False)
    assert button.text() == "How are you tracked?"


def test_any_port_can_be_chosen(room: Room, qtbot, monkeypatch) -> None:
    mine = free_port()
    answers = iter([(mine, True), (mine + 1, False)])
    monkeypatch.setattr(QInputDialog, "getInt", lambda *_: next(answers))
    box = room.view.inputs.port
    for _ in range(2):
        box.setCurrentIndex(box.findData(OTHER))
        box.activated.emit(box.currentIndex())
        assert (box.currentText(), room.session.settings.vmc_port) == (f"Port {mine}", mine)


def test_a_microphone_that_is_not_there_is_looked_for_again(virtual_audio, room: Room, qtbot) -> None:
    box = room.view.inputs.device
    qtbot.waitUntil(lambda: bool(box.toolTip()), timeout=30_000)
    room.model.may_refresh = False
    room.view.inputs.device_chosen.emit("Blue Parrot")
    wanted = "There is no sound input called Blue Parrot."
    qtbot.waitUntil(lambda: wanted in room.view.health.sentences, timeout=30_000)
    room.session.change_settings(audio_device="default")  # as if it were plugged in under its name
    room.presenter.inputs.retry_every(50)
    recorder = room.model.recorder
    qtbot.waitUntil(lambda: recorder.snapshot().audio_alive, timeout=30_000)
    qtbot.waitUntil(lambda: wanted not in room.view.health.sentences, timeout=30_000)


def test_the_network_choice_comes_with_a_sentence(room: Room) -> None:
    network = room.view.inputs.network
    network.setCurrentIndex(1)
    network.activated.emit(1)
    said = "Any device on your network can send motion here, such as a phone or second PC."
    address = own_address()
    said += f" This computer's address is {address}." if address else ""
    assert room.view.inputs.network_note.text() == said
    assert room.session.settings.vmc_host == "0.0.0.0"


def test_keep_note_and_redo(room: Room, sender: Sender, qtbot) -> None:
    record(room, qtbot)
    qtbot.waitUntil(lambda: room.view.takes.shown == ("Hello_001",), timeout=30_000)
    row = room.view.takes.row("Hello_001")
    row.keep.click()
    assert room.project.dataset["Hello_001"].stars == 3
    row.note_button.click()
    qtbot.keyClicks(row.note, "smile more")
    qtbot.keyClick(row.note, Qt.Key.Key_Return)
    assert room.project.dataset["Hello_001"].note == "smile more"
    row.redo.click()
    qtbot.waitUntil(lambda: room.session.rolling, timeout=30_000)
    assert room.project.takes == ()
    qtbot.waitUntil(lambda: recorded(room), timeout=30_000)
    room.presenter.toggle()
    qtbot.waitUntil(lambda: len(room.project.takes) == 1, timeout=30_000)


def test_a_take_thrown_away_comes_back_by_undo(room: Room, sender: Sender, qtbot) -> None:
    record(room, qtbot)
    room.session.change_settings(countdown=30.0)
    room.view.takes.row("Hello_001").redo.click()
    assert room.project.takes == ()
    room.view.findChild(Toast).action.click()
    assert [take.id for take in room.project.takes] == ["Hello_001"]
    room.view.cancel_requested.emit()
    room.view.takes.row("Hello_001").redo.click()
    assert room.project.takes == ()
    room.view.cancel_requested.emit()
    assert [take.id for take in room.project.takes] == ["Hello_001"], "Esc in the countdown"


def test_a_take_is_heard_with_the_figure_moving(room: Room, qtbot) -> None:
    today = datetime.now().astimezone().isoformat(timespec="seconds")
    long = Motion.build([0.0, 600.0], VRM0_SHAPES, np.array([[0.2], [0.3]]).repeat(18, 1), BONES)
    info = TakeInfo("Hello", 1, created=today)
    room.session.adopt(room.project.add_take("Hello_001", info, long, None))
    room.model.player.toggle("Hello_001")
    qtbot.waitUntil(lambda: room.model.player.current is not None, timeout=30_000)
    qtbot.waitUntil(lambda: room.view.figure.caption == "Playing Hello_001", timeout=30_000)
    assert room.model.player.pose is not None
    room.model.player.current.player.seek(599.9)
    qtbot.waitUntil(lambda: room.model.player.current is None, timeout=30_000)


def test_a_take_says_before_it_begins_what_it_would_lack(room: Room, sender: Sender, qtbot) -> None:
    missing = room.view.slate_bar.missing
    qtbot.waitUntil(lambda: missing.isHidden(), timeout=30_000)
    sender.stop()
    words = "No motion and no sound yet. Connect a tracker or a microphone."
    qtbot.waitUntil(lambda: missing.text() == words, timeout=30_000)
    assert missing.isVisible()
    assert room.view.slate_bar.record.isEnabled(), "warned of, not forbidden"


def test_a_take_that_stays_empty_says_so_while_it_rolls(room: Room, qtbot) -> None:
    room.view.slate_bar.record.click()
    words = "Nothing is being recorded: no motion and no sound. Check your tracker and microphone."
    missing = room.view.slate_bar.missing
    qtbot.waitUntil(lambda: missing.text() == words and missing.isVisible(), timeout=30_000)
    assert missing.property("role") == "bad"
    room.presenter.toggle()
    qtbot.waitUntil(lambda: not room.session.rolling and not room.model.busy, timeout=30_000)
    assert room.view.findChild(Toast).text.text() == "Nothing came in while Hello_001 was recorded."


def test_a_slate_that_cannot_be_a_file_s_name_says_what_it_is_saved_as(room: Room, qtbot) -> None:
    bar = room.view.slate_bar
    assert bar.number.text() == "take 001"
    bar.slate.setText("Who? Me: yes")
    bar.slate.editingFinished.emit()
    assert bar.number.text() == "saved as Who_ Me_ yes_001"
    assert bar.number.toolTip() == (
        "Some characters can't be used in file names. This take will be saved as Who_ Me_ yes_001."
    )


def test_a_take_of_the_practice_performer_is_named_after_it(room: Room, sender: Sender, qtbot) -> None:
    record(room, qtbot)
    room.model.practice.set_on(True, free_port(), "none")
    record(room, qtbot)
    room.model.practice.set_on(False)
    named = {one.take: one.performer for one in room.project.dataset.selections}
    assert named == {"Hello_001": "", "Hello_002": PERFORMER_NAME}


def test_a_long_slate_leaves_the_buttons_of_a_take_in_sight(room: Room, qtbot) -> None:
    slate = "A slate of sixty characters, as long as one may ever be here"
    today = datetime.now().astimezone().isoformat(timespec="seconds")
    still = Motion.build([0.0, 1.0], ("A",), [[0.0], [1.0]])
    room.session.adopt(room.project.add_take(f"{slate}_001", TakeInfo(slate, 1, created=today), still, None))
    row = room.view.takes.row(f"{slate}_001")
    card = room.view.takes
    qtbot.waitUntil(lambda: row.redo.isVisible(), timeout=30_000)
    qtbot.waitUntil(
        lambda: row.redo.mapTo(card, row.redo.rect().topRight()).x() < card.width(), timeout=30_000
    )


def test_in_the_smallest_window_nothing_lies_over_the_button(room: Room, qtbot) -> None:
    bar = room.view.slate_bar
    room.view.resize(1040, 588)
    qtbot.waitUntil(lambda: room.view.width() == 1040, timeout=30_000)
    bar.layout().activate()
    boxes = bar.countdown.geometry(), bar.record.geometry(), bar.pre_roll.geometry()
    assert boxes[0].right() < boxes[1].left()
    assert boxes[1].right() < boxes[2].left()


def test_takes_are_graded_and_prove_themselves(virtual_audio, room: Room, sender: Sender, qtbot) -> None:
    room.session.change_settings(audio_device="default")
    qtbot.waitUntil(lambda: room.model.recorder.snapshot().audio_alive, timeout=30_000)
    record(room, qtbot, seconds=1.5, frames=40)
    row = room.view.takes.row("Hello_001")
    qtbot.waitUntil(lambda: row.grade.text() in "ABCD" and row.grade.text() != "", timeout=30_000)
    take = room.project.take("Hello_001")
    # The virtual sound device may be silent or busy; what the files hold is what is told of them.
    proof = proof_of(take, check_take(take))
    assert row.proof.text() == f"{proof.what} {proof.remedy}".strip()
    assert f"{take.info.frames} frames of motion" in row.proof.toolTip()


def test_a_take_that_is_not_whole_says_so_at_once(room: Room, tmp_path: Path, qtbot) -> None:
    import soundfile

    soundfile.write(tmp_path / "voice.wav", 0.1 * np.sin(np.arange(48_000) / 10), 16_000)
    motion = Motion.build([0.0, 0.1, 0.2], ("A",), [[0.0], [1.0], [0.5]])
    folder = room.project.takes_folder / "Bad_001"
    today = datetime.now().astimezone().isoformat(timespec="seconds")
    take = save_take(folder, TakeInfo("Bad", 1, created=today), motion, tmp_path / "voice.wav")
    take.motion_path.write_bytes(b"spoilt")
    room.model.adopt(take)
    row = room.view.takes.row("Bad_001")
    qtbot.waitUntil(lambda: row.proof.property("role") == "bad", timeout=30_000)
    toast = room.view.findChild(Toast)
    qtbot.waitUntil(lambda: toast.text.text().startswith("Bad_001: "), timeout=30_000)
    assert toast.action.text() == "Re-record"


def test_a_take_of_another_project_has_no_grade_of_this_ones(
    room: Room, sender: Sender, qtbot, tmp_path
) -> None:
    record(room, qtbot)
    row = room.view.takes.row("Hello_001")
    qtbot.waitUntil(lambda: row.grade.text() in "ABCD" and row.grade.text() != "", timeout=30_000)
    other = Project.create(tmp_path / "Other")
    today = datetime.now().astimezone().isoformat(timespec="seconds")
    moving = Motion.build([0.0, 1.0], ("A",), [[0.0], [1.0]])
    other.add_take("Hello_001", TakeInfo("Hello", 1, created=today, source="imported"), moving, None)
    other.close()
    assert row.proof.text() == "No sound was recorded. Choose a microphone and record it again. " + (
        "Nothing can be learnt from it."
    )
    room.session.open_project(other.folder)
    other_row = room.view.takes.row("Hello_001")
    qtbot.waitUntil(lambda: other_row.proof.text().startswith("The take has no sound."), timeout=30_000)


@pytest.mark.parametrize(
    ("created", "listed"),
    [
        ("2026-03-02T00:10:00+01:00", True),
        ("2026-03-01T23:50:00+01:00", True),
        ("2026-03-01T22:50:00+00:00", True),
        ("2026-03-01T16:00:00+01:00", False),
        ("", False),
    ],
)
def test_who_records_past_midnight_still_has_the_takes_of_the_evening(created: str, listed: bool) -> None:
    now = datetime.fromisoformat("2026-03-02T00:20:00+01:00")
    assert of_today(created, now) is listed


def test_closing_while_rolling_asks_and_saves(room: Room, sender: Sender, qtbot, monkeypatch) -> None:
    room.view.slate_bar.record.click()
    qtbot.waitUntil(lambda: room.session.rolling, timeout=30_000)
    qtbot.waitUntil(lambda: recorded(room), timeout=30_000)
    answers = iter(["Cancel", "Stop and save"])

    def answer(box: QMessageBox) -> int:
        words = next(answers)
        next(b for b in box.buttons() if b.text() == words).click()
        return 0

    monkeypatch.setattr(QMessageBox, "exec", answer)
    assert not room.presenter.may_close()
    assert room.session.rolling
    assert room.presenter.may_close()
    assert [take.id for take in Project.open(room.project.folder, read_only=True).takes] == ["Hello_001"]


def test_a_recording_cut_short_is_recovered_with_a_sentence(
    room: Room, sender: Sender, qtbot, tmp_path
) -> None:
    import subprocess

    folder = tmp_path / "Crashed"
    Project.create(folder).close()
    port = free_port()
    other = Sender(port)
    code = (
        "import os, time\nfrom pathlib import Path\nfrom studio.capture.recorder import Recorder\n"
        f"takes = Path({str(folder / 'takes')!r})\nr = Recorder(takes)\nr.open_motion({port})\n"
        "r.start('Lost')\n"
        "while (takes / 'Lost_001' / 'journal.bin').stat().st_size < 20_000:\n    time.sleep(0.02)\n"
        "os._exit(9)\n"
    )
    ended = subprocess.run([sys.executable, "-c", code], check=False, timeout=240)
    assert ended.returncode == 9
    other.stop()
    room.session.open_project(folder)
    qtbot.waitUntil(lambda: bool(room.project.takes), timeout=30_000)
    toast = room.view.findChild(Toast)
    assert toast.text.text().startswith("A recording that was cut short was recovered: Lost_001 (")
    assert toast.remedy.text() == "It is among your takes."


def test_a_full_disk_ends_the_take_which_is_kept_and_said(room: Room, sender: Sender, qtbot) -> None:
    qtbot.waitUntil(lambda: room.model.recorder.snapshot().motion_alive, timeout=30_000)
    room.presenter.toggle()
    qtbot.waitUntil(lambda: room.session.rolling and recorded(room), timeout=30_000)
    room.model.recorder.reserve_bytes = 2**62  # what no disk has stands for a disk with nothing left
    qtbot.waitUntil(lambda: bool(room.project.takes), timeout=30_000)
    assert not room.session.rolling
    qtbot.waitUntil(lambda: room.view.findChild(Toast) is not None, timeout=30_000)
    toast = room.view.findChild(Toast)
    said = "The disk is full. Recording ended at "
    qtbot.waitUntil(lambda: toast.text.text().startswith(said), timeout=30_000)
    kept = room.project.takes_folder / "Hello_001"
    assert toast.remedy.text() == f"What came until then is kept in {kept}. Free some space."


@pytest.mark.skipif(os.name != "posix", reason="Windows lets nobody move a folder with open files")
def test_a_project_moved_in_mid_take_keeps_it_and_says_where(room: Room, sender: Sender, qtbot) -> None:
    folder, elsewhere = room.project.folder, room.project.folder.with_name("Elsewhere")
    qtbot.waitUntil(lambda: room.model.recorder.snapshot().motion_alive, timeout=30_000)
    room.presenter.toggle()
    qtbot.waitUntil(lambda: room.session.rolling and recorded(room), timeout=30_000)
    folder.rename(elsewhere)
    qtbot.waitUntil(lambda: room.view.findChild(Toast) is not None, timeout=30_000)
    toast = room.view.findChild(Toast)
    said = "The folder of Hello_001 was moved or renamed. Recording ended at "
    qtbot.waitUntil(lambda: toast.text.text().startswith(said), timeout=30_000)
    kept = elsewhere / "takes" / "Hello_001"
    where = f"What came until then is kept in {kept}. Open the project where it is now."
    assert toast.remedy.text() == where
    assert load_take(kept).info.frames > 0
    qtbot.waitUntil(lambda: room.ready, timeout=30_000)
    room.presenter.toggle()
    assert toast.text.text() == "The folder of Project is gone."
    assert not folder.exists()


def test_a_project_that_opens_shows_its_button_and_nothing_of_the_one_before(
    room: Room, sender: Sender, port: int, qtbot, tmp_path
) -> None:
    qtbot.waitUntil(lambda: set(room.view.shapes.shown_names) == set(VRM0_SHAPES))
    # Of the port of the next one, nobody knows.
    sender.stop()
    room.session.change_settings(vmc_port=free_port())
    Project.create(tmp_path / "Other").close()
    room.session.open_project(tmp_path / "Other")
    button = room.view.slate_bar.record
    assert (button.text(), button.isEnabled()) == ("Record  F1", False)
    assert not button.icon().isNull()
    qtbot.waitUntil(lambda: room.ready)
    assert room.view.shapes.shown_names == ()
    assert room.view.figure.empty
    assert button.text() == "Record  F1"


def test_the_button_says_record_before_anything_is_open(qtbot, qapp) -> None:
    theme.apply(qapp)
    made = Room(Session())
    qtbot.addWidget(made.view)
    button = made.view.slate_bar.record
    assert (button.text(), button.isEnabled()) == ("Record  F1", False)
    made.presenter.close()


def test_what_comes_late_of_a_project_that_was_left_is_none_of_the_next(room: Room, qtbot, tmp_path) -> None:
    first = room.project
    Project.create(tmp_path / "Other").close()
    room.session.open_project(tmp_path / "Other")
    qtbot.waitUntil(lambda: room.model.recorder is not None, timeout=30_000)
    recorder = room.model.recorder
    motion = Motion.build([0.0, 1.0], ("A",), [[0.0], [1.0]])
    late = save_take(first.takes_folder / "Late_001", TakeInfo("Late", 1), motion, None)
    room.model.adopt(late)
    assert room.project.takes == ()
    room.model.use_recovered(first, (late,))
    assert room.project.takes == ()
    assert room.model.recorder is recorder
    assert recorder.takes_folder == room.project.takes_folder


@pytest.mark.parametrize("size", [(1004, 560), (1260, 720)])
def test_while_the_practice_performer_gets_ready_nothing_else_is_asked_for(room: Room, qtbot, size) -> None:
    view = room.view
    view.resize(*size)
    # Its process would say by and by that it is ready.
    room.model.practice = practice = PracticeTask(room.model, FakeChildTask())
    practice.set_on(True, free_port())
    ready = "The practice performer is getting ready."
    qtbot.waitUntil(lambda: view.health.sentences[:1] == (ready,))
    qtbot.waitUntil(lambda: room.model.recorder.snapshot().problems == ())
    assert view.figure.empty_text == "The practice performer is getting ready…"
    assert view.slate_bar.missing.text().startswith(ready)
    assert view.inputs.practice.text() == "Getting ready…"
    assert [one for one in faults(view) if "InputsCard" in one] == []
    practice.set_on(False)
    qtbot.waitUntil(lambda: ready not in view.health.sentences)
    assert view.inputs.practice.text() == "Use the practice performer"


@pytest.mark.slow
def test_the_practice_performer_performs_on_a_button(virtual_audio, room: Room, qtbot) -> None:
    room.view.inputs.practice.click()
    qtbot.waitUntil(lambda: not room.view.figure.empty, timeout=60_000)
    qtbot.waitUntil(lambda: room.view.inputs.practice.text() == "Stop the practice performer", timeout=30_000)
    practice = room.model.practice
    qtbot.waitUntil(lambda: room.view.figure.caption == practice.speaking != "", timeout=60_000)
    room.view.inputs.practice.click()
    assert not room.model.practice.on
    qtbot.waitUntil(lambda: not room.model.practice.running, timeout=30_000)


@pytest.mark.slow
def test_the_practice_performer_s_voice_is_recorded_without_any_sound_device(room: Room, qtbot) -> None:
    """The person's own choice of microphone comes back when it stops, and not in the middle of a take."""
    room.session.change_settings(audio_device="Gramophone")
    choice, recorder = room.view.inputs.device, room.model.recorder
    assert recorder is not None
    # No device that could hear it.
    qtbot.waitUntil(lambda: "sound" in room.model.problems, timeout=30_000)
    room.view.inputs.practice.click()
    assert choice.currentText() == "Practice performer"
    qtbot.waitUntil(lambda: recorder.snapshot().device == "Practice performer", timeout=30_000)
    qtbot.waitUntil(lambda: room.model.practice.speaking != "", timeout=60_000)
    record(room, qtbot, seconds=1.0)
    take = room.project.takes[0]
    assert take.audio_path is not None
    assert take.info.device == "Practice performer"
    assert np.abs(read_sound(take.audio_path).samples).max() > 0.01, "its voice is in it"
    assert "sound" not in room.model.problems
    room.view.slate_bar.record.click()
    qtbot.waitUntil(lambda: room.session.rolling and not room.model.busy, timeout=30_000)
    listed: list[object] = []
    choice.model().rowsInserted.connect(lambda *_: listed.append(choice.currentText()))
    room.view.inputs.practice.click()
    qtbot.waitUntil(lambda: recorded(room, seconds=1.0))
    assert recorder.snapshot().device == "Practice performer", "a take that rolls keeps its sound"
    assert choice.currentText() == "Practice performer", "and says so"
    assert not listed, "nothing is listed anew with every picture"
    told = "You stopped the practice performer. The take goes on without motion and voice."
    qtbot.waitUntil(lambda: told in room.view.health.sentences, timeout=30_000)
    toast = messages.toast_of(room.view)
    assert toast is not None
    assert toast.text.text() == told
    line = room.model.practice.voice_port
    room.view.inputs.practice.click()
    assert room.model.practice.voice_port == line, "the take hears it again"
    ready = "The practice performer is getting ready."
    qtbot.waitUntil(lambda: ready in room.view.health.sentences, timeout=30_000)
    room.model.set_practising(False)
    room.view.slate_bar.record.click()
    qtbot.waitUntil(lambda: len(room.project.takes) == 2, timeout=60_000)
    assert not room.project.takes[1].info.notes
    qtbot.waitUntil(lambda: recorder.snapshot().device is None, timeout=30_000)
    assert choice.currentText() == "Gramophone (not found)"
    assert choice.findText("Practice performer") < 0


@pytest.mark.slow
def test_the_practice_performer_rests_while_another_tab_is_shown_unless_a_take_rolls(
    room: Room, qtbot
) -> None:
    practice, model = room.model.practice, room.model
    room.view.inputs.practice.click()
    model.practice_voice = False
    room.presenter.deactivate()
    assert not practice.on
    room.presenter.activate()
    assert (practice.on, model.practice_voice) == (True, False), "as it was"
    qtbot.waitUntil(lambda: practice.speaking != "" and recorder_hears(room))
    room.view.slate_bar.record.click()
    qtbot.waitUntil(lambda: room.session.rolling and not model.busy)
    qtbot.waitUntil(lambda: recorded(room))
    room.presenter.deactivate()
    assert practice.on
    room.presenter.activate()
    room.view.slate_bar.record.click()
    qtbot.waitUntil(lambda: len(room.project.takes) == 1)
    room.view.inputs.practice.click()
    room.presenter.deactivate()
    room.presenter.activate()
    assert not practice.on, "who was sent away stays away"


def test_a_resting_practice_performer_comes_back_into_no_other_project_and_no_take(
    room: Room, qtbot, tmp_path
) -> None:
    # Its process would take seconds to start each time.
    model = room.model
    model.practice = practice = PracticeTask(model, FakeChildTask())
    room.view.inputs.practice.click()
    room.presenter.deactivate()
    # From another tab, by the one key.
    room.presenter.toggle()
    qtbot.waitUntil(lambda: room.session.rolling and not model.busy)
    room.presenter.activate()
    assert not practice.on
    room.presenter.toggle()
    qtbot.waitUntil(lambda: len(room.project.takes) == 1 or (not room.session.rolling and not model.busy))
    room.presenter.deactivate()
    room.presenter.activate()
    assert not practice.on, "who came back without it goes on without it"
    room.view.inputs.practice.click()
    assert practice.on
    # As the window does: the tab is left with its project.
    room.presenter.deactivate()
    room.session.close_project()
    room.session.create_project(tmp_path / "Other")
    room.presenter.activate()
    assert not practice.on
    qtbot.waitUntil(lambda: room.ready)


def recorder_hears(room: Room) -> bool:
    return room.model.recorder is not None and room.model.recorder.snapshot().motion_alive


@pytest.mark.slow
def test_a_microphone_chosen_beside_the_practice_performer_is_recorded(room: Room, qtbot) -> None:
    room.view.inputs.practice.click()
    choice = room.view.inputs.device
    assert [choice.itemText(i) for i in range(choice.count())][-2:] == ["Practice performer", "No microphone"]
    for words in ("No microphone", "Practice performer"):
        choice.setCurrentIndex(choice.findText(words))
        choice.activated.emit(choice.currentIndex())
        wanted = words if words == "Practice performer" else None
        qtbot.waitUntil(
            lambda wanted=wanted: room.model.recorder.snapshot().device == wanted,  # type: ignore[union-attr]
            timeout=30_000,
        )
    assert room.session.settings.audio_device == NO_MICROPHONE, "the choice of another day is not touched"


def test_the_practice_performer_follows_the_port_one_after_the_other() -> None:
    """The next one begins when that before has ended: two would speak at once."""
    child = FakeChildTask()
    practice = PracticeTask(child=child)
    practice.redirect(5000)
    assert not practice.on
    practice.set_on(True, 39539)
    practice.redirect(39539)
    practice.redirect(39540)
    assert practice.on
    voice = ["--voice-to", str(practice.voice_port)]
    assert child.started == [["performer", "--to", "127.0.0.1:39539", *voice]]
    child.end(StudioError("It was interrupted.", ""))
    assert practice.on
    assert child.started[1:] == [["performer", "--to", "127.0.0.1:39540", *voice]]
    practice.close()


def test_a_practice_performer_that_is_stopped_while_it_moves_stays_stopped() -> None:
    child = FakeChildTask()
    practice = PracticeTask(child=child)
    practice.set_on(True, 39539)
    practice.redirect(39540)
    practice.set_on(False)
    child.end(None)
    assert not practice.on
    assert len(child.started) == 1


@pytest.mark.slow
def test_a_practice_performer_that_is_wanted_again_at_once_comes_back(room: Room, qtbot) -> None:
    practice = room.model.practice
    practice.set_on(True, free_port(), "none")
    practice.set_on(False)
    practice.set_on(True, room.session.settings.vmc_port, "none")
    assert practice.on
    qtbot.waitUntil(lambda: not room.view.figure.empty, timeout=60_000)


def test_a_take_without_motion_is_saved_with_a_warning(room: Room, tmp_path: Path) -> None:
    import soundfile

    soundfile.write(tmp_path / "voice.wav", np.zeros(16_000), 16_000)
    folder = room.project.takes_folder / "Alone_001"
    take = save_take(folder, TakeInfo("Alone", 1), None, tmp_path / "voice.wav")
    room.model.adopt(take)
    toast = room.view.findChild(Toast)
    assert toast.text.text() == "Alone_001 is saved with sound only: 1.0 s."
    assert toast.remedy.text().startswith("No motion came in.")
    assert not toast.bad
    assert (toast.action.text(), toast.also.text()) == ("Play", "Undo")
    toast.also.click()
    assert room.project.takes == ()
    assert toast.text.text() == "Alone_001 is in the trash."
    assert (toast.action.text(), toast.also.isVisible()) == ("Undo", False)
    toast.action.click()
    assert [one.id for one in room.project.takes] == ["Alone_001"]
