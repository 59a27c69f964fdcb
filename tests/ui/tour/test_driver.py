"""The tour's hands and eyes must fail loudly: a tour that can't fail shows nothing."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtWidgets import QComboBox, QListWidget, QPushButton, QSpinBox, QVBoxLayout, QWidget
from pytestqt.qtbot import QtBot

from studio.errors import StudioError
from studio.motion import Motion
from studio.motion.channels import BONES, VRM0_SHAPES
from studio.ui.tour.driver import Driver, Listener
from studio.vmc.encode import encode_frame


@pytest.fixture
def window(qtbot: QtBot) -> QWidget:
    window = QWidget()
    layout = QVBoxLayout(window)
    for control, name in (
        (QPushButton("Go"), "go"),
        (QSpinBox(), "port"),
        (QComboBox(), "target"),
        (QListWidget(), "takes"),
    ):
        control.setObjectName(name)
        layout.addWidget(control)
    window.findChild(QSpinBox, "port").setRange(0, 65535)
    window.findChild(QComboBox, "target").addItems(["VSeeFace", "Warudo"])
    window.findChild(QListWidget, "takes").addItems(["Hello_001", "Hello_002"])
    qtbot.addWidget(window)
    with qtbot.waitExposed(window):
        window.show()
    return window


@pytest.fixture
def driver(window: QWidget, tmp_path: Path) -> Driver:
    return Driver(window, tmp_path)


def test_a_control_that_is_not_there_is_a_failure(driver: Driver) -> None:
    with pytest.raises(StudioError) as caught:
        driver.find("no_such_button", QPushButton)
    assert caught.value.what == "The window has no QPushButton named no_such_button."


def test_a_click_presses_the_button(driver: Driver, window: QWidget) -> None:
    pressed: list[bool] = []
    window.findChild(QPushButton, "go").clicked.connect(lambda: pressed.append(True))
    driver.click("go")
    assert len(pressed) == 1


@pytest.mark.parametrize("state", ["setDisabled", "setHidden"])
def test_a_button_that_can_not_be_pressed_is_a_failure(driver: Driver, window: QWidget, state: str) -> None:
    getattr(window.findChild(QPushButton, "go"), state)(True)
    with pytest.raises(StudioError) as caught:
        driver.click("go", seconds=0.1)
    assert caught.value.what == "After 0 s it was still not so that the button go was ready."


def test_typing_replaces_a_number(driver: Driver, window: QWidget) -> None:
    driver.type_into("port", "39540")
    assert window.findChild(QSpinBox, "port").value() == 39540


def test_choosing_an_entry_says_so_like_the_mouse(driver: Driver, window: QWidget) -> None:
    box = window.findChild(QComboBox, "target")
    chosen: list[int] = []
    box.activated.connect(chosen.append)
    driver.choose("target", "Warudo")
    assert box.currentText() == "Warudo"
    assert chosen == [1]


def test_a_row_is_chosen_by_its_text(driver: Driver, window: QWidget) -> None:
    driver.choose_row("takes", "Hello_002")
    assert window.findChild(QListWidget, "takes").currentRow() == 1


def test_a_hope_that_does_not_come_true_is_a_sentence(driver: Driver) -> None:
    with pytest.raises(StudioError) as caught:
        driver.wait(lambda: False, 0.05, "a take was saved")
    assert caught.value.what == "After 0 s it was still not so that a take was saved."


def test_an_empty_picture_is_a_failure(qtbot: QtBot, tmp_path: Path) -> None:
    bare = QWidget()
    qtbot.addWidget(bare)
    bare.show()
    with pytest.raises(StudioError) as caught:
        Driver(bare, tmp_path).picture("bare")
    assert caught.value.what == "The picture bare_1280x800.png is empty."


@pytest.fixture
def listener() -> Iterator[Listener]:
    listener = Listener()
    yield listener
    listener.close()


def test_nothing_sent_is_nothing_heard(listener: Listener) -> None:
    listener.read()
    assert (listener.packets, listener.frames, listener.moving) == (0, 0, set())


def test_frames_are_counted_and_moving_shapes_named(listener: Listener) -> None:
    shapes = np.zeros((10, len(VRM0_SHAPES)))
    shapes[:, VRM0_SHAPES.index("A")] = np.linspace(0, 1, 10)
    motion = Motion.build(np.arange(10) / 60, VRM0_SHAPES, shapes, BONES)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for t in motion.times:
            for datagram in encode_frame(motion.pose(t), VRM0_SHAPES, BONES, float(t)):
                sender.sendto(datagram, ("127.0.0.1", listener.port))
    for _ in range(100):
        listener.read()
        if listener.frames >= 9:
            break
    assert listener.frames >= 9
    assert listener.moving == {"A"}


def test_noise_is_no_frame(listener: Listener) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.sendto(b"\xff\x00noise", ("127.0.0.1", listener.port))
    for _ in range(1000):
        listener.read()
        if listener.packets:
            break
    assert (listener.packets, listener.frames) == (1, 0)
