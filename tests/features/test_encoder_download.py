"""Fetching an encoder from a real server: gone on with, checked, and a sentence for every way it can fail."""

from __future__ import annotations

import hashlib
import re
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest

from studio.errors import RequestError, StudioError
from studio.features.encoder_download import fetch
from studio.features.encoders import home_of, installed, load_encoder
from tests.features import wav2vec2_example as example

NAME = "someone/tiny-wav2vec2"


class Hub(ThreadingHTTPServer):
    """A hub with one encoder, which answers as Hugging Face's does: weights lie in a store elsewhere."""

    def __init__(self, folder: Path) -> None:
        super().__init__(("127.0.0.1", 0), Handler)
        self.files = {path.name: path.read_bytes() for path in folder.iterdir()}
        self.cut_after: int | None = None  # bytes of the weights after which the connection breaks
        self.spoilt = False
        self.ranges = True
        self.renamed = False
        self.asked: list[str] = []  # "GET path range"

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.server_port}"


class Handler(BaseHTTPRequestHandler):
    server: Hub

    def do_HEAD(self) -> None:
        self._answer(body=False)

    def do_GET(self) -> None:
        self._answer(body=True)

    def log_message(self, *_: object) -> None:
        pass

    def _answer(self, body: bool) -> None:
        hub, path = self.server, self.path
        if body:
            hub.asked.append(f"{path} {self.headers.get('Range', '')}".strip())
        if hub.renamed and path.startswith(f"/{NAME}/"):
            self._send(307, {"Location": path.replace(NAME, "new/name")})
            return
        file = path.rpartition("/")[2]
        content = hub.files.get(file)
        known = re.fullmatch(rf"/(?:{NAME}|new/name)/resolve/main/[\w.]+|/store/[\w.]+", path)
        if content is None or not known:
            self._send(404, {"Content-Length": "0"})
        elif file.startswith(("model", "pytorch")) and not path.startswith("/store/"):
            digest = hashlib.sha256(content).hexdigest()
            linked = {"X-Linked-ETag": f'"{digest}"', "X-Linked-Size": str(len(content))}
            self._send(302, {"Location": f"{hub.url}/store/{file}", "Content-Length": "0"} | linked)
        else:
            self._content(content, body, file)

    def _content(self, content: bytes, body: bool, file: str) -> None:
        hub, status, headers = self.server, 200, {}
        wanted = re.fullmatch(r"bytes=(\d+)-", self.headers.get("Range", ""))
        if wanted and hub.ranges:
            first = int(wanted.group(1))
            headers["Content-Range"] = f"bytes {first}-{len(content) - 1}/{len(content)}"
            content, status = content[first:], 206
        if hub.spoilt and file.startswith("model"):
            content = bytes(len(content))
        self._send(status, headers | {"Content-Length": str(len(content)), "ETag": '"0123456789"'})
        if body:
            cut = hub.cut_after if file.startswith("model") else None
            self.wfile.write(content[:cut])

    def _send(self, status: int, headers: dict[str, str]) -> None:
        self.send_response(status)
        for name, value in headers.items():
            self.send_header(name, value)
        self.end_headers()


@pytest.fixture
def hub(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Hub]:
    server = Hub(example.write(tmp_path / "source"))
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.02})
    thread.start()
    monkeypatch.setenv("HF_ENDPOINT", server.url)
    monkeypatch.setenv("SAIA_ENCODERS", str(tmp_path / "encoders"))
    monkeypatch.setenv("no_proxy", "*")
    yield server
    server.shutdown()
    server.server_close()
    thread.join()


def parts() -> list[Path]:
    return list(home_of(NAME).glob("*.part"))


def test_it_is_fetched_checked_and_used(hub: Hub) -> None:
    told: list[tuple[int, int]] = []
    found = fetch(NAME, lambda here, there: told.append((here, there)))
    assert found in installed()
    assert found.digest == hashlib.sha256(hub.files["model.safetensors"]).hexdigest()
    assert load_encoder(NAME, found.digest).width == 16
    assert told[-1] == (sum(map(len, hub.files.values())),) * 2
    assert told == sorted(told)
    assert parts() == []
    hub.asked.clear()
    assert fetch(NAME) == found
    assert not any("store" in path for path in hub.asked), "weights that are here are not fetched again"


def test_a_renamed_encoder_is_followed(hub: Hub) -> None:
    hub.renamed = True
    assert fetch(NAME).name == NAME


@pytest.mark.parametrize("ranges", [True, False])
def test_a_broken_connection_is_gone_on_with(hub: Hub, ranges: bool) -> None:
    hub.cut_after, hub.ranges = 1000, ranges
    with pytest.raises(StudioError) as caught:
        fetch(NAME)
    host = hub.url.removeprefix("http://")
    assert str(caught.value) == (
        f"The connection to {host} was lost while downloading model.safetensors. "
        "Run it again: it goes on where it was."
    )
    assert [part.stat().st_size for part in parts()] == [1000]
    assert installed() == []
    hub.cut_after = None
    found = fetch(NAME)
    assert found.digest == hashlib.sha256(hub.files["model.safetensors"]).hexdigest()
    assert any(path.endswith("bytes=1000-") for path in hub.asked)
    assert parts() == []


def test_what_is_not_what_was_offered_is_thrown_away(hub: Hub) -> None:
    hub.spoilt = True
    with pytest.raises(StudioError, match=r"^What arrived as model\.safetensors is not what .* offers\."):
        fetch(NAME)
    assert parts() == []
    assert installed() == []
    hub.spoilt = False
    assert fetch(NAME).name == NAME


def test_weights_as_a_pickle_are_fetched_where_there_are_no_others(hub: Hub, tmp_path: Path) -> None:
    folder = example.write(tmp_path / "older", pickled=True)
    hub.files = {path.name: path.read_bytes() for path in folder.iterdir()}
    assert load_encoder(fetch(NAME).name, "").width == 16


def test_a_name_the_hub_does_not_know_is_a_sentence(hub: Hub) -> None:
    with pytest.raises(RequestError) as caught:
        fetch("someone/else")
    assert str(caught.value) == (
        "The hub has no open encoder called someone/else. "
        "Check the name on huggingface.co; it needs a config.json and weights."
    )


@pytest.mark.parametrize("name", ["", "wav2vec2", "../../etc/x", "a/..", "a/b/c", "a b/c"])
def test_what_is_no_name_is_refused(name: str) -> None:
    with pytest.raises(RequestError, match=r"is neither a folder nor the name of an encoder\."):
        fetch(name)


def test_offline_is_a_sentence(hub: Hub, monkeypatch: pytest.MonkeyPatch) -> None:
    import socket

    with socket.socket() as free:  # bound and not listening: nobody answers there
        free.bind(("127.0.0.1", 0))
        host = f"127.0.0.1:{free.getsockname()[1]}"
        monkeypatch.setenv("HF_ENDPOINT", f"http://{host}")
        with pytest.raises(StudioError) as caught:
            fetch(NAME)
    assert str(caught.value) == (
        f"{host} cannot be reached. "
        "Connect to the internet and run it again, or give a folder that holds the encoder."
    )


def test_a_disk_that_is_too_small_is_said_before(hub: Hub, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("shutil.disk_usage", lambda _: type("Usage", (), {"free": 100})())
    with pytest.raises(
        StudioError, match=r"^\d+ KB do not fit on the disk of .*, where 100 bytes are free\."
    ):
        fetch(NAME)
    assert not any("store" in path for path in hub.asked)
