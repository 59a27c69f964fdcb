"""Several targets: kept for the next time, switched together, each with a light of its own."""

from __future__ import annotations

import socket

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLabel
from pytestqt.qtbot import QtBot

from studio.motion import Motion
from studio.playback.player import Player
from studio.settings import Settings
from studio.ui.review.clip import Tuned
from studio.ui.review.model import ReviewModel
from studio.ui.review.send_presenter import SendPresenter
from studio.ui.session import Session
from studio.ui.widgets.send_panel import SendPanel, TargetRow
from studio.vmc.address import Address


def _made(
    qtbot: QtBot, settings: Settings, session: Session | None = None
) -> tuple[SendPanel, SendPresenter, Session]:
    motion = Motion.build(np.arange(60) / 60, ("A",), np.ones((60, 1)))
    panel, session = SendPanel(), session or Session(settings)
    qtbot.addWidget(panel)
    panel.resize(300, 500)
    model = ReviewModel(session)
    model.player = Player(None, 1.0, None)
    model.captured_tuned = Tuned(motion, None, {})
    sending = SendPresenter(panel, model, session)
    panel.show()
    return panel, sending, session


def _words(row: TargetRow) -> str:
    labels = row.findChildren(QLabel)
    return next(one.text() for one in labels if one.objectName().startswith("target_state"))


def test_targets_come_back_the_next_time(qtbot: QtBot) -> None:
    panel, sending, session = _made(qtbot, Settings())
    panel.rows[0].preset.setCurrentText("VNyan")
    qtbot.mouseClick(panel.add, Qt.MouseButton.LeftButton)
    panel.rows[1].host.setText("192.168.0.7")
    panel.rows[1].host.editingFinished.emit()
    assert session.settings.send_targets == ("VNyan=127.0.0.1:39539", "Other program=192.168.0.7:39539")
    again, _, _ = _made(qtbot, session.settings)
    assert [row.address for row in again.rows] == [row.address for row in panel.rows]
    again.rows[0].remove.click()
    assert [row.address.host for row in again.rows] == ["192.168.0.7"]
    sending.close()


def test_a_host_half_written_is_not_kept_and_harms_nothing(qtbot: QtBot) -> None:
    panel, sending, session = _made(qtbot, Settings(send_targets=("VNyan=127.0.0.1:39539",)))
    panel.rows[0].host.setText("192.168 0.7")
    panel.rows[0].host.editingFinished.emit()
    assert session.settings.send_targets == ("VNyan=127.0.0.1:39539",)
    assert panel.rows[0].host.text() == "127.0.0.1", "what is in use is shown"
    panel.rows[0].host.setText("192.168.0.7")
    panel.rows[0].host.editingFinished.emit()
    assert session.settings.send_targets == ("VNyan=192.168.0.7:39539",)
    sending.close()


@pytest.mark.parametrize("text", ["", "x", "a=b c:1", "a=b", "a=:1", "a=b:0", "a=b:70000", "a=b:１"])
def test_a_kept_target_that_makes_no_sense_is_left_out(qtbot: QtBot, text: str) -> None:
    assert Address.parse(text) is None
    panel, _, _ = _made(qtbot, Settings(send_targets=(text,)))
    assert [row.address.port for row in panel.rows] == [39540]


def test_a_name_with_signs_in_it_survives() -> None:
    address = Address("私の=:program", "::1", 39539)
    assert Address.parse(address.text) == address
    assert address.where == "[::1]:39539"
    assert Address.parse("::1:39539") == Address.parse("[::1]:39539") == Address("", "::1", 39539)


def test_all_targets_are_switched_together_and_each_gets_the_motion(
    qtbot: QtBot, listeners: list[socket.socket]
) -> None:
    ports = [listener.getsockname()[1] for listener in listeners]
    kept = tuple(f"VNyan=127.0.0.1:{port}" for port in ports)
    panel, sending, _ = _made(qtbot, Settings(send_targets=kept))
    assert panel.all.text() == "Send to all"
    qtbot.mouseClick(panel.all, Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: all(_words(row).startswith("sending") for row in panel.rows))
    for listener in listeners:
        assert b"/VMC/Ext/Blend/Val" in listener.recv(65536)
    assert panel.all.text() == "Stop all"
    qtbot.mouseClick(panel.rows[0].send, Qt.MouseButton.LeftButton)
    assert panel.all.text() == "Send to all"
    panel.rows[0].send.click()
    qtbot.mouseClick(panel.all, Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: not sending.sending)
    sending.close()


def test_one_target_that_nobody_hears_leaves_the_other_alone(
    qtbot: QtBot, listeners: list[socket.socket]
) -> None:
    heard, gone = (listener.getsockname()[1] for listener in listeners)
    listeners[1].close()
    kept = (f"VNyan=127.0.0.1:{heard}", f"Warudo=127.0.0.1:{gone}")
    panel, sending, _ = _made(qtbot, Settings(send_targets=kept))
    panel.all.click()
    said = f"Nothing is receiving on 127.0.0.1 port {gone}. Start the avatar program"
    qtbot.waitUntil(lambda: _words(panel.rows[1]).startswith(said))
    qtbot.waitUntil(lambda: _words(panel.rows[0]).startswith("sending"))
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as back:
        back.bind(("127.0.0.1", gone))
        qtbot.waitUntil(lambda: _words(panel.rows[1]).startswith("sending"))
    sending.close()


def test_what_was_asked_last_of_a_target_holds(qtbot: QtBot, listeners: list[socket.socket]) -> None:
    panel, sending, _ = _made(qtbot, Settings(send_targets=(f"127.0.0.1:{listeners[0].getsockname()[1]}",)))
    row = panel.rows[0]
    for _ in range(7):
        row.send.click()
    assert row.send.isChecked()
    qtbot.waitUntil(lambda: _words(row).startswith("sending"))
    for _ in range(5):
        row.send.click()
    pool, target = sending.targets[row].pool, sending.targets[row].target
    assert pool.waitForDone(60_000)
    qtbot.waitUntil(lambda: not target.running)
    row.send.click()
    panel.add_target(Address("", "127.0.0.1", 2))
    row.remove.click()
    assert pool.waitForDone(60_000)
    qtbot.waitUntil(lambda: not target.running)
    sending.close()


def test_a_window_that_closes_waits_for_a_target_that_was_removed(
    qtbot: QtBot, listeners: list[socket.socket]
) -> None:
    kept = tuple(f"VNyan=127.0.0.1:{listener.getsockname()[1]}" for listener in listeners)
    panel, sending, _ = _made(qtbot, Settings(send_targets=kept))
    row = panel.rows[0]
    target = sending.targets[row].target
    row.send.click()
    qtbot.waitUntil(lambda: target.state.sent > 0)
    row.remove.click()
    sending.close()
    assert not target.running, "its avatar has come to rest"


def test_the_same_target_twice_is_told(qtbot: QtBot) -> None:
    panel, sending, _ = _made(qtbot, Settings(send_targets=("VNyan=127.0.0.1:1", "Warudo=127.0.0.1:1")))
    assert _words(panel.rows[1]).startswith("127.0.0.1 port 1 is in the list twice. Remove one")
    assert not _words(panel.rows[0]).startswith("127.0.0.1 port 1 is")
    panel.rows[1].port.setValue(2)
    assert "twice" not in _words(panel.rows[1])
    sending.close()


def test_a_single_target_has_no_button_for_all(qtbot: QtBot) -> None:
    panel, sending, _ = _made(qtbot, Settings())
    assert panel.all.isHidden()
    assert panel.rows[0].remove.isHidden()
    sending.close()


def test_review_and_live_share_one_list_of_targets(qtbot: QtBot, listeners: list[socket.socket]) -> None:
    port = listeners[0].getsockname()[1]
    panel, sending, session = _made(qtbot, Settings(send_targets=(f"VNyan=127.0.0.1:{port}",)))
    other, elsewhere, _ = _made(qtbot, session.settings, session)
    panel.rows[0].send.click()
    qtbot.mouseClick(other.add, Qt.MouseButton.LeftButton)
    assert [row.address for row in panel.rows] == [row.address for row in other.rows]
    other.rows[1].port.setValue(39600)
    assert panel.rows[1].address.port == 39600
    other.names.setCurrentIndex(other.names.findData("arkit"))
    assert panel.names.currentData() == "arkit"
    other.rows[1].remove.click()
    other.rows[0].host.editingFinished.emit()
    # Who is sent to already goes on.
    assert [row.send.isChecked() for row in panel.rows] == [True]
    qtbot.waitUntil(lambda: _words(panel.rows[0]).startswith("sending"))
    session.change_settings(send_targets=("Warudo=127.0.0.1:39541", "127.0.0.1:39540"), send_fps=45.0)
    assert [row.address.text for row in panel.rows] == ["Warudo=127.0.0.1:39541", "VSeeFace=127.0.0.1:39540"]
    assert panel.fps.currentText() == "45 frames/s"
    assert [row.send.isChecked() for row in panel.rows] == [False, False]
    sending.close()
    elsewhere.close()
