"""A small OBS: a real websocket server that speaks obs-websocket 5 as far as the studio asks."""

from __future__ import annotations

import asyncio
import json
import threading
from typing import Any

from aiohttp import WSMsgType, web

from studio.remote.obs import authentication

SALT, CHALLENGE = "c2FsdA==", "Y2hhbGxlbmdl"


class ObsServer:
    """Serves on a free port from a thread of its own.

    Args:
        password: "" asks for none.
        offsets: the Sync Offset of each sound; None for an input that has no sound.
    """

    def __init__(self, password: str = "", offsets: dict[str, int | None] | None = None) -> None:
        self.password, self.port = password, 0
        self.offsets = {"Mic/Aux": 0, "Image": None} if offsets is None else offsets
        self.requests: list[tuple[str, dict[str, Any]]] = []
        self._sockets: set[web.WebSocketResponse] = set()
        self._loop = asyncio.new_event_loop()
        self._ready = threading.Event()
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()
        self._ready.wait(10)

    def tell_stream(self, state: str) -> None:
        """The stream is in another state."""
        data = {"outputActive": True, "outputState": state}
        event = {"eventType": "StreamStateChanged", "eventIntent": 64, "eventData": data}
        for socket in list(self._sockets):
            self._wait(socket.send_json({"op": 5, "d": event}))

    def hang_up(self) -> None:
        """OBS quits."""
        for socket in list(self._sockets):
            self._wait(socket.close())

    def stop(self) -> None:
        self.hang_up()
        self._wait(self._runner.cleanup())
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(10)
        self._loop.close()

    def _wait(self, work: Any) -> None:
        asyncio.run_coroutine_threadsafe(work, self._loop).result(10)

    def _serve(self) -> None:
        asyncio.set_event_loop(self._loop)
        self._loop.run_until_complete(self._listen())
        self._ready.set()
        self._loop.run_forever()

    async def _listen(self) -> None:
        app = web.Application()
        app.router.add_get("/", self._talk)
        self._runner = web.AppRunner(app)
        await self._runner.setup()
        site = web.TCPSite(self._runner, "127.0.0.1", 0)
        await site.start()
        self.port = self._runner.addresses[0][1]

    async def _talk(self, request: web.Request) -> web.WebSocketResponse:
        socket = web.WebSocketResponse(protocols=("obswebsocket.json",))
        await socket.prepare(request)
        hello: dict[str, Any] = {"obsWebSocketVersion": "5.5.0", "rpcVersion": 1}
        if self.password:
            hello["authentication"] = {"challenge": CHALLENGE, "salt": SALT}
        await socket.send_json({"op": 0, "d": hello})
        identify = (await socket.receive_json())["d"]
        right = authentication(self.password, SALT, CHALLENGE) if self.password else None
        if identify.get("authentication") != right or identify["rpcVersion"] != 1:
            await socket.close(code=4009, message=b"Authentication failed.")
            return socket
        await socket.send_json({"op": 2, "d": {"negotiatedRpcVersion": 1}})
        self._sockets.add(socket)
        async for message in socket:
            if message.type == WSMsgType.TEXT:
                asked = json.loads(message.data)["d"]
                await socket.send_json({"op": 7, "d": self._answer(asked)})
        self._sockets.discard(socket)
        return socket

    def _answer(self, asked: dict[str, Any]) -> dict[str, Any]:
        kind, data = asked["requestType"], asked.get("requestData") or {}
        self.requests.append((kind, data))
        status: dict[str, Any] = {"result": True, "code": 100}
        response: dict[str, Any] = {}
        name = data.get("inputName")
        if kind == "GetInputList":
            response = {"inputs": [{"inputName": one, "inputKind": "any"} for one in self.offsets]}
        elif name not in self.offsets:
            status = {"result": False, "code": 600, "comment": f"No source was found by the name of {name}."}
        elif self.offsets[name] is None:
            status = {"result": False, "code": 604, "comment": "The specified input does not support audio."}
        elif kind == "GetInputAudioSyncOffset":
            response = {"inputAudioSyncOffset": self.offsets[name]}
        elif kind == "SetInputAudioSyncOffset":
            self.offsets[name] = data["inputAudioSyncOffset"]
        return {
            "requestType": kind, "requestId": asked["requestId"], "requestStatus": status,
            "responseData": response,
        }  # fmt: skip
