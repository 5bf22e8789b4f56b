"""Serving the editor until somebody ends it."""

from __future__ import annotations

import contextlib
import secrets
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass

from companion.editor.base import Base
from companion.editor.desk import Desk
from companion.editor.plans import Previews
from companion.page import Address, listening
from companion.planner.worker import PlannerWorker


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """Where the editor is: its address with the token behind ``#``, which no browser sends on."""

    url: str
    token: str


@contextlib.asynccontextmanager
async def editing(base: Base, address: Address, say: Callable[[str], None] = lambda _: None) -> AsyncIterator[Place]:
    """Serve the editor of a mission while the body runs. ``say`` hears where. An address without a token gets one.

    Raises:
        JobError: the port is in use, or it cannot be listened there.
    """
    token = address.token or secrets.token_urlsafe(24)
    async with (
        PlannerWorker(algorithm=base.options.skipper.planner) as worker,
        listening(address, Desk(base, token, Previews(worker))) as server,
    ):
        place = Place(url=f"{server.address.url}#{token}", token=token)
        say(place.url)
        yield place
