"""OBS over a real websocket: the password, the sounds, their offset, and the stream that begins."""

from __future__ import annotations

import socket
import threading
from collections.abc import Iterator

import pytest

from studio.remote.obs import ObsClient, ObsError, authentication
from tests.remote.obs_server import ObsServer


@pytest.fixture
def obs() -> Iterator[ObsServer]:
    server = ObsServer(password="geheim 秘密")
    yield server
    server.stop()


def test_the_proof_of_the_password_is_that_of_the_protocol() -> None:
    """Its documentation's own example."""
    proof = authentication(
        "supersecretpassword",
        "lM1GncleQOaCu9lT1yeUZhFYnqhsLLP1G5lAGo3ixaI=",
        "+IxH4CnCiqpX1rM9scsNynZzbOe4KhDeYcTNS3PDaeY=",
    )
    assert proof == "1Ct943GAT+6YQUUX47Ia/ncufilbe6+oD6lY+5kaCu4="


def test_the_sounds_are_listed_and_an_offset_is_set_and_read_back(obs: ObsServer) -> None:
    client = ObsClient(lambda: None, lambda: None)
    client.connect("127.0.0.1", obs.port, "geheim 秘密")
    assert client.sounds() == ("Mic/Aux",)
    assert client.set_sync_offset("Mic/Aux", 141) == 141
    assert obs.offsets["Mic/Aux"] == 141
    assert client.set_sync_offset("Mic/Aux", 99_999) == 20_000
    with pytest.raises(ObsError, match="No source was found by the name of Gone"):
        client.sync_offset("Gone")
    client.close()
    assert not client.connected
    with pytest.raises(ObsError, match="not connected"):
        client.sounds()


def test_the_stream_that_begins_and_obs_that_quits_are_told(obs: ObsServer) -> None:
    began, closed = threading.Event(), threading.Event()
    client = ObsClient(began.set, closed.set)
    client.connect("127.0.0.1", obs.port, "geheim 秘密")
    obs.tell_stream("OBS_WEBSOCKET_OUTPUT_STOPPED")
    client.sounds()  # the event before it was heard by then
    assert not began.is_set()
    obs.tell_stream("OBS_WEBSOCKET_OUTPUT_STARTED")
    assert began.wait(5)
    obs.hang_up()
    assert closed.wait(5)
    assert not client.connected


def test_a_wrong_password_and_no_obs_at_all_are_told_apart(obs: ObsServer) -> None:
    client = ObsClient(lambda: None, lambda: None)
    with pytest.raises(ObsError, match="does not accept this password"):
        client.connect("127.0.0.1", obs.port, "wrong")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    with pytest.raises(ObsError, match=f"OBS was not found at 127.0.0.1:{port}"):
        client.connect("127.0.0.1", port, "")
