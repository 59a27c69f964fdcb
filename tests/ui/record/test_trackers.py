"""The tracker cards: real packets light the right card, and the tracker that is heard is used."""

import contextlib
import json
import os
import socket

import psutil
import pytest
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QLabel, QToolButton

from studio.capture import trackers
from studio.capture.trackers import EVERYWHERE, LOOPBACK, TRACKERS, tracker_of
from studio.motion import Motion
from studio.motion.channels import BONES
from studio.ui import theme
from studio.ui.record.tracker_pictures import PhoneCode, StepPicture
from studio.vmc.decode import IFACIALMOCAP_PORT
from studio.vmc.encode import encode_frame
from studio.vmc.stream import Sender
from studio.vmc.vtube_studio import PHONE_PORT, VTUBE_STUDIO_PORT
from tests.ports import free_port
from tests.vmc.test_vtube_studio import packet

FACE = b"jawOpen-40|eyeBlink_L-10|=head#0,0,0,0,0,0|"


def test_what_is_heard_on_any_known_port_lights_its_card_and_is_used(tab, qtbot) -> None:
    view, presenter, session = tab
    before = session.settings.vmc_port
    view.figure.empty_button.click()
    page, model = view.trackers, presenter.model
    assert page.isVisible()
    qtbot.waitUntil(lambda: len(model.recorder.snapshot().ports) > 1)
    open_ports = model.recorder.snapshot().ports
    assert before in open_ports, "what was listened on goes on"
    if IFACIALMOCAP_PORT not in open_ports:
        pytest.skip("another program of this computer holds iFacialMocap's port")
    assert not page.use.isEnabled()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as phone:

        def heard() -> bool:
            phone.sendto(FACE, ("127.0.0.1", IFACIALMOCAP_PORT))
            return page.use.isEnabled()

        qtbot.waitUntil(heard)
        assert page.heard.text() == f"I hear it on port {IFACIALMOCAP_PORT}: 1 bone, 2 shapes."
        lit = [
            one.id for one in TRACKERS if page.findChild(QToolButton, f"tracker_{one.id}").property("heard")
        ]
        assert lit == ["ifacialmocap"], "found by itself"
        page.use.click()
    assert session.settings.more_ports == (str(IFACIALMOCAP_PORT),)
    assert session.settings.vmc_port == before
    qtbot.waitUntil(lambda: set(model.recorder.snapshot().ports) == {before, IFACIALMOCAP_PORT})
    assert not page.isVisible()


def test_a_vmc_program_on_the_port_in_use_is_heard_and_closing_listens_as_before(tab, qtbot) -> None:
    view, presenter, session = tab
    port = session.settings.vmc_port
    view.inputs.trackers.click()
    page = view.trackers
    page.chosen.emit("warudo")
    pose = Motion.build([0.0], ("Joy",), [[0.5]], BONES).pose(0.0)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as program:

        def heard() -> bool:
            for datagram in encode_frame(pose, ("Joy",), BONES, 0.0):
                program.sendto(datagram, ("127.0.0.1", port))
            return page.use.isEnabled()

        qtbot.waitUntil(heard)
    assert page.heard.text() == f"I hear it on port {port}: 54 bones, 1 shape."
    assert page.address.text() == f"127.0.0.1  port {port}", "where it will be listened to afterwards"
    page.reject()
    qtbot.waitUntil(lambda: presenter.model.recorder.snapshot().ports == (port,))
    assert session.settings.vmc_port == port


def test_vtube_studio_is_asked_from_its_card_and_heard(tab, qtbot) -> None:
    view, presenter, session = tab
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as phone:
        try:
            phone.bind(("127.0.0.1", PHONE_PORT))
        except OSError:
            pytest.skip("another program of this computer holds VTube Studio's port")
        phone.setblocking(False)
        view.inputs.trackers.click()
        page, model = view.trackers, presenter.model
        qtbot.waitUntil(lambda: len(model.recorder.snapshot().ports) > 1)
        if VTUBE_STUDIO_PORT not in model.recorder.snapshot().ports:
            pytest.skip("another program of this computer holds the port it sends to")
        page.chosen.emit("openseeface")
        assert not page.phone.isVisible()
        page.chosen.emit("vtube_studio")
        assert page.phone.isVisible()
        assert not page.code.isVisible()
        assert not page.address.isVisible()
        page.phone.address.setText("127.0.0.1")
        page.phone.button.click()
        qtbot.waitUntil(lambda: page.heard.text() == "Waiting for the phone…")
        asked: list[bytes] = []

        def is_asked() -> bool:
            with contextlib.suppress(BlockingIOError):
                asked.append(phone.recv(1000))
            return bool(asked)

        qtbot.waitUntil(is_asked)
        told = "Asking 127.0.0.1 to send… Open VTube Studio there, in the same network."
        qtbot.waitUntil(lambda: page.phone.words.text() == told)
        (port,) = json.loads(asked[0])["ports"]

        def heard() -> bool:
            phone.sendto(packet(JawOpen=0.4), ("127.0.0.1", port))
            return page.use.isEnabled()

        qtbot.waitUntil(heard)
        assert page.heard.text() == f"I hear it on port {VTUBE_STUDIO_PORT}: 1 bone, 52 shapes."
        page.use.click()
    assert session.settings.more_ports == (str(VTUBE_STUDIO_PORT),)
    assert session.settings.phone == "127.0.0.1"
    assert view.inputs.phone.isVisible(), "where it can be disconnected"


def test_a_phone_that_is_only_tried_changes_nothing(tab, qtbot) -> None:
    view, presenter, session = tab
    before = session.settings
    view.inputs.trackers.click()
    page, model = view.trackers, presenter.model
    page.chosen.emit("vtube_studio")
    note = page.findChild(QLabel, "tracker_note")
    assert "My network" in note.text(), "what it takes is said before it is done"
    qtbot.waitUntil(lambda: len(model.recorder.snapshot().ports) > 1)
    assert not page.phone.button.isEnabled(), "there is nothing to connect to"
    page.phone.address.setText("my phone")
    page.phone.button.click()
    qtbot.waitUntil(lambda: page.phone.words.text().startswith("my phone is not the address of a phone."))
    assert page.phone.words.isVisible()
    page.phone.address.setText("127.0.0.9")
    page.phone.button.click()
    qtbot.waitUntil(lambda: page.phone.button.text() == "Disconnect")
    page.phone.address.clear()
    assert page.phone.button.text() == "Disconnect", "an empty line leaves a way to stop"
    page.phone.address.setText("127.0.0.9")
    page.reject()
    assert session.settings == before
    assert presenter.inputs.phone.address == ""
    assert view.inputs.network.currentData() == LOOPBACK
    session.change_settings(vmc_host=EVERYWHERE)
    view.inputs.trackers.click()
    assert page.phone.address.text() == ""
    assert not note.isVisible(), "nothing stands in its way"


def test_the_practice_performer_is_no_tracker(tab, qtbot) -> None:
    view, presenter, session = tab
    model, port = presenter.model, session.settings.vmc_port
    model.practice.set_on(True, free_port(), "none")
    view.inputs.trackers.click()
    page = view.trackers
    pose = Motion.build([0.0], ("Joy",), [[0.5]], BONES).pose(0.0)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as program:

        def heard() -> str:
            for datagram in encode_frame(pose, ("Joy",), BONES, 0.0):
                program.sendto(datagram, ("127.0.0.1", port))
            return page.heard.text()

        said = "This is the practice performer. Listening for a tracker…"
        qtbot.waitUntil(lambda: heard() == said)
        tiles = [page.findChild(QToolButton, f"tracker_{one.id}") for one in TRACKERS]
        assert not any(tile.property("heard") for tile in tiles)
        assert not page.use.isEnabled()
        model.practice.set_on(False)
        qtbot.waitUntil(lambda: heard() and page.use.isEnabled())


def test_a_take_keeps_its_motion_when_the_page_closes_in_its_midst(tab, qtbot) -> None:
    view, presenter, session = tab
    model, port = presenter.model, session.settings.vmc_port
    session.change_settings(countdown=3.0)
    model.toggle()
    model.trackers_requested.emit()
    assert not view.trackers.isVisible(), "not in a countdown: its ports would be in the take"
    model.toggle()
    session.change_settings(countdown=0.0)
    view.inputs.trackers.click()
    qtbot.waitUntil(lambda: len(model.recorder.snapshot().ports) > 1)
    model.toggle()
    qtbot.waitUntil(lambda: session.rolling)
    view.trackers.reject()
    done: list[object] = []
    model.in_order(lambda: None, done.append)
    qtbot.waitUntil(lambda: bool(done))
    assert port in model.recorder.snapshot().ports
    model.toggle()
    qtbot.waitUntil(lambda: model.recorder.snapshot().ports == (port,))


def test_a_program_is_known_by_its_process() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as mine:
        mine.bind(("127.0.0.1", 0))
        sender = Sender(f"127.0.0.1:{mine.getsockname()[1]}", 39539, "VMC", ("Hips",))
        assert trackers.program_of(sender) == psutil.Process(os.getpid()).name()
    assert trackers.program_of(Sender("192.168.0.9:5", 39539, "VMC")) == ""
    assert tracker_of(sender, "VSeeFace.exe").id == "vseeface"
    assert tracker_of(sender, "python").id == "other"
    assert tracker_of(Sender("192.168.0.9:5", 11111, "Live Link Face")).id == "live_link"


@pytest.mark.parametrize("name", ["dark", "light"])
def test_every_step_is_drawn_in_both_themes(qtbot, qapp, name: str) -> None:
    theme.apply(qapp, name)
    picture = StepPicture()
    qtbot.addWidget(picture)
    picture.resize(190, 112)
    seen = set()
    for kind in sorted({step.picture for tracker in TRACKERS for step in tracker.steps}):
        picture.show_step(kind, "192.168.1.20", 11111)
        image = picture.grab().toImage().convertToFormat(QImage.Format.Format_RGB32)
        seen.add(bytes(image.constBits()))
    assert len(seen) == 8, "eight different pictures"


def test_a_phone_reads_the_address(qtbot) -> None:
    """The finder patterns stand in three corners, and the modules are those of a reader's own encoder."""
    import segno

    code = PhoneCode()
    qtbot.addWidget(code)
    code.show_text("192.168.1.20")
    image = code.grab().toImage()
    rows = [list(row) for row in segno.make_qr("192.168.1.20", error="m").matrix]
    side = image.width() // (len(rows) + 6)
    left = (image.width() - side * (len(rows) + 6)) // 2 + 3 * side
    middle = side // 2
    drawn = [
        [
            int(image.pixelColor(left + x * side + middle, left + y * side + middle).value() < 128)
            for x in range(len(rows))
        ]
        for y in range(len(rows))
    ]
    assert drawn == rows
    assert drawn[0][:7] == drawn[0][-7:] == drawn[-1][:7] == [1] * 7
