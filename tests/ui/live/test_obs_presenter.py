"""OBS beside Live: a real websocket server gets the Sync Offset, and its stream starts the performance."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest
from pytestqt.qtbot import QtBot

from studio.project import Project
from studio.ui.live.obs_view import ObsDialog
from tests.inference.live.runs import add_run
from tests.remote.obs_server import ObsServer
from tests.ui.live.children import FakeChild, Room, ready, state


@pytest.fixture
def obs() -> Iterator[ObsServer]:
    server = ObsServer("secret", {"Desktop Audio": 0, "Mic/Aux": 35, "Image": None})
    yield server
    server.stop()


@pytest.fixture
def connected(
    room: Callable[..., Room], toy_project: Project, child: FakeChild, obs: ObsServer, qtbot: QtBot
) -> Room:
    """The tab with OBS connected by the dialog, a wrong password first."""
    add_run(toy_project)
    built = room(toy_project, child, obs_address=f"127.0.0.1:{obs.port}", obs_start=True)
    panel = built[0].stream.obs
    panel.button.click()
    dialog = built[0].window().findChild(ObsDialog)
    assert dialog is not None
    dialog.go.click()
    qtbot.waitUntil(lambda: "does not accept this password" in dialog.problem.text())
    dialog.password.setText("secret")
    dialog.go.click()
    qtbot.waitUntil(lambda: panel.button.text() == "Disconnect OBS")
    return built


def test_the_offset_is_set_once_settled_verified_and_set_again_when_more_than_20_ms_are_left(
    connected: Room, obs: ObsServer, child: FakeChild, qtbot: QtBot
) -> None:
    view, _, session = connected
    panel = view.stream.obs
    assert [panel.sounds.itemText(i) for i in range(panel.sounds.count())] == ["Desktop Audio", "Mic/Aux"]
    assert panel.sounds.currentText() == "Mic/Aux"
    view.source.start.click()
    child.told.emit(ready(("A",), ()))
    child.told.emit(state(latency_ms=225.0, settled=False))
    assert panel.words.text() == "Settling…"

    def told(latency_ms: float) -> str:
        child.told.emit(state(latency_ms=latency_ms))
        return panel.words.text()

    qtbot.waitUntil(lambda: told(155.2) == "Verified: OBS delays Mic/Aux by 155 ms; 0 ms are left.")
    assert obs.offsets == {"Desktop Audio": 0, "Mic/Aux": 155, "Image": None}
    assert told(170.0) == "Verified: OBS delays Mic/Aux by 155 ms; 15 ms are left."
    qtbot.waitUntil(lambda: told(190.0) == "Verified: OBS delays Mic/Aux by 190 ms; 0 ms are left.")
    assert obs.offsets["Mic/Aux"] == 190
    session.change_settings(live_voice="CABLE Input")
    assert told(300.0) == "Your delayed voice already matches the lips; no Sync Offset needed."
    assert obs.offsets["Mic/Aux"] == 190


def test_live_starts_with_the_stream_and_obs_that_quits_is_said(
    connected: Room, obs: ObsServer, child: FakeChild, qtbot: QtBot
) -> None:
    view, _, _ = connected
    obs.tell_stream("OBS_WEBSOCKET_OUTPUT_STARTING")
    obs.tell_stream("OBS_WEBSOCKET_OUTPUT_STARTED")
    qtbot.waitUntil(lambda: len(child.started) == 1)
    obs.hang_up()
    qtbot.waitUntil(lambda: view.stream.obs.words.text() == "OBS closed the connection.")
    assert view.stream.obs.button.text() == "Connect OBS…"
    assert child.running  # the performance goes on without it
