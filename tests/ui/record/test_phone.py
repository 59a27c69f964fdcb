"""A phone is asked for its face until it sends."""

import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

from studio import clock
from studio.capture.snapshot import Snapshot
from studio.settings import NO_MICROPHONE
from studio.ui import tasks, theme
from studio.ui.record.inputs import EVERYWHERE, InputsCard
from studio.ui.record.inputs_presenter import InputsPresenter
from studio.ui.record.phone import PhoneLink
from studio.ui.session import Session
from studio.vmc.assemble import Sender
from studio.vmc.decode import HELLO, IFACIALMOCAP_PORT


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
    link = PhoneLink(port=phone.getsockname()[1])
    link.connect_to(" 127.0.0.1 ")
    assert phone.recv(100) == HELLO
    assert link.words == "Asking 127.0.0.1 to send… Open iFacialMocap there, in the same network."
    link._ask()
    assert phone.recv(100) == HELLO
    link.follow(face(clock.now()))
    assert link.words == "The phone sends its face."
    asked = link.asked
    link._ask()
    assert link.asked == asked
    link.follow(face(clock.now() - 10.0))
    link._ask()
    assert link.asked == asked + 1
    link.connect_to("")
    assert link.words == ""
    link._ask()
    assert link.asked == asked + 1


def test_what_is_no_address_is_a_sentence(qapp) -> None:
    link = PhoneLink()
    link.connect_to("my phone")
    assert link.problem == (
        "my phone is not the address of a phone.",
        "Type the four numbers at the top of iFacialMocap, for example 192.168.1.7.",
    )
    assert (link.address, link.asked, link.words) == ("", 0, "")


@pytest.fixture
def card(qtbot, qapp, tmp_path: Path) -> Iterator[InputsCard]:
    theme.apply(qapp)
    made = InputsCard()
    qtbot.addWidget(made)
    made.show()
    yield made
    tasks.wait()


def test_the_row_opens_the_network_and_remembers_the_phone(qtbot, card: InputsCard) -> None:
    session = Session()
    session.change_settings(audio_device=NO_MICROPHONE)
    inputs = InputsPresenter(card, session, card)
    assert not card.phone.isVisible()
    card.show_more_ports((IFACIALMOCAP_PORT,))
    assert card.phone.isVisible()
    card.phone.address.setText("127.0.0.1")
    card.phone.button.click()
    assert (session.settings.phone, session.settings.vmc_host) == ("127.0.0.1", EVERYWHERE)
    assert card.network.currentData() == EVERYWHERE
    inputs.show(Snapshot(ports=(39539, IFACIALMOCAP_PORT)))
    assert card.phone.words.text().startswith("Asking 127.0.0.1 to send…")
    assert card.phone.button.text() == "Disconnect"
    card.phone.button.click()
    assert (session.settings.phone, inputs.phone.address) == ("", "")
    card.phone.address.setText("nonsense")
    card.phone.button.click()
    inputs.show(Snapshot(ports=(39539, IFACIALMOCAP_PORT)))
    assert inputs.problems["phone"][0] == "nonsense is not the address of a phone."
    inputs.close()
