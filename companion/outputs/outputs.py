"""The outputs of a voyage: all its receivers, told of each step and never waited for."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from companion.addresses import Displays
from companion.disk import read_secret
from companion.errors import InputError
from companion.geo.frame import LocalFrame
from companion.guard import Auxiliary, Guard
from companion.outputs.nmea import Lines, TcpOutlet, UdpOutlet, lines_of
from companion.outputs.outlet import Outlet, Say
from companion.outputs.signalk import TcpSignalK, Values, WebSocketSignalK, require_websockets, values_of
from companion.view import View

MOST_TOKEN = 8192  # characters


def checked_displays(displays: Displays, guard: Guard) -> Displays:
    """Return whom to tell, with the token that was read; what cannot be, ``guard`` knows.

    A server is told without a token that cannot be read, and not at all without the library that its kind needs.
    """
    try:
        if any(name.kind != "tcp" for name in displays.signalk):
            require_websockets()
    except InputError as error:
        guard.lost(Auxiliary.OUTPUTS, f"{error}", for_good=True)
        displays = replace(displays, signalk=tuple(name for name in displays.signalk if name.kind == "tcp"))
    token = ""
    if displays.token_file is not None:
        try:
            token = read_token(displays.token_file)
        except InputError as error:
            guard.lost(Auxiliary.SIGNALK_TOKEN, f"{error}", for_good=True)
    return replace(displays, token=token)


def read_token(path: Path) -> str:
    """Return the token of a file that only its owner may read. Raises InputError."""
    text = read_secret(path, "", "write it there, with mode 0600")
    if not text or not text.isascii() or len(text) > MOST_TOKEN or any(c.isspace() for c in text):
        raise InputError(str(path), "", "holds no token", "write the token that the server gave, and nothing else")
    return text


class Outputs:
    """The receivers that are wanted, while it is open. ``say`` hears how they stand, in words; ``guard`` knows it."""

    def __init__(
        self, chosen: Displays, frame: LocalFrame, say: Say, *, seed: int = 0, guard: Guard | None = None
    ) -> None:
        self._frame = frame
        self._guard = guard or Guard(
            lambda name, why: say(f"{name}: not told: {why}" if why else f"{name}: told again")
        )
        self.nmea: list[Outlet[Lines]] = [
            (UdpOutlet if name.kind == "udp" else TcpOutlet)(name, say, seed=seed + number)
            for number, name in enumerate(chosen.nmea)
        ]
        self.signalk: list[Outlet[Values]] = [
            TcpSignalK(name, say, seed=seed + number)
            if name.kind == "tcp"
            else WebSocketSignalK(name, say, token=chosen.token, seed=seed + number)
            for number, name in enumerate(chosen.signalk, len(chosen.nmea))
        ]
        self._stack = contextlib.AsyncExitStack()
        if guard is not None:
            for outlet in self._outlets:
                outlet.guard = guard

    @property
    def _outlets(self) -> tuple[Outlet[Any], ...]:
        return (*self.nmea, *self.signalk)

    @property
    def are_any(self) -> bool:
        """Is anybody told?"""
        return bool(self.nmea or self.signalk)

    async def __aenter__(self) -> Self:
        for outlet in self._outlets:
            await self._stack.enter_async_context(outlet)
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        await self._stack.aclose()

    def tell(self, view: View, utc_s: float | None, frame: LocalFrame | None = None) -> None:
        """Tell all of a view; ``utc_s`` is the time by GPS, ``frame`` that of its metres, where it has moved along.

        Returns at once and never raises.
        """
        self._frame = frame or self._frame
        self._tell(self.nmea, lambda: lines_of(view, self._frame, utc_s))
        self._tell(self.signalk, lambda: values_of(view, self._frame))

    def _tell(self, outlets: Sequence[Outlet[Any]], made: Any) -> None:
        value = self._guard.call(Auxiliary.OUTPUTS, made) if outlets else None
        if value is None:
            return
        for outlet in outlets:
            outlet.tell(value)
