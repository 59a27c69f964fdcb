"""Live's actions over HTTP and OSC on this computer, for Stream Deck, Touch Portal and their like.

    http://127.0.0.1:PORT/saia/live/mute        press: GET or POST; /on or /off behind it says which
    http://127.0.0.1:PORT/saia/live             how Live is, as JSON
    /saia/live/mute  to UDP 127.0.0.1:PORT      the same as OSC; an argument 1 or 0 says which

Pages in a browser reach 127.0.0.1 as well. They cannot keep the browser from telling that the request is a
page's (Origin, Sec-Fetch-Site, Referer), nor from naming the host they believe to talk to, so a request that
has any of these, or another host, is refused. Source: Fetch Metadata Request Headers, W3C; RFC 6454.
"""

from __future__ import annotations

import json
import socket
import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, dataclass
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

from studio.errors import StudioError, say
from studio.vmc.osc import MalformedError, address, arguments, split

HOST, ROOT = "127.0.0.1", "/saia/live"
ACTIONS = {
    "start": "start_live", "stop": "stop_live", "mute": "mute", "freeze": "freeze", "neutral": "neutral",
    "keep": "keep_live", **{f"mood/{n}": f"mood_{n}" for n in range(10)},
}  # fmt: skip
"""What may be pressed: the end of its address, and its id in `studio.actions`."""
SWITCHES = frozenset({"mute", "freeze", "neutral"})
"""Those of them that are on or off."""
WHILE_OFF = frozenset({"start_live", "stop_live"})
"""Those that mean something while nothing is live."""
_OF_A_PAGE = ("Origin", "Referer", "Sec-Purpose")
_PATIENCE_S, _LARGEST = 5.0, 4096


@dataclass(frozen=True)
class RemoteRequest:
    """A press from outside.

    Args:
        action: its id in `studio.actions`.
        on: what a switch is to be; None for the other way round.
    """

    action: str
    on: bool | None = None


@dataclass(frozen=True)
class RemoteState:
    """What is answered about Live; latency_ms is 0 before it is known."""

    live: bool = False
    muted: bool = False
    frozen: bool = False
    neutral: bool = False
    mood: str = ""
    latency_ms: float = 0.0


def url_of(name: str, port: int) -> str:
    """The address to paste for one of ACTIONS."""
    return f"http://{HOST}:{port}{ROOT}/{name}"


class RemoteServer:
    """Listens on one port of this computer, TCP for HTTP and UDP for OSC.

    Args:
        pressed: told each RemoteRequest, on a thread of the server.

    Attributes:
        state: what is answered about Live.
    """

    def __init__(self, pressed: Callable[[RemoteRequest], None]) -> None:
        self._pressed = pressed
        self.state = RemoteState()
        self._http: ThreadingHTTPServer | None = None
        self._udp: socket.socket | None = None
        self._threads: list[threading.Thread] = []

    @property
    def port(self) -> int:
        """The port in use, 0 while it does not listen."""
        return int(self._http.server_address[1]) if self._http is not None else 0

    def start(self, port: int) -> None:
        """Listen from now on.

        Args:
            port: 0 takes a free one.

        Raises:
            StudioError: another program has the port.
        """
        self.stop()
        udp: socket.socket | None = None
        try:
            http = _Http((HOST, port), _handler(self))
        except OSError as error:
            raise _taken(port) from error
        try:
            udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            udp.bind((HOST, http.server_address[1]))
        except OSError as error:
            http.server_close()
            if udp is not None:
                udp.close()
            raise _taken(port) from error
        self._http, self._udp = http, udp
        self._threads = [
            threading.Thread(target=http.serve_forever, args=(0.05,), name="remote http", daemon=True),
            threading.Thread(target=self._hear, args=(udp,), name="remote osc", daemon=True),
        ]
        for thread in self._threads:
            thread.start()

    def stop(self) -> None:
        """Listen no more."""
        http, udp, self._http, self._udp = self._http, self._udp, None, None
        if udp is not None:
            # Closing alone does not wake a thread that waits on it everywhere: a datagram of nothing does.
            with suppress(OSError):
                udp.sendto(b"", udp.getsockname())
        if http is not None:
            http.shutdown()
            http.server_close()
        # The port is free once they are gone. Bounded: nothing here may hold up the window.
        for thread in self._threads:
            thread.join(1.0)

    def press(self, name: str, on: bool | None = None) -> tuple[int, str]:
        """Do what an address asks for; an HTTP status and a sentence.

        Args:
            name: of ACTIONS.
            on: for SWITCHES, None for the other way round.
        """
        action = ACTIONS.get(name)
        if action is None or (on is not None and name not in SWITCHES):
            return HTTPStatus.NOT_FOUND, f"There is no {name}. Use one of: {', '.join(ACTIONS)}."
        if not self.state.live and action not in WHILE_OFF:
            return HTTPStatus.CONFLICT, "Live is off."
        self._pressed(RemoteRequest(action, on))
        return HTTPStatus.OK, f"{name} was pressed."

    def _hear(self, udp: socket.socket) -> None:
        """Runs on the OSC thread until closed."""
        with udp:
            while self._udp is udp:
                try:
                    datagram = udp.recv(_LARGEST)
                except OSError:
                    # Windows reports here that somebody did not take an answer; nothing was lost.
                    continue
                for message in split(datagram)[0]:
                    self._obey(message)

    def _obey(self, message: bytes) -> None:
        try:
            path, values = address(message), arguments(message)
        except MalformedError:
            return
        name = path.removeprefix(f"{ROOT}/")
        if name == path:
            return
        # Buttons send 1 as they go down and many 0 as they come up: that is one press of what is no switch.
        on = bool(values[0]) if values and isinstance(values[0], bool | int | float) else None
        if name in SWITCHES:
            self.press(name, on)
        elif on is not False:
            self.press(name)


class _Http(ThreadingHTTPServer):
    daemon_threads = True
    # On Windows reuse would let two programs share a port in silence.
    allow_reuse_address = False

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A caller that hangs up is no news."""


def _handler(server: RemoteServer) -> type[BaseHTTPRequestHandler]:
    class Handler(BaseHTTPRequestHandler):
        timeout = _PATIENCE_S

        def do_GET(self) -> None:
            self._answer()

        def do_POST(self) -> None:
            self._answer()

        def log_message(self, format: str, *args: Any) -> None:
            """Presses are no news either."""

        def _answer(self) -> None:
            path = self.path.partition("?")[0].rstrip("/")
            if not _is_local(self.headers.get("Host", ""), server.port) or self._of_a_page:
                self._say(HTTPStatus.FORBIDDEN, {"error": "Pages in a browser may not use this."})
            elif path == ROOT:
                self._say(HTTPStatus.OK, asdict(server.state))
            elif path.startswith(f"{ROOT}/"):
                name, _, end = path.removeprefix(f"{ROOT}/").rpartition("/")
                on = {"on": True, "off": False}.get(end)
                status, words = server.press(name if on is not None else f"{name}/{end}".lstrip("/"), on)
                self._say(status, {"done" if status == HTTPStatus.OK else "error": words})
            else:
                self._say(HTTPStatus.NOT_FOUND, {"error": f"Addresses begin with {ROOT}."})

        @property
        def _of_a_page(self) -> bool:
            # "none" is an address that a person typed or a program asked for.
            fetched = self.headers.get("Sec-Fetch-Site", "none") != "none"
            return fetched or any(name in self.headers for name in _OF_A_PAGE)

        def _say(self, status: int, content: dict[str, Any]) -> None:
            body = json.dumps(content).encode()
            self.send_response(status)
            self.send_header("Content-Type", "application/json")
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)

    return Handler


def _is_local(host: str, port: int) -> bool:
    return host in {f"{HOST}:{port}", f"localhost:{port}"}


def _taken(port: int) -> StudioError:
    return StudioError(
        say("Port {port} is in use by another program.", port=port), "Choose another Remote port in Settings."
    )
