"""OBS Studio through its websocket: its sounds, their Sync Offset, and when the stream begins.

Source: obs-websocket 5, docs/generated/protocol.md: Hello, Identify, Request and Event as JSON.
"""

from __future__ import annotations

import asyncio
import base64
import hashlib
import itertools
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from studio.errors import StudioError, say

if TYPE_CHECKING:
    from aiohttp import ClientWebSocketResponse

USUAL_HOST, USUAL_PORT = "127.0.0.1", 4455
WAIT_S = 5.0
HELLO, IDENTIFY, IDENTIFIED, EVENT, REQUEST, RESPONSE = 0, 1, 2, 5, 6, 7
OUTPUT_EVENTS = 1 << 6
"""Of the kinds of events: those of the stream and the recording."""
WRONG_PASSWORD = 4009
STREAM_EVENT = "StreamStateChanged"
STARTING = frozenset({"OBS_WEBSOCKET_OUTPUT_STARTING", "OBS_WEBSOCKET_OUTPUT_STARTED"})
LOWEST_MS, HIGHEST_MS = -950, 20_000
"""Sync Offsets that OBS takes."""


class ObsError(StudioError):
    """OBS cannot be reached, or does not do what it was asked."""

    code = "obs"


class ObsClient:
    """A connection to one OBS. Its methods wait for OBS, so they are not for the window's thread.

    Args:
        stream_began: called when the stream starts, on the connection's thread.
        closed: called when the connection is gone that had been there, on that thread.
    """

    def __init__(self, stream_began: Callable[[], None], closed: Callable[[], None]) -> None:
        self._stream_began, self._closed = stream_began, closed
        self._loop: asyncio.AbstractEventLoop | None = None
        self._socket: ClientWebSocketResponse | None = None
        self._answers: dict[str, asyncio.Future[dict[str, Any]]] = {}
        self._ids = itertools.count(1)
        self._thread: threading.Thread | None = None
        self._ready = threading.Event()
        self._failure: StudioError | None = None

    @property
    def connected(self) -> bool:
        """Whether OBS is there."""
        return self._socket is not None

    def connect(self, host: str, port: int, password: str) -> None:
        """Reach OBS and give it the password where it asks for one.

        Raises:
            ObsError: it is not there, or refuses.
        """
        self.close()
        self._ready.clear()
        self._failure = None
        work = self._run(host, port, password)
        self._thread = threading.Thread(target=lambda: asyncio.run(work), name="obs", daemon=True)
        self._thread.start()
        if not self._ready.wait(2 * WAIT_S):
            self.close()
            raise _missing(host, port)
        if self._failure is not None:
            raise self._failure

    def close(self) -> None:
        """Leave; nobody is told."""
        loop, socket, self._socket = self._loop, self._socket, None
        if loop is not None and socket is not None:
            with suppress(RuntimeError):  # its thread ended meanwhile
                asyncio.run_coroutine_threadsafe(socket.close(), loop)
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join(WAIT_S)
        self._thread = None

    def sounds(self) -> tuple[str, ...]:
        """Names of the inputs that have sound."""
        inputs = self.request("GetInputList").get("inputs", [])
        names = [str(one["inputName"]) for one in inputs if isinstance(one, dict) and "inputName" in one]
        found = []
        for name in names:
            # Pictures and texts have no offset, and OBS says so.
            with suppress(ObsError):
                self.sync_offset(name)
                found.append(name)
        return tuple(found)

    def sync_offset(self, name: str) -> int:
        """The Sync Offset of an input, milliseconds."""
        answer = self.request("GetInputAudioSyncOffset", inputName=name)
        return int(answer["inputAudioSyncOffset"])

    def set_sync_offset(self, name: str, ms: int) -> int:
        """Set the Sync Offset of an input; what OBS says it is then.

        Raises:
            ObsError: the input is gone, or OBS is.
        """
        ms = min(max(ms, LOWEST_MS), HIGHEST_MS)
        self.request("SetInputAudioSyncOffset", inputName=name, inputAudioSyncOffset=ms)
        return self.sync_offset(name)

    def request(self, kind: str, **data: Any) -> dict[str, Any]:
        """Ask OBS for something and wait for its answer.

        Raises:
            ObsError: it is gone, refuses or does not answer.
        """
        loop = self._loop
        if loop is None or not self.connected:
            raise ObsError("OBS is not connected.", "Connect it again.")
        try:
            answer = asyncio.run_coroutine_threadsafe(self._ask(kind, data), loop).result(WAIT_S)
        except (TimeoutError, RuntimeError, OSError, asyncio.CancelledError) as error:
            raise ObsError("OBS does not answer.", "Connect it again.") from error
        status = answer.get("requestStatus") or {}
        if not status.get("result"):
            why = status.get("comment") or say("code {code}", code=status.get("code"))
            raise ObsError(
                say("OBS refused {kind}: {reason}", kind=kind, reason=why),
                "Check the input in OBS, then connect again.",
            )
        return answer.get("responseData") or {}

    # -- on the connection's thread ------------------------------------------------------------

    async def _run(self, host: str, port: int, password: str) -> None:
        """From the greeting to the end of the connection."""
        import aiohttp

        self._loop, identified = asyncio.get_running_loop(), False
        try:
            async with aiohttp.ClientSession() as session:
                calling = session.ws_connect(f"ws://{host}:{port}", protocols=("obswebsocket.json",))
                socket = await asyncio.wait_for(calling, WAIT_S)
                await asyncio.wait_for(self._identify(socket, password), WAIT_S)
                self._socket, identified = socket, True
                self._ready.set()
                await self._listen(socket)
                await socket.close()
        except (aiohttp.ClientError, OSError, ValueError, TypeError, KeyError):
            self._failure = self._failure or _missing(host, port)
        except ObsError as error:
            self._failure = error
        finally:
            for answer in self._answers.values():
                answer.cancel()
            self._answers.clear()
            was_there, self._socket = self._socket is not None, None
            if not identified:
                self._ready.set()
            elif was_there:
                self._closed()

    async def _identify(self, socket: ClientWebSocketResponse, password: str) -> None:
        hello = (await socket.receive_json())["d"]
        answer: dict[str, Any] = {"rpcVersion": 1, "eventSubscriptions": OUTPUT_EVENTS}
        if asked := hello.get("authentication"):
            answer["authentication"] = authentication(password, asked["salt"], asked["challenge"])
        await socket.send_json({"op": IDENTIFY, "d": answer})
        message = await socket.receive()
        if not isinstance(message.data, str):
            if socket.close_code == WRONG_PASSWORD:
                remedy = "Copy it from OBS: Tools, WebSocket Server Settings, Show Connect Info."
                raise ObsError("OBS does not accept this password.", remedy)
            raise ObsError("OBS closed the connection.", "Update OBS to version 28 or newer.")

    async def _listen(self, socket: ClientWebSocketResponse) -> None:
        async for message in socket:
            with suppress(ValueError, KeyError, TypeError, AttributeError):
                content = message.json()
                self._hear(content["op"], content["d"])

    def _hear(self, op: int, data: dict[str, Any]) -> None:
        if op == RESPONSE:
            answer = self._answers.pop(data["requestId"], None)
            if answer is not None and not answer.done():
                answer.set_result(data)
        elif (
            op == EVENT and data["eventType"] == STREAM_EVENT and data["eventData"]["outputState"] in STARTING
        ):
            self._stream_began()

    async def _ask(self, kind: str, data: dict[str, Any]) -> dict[str, Any]:
        socket = self._socket
        if socket is None:
            raise OSError("closed")
        number = str(next(self._ids))
        answer = self._answers[number] = asyncio.get_running_loop().create_future()
        request = {"requestType": kind, "requestId": number, "requestData": data}
        await socket.send_json({"op": REQUEST, "d": request})
        return await answer


def authentication(password: str, salt: str, challenge: str) -> str:
    """What proves to OBS that the password is known."""
    return _hash(_hash(password + salt) + challenge)


def _hash(text: str) -> str:
    return base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()


def _missing(host: str, port: int) -> ObsError:
    return ObsError(
        say("OBS was not found at {host}:{port}.", host=host, port=port),
        "Start OBS and tick Enable WebSocket server in Tools, WebSocket Server Settings.",
    )
