"""The inputs of Record: several senders, a phone that has to be asked, microphones listed for another tab."""

import json
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest
from PySide6.QtWidgets import QLabel

from studio import clock
from studio.capture.microphone import AudioDevice
from studio.capture.snapshot import Snapshot
from studio.errors import StudioError
from studio.motion import Motion
from studio.motion.channels import BONES
from studio.settings import NO_MICROPHONE
from studio.ui import tasks, theme
from studio.ui.messages import Toast
from studio.ui.record.inputs_presenter import InputsPresenter, source_texts
from studio.ui.record.inputs_view import EVERYWHERE, MORE_PORTS, InputsCard
from studio.ui.record.model import RecordModel
from studio.ui.record.phone_link import PhoneLink
from studio.ui.record.presenter import RecordPresenter
from studio.ui.record.view import RecordView
from studio.ui.session import MicrophoneRequest, Session
from studio.vmc.decode import HELLO, IFACIALMOCAP, IFACIALMOCAP_PORT
from studio.vmc.encode import encode_frame
from studio.vmc.stream import Sender
from studio.vmc.vtube_studio import VTUBE_STUDIO, VTUBE_STUDIO_PORT
from tests.ports import free_port

FACE = b"jawOpen-40|eyeBlink_L-10|=head#0,0,0,0,0,0|"
BODY = Sender("127.0.0.1:5", 39539, "VMC", ("Hips", "Head"), ("Joy",))
PHONE = Sender("192.168.0.9:5", 49983, "iFacialMocap", (), ("JawOpen",))


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
    words = view.inputs.findChild(QLabel, "motion_sources")
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


def test_another_room_is_answered_while_a_take_is_recorded(qtbot, session: Session, card: InputsCard) -> None:
    asked: list[bool] = []
    model = RecordModel(session, card)
    inputs = InputsPresenter(card, model, session, lambda refresh: asked.append(refresh) or ())
    session.set_rolling(True)
    request = MicrophoneRequest()
    with qtbot.waitSignal(session.microphones_listed, timeout=30_000):
        session.microphones_requested.emit(request)
    assert request.accepted
    inputs.close()
    model.close()
    assert asked == [False], "the microphone that is recorded is not let go"
    toast = card.window().findChild(Toast)
    assert toast is not None
    assert toast.remedy.text() == "Look again after the take."


def test_another_room_is_answered_where_listing_fails(qtbot, session: Session, card: InputsCard) -> None:
    def broken(_refresh: bool) -> tuple[AudioDevice, ...]:
        raise StudioError("The sound system did not answer.", "Start it again.")

    model = RecordModel(session, card)
    inputs = InputsPresenter(card, model, session, broken)
    request = MicrophoneRequest()
    with qtbot.waitSignal(session.microphones_listed, timeout=30_000):
        session.microphones_requested.emit(request)
    assert request.accepted
    inputs.close()
    model.close()
    assert model.problems["sound"] == ("The sound system did not answer.", "Start it again.")


def test_one_sender_needs_no_words() -> None:
    assert source_texts(Snapshot(sources=(BODY,))) == ([], "")
    lines, details = source_texts(Snapshot(sources=(PHONE, BODY)))
    assert lines == ["2 bones, 1 shape from VMC :39539", "1 shape from iFacialMocap :49983 192.168.0.9"]
    assert "iFacialMocap :49983 192.168.0.9: JawOpen" in details


def test_further_ports_are_chosen_in_a_menu(qtbot, card: InputsCard) -> None:
    assert MORE_PORTS == (39539, 39540, 49983, 11111, 11573, 11125)
    actions = {action.text(): action for action in card.more.menu().actions()}
    with qtbot.waitSignal(card.more_ports_chosen) as told:
        actions["iFacialMocap, port 49983"].trigger()
    assert told.args == [(49983,)]
    assert card.more.text() == "+1"


def face(last: float) -> Snapshot:
    source = Sender("192.168.1.7:49983", IFACIALMOCAP_PORT, "iFacialMocap", (), ("JawOpen",), last)
    return Snapshot(sources=(source,), ports=(39539, IFACIALMOCAP_PORT))


@pytest.fixture
def phone() -> Iterator[socket.socket]:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as opened:
        opened.bind(("127.0.0.1", 0))
        opened.settimeout(30)
        yield opened


def test_a_phone_is_asked_until_it_sends_and_again_when_it_stops(qapp, phone: socket.socket) -> None:
    link = PhoneLink(ports={IFACIALMOCAP: phone.getsockname()[1]})
    link.listen((39539, IFACIALMOCAP_PORT))
    link.connect_to(" 127.0.0.1 ")
    assert phone.recv(100) == HELLO
    assert link.status == "Asking 127.0.0.1 to send… Open iFacialMocap there, in the same network."
    link.ask()
    assert phone.recv(100) == HELLO
    link.follow(face(clock.now()))
    assert link.status == "The phone sends its face."
    asked = link.asked
    link.ask()
    assert link.asked == asked
    link.follow(face(clock.now() - 10.0))
    link.ask()
    assert link.asked == asked + 1
    link.connect_to("")
    assert link.status == ""
    link.ask()
    assert link.asked == asked + 1


def test_vtube_studio_is_asked_while_it_sends_too(qapp, phone: socket.socket) -> None:
    link = PhoneLink(ports={VTUBE_STUDIO: phone.getsockname()[1]})
    link.listen((39539, VTUBE_STUDIO_PORT))
    link.connect_to("127.0.0.1")
    asked = json.loads(phone.recv(200))
    assert asked == {
        "messageType": "iOSTrackingDataRequest",
        "time": 5.0,
        "sentBy": "Saia Studio",
        "ports": [VTUBE_STUDIO_PORT],
    }
    assert link.status == "Asking 127.0.0.1 to send… Open VTube Studio there, in the same network."
    source = Sender("127.0.0.1:4000", VTUBE_STUDIO_PORT, VTUBE_STUDIO, (), ("JawOpen",), clock.now())
    link.follow(Snapshot(sources=(source,)))
    assert link.status == "The phone sends its face."
    link.ask()
    assert json.loads(phone.recv(200)) == asked
    link.listen((39539,))
    count = link.asked
    link.ask()
    assert link.asked == count
    link.close()


def test_what_is_no_address_is_a_sentence(qapp) -> None:
    link = PhoneLink()
    link.connect_to("my phone")
    assert link.problem == (
        "my phone is not the address of a phone.",
        "Type the four numbers that the app shows, for example 192.168.1.7.",
    )
    assert (link.address, link.asked, link.status) == ("", 0, "")


def test_the_row_opens_the_network_and_remembers_the_phone(session: Session, card: InputsCard) -> None:
    session.change_settings(audio_device=NO_MICROPHONE)
    model = RecordModel(session, card)
    inputs = InputsPresenter(card, model, session)
    assert not card.phone.isVisible()
    card.show_more_ports((IFACIALMOCAP_PORT,))
    assert card.phone.isVisible()
    card.phone.address.setText("127.0.0.1")
    card.phone.button.click()
    assert (session.settings.phone, session.settings.vmc_host) == ("127.0.0.1", EVERYWHERE)
    assert card.network.currentData() == EVERYWHERE
    inputs.follow_phone(Snapshot(ports=(39539, IFACIALMOCAP_PORT)))
    assert card.phone.words.text().startswith("Asking 127.0.0.1 to send…")
    assert card.phone.button.text() == "Disconnect"
    card.phone.button.click()
    assert (session.settings.phone, inputs.phone.address) == ("", "")
    card.phone.address.setText("nonsense")
    card.phone.button.click()
    inputs.follow_phone(Snapshot(ports=(39539, IFACIALMOCAP_PORT)))
    assert model.problems["phone"][0] == "nonsense is not the address of a phone."
    inputs.close()
    model.close()
