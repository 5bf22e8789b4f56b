"""A page of a made-up voyage on a port of this machine, and requests to it, byte by byte."""

import asyncio
import contextlib
import json
import socket

from companion.clock import run
from companion.orders import Answer, Result
from companion.page import Address, LiveSource, served
from companion.view import Event, View
from companion.view.values import StateView

TOKEN = "a-token-of-enough-characters"


def free_port():
    """Return a TCP port that nobody listens on now."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def view_at(t_s, why=""):
    return View(source="live", name="test", t_s=t_s, state=StateView(phase="standard", why=why))


def event(number):
    return Event(number=number, t_s=float(number), kind="said", title=f"event {number}")


class Asked:
    """Takes orders, and answers them."""

    def __init__(self, answer=None):
        self.orders, self.answer = [], answer or Answer(result=Result.DONE, text="holding")

    async def ask(self, wanted):
        self.orders.append(wanted.words)
        return self.answer

    async def preview(self, wanted):
        return {"error": None, "order": wanted.words}


async def hang_up(writer):
    writer.close()
    with contextlib.suppress(ConnectionError):
        await writer.wait_closed()


class Browser:
    """Speaks HTTP without any kindness."""

    def __init__(self, port):
        self.port = port

    async def raw(self, data, at_most_s=5.0):
        """Return all that is answered to bytes until the server hangs up, or is silent."""
        reader, writer = await asyncio.open_connection("127.0.0.1", self.port)
        out = b""
        with contextlib.suppress(TimeoutError, ConnectionError):
            writer.write(data)
            await writer.drain()
            async with asyncio.timeout(at_most_s):
                while got := await reader.read(65536):
                    out += got
        await hang_up(writer)
        return out

    async def get(self, path="/", method="GET", body=b"", **headers):
        """Return status, headers and body of one request; ``headers`` with _ for -; None leaves one out."""
        fields = {
            "Host": f"127.0.0.1:{self.port}",
            "Connection": "close",
            **({"Content-Length": str(len(body))} if body or method == "POST" else {}),
            **{name.replace("_", "-"): value for name, value in headers.items()},
        }
        head = "".join(f"{k}: {v}\r\n" for k, v in fields.items() if v is not None)
        raw = await self.raw(f"{method} {path} HTTP/1.1\r\n{head}\r\n".encode() + body)
        top, _, rest = raw.partition(b"\r\n\r\n")
        lines = top.decode("latin-1").split("\r\n")
        found = {k.lower(): v.strip() for k, _, v in (line.partition(":") for line in lines[1:])}
        return int(lines[0].split()[1]) if lines[0] else 0, found, rest

    async def order(self, words="hold", path="/api/order", token=TOKEN, **headers):
        """Post an order as the page does; return status and answer."""
        status, _, body = await self.get(
            path,
            "POST",
            json.dumps({"order": words}).encode(),
            **{
                "Origin": f"http://127.0.0.1:{self.port}",
                "Content_Type": "application/json",
                "X_Companion": "1",
                "Authorization": f"Bearer {token}",
                **headers,
            },
        )
        return status, json.loads(body) if body else None


def with_page(talk, source=None, token="", names=(), charts=()):
    """Return what ``talk(browser, source, server)`` returns while the page is served."""

    async def whole():
        port = free_port()
        mine = source if source is not None else LiveSource(name="test")
        address = Address(host="127.0.0.1", port=port, token=token, names=names)
        async with served(address, mine, charts=charts) as server:
            return await talk(Browser(port), mine, server)

    return run(whole())


def taking_orders(talk, asked=None):
    """The same for a page that takes orders; returns (answer of talk, orders)."""
    asked = asked or Asked()
    live = LiveSource(name="test", ask=asked.ask, preview=asked.preview, permitted=("hold",))
    return with_page(talk, live, TOKEN), asked.orders
