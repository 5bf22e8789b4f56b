"""Serving the editor until somebody ends it."""

from __future__ import annotations

import contextlib
import secrets
from collections.abc import AsyncIterator, Sequence
from dataclasses import dataclass

from companion.editor.base import Base
from companion.editor.desk import Desk
from companion.editor.plans import Previews
from companion.page import Address, Chart, listening
from companion.planner.worker import PlannerWorker


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """Where the editor is: its address with the token behind ``#``, which no browser sends on."""

    url: str
    token: str


@contextlib.asynccontextmanager
async def editing(base: Base, address: Address, charts: Sequence[Chart] = ()) -> AsyncIterator[Place]:
    """Serve the editor of a mission while the body runs. An address without a token gets one.

    ``charts`` lie under the drawing, the lowest first.

    Raises:
        JobError: the port is in use, or it cannot be listened there.
    """
    token = address.token or secrets.token_urlsafe(24)
    async with (
        PlannerWorker(algorithm=base.options.skipper.planner) as worker,
        listening(address, Desk(base, token, Previews(worker), charts)) as server,
    ):
        yield Place(url=f"{server.address.url}#{token}", token=token)
