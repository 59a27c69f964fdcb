"""Sending to the port that Record itself listens on is told of, in the window that people use."""

from __future__ import annotations

import socket
from collections.abc import Iterator

import pytest
from PySide6.QtWidgets import QLabel
from pytestqt.qtbot import QtBot

from studio import settings
from studio.project import Project
from studio.ui import app as application
from studio.ui import tasks
from studio.ui.main_window import MainWindow
from studio.ui.widgets.send_panel import TargetRow


def _free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


@pytest.fixture
def window(qtbot: QtBot, toy_project: Project) -> Iterator[MainWindow]:
    folder = toy_project.folder
    toy_project.close()
    settings.save(settings.load().changed(vmc_port=_free_port()))
    _, window = application.build([str(folder)])
    qtbot.addWidget(window)
    window.show()
    yield window
    window.close()
    tasks.wait()


def _row(window: MainWindow) -> TargetRow:
    found = window.findChild(TargetRow, "target_0")
    assert found is not None
    return found


def _light(row: TargetRow) -> str:
    return next(token for one in row.findChildren(QLabel) if (token := one.property("token")))


def _words(window: MainWindow) -> str:
    found = window.findChild(QLabel, "target_state")
    assert found is not None
    return found.text()


def test_a_target_that_is_the_studio_itself_is_amber_and_says_so(qtbot: QtBot, window: MainWindow) -> None:
    heard = window.session.settings.vmc_port
    window.show_room("review")
    row = _row(window)
    row.port.setValue(heard)
    said = f"Port {heard} is where this studio itself listens. Choose another port in Record"
    qtbot.waitUntil(lambda: _words(window).startswith(said))
    assert _light(row) == "warn"
    sending = window.room("review")[1].send  # type: ignore[attr-defined]
    row.send.click()
    qtbot.waitUntil(lambda: sending.targets[row].shown > 0)
    assert _words(window).startswith(said), "not green while it sends"
    assert _light(row) == "warn"
    row.port.setValue(heard - 1)
    qtbot.waitUntil(lambda: not _words(window).startswith("Port"))
    row.send.click()
    assert sending.targets[row].pool.waitForDone(60_000), "the start at the other port may still be under way"
    qtbot.waitUntil(lambda: not sending.sending)
    row.port.setValue(heard)
    qtbot.waitUntil(lambda: _words(window).startswith(said))
    row.host.setText("192.0.2.1")
    row.host.editingFinished.emit()
    assert not _words(window).startswith("Port"), "another computer's port is its own"
