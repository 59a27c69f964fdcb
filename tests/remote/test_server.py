"""Live's actions from outside: real HTTP and real datagrams, and what a page in a browser would send."""

from __future__ import annotations

import http.client
import json
import socket
from collections.abc import Iterator
from queue import Queue

import pytest
from pythonosc.udp_client import SimpleUDPClient

from studio import actions
from studio.errors import StudioError
from studio.remote.server import ACTIONS, RemoteRequest, RemoteServer, RemoteState, url_of

Listening = tuple[RemoteServer, "Queue[RemoteRequest]"]


@pytest.fixture
def listening() -> Iterator[Listening]:
    """A server on a free port while Live is on, and what was pressed."""
    pressed: Queue[RemoteRequest] = Queue()
    server = RemoteServer(pressed.put)
    server.start(0)
    server.state = RemoteState(live=True, muted=True, latency_ms=141.0)
    yield server, pressed
    server.stop()


def ask(
    server: RemoteServer, path: str, method: str = "GET", **headers: str
) -> tuple[int, dict[str, object]]:
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=5)
    given = {name.replace("_", "-"): value for name, value in headers.items()}
    connection.request(method, path, headers=given)
    answer = connection.getresponse()
    content = json.loads(answer.read())
    connection.close()
    return answer.status, content


def test_every_address_is_an_action_and_is_pressed(listening: Listening) -> None:
    server, pressed = listening
    for name, action in ACTIONS.items():
        assert action in actions.ACTIONS
        assert ask(server, f"/saia/live/{name}")[0] == 200
        assert pressed.get(timeout=5) == RemoteRequest(action)
    assert ask(server, "/saia/live/freeze/on", "POST")[0] == 200
    assert pressed.get(timeout=5) == RemoteRequest("freeze", True)
    assert url_of("mood/2", server.port) == f"http://127.0.0.1:{server.port}/saia/live/mood/2"


def test_the_state_is_told_and_what_cannot_be_is_refused(listening: Listening) -> None:
    server, pressed = listening
    status, state = ask(server, "/saia/live")
    assert (status, state["live"], state["muted"], state["latency_ms"]) == (200, True, True, 141.0)
    assert ask(server, "/saia/live/dance")[0] == 404
    assert ask(server, "/saia/live/start/on")[0] == 404
    assert ask(server, "/")[0] == 404
    server.state = RemoteState()
    assert ask(server, "/saia/live/mute") == (409, {"error": "Live is off."})
    assert ask(server, "/saia/live/start")[0] == 200
    assert pressed.get(timeout=5) == RemoteRequest("start_live")
    assert pressed.empty()


@pytest.mark.parametrize(
    "headers",
    [
        {"Origin": "https://evil.example"},
        {"Origin": "null"},
        {"Referer": "https://evil.example/page"},
        {"Sec_Fetch_Site": "cross-site"},
        {"Sec_Fetch_Site": "none", "Sec_Purpose": "prefetch"},
        {"Host": "evil.example"},  # a name that was made to lead here
        {"Host": "127.0.0.1"},
    ],
)
def test_a_page_in_a_browser_presses_nothing(listening: Listening, headers: dict[str, str]) -> None:
    server, pressed = listening
    for path in ("/saia/live/neutral", "/saia/live"):
        for method in ("GET", "POST"):
            assert ask(server, path, method, **headers)[0] == 403
    assert pressed.empty()


def test_osc_presses_and_says_on_or_off(listening: Listening) -> None:
    server, pressed = listening
    client = SimpleUDPClient("127.0.0.1", server.port)
    for path, value in (
        ("/saia/live/mute", []), ("/saia/live/mute", 1), ("/saia/live/mute", 0.0),
        ("/VMC/Ext/OK", 1), ("/saia/live/dance", 1),
        ("/saia/live/mood/3", 1), ("/saia/live/mood/3", 0),  # a button goes down and comes up
        ("/saia/live/keep", []),
    ):  # fmt: skip
        client.send_message(path, value)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.sendto(b"\xff/saia/live/mute", ("127.0.0.1", server.port))
    client.send_message("/saia/live/stop", [])
    got = [pressed.get(timeout=5) for _ in range(6)]
    assert got == [
        RemoteRequest("mute"), RemoteRequest("mute", True), RemoteRequest("mute", False),
        RemoteRequest("mood_3"), RemoteRequest("keep_live"), RemoteRequest("stop_live"),
    ]  # fmt: skip
    client._sock.close()


def test_it_listens_on_this_computer_alone_and_a_port_in_use_is_said(listening: Listening) -> None:
    server, _ = listening
    assert server._http is not None
    assert server._http.server_address[0] == "127.0.0.1"
    with pytest.raises(StudioError, match="is in use by another program"):
        RemoteServer(lambda _: None).start(server.port)
    port = server.port
    server.stop()
    assert server.port == 0
    server.start(port)  # free again at once
    assert server.port == port
