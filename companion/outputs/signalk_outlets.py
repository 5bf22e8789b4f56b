"""A Signal K server: deltas over a WebSocket, with a token where it asks for one, or over its plain TCP port.

A server that does not take what it is sent says nothing of it. So over the WebSocket one value is asked back until
a new one is heard: what does not come back was not taken.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
from typing import Any

from companion.addresses import OutputName
from companion.clock import effort_s
from companion.errors import InputError
from companion.outputs.deltas import LABEL, Values, delta, told_after
from companion.outputs.outlet import Outlet, Say

OPEN_S = 10.0            # for a connection to stand
STUCK_S = 20.0           # a server that takes nothing for so long is given up
ECHO_S = 15.0            # what we told comes back within this
ECHO_EVERY_MS = 2_000
ECHO = "navigation.position"
NOT_TAKEN = "it takes nothing from us: give a token with the right to write (--signalk-token FILE)"
REFUSED = frozenset({401, 403})


class TcpSignalK(Outlet[Values]):
    """Deltas as lines of JSON to a server's TCP port (8375), which takes them only where its security is off."""

    def __init__(self, name: OutputName, say: Say, *, seed: int = 0) -> None:
        super().__init__(f"Signal K {name.text}", say, seed=seed)
        self._address = (name.host, name.port)

    async def serve(self) -> None:
        """Connect and tell until the server goes."""
        async with asyncio.timeout(OPEN_S):
            reader, writer = await asyncio.open_connection(*self._address, limit=65_536)
        heard = asyncio.create_task(_drain(reader))
        self.became("connected", is_open=True)
        told: Values = {}
        try:
            while not heard.done():
                values = await _unless(heard, self.slot.take())
                if values is None:
                    return
                writer.write(json.dumps(delta(values, told)).encode() + b"\r\n")
                async with asyncio.timeout(STUCK_S):
                    await writer.drain()
                told = told_after(values, told)
                self.sent += 1
        finally:
            heard.cancel()
            writer.transport.abort()


class WebSocketSignalK(Outlet[Values]):
    """Deltas over the server's stream. ``token`` is a JSON web token of the server's, empty where it asks for none."""

    def __init__(self, name: OutputName, say: Say, *, token: str = "", seed: int = 0) -> None:
        super().__init__(f"Signal K {name.text}", say, seed=seed)
        self._url, self._token = name.url, token
        self.is_taken: bool | None = None    # by the server; None: not known yet

    async def serve(self) -> None:
        """Connect and tell until the server goes."""
        from websockets.asyncio.client import connect
        from websockets.exceptions import InvalidStatus, WebSocketException

        quiet = logging.getLogger("companion.outputs.websocket")
        quiet.setLevel(logging.CRITICAL)
        headers = {"Authorization": f"Bearer {self._token}"} if self._token else {}
        try:
            async with connect(
                self._url, additional_headers=headers, compression=None, open_timeout=OPEN_S, close_timeout=1.0,
                max_queue=4, max_size=1 << 20, write_limit=65_536, logger=quiet, proxy=None, user_agent_header=None,
            ) as socket:
                await self._tell(socket)
        except InvalidStatus as error:
            status = error.response.status_code
            raise OSError(f"it refuses our token ({status}): make a new one" if status in REFUSED and self._token else
                          f"it wants a token ({status}): --signalk-token FILE" if status in REFUSED else
                          f"no Signal K stream is there (HTTP {status})") from error
        except WebSocketException as error:
            raise OSError(str(error) or type(error).__name__) from error

    async def _tell(self, socket: Any) -> None:
        asked_s, self.is_taken = None, None
        told: Values = {}
        heard = asyncio.create_task(self._hear(socket))
        self.became("connected", is_open=True)
        await socket.send(json.dumps({"context": "vessels.self", "subscribe": [
            {"path": ECHO, "period": ECHO_EVERY_MS, "policy": "fixed"}]}))
        try:
            while not heard.done():
                values = await _unless(heard, self.slot.take())
                if values is None:
                    break
                async with asyncio.timeout(STUCK_S):
                    await socket.send(json.dumps(delta(values, told)))
                told = told_after(values, told)
                self.sent += 1
                if asked_s is None and ECHO in told:
                    asked_s = effort_s()   # of the server's time: beside a hurried simulator it is not ours
                if self.is_taken is None and asked_s is not None and effort_s() - asked_s > ECHO_S:
                    self.is_taken = False
                    self.became(NOT_TAKEN, is_open=True)
        finally:
            heard.cancel()

    async def _hear(self, socket: Any) -> None:
        """Read what comes, so that it never waits, and look for ourselves in it."""
        heard: set[str] = set()   # when what we told was taken: a server keeps the last of an earlier voyage
        async for message in socket:
            if self.is_taken:
                continue
            with contextlib.suppress(ValueError, AttributeError, TypeError):
                updates = json.loads(message).get("updates", ())
                heard |= {str(update["timestamp"]) for update in updates if update.get("$source") == LABEL}
            if len(heard) > 1:
                self.is_taken = True
                self.became("connected, and it takes what it is told", is_open=True)
                await socket.send(json.dumps({"context": "*", "unsubscribe": [{"path": "*"}]}))


def require_websockets() -> None:
    """Raise InputError where the library for WebSockets is not installed."""
    try:
        import websockets  # noqa: F401 - looked for, not used
    except ImportError:
        raise InputError("--signalk", "", "ws:// needs a library that is not installed",
                         "pip install 'sailboat-companion[signalk]', or name the server's TCP port") from None


async def _drain(reader: asyncio.StreamReader) -> None:
    while await reader.read(4096):
        pass


async def _unless(ended: asyncio.Task[None], coming: Any) -> Any:
    """Return what is coming, None when the other end hung up before."""
    waiting = asyncio.ensure_future(coming)
    try:
        await asyncio.wait({ended, waiting}, return_when=asyncio.FIRST_COMPLETED)
        return waiting.result() if waiting.done() else None
    finally:
        waiting.cancel()
