"""A preset changes the motion on screen and on the wire, and every target gets it."""

from __future__ import annotations

import socket
from dataclasses import replace
from typing import cast

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QLabel
from pytestqt.qtbot import QtBot
from pythonosc.osc_packet import OscPacket

from studio.errors import StudioError
from studio.motion import Motion
from studio.playback.layers import Tuning
from studio.ui.review.presenter import ReviewPresenter
from studio.ui.review.view import ReviewView
from studio.ui.widgets.send_panel import Address
from tests.patience import until

Tab = tuple[ReviewView, ReviewPresenter]


@pytest.fixture
def tab(qtbot: QtBot, tab: Tab) -> Tab:
    view, _ = tab
    qtbot.waitUntil(lambda: view.tune.presets.list.count() == 5)
    return tab


class Damaged:
    """In the place of a motion: it cannot be tuned."""

    @property
    def fps(self) -> float:
        raise StudioError("There is not enough memory.", "Close other programs.")


def test_sliders_live_on_after_a_tuning_that_failed(qtbot: QtBot, tab: Tab) -> None:
    view, presenter = tab
    model, right = presenter.model, presenter.model.captured
    qtbot.waitUntil(lambda: not presenter.tune.busy)
    model.captured = replace(right, motion=cast(Motion, Damaged()))
    view.tune.set_tuning(Tuning(smoothing=0.1))
    told = "There is not enough memory."
    qtbot.waitUntil(lambda: told in [one.text() for one in view.window().findChildren(QLabel, "toast_text")])
    model.captured = right
    before = model.tuned
    view.tune.set_tuning(Tuning(mouth=0.0))
    qtbot.waitUntil(lambda: model.tuned is not None and model.tuned is not before)
    assert model.tuned is not None
    assert model.tuned.shapes[:, model.tuned.shape_names.index("A")].max() == 0.0


def _choose(view: ReviewView, title: str) -> None:
    index = view.tune.presets.list.findText(title)
    view.tune.presets.list.setCurrentIndex(index)
    view.tune.presets.list.activated.emit(index)


def _channels(listener: socket.socket) -> set[str]:
    """Names of the shapes and bones in the next datagram."""
    messages = [timed.message for timed in OscPacket(listener.recv(65536)).messages]
    named = ("/VMC/Ext/Bone/Pos", "/VMC/Ext/Blend/Val")
    return {str(message.params[0]) for message in messages if message.address in named}


def test_a_preset_changes_what_is_seen_and_what_every_target_gets(
    qtbot: QtBot, tab: Tab, listeners: list[socket.socket]
) -> None:
    view, presenter = tab
    view.send.rows[0].port.setValue(listeners[0].getsockname()[1])
    second = view.send.add_target(Address("", "127.0.0.1", listeners[1].getsockname()[1]))
    for row in (view.send.rows[0], second):
        qtbot.mouseClick(row.send, Qt.MouseButton.LeftButton)
    for listener in listeners:
        until(lambda listener=listener: "Head" in _channels(listener))
    _choose(view, "Mouth only")
    qtbot.waitUntil(lambda: presenter.model.tuned is not None and not presenter.model.tuned.bone_names)
    assert presenter.model.tuned is not None
    assert presenter.model.tuned.shape_names == ("A",)
    for listener in listeners:  # what was under way still comes
        until(lambda listener=listener: _channels(listener) == {"A"})
    view.tune.undo_button.click()
    qtbot.waitUntil(lambda: presenter.model.tuned is not None and bool(presenter.model.tuned.bone_names))
    for listener in listeners:
        until(lambda listener=listener: "Head" in _channels(listener))


def test_playing_goes_on_while_it_is_tuned(qtbot: QtBot, tab: Tab) -> None:
    view, presenter = tab
    player, before = presenter.model.player, presenter.model.tuned
    assert player is not None
    view.loop.setChecked(True)
    qtbot.mouseClick(view.play, Qt.MouseButton.LeftButton)
    qtbot.waitUntil(lambda: player.playing and player.position > 0)
    for place in range(0, 40, 4):
        view.tune.rows["mouth"].slider.setValue(place)
    qtbot.waitUntil(lambda: presenter.model.tuned is not before)
    assert presenter.model.player is player
    assert player.playing
    wanted = view.tune.rows["mouth"].value
    original = presenter.model.captured.motion
    assert original is not None

    def newest() -> bool:
        tuned = presenter.model.tuned
        assert tuned is not None
        return np.allclose(tuned.shapes[:, 0], np.clip(original.shapes[:, 0] * wanted, 0, 1), atol=1e-5)

    qtbot.waitUntil(newest)
