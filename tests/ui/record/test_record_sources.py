"""Record with several senders, and the sync test beside the offset."""

import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

from studio.capture import input_tests, microphone
from studio.capture.snapshot import Snapshot
from studio.errors import StudioError
from studio.motion import Motion
from studio.motion.channels import BONES
from studio.project import Project
from studio.settings import NO_MICROPHONE
from studio.take import TakeInfo
from studio.ui import tasks, theme
from studio.ui.messages import Toast
from studio.ui.record import findings
from studio.ui.record.inputs import MORE_PORTS, InputsCard
from studio.ui.record.inputs_presenter import InputsPresenter
from studio.ui.record.presenter import RecordPresenter
from studio.ui.record.sync import SyncTest, verdict
from studio.ui.record.view import RecordView
from studio.ui.session import Session
from studio.vmc.assemble import Sender
from studio.vmc.encode import encode_frame

FACE = b"jawOpen-40|eyeBlink_L-10|=head#0,0,0,0,0,0|"
BODY = Sender("127.0.0.1:5", 39539, "VMC", ("Hips", "Head"), ("Joy",))
PHONE = Sender("192.168.0.9:5", 49983, "iFacialMocap", (), ("JawOpen",))


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@pytest.fixture
def session(qapp, tmp_path: Path) -> Iterator[Session]:
    theme.apply(qapp)
    made = Session()
    made.create_project(tmp_path / "Project")
    yield made
    tasks.wait()


@pytest.fixture
def card(qtbot, session: Session) -> InputsCard:
    made = InputsCard()
    qtbot.addWidget(made)
    made.show()
    return made


def test_a_body_and_a_face_show_who_gives_what(qtbot, session: Session) -> None:
    first, second = free_port(), free_port()
    session.change_settings(vmc_port=first, more_ports=(str(second),), audio_device=NO_MICROPHONE)
    view = RecordView()
    qtbot.addWidget(view)
    presenter = RecordPresenter(view, session)
    view.resize(1280, 750)
    view.show()
    presenter.activate()
    pose = Motion.build([0.0], ("Joy",), [[0.5]], BONES).pose(0.0)
    words = view.inputs.findChild(type(view.inputs.motion_text), "motion_sources")
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other,
    ):

        def shown() -> bool:
            other.sendto(FACE, ("127.0.0.1", second))
            for datagram in encode_frame(pose, ("Joy",), BONES, 0.0):
                one.sendto(datagram, ("127.0.0.1", first))
            return "iFacialMocap" in words.text()

        wanted = f"54 bones, 1 shape from VMC :{first}\n2 shapes from iFacialMocap :{second}"
        qtbot.waitUntil(lambda: shown() and words.text() == wanted, timeout=30_000)
        assert words.isVisible()
        index = [row.name for row in view.shapes.list.rows].index("JawOpen")
        assert view.shapes.list.tip_at(index * 22 + 5) == f"JawOpen, from iFacialMocap :{second}"
    presenter.close()


def test_another_room_is_answered_while_a_take_is_recorded(
    qtbot, session: Session, card: InputsCard, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[bool] = []
    monkeypatch.setattr(microphone, "input_devices", lambda refresh=False: asked.append(refresh) or ())
    inputs = InputsPresenter(card, session, card)
    session.set_rolling(True)
    with qtbot.waitSignal(session.microphones_listed, timeout=30_000):
        session.microphones_wanted.emit()
    inputs.close()
    assert asked == [False], "the microphone that is recorded is not let go"
    toast = card.window().findChild(Toast)
    assert toast is not None
    assert toast.remedy.text() == "Look again after the take."


def test_another_room_is_answered_where_listing_fails(
    qtbot, session: Session, card: InputsCard, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(refresh: bool = False) -> tuple[microphone.AudioDevice, ...]:
        raise StudioError("The sound system did not answer.", "Start it again.")

    monkeypatch.setattr(microphone, "input_devices", broken)
    inputs = InputsPresenter(card, session, card)
    with qtbot.waitSignal(session.microphones_listed, timeout=30_000):
        session.microphones_wanted.emit()
    inputs.close()
    assert inputs.problems["sound"] == ("The sound system did not answer.", "Start it again.")


def test_one_sender_needs_no_words() -> None:
    assert findings.source_texts(Snapshot(sources=(BODY,))) == ([], "")
    lines, details = findings.source_texts(Snapshot(sources=(PHONE, BODY)))
    assert lines == ["2 bones, 1 shape from VMC :39539", "1 shape from iFacialMocap :49983 192.168.0.9"]
    assert "iFacialMocap :49983 192.168.0.9: JawOpen" in details


def test_further_ports_are_chosen_in_a_menu(qtbot, card: InputsCard) -> None:
    assert MORE_PORTS == (39539, 39540, 49983, 11111)
    actions = {action.text(): action for action in card.more.menu().actions()}
    with qtbot.waitSignal(card.more_ports_chosen) as told:
        actions["iFacialMocap, port 49983"].trigger()
    assert told.args == [(49983,)]
    assert card.more.text() == "+1"


def test_the_sync_test_says_what_it_needs(qtbot, session: Session, card: InputsCard) -> None:
    test = SyncTest(card, session, lambda: False, card)
    test.start()
    assert not test.running
    (toast,) = card.window().findChildren(Toast)
    assert "The sync test needs a microphone and motion." in toast.text.text()


def test_a_measured_pair_is_shown_and_moves_later_takes(qtbot, session: Session, card: InputsCard) -> None:
    practising: list[bool] = []
    test = SyncTest(card, session, lambda: bool(practising), card)
    snap = Snapshot(device="Studio mic", sources=(BODY, PHONE), motion_alive=True, audio_alive=True)
    sender = "iFacialMocap :49983 192.168.0.9"
    test.show(snap, ("needs a test", ""))
    assert card.sync_text.text() == "needs a test"
    kept = input_tests.with_pair((), "Studio mic", sender, 80.0)
    session.change_settings(sync_offsets=kept)
    test.show(snap, ("needs a test", ""))
    assert card.sync_text.text() == "+80 ms  off"
    practising.append(True)  # on the same port, yet without a camera's delay
    assert test.known(snap) is None
    practising.clear()
    project = session.project
    assert isinstance(project, Project)
    motion = Motion.build([0.0, 1.0], ("A",), [[0.0], [1.0]])
    take = project.add_take("Hello_001", TakeInfo("Hello", 1), motion, None)
    said = test.apply(take, snap)
    assert said == "Its motion is moved by -80 ms, as the sync test found."
    assert project.dataset["Hello_001"].offset == pytest.approx(-0.08)
    assert session.undo() == "Sync of Hello_001"
    assert project.dataset["Hello_001"].offset == 0.0
    assert test.apply(take, Snapshot(device="Other mic", sources=(BODY,))) == ""


@pytest.mark.parametrize(
    ("ms", "words"), [(12.0, ("+12 ms  in sync", "good")), (-60.0, ("-60 ms  slightly off", "warn"))]
)
def test_a_verdict_has_words_and_a_colour(ms: float, words: tuple[str, str]) -> None:
    assert verdict(ms) == words
