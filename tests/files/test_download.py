"""Downloads from a real server that keeps no promise."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest

from studio.errors import StudioError
from studio.files.download import Offered, download

MEGABYTE = 1 << 20
OFFERED, SENT = 2 * MEGABYTE, 60 * MEGABYTE


class Endless(BaseHTTPRequestHandler):
    def do_GET(self) -> None:
        self.send_response(206 if "Range" in self.headers else 200)
        self.end_headers()
        for _ in range(SENT // MEGABYTE):
            try:
                self.wfile.write(bytes(MEGABYTE))
            except OSError:
                return

    def log_message(self, *_: object) -> None:
        pass


@pytest.fixture
def server() -> Iterator[ThreadingHTTPServer]:
    with ThreadingHTTPServer(("127.0.0.1", 0), Endless) as opened:
        threading.Thread(target=opened.serve_forever, args=(0.02,), daemon=True).start()
        yield opened
        opened.shutdown()


@pytest.mark.parametrize("here", [0, MEGABYTE])
def test_a_server_that_sends_more_than_it_offered_is_hung_up_on(
    server: ThreadingHTTPServer, tmp_path: Path, here: int
) -> None:
    file = Offered("model", f"http://127.0.0.1:{server.server_port}/model", OFFERED, "0" * 64)
    if here:
        (tmp_path / "model.000000000000.part").write_bytes(bytes(here))
    told: list[int] = []
    with pytest.raises(StudioError) as refused:
        download(file, tmp_path, told.append)
    assert refused.value.what == f"What arrived as model is not what 127.0.0.1:{server.server_port} offers."
    assert refused.value.remedy == "Run it again: it starts anew."
    assert max(told) <= OFFERED
    assert not list(tmp_path.iterdir())
