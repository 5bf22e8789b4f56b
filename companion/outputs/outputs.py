"""The outputs of a voyage: all its receivers, told of each step and never waited for."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from companion.addresses import Displays
from companion.errors import InputError
from companion.geo.frame import LocalFrame
from companion.outputs.deltas import Values, values_of
from companion.outputs.nmea import Lines, lines_of
from companion.outputs.nmea_outlets import TcpOutlet, UdpOutlet
from companion.outputs.outlet import Outlet, Say
from companion.outputs.signalk_outlets import TcpSignalK, WebSocketSignalK, require_websockets
from companion.secret import read_secret
from companion.view.values import View

MOST_TOKEN = 8192   # characters


@dataclass(frozen=True, slots=True, kw_only=True)
class Wanted:
    """Whom to tell, and the token that a Signal K server asks for."""

    displays: Displays
    token: str = field(default="", repr=False)


def wanted(displays: Displays) -> Wanted:
    """Return whom to tell, with the token that was read.

    Raises:
        InputError: the token cannot be read, or a library is missing.
    """
    if any(name.kind != "tcp" for name in displays.signalk):
        require_websockets()
    return Wanted(displays=displays, token="" if displays.token_file is None else read_token(displays.token_file))


def read_token(path: Path) -> str:
    """Return the token of a file that only its owner may read. Raises InputError."""
    text = read_secret(path, "the Signal K token", "write it there, with mode 0600")
    if not text or not text.isascii() or len(text) > MOST_TOKEN or any(c.isspace() for c in text):
        raise InputError(str(path), "", "holds no token", "write the token that the server gave, and nothing else")
    return text


class Outputs:
    """The receivers that are wanted, while it is open. ``say`` hears how they stand, in words."""

    def __init__(self, chosen: Wanted, frame: LocalFrame, say: Say, *, seed: int = 0) -> None:
        self._frame, self._say = frame, say
        self._faults: set[str] = set()
        self.nmea: list[Outlet[Lines]] = [
            (UdpOutlet if name.kind == "udp" else TcpOutlet)(name, say, seed=seed + number)
            for number, name in enumerate(chosen.displays.nmea)]
        self.signalk: list[Outlet[Values]] = [
            TcpSignalK(name, say, seed=seed + number) if name.kind == "tcp" else
            WebSocketSignalK(name, say, token=chosen.token, seed=seed + number)
            for number, name in enumerate(chosen.displays.signalk, len(chosen.displays.nmea))]
        self._stack = contextlib.AsyncExitStack()

    @property
    def are_any(self) -> bool:
        """Is anybody told?"""
        return bool(self.nmea or self.signalk)

    async def __aenter__(self) -> Self:
        outlets: list[Outlet[Any]] = [*self.nmea, *self.signalk]
        for outlet in outlets:
            await self._stack.enter_async_context(outlet)
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None,
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
        if not outlets:
            return
        try:
            value = made()
        except Exception as error:   # a display is not worth the voyage
            text = f"{outlets[0].name}: not told: {error!r}"
            if text not in self._faults and len(self._faults) < 8:
                self._faults.add(text)
                self._say(text)
            return
        for outlet in outlets:
            outlet.tell(value)
