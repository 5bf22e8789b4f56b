"""The shell of the simulated autopilot: transports and the event loop's clock around the core.

The loop may run in real time, faster, or under the virtual clock: one task lets simulated time follow it. The
task sleeps until the next loop of the autopilot in which something is due, or until bytes arrive; they are read
at the following loop of 20 ms, as on the real one.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Sequence
from typing import Any

from companion.clock import ended, now_s
from companion.errors import LinkError
from companion.mavlink.transports import LinkName, Transport, open_link, parse_link
from sitl.autopilot.autopilot import SimulatedAutopilot
from sitl.autopilot.config import Truth
from sitl.autopilot.link import LOOP_S

# Behind by more than this the machine is too slow for the speed asked for: simulated time stretches instead.
MAX_LAG_S = 2.0
# Never sleep longer: ``truth`` is read by others between wakes.
MAX_SLEEP_S = 0.2
MAX_PEERS = 8


class Server:
    """A running simulated autopilot."""

    def __init__(self, autopilot: SimulatedAutopilot) -> None:
        self.autopilot = autopilot
        self.lag_s = 0.0
        self._ports: dict[int, Any] = {}
        self._numbers = 0
        self._wake: asyncio.Future[None] | None = None
        self._zero_s: float | None = None
        self._task: asyncio.Task[None] | None = None

    @property
    def truth(self) -> Truth:
        """The truth at this moment of the loop's clock (``autopilot.truth`` may be up to 0.2 s old)."""
        self.catch_up()
        return self.autopilot.truth

    # ----------------------------------------------------------------------------------------------- ports
    def add_port(self, write: Any) -> int:
        """Open a port of the autopilot whose output goes to ``write(bytes)``, None: nowhere; return its number."""
        number = self._numbers
        self._numbers += 1
        self._ports[number] = write
        self.autopilot.open_link(number).is_plugged = write is not None
        self._kick()
        return number

    def remove_port(self, number: int) -> None:
        """Take a port away."""
        self._ports.pop(number, None)
        self.autopilot.close_link(number)

    def receive(self, number: int, data: bytes) -> None:
        """Bytes for a port."""
        if number in self._ports:
            self.autopilot.receive(number, data)
            self._kick()

    def _kick(self) -> None:
        if self._wake is not None and not self._wake.done():
            self._wake.set_result(None)

    # ------------------------------------------------------------------------------------------------ time
    def catch_up(self) -> None:
        """Bring the autopilot up to the clock and send what it says."""
        if self._zero_s is None:
            self._zero_s = now_s() - self.autopilot.t_s
        loops = int((now_s() - self._zero_s - self.autopilot.t_s) / LOOP_S + 1e-6)
        if loops > 0:
            lag_s = loops * LOOP_S
            if lag_s > MAX_LAG_S:
                self._zero_s += lag_s - MAX_LAG_S
                self.lag_s += lag_s - MAX_LAG_S
                loops = int(MAX_LAG_S / LOOP_S)
            self.autopilot.step(loops * LOOP_S)
        self._flush()

    def _flush(self) -> None:
        links = self.autopilot.links
        for number, write in list(self._ports.items()):
            link = links.get(number)
            if link is not None and link.has_output:
                write(link.take())

    async def wait(self, for_s: float | None = None) -> bool:
        """Return whether the simulation goes on: when it ended with an error, or after ``for_s`` simulated seconds."""
        if self._task is None:
            return False
        return bool((await asyncio.wait([self._task], timeout=for_s))[1])

    def follow(self, task: asyncio.Task[None]) -> None:
        """Remember who lets time pass."""
        self._task = task

    async def run(self) -> None:
        """Follow the clock for ever."""
        loop = asyncio.get_running_loop()
        while True:
            self.catch_up()
            assert self._zero_s is not None
            due_s = self._zero_s + min(self.autopilot.next_wake_s, self.autopilot.t_s + MAX_SLEEP_S)
            self._wake = loop.create_future()
            timer = loop.call_at(due_s, self._kick)
            await self._wake
            timer.cancel()
            # bytes that came early wait for the next loop
            next_s = self._zero_s + self.autopilot.t_s + LOOP_S
            if now_s() < next_s - 1e-6:
                await asyncio.sleep(next_s - now_s())


class _UdpPort(asyncio.DatagramProtocol):
    """A listening UDP endpoint: every peer that speaks has a port of its own, up to ``MAX_PEERS``."""

    def __init__(self, server: Server) -> None:
        self._server = server
        self._wire: Any = None
        self._peers: dict[Any, int] = {}

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._wire = transport

    def datagram_received(self, data: bytes, addr: Any) -> None:
        number = self._peers.get(addr)
        if number is None:
            if len(self._peers) >= MAX_PEERS:
                first, gone = next(iter(self._peers.items()))
                del self._peers[first]
                self._server.remove_port(gone)
            number = self._peers[addr] = self._server.add_port(lambda out: self._send(out, addr))
        self._server.receive(number, data)

    def error_received(self, exc: Exception) -> None:
        """A peer that closed its socket: the next datagram may find another."""

    def _send(self, data: bytes, addr: Any) -> None:
        if self._wire is not None and not self._wire.is_closing():
            # a datagram holds whole frames and stays below the loopback's and the Ethernet's limits
            for piece in pieces(data):
                self._wire.sendto(piece, addr)


class _TcpPort(asyncio.Protocol):
    """One client of a TCP server."""

    def __init__(self, server: Server) -> None:
        self._server = server
        self._number: int | None = None

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._number = self._server.add_port(lambda out: self._send(transport, out))

    @staticmethod
    def _send(transport: Any, data: bytes) -> None:
        if not transport.is_closing() and transport.get_write_buffer_size() < 1 << 20:
            transport.write(data)

    def data_received(self, data: bytes) -> None:
        if self._number is not None:
            self._server.receive(self._number, data)

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002 - the interface has it
        if self._number is not None:
            self._server.remove_port(self._number)


def pieces(data: bytes, limit: int = 1200) -> list[bytes]:
    """Split output into datagrams of whole MAVLink 2 frames."""
    out: list[bytes] = []
    start = end = 0
    while end < len(data):
        size = 12 + data[end + 1] + (13 if data[end + 2] & 1 else 0) if data[end] == 0xFD else len(data) - end
        if end + size - start > limit and end > start:
            out.append(data[start:end])
            start = end
        end += size
    out.append(data[start:])
    return out


async def _open(server: Server, endpoint: Transport | str | None, stack: contextlib.AsyncExitStack) -> None:
    loop = asyncio.get_running_loop()
    if endpoint is None:
        server.add_port(None)
        return
    if isinstance(endpoint, str):
        name = parse_link(endpoint)
        if name.kind in {"udpin", "tcpin"}:
            try:
                await _listen(server, name, stack, loop)
            except OSError as error:
                raise LinkError(f"{endpoint}: {error.strerror or error}") from error
            return
        endpoint = open_link(endpoint)
    transport = endpoint
    number = server.add_port(transport.write)
    await transport.open(lambda data: server.receive(number, data))
    stack.push_async_callback(transport.close)


async def _listen(
    server: Server, name: LinkName, stack: contextlib.AsyncExitStack, loop: asyncio.AbstractEventLoop
) -> None:
    if name.kind == "udpin":
        wire, _ = await loop.create_datagram_endpoint(lambda: _UdpPort(server), local_addr=(name.host, name.port))
        stack.callback(wire.abort)
    else:
        listener = await loop.create_server(lambda: _TcpPort(server), name.host, name.port)
        stack.callback(listener.close)


@contextlib.asynccontextmanager
async def serve(autopilot: SimulatedAutopilot, endpoints: Sequence[Transport | str | None]) -> AsyncIterator[Server]:
    """Run ``autopilot`` on the running loop's clock while the block runs.

    Args:
        autopilot: the core; nobody else may step it meanwhile.
        endpoints: transports (``MemoryLink.far``) or LINK names. ``udpin:`` and ``tcpin:`` serve several clients,
            each on a port of the autopilot of its own; ``udpout:`` speaks first. None: a port with nothing plugged in.

    Raises:
        LinkError: an endpoint cannot be had.
        Exception: what went wrong in the simulation, when the block ends.
    """
    server = Server(autopilot)
    async with contextlib.AsyncExitStack() as stack:
        for endpoint in endpoints:
            await _open(server, endpoint, stack)
        task = asyncio.create_task(server.run(), name="simulated autopilot")
        server.follow(task)
        try:
            yield server
        finally:
            await ended(task)
