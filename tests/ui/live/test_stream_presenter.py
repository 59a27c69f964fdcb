"""Live pressed from another program: real requests to the tab, and what the child is told."""

from __future__ import annotations

import socket
import urllib.request
from collections.abc import Callable
from urllib.error import HTTPError

import pytest
from pytestqt.qtbot import QtBot

from studio.ipc.commands import Command
from studio.project import Project
from tests.inference.live.runs import add_run
from tests.ports import free_port
from tests.ui.live.children import FakeChild, Room, ready, state


def press(name: str, port: int) -> int:
    """The status of the answer; asked with the window's thread at rest, for the server has its own."""
    try:
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/saia/live/{name}", timeout=5) as answer:
            return int(answer.status)
    except HTTPError as refused:
        return refused.code


def test_a_remote_goes_live_turns_switches_and_ends_it(
    room: Callable[..., Room], toy_project: Project, child: FakeChild, qtbot: QtBot
) -> None:
    add_run(toy_project)
    port = free_port(socket.SOCK_STREAM)
    view, presenter, session = room(toy_project, child, remote_port=port)
    assert presenter.remote.port == 0  # nothing listens before it is switched on
    assert "in front" in view.stream.words.text()
    view.stream.remote.click()
    assert session.settings.remote
    assert f"http://127.0.0.1:{port}/saia/live/mute" in view.stream.remote.toolTip()
    assert press("mute", port) == 409
    assert press("start", port) == 200
    qtbot.waitUntil(lambda: len(child.started) == 1)
    child.told.emit(ready(("A",), ()))
    child.told.emit(state(muted=True))
    for name, command in (
        ("mute", Command("mute", "off")), ("freeze/on", Command("freeze", "on")),
        ("mood/0", Command("mood")),
    ):  # fmt: skip
        child.commands.clear()
        assert press(name, port) == 200
        qtbot.waitUntil(lambda command=command: child.commands == [command])
    assert press("stop", port) == 200
    qtbot.waitUntil(lambda: presenter.model.task.phase == "stopping")
    child.end()
    view.stream.remote.click()
    with pytest.raises(OSError, match="refused"):
        press("mute", port)


def test_a_port_in_use_is_said_where_the_addresses_would_be(
    room: Callable[..., Room], toy_project: Project
) -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        view, presenter, _ = room(toy_project, remote=True, remote_port=port)
        assert presenter.remote.port == 0
        assert view.stream.words.text() == (
            f"Port {port} is in use by another program. Choose another Remote port in Settings."
        )
        assert not view.stream.addresses.isVisible()
