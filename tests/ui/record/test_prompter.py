"""The teleprompter: keys and pauses go on, and what was asked for is kept with a take of real packets."""

import socket
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QInputDialog

from studio.capture.snapshot import Snapshot
from studio.dataset import prompts
from studio.motion import Motion
from studio.motion.channels import BONES, VRM0_SHAPES
from studio.settings import NO_MICROPHONE
from studio.ui import tasks, theme
from studio.ui.record.model import RecordModel
from studio.ui.record.presenter import RecordPresenter
from studio.ui.record.prompter_presenter import PrompterPresenter
from studio.ui.record.prompter_view import PrompterCard
from studio.ui.record.view import RecordView
from studio.ui.session import Session
from studio.vmc.encode import encode_frame
from tests.ports import free_port

Tab = tuple[RecordView, RecordPresenter, Session]


@pytest.fixture
def tab(qtbot, qapp, tmp_path: Path) -> Iterator[Tab]:
    theme.apply(qapp)
    session = Session()
    session.change_settings(
        vmc_port=free_port(), audio_device=NO_MICROPHONE, countdown=0.0, pre_roll=0.0, prompt_language="en"
    )
    session.create_project(tmp_path / "Project")
    view = RecordView()
    qtbot.addWidget(view)
    presenter = RecordPresenter(view, session)
    view.resize(1280, 750)
    view.show()
    presenter.activate()
    model = presenter.model
    qtbot.waitUntil(lambda: model.recorder is not None and model.recorder.snapshot().port is not None)
    yield view, presenter, session
    presenter.close()
    tasks.wait()


@pytest.fixture
def sending(tab: Tab) -> Iterator[None]:
    port, over = tab[2].settings.vmc_port, threading.Event()
    motion = Motion.build([0.0, 1.0], VRM0_SHAPES, np.array([[0.25], [0.3]]).repeat(18, 1), BONES)

    def run() -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as channel:
            while not over.wait(1 / 60):
                for datagram in encode_frame(motion.pose(time.monotonic() % 1), VRM0_SHAPES, BONES, 0.0):
                    with suppress(OSError):
                        channel.sendto(datagram, ("127.0.0.1", port))

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    yield
    over.set()
    thread.join()


def test_keys_go_on_and_the_take_keeps_what_was_said_and_leaves_first_tries_out(
    tab: Tab, sending: None, qtbot
) -> None:
    view, presenter, session = tab
    model = presenter.model
    assert session.project is not None
    first = view.prompter.text.text()
    assert first in {one.text for one in prompts.prompts_of("en")}
    view.slate_bar.record.click()
    qtbot.waitUntil(lambda: session.rolling)
    qtbot.waitUntil(lambda: model.recorder.snapshot().elapsed > 0.3)
    view.activateWindow()
    qtbot.waitUntil(view.isActiveWindow)
    view.figure.setFocus()
    qtbot.keyClick(view.figure, Qt.Key.Key_PageUp)
    said = model.recorder.snapshot().elapsed
    qtbot.waitUntil(lambda: model.recorder.snapshot().elapsed > said + 0.3)
    qtbot.keyClick(view.figure, Qt.Key.Key_PageDown)
    second = view.prompter.text.text()
    assert second not in ("", first)
    qtbot.waitUntil(lambda: model.recorder.snapshot().elapsed > said + 0.8)
    presenter.toggle()
    qtbot.waitUntil(lambda: bool(session.project.dataset.selections))
    qtbot.waitUntil(lambda: bool(session.project.dataset.selections[0].labels))
    selection = session.project.dataset.selections[0]
    assert [(one.tier, one.text) for one in selection.labels] == [("prompt", first), ("prompt", second)]
    assert len(selection.excluded) == 1, "the first try"
    assert selection.excluded[0][1] == pytest.approx(selection.labels[0].t, abs=1e-3)
    assert view.prompter.text.text() not in (first, second)
    assert session.undo() == f"Prompts of {selection.id}"


def test_a_long_pause_brings_the_next_one_where_that_is_chosen(qapp, qtbot) -> None:
    theme.apply(qapp)
    session, card = Session(), PrompterCard()
    qtbot.addWidget(card)
    session.change_settings(prompt_pause=True, prompt_language="en")
    model = RecordModel(session)
    presenter = PrompterPresenter(card, model, session)
    session.set_rolling(True)
    first, t = card.text.text(), time.monotonic()
    loud = replace(Snapshot(), audio_alive=True, rms_dbfs=-20.0)
    quiet = replace(loud, rms_dbfs=-70.0)
    model.frame_due.emit(quiet)
    while time.monotonic() < t + 1.0:
        qtbot.wait(20)
        model.frame_due.emit(loud)
    assert card.text.text() == first

    def went_on() -> bool:
        model.frame_due.emit(quiet)
        return card.text.text() != first

    qtbot.waitUntil(went_on)
    assert time.monotonic() - t > prompts.PAUSE_S
    assert presenter.prompt == prompts.prompts_of("en")[1]
    session.set_rolling(False)
    model.close()


def test_it_can_be_hidden_and_speaks_other_languages_and_ones_own_text(tab: Tab, monkeypatch) -> None:
    view, _presenter, session = tab
    card = view.prompter
    card.toggle.click()
    assert not card.text.isVisible()
    assert not session.settings.prompter
    card.toggle.click()
    assert card.text.isVisible()
    card.language_chosen.emit("ja")
    assert card.text.text() in {one.text for one in prompts.prompts_of("ja")}
    monkeypatch.setattr(QInputDialog, "getMultiLineText", lambda *_: (" To be, or not to be? \n\nTwo.", True))
    card.own_text_requested.emit()
    assert session.settings.own_prompts == ("To be, or not to be?", "Two.")
    assert card.text.text() == "To be, or not to be?"
    card.next.click()
    assert card.text.text() == "Two."
    assert card.missing.text().startswith("Next: 2 min (a first look). Still missing: loud speech")


def test_the_practice_performer_is_seen_where_another_program_has_the_port(tab: Tab, qtbot) -> None:
    view, presenter, session = tab
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        taken = int(other.getsockname()[1])
        session.change_settings(vmc_port=taken)
        model = presenter.model
        assert model.recorder is not None
        qtbot.waitUntil(lambda: model.recorder.snapshot().port is None)
        model.set_practising(True)
        assert session.settings.vmc_port != taken
        assert "its own lines" in view.prompter.text.text()
        qtbot.waitUntil(lambda: model.recorder.snapshot().frames > 10)
        model.set_practising(False)
        assert view.prompter.text.text() in {one.text for one in prompts.prompts_of("en")}
