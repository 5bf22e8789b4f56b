"""NMEA 0183 over the network: datagrams to one address, and a server that OpenCPN and others connect to."""

from __future__ import annotations

import asyncio
import errno
import math
from typing import Any, cast

from companion.addresses import OutputName
from companion.clock import now_s
from companion.outputs.nmea import Lines
from companion.outputs.outlet import Outlet, Say

ROUTE_EVERY_S = 60.0           # who comes to a broadcast later has the route after this long
MOST_CLIENTS = 16
BEHIND_BYTES = 16_384          # a client that has not read so much misses what comes
PATIENCE_S = 10.0              # ... and is hung up on after this long


class RouteTeller:
    """When one listener is told the route: when it has changed, and now and then."""

    def __init__(self) -> None:
        self._told: tuple[str, ...] = ()
        self._told_s = -math.inf

    def data(self, lines: Lines, t_s: float) -> tuple[bytes, ...]:
        """Return the sentences that are due, one value each."""
        is_due = lines.route != self._told or t_s - self._told_s >= ROUTE_EVERY_S
        if is_due:
            self._told, self._told_s = lines.route, t_s
        return tuple(line.encode("ascii") for line in (*lines.now, *(lines.route if is_due else ())))


class UdpOutlet(Outlet[Lines]):
    """Datagrams of one sentence each, to one address; a broadcast address is one too."""

    def __init__(self, name: OutputName, say: Say, *, seed: int = 0) -> None:
        super().__init__(f"NMEA 0183 {name.text}", say, seed=seed)
        self._address = (name.host, name.port)

    async def serve(self) -> None:
        """Send until the network fails; that nobody listens is no failure."""
        failed: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        wire, _ = await asyncio.get_running_loop().create_datagram_endpoint(
            lambda: _Refusals(failed), remote_addr=self._address, allow_broadcast=True)
        teller = RouteTeller()
        self.became("sending", is_open=True)
        try:
            while not failed.done():
                lines = await self.slot.take()
                for data in teller.data(lines, now_s()):
                    wire.sendto(data)
                self.sent += 1
        finally:
            wire.abort()
        failed.result()


class _Refusals(asyncio.DatagramProtocol):
    def __init__(self, failed: asyncio.Future[None]) -> None:
        self._failed = failed

    def error_received(self, exc: Exception) -> None:
        """Note that the network is gone; a new socket finds the way that there is by then."""
        if getattr(exc, "errno", None) != errno.ECONNREFUSED and not self._failed.done():
            self._failed.set_exception(exc)


class TcpOutlet(Outlet[Lines]):
    """A server: whoever connects is told. Nothing that a client sends is looked at."""

    def __init__(self, name: OutputName, say: Say, *, seed: int = 0) -> None:
        super().__init__(f"NMEA 0183 {name.text}", say, seed=seed)
        self._host, self._port = name.host, name.port
        self.clients: set[_Client] = set()
        self.hung_up = 0     # clients that did not read
        self._missed = 0

    @property
    def dropped(self) -> int:
        """Values that were too much for the outlet or for one of its clients."""
        return self.slot.dropped + self._missed

    async def serve(self) -> None:
        """Listen and hand on."""
        server = await asyncio.get_running_loop().create_server(lambda: _Client(self), self._host, self._port)
        self.became("listening", is_open=True)
        try:
            while True:
                lines = await self.slot.take()
                for client in tuple(self.clients):
                    self._missed += not client.tell(lines, now_s())
                self.sent += 1
        finally:
            server.close()
            for client in tuple(self.clients):
                client.hang_up()


class _Client(asyncio.Protocol):
    def __init__(self, owner: TcpOutlet) -> None:
        self._owner, self._teller = owner, RouteTeller()
        self._wire: Any = None
        self._behind_s: float | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._wire = cast("Any", transport)
        if len(self._owner.clients) >= MOST_CLIENTS:
            self._wire.abort()
        else:
            self._owner.clients.add(self)

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002 - asyncio's signature
        self._owner.clients.discard(self)

    def tell(self, lines: Lines, t_s: float) -> bool:
        """Hand over the sentences; return False where the client is behind with its reading."""
        if self._wire.get_write_buffer_size() > BEHIND_BYTES:
            self._behind_s = t_s if self._behind_s is None else self._behind_s
            if t_s - self._behind_s >= PATIENCE_S:
                self._owner.hung_up += 1
                self.hang_up()
            return False
        self._behind_s = None
        self._wire.write(b"".join(self._teller.data(lines, t_s)))
        return True

    def hang_up(self) -> None:
        """Close without waiting for bytes that nobody takes."""
        self._wire.abort()
