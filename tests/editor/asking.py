"""The editor of a mission on a port of this machine: in a thread for a browser, in a loop for requests byte by byte."""

import asyncio
import contextlib
import json
import threading

from companion.clock import run
from companion.editor import editing, read_base
from companion.page import Address
from tests.page.asking import Browser

TOKEN = "a-token-of-enough-characters"


class Asker(Browser):
    """Asks as the editor's page does."""

    async def raw(self, data, at_most_s=90.0):
        """The first plan waits for the planner's kernels."""
        return await super().raw(data, at_most_s)

    async def post(self, path, value=None, token=TOKEN, body=None, **headers):
        """Return status and answer."""
        data = json.dumps(value or {}).encode() if body is None else body
        status, _, answer = await self.get(
            path,
            "POST",
            data,
            **{
                "Origin": f"http://127.0.0.1:{self.port}",
                "Content_Type": "application/json",
                "X_Companion": "1",
                "Authorization": f"Bearer {token}",
                **headers,
            },
        )
        return status, json.loads(answer) if answer else None


def with_editor(path, talk, waters=()):
    """Return what ``talk(asker)`` returns while the editor of a file is served."""

    async def whole():
        async with editing(read_base(path), Address(host="127.0.0.1", port=0, token=TOKEN), (), waters) as place:
            return await talk(Asker(int(place.url.split(":")[2].split("/")[0])))

    return run(whole())


@contextlib.contextmanager
def edited(path, port=0, charts=(), waters=()):
    """Serve the editor of a file from a thread; yields its address with its token."""
    ready, found = threading.Event(), []

    async def whole():
        over = asyncio.Event()
        found.extend([asyncio.get_running_loop(), over])
        async with editing(read_base(path), Address(host="127.0.0.1", port=port, token=TOKEN), charts, waters) as place:
            found.append(place.url)
            ready.set()
            await over.wait()

    thread = threading.Thread(target=lambda: run(whole()), daemon=True)
    thread.start()
    assert ready.wait(20.0)
    try:
        yield found[2]
    finally:
        found[0].call_soon_threadsafe(found[1].set)
        thread.join(20.0)
