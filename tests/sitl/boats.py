"""Boats for the tests: one in its own process, one in this one under the virtual clock."""

from __future__ import annotations

import asyncio
import contextlib
import math
import socket
import subprocess
import sys
from collections.abc import Awaitable, Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mav

from companion.clock import now_s, run_virtual
from companion.geo.frame import LocalFrame
from sitl.autopilot import HOME, AutopilotConfig, MemoryLink, SimulatedAutopilot, serve
from sitl.world.environment import Constant, WindModel

FRAME = LocalFrame(HOME)


def free_port(kind: int) -> int:
    with socket.socket(socket.AF_INET, kind) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@contextlib.contextmanager
def boat_process(*options: str) -> Iterator[tuple[str, int, int]]:
    """Run ``sitl boat``; yields host, TCP port, UDP port."""
    tcp, udp = free_port(socket.SOCK_STREAM), free_port(socket.SOCK_DGRAM)
    process = subprocess.Popen(
        [sys.executable, "-m", "sitl.cli", "boat", "--port", str(tcp), "--udp", str(udp), *options],
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        line = process.stdout.readline()
        assert line.startswith("sitl boat:"), line
        yield "127.0.0.1", tcp, udp
    finally:
        process.terminate()
        process.wait(10.0)
        process.stdout.close()


def e7(east: float, north: float) -> tuple[int, int]:
    p = FRAME.geo_from_en(east, north)
    return round(p.lat_deg * 1e7), round(p.lon_deg * 1e7)


def en(lat_e7: int, lon_e7: int) -> tuple[float, float]:
    from companion.messages import GeoPoint

    return FRAME.en_from_geo(GeoPoint(lat_deg=lat_e7 / 1e7, lon_deg=lon_e7 / 1e7))


@dataclass
class Client:
    """A client of the simulated boat that keeps everything it hears with its time."""

    write: Callable[[bytes], None]
    autopilot: SimulatedAutopilot
    component: int = 191
    system: int = 1
    heard: list[tuple[float, Any]] = field(default_factory=list)
    answers: dict[str, Callable[[Any], None]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.codec = mav.MAVLink(None, srcSystem=self.system, srcComponent=self.component)
        self.codec.robust_parsing = True
        self.bytes_in = b""
        self.waiting: list[tuple[str, Callable[[Any], bool], asyncio.Future[Any]]] = []

    def on_bytes(self, data: bytes) -> None:
        self.bytes_in += data
        for m in self.codec.parse_buffer(data) or ():
            self.heard.append((now_s(), m))
            answer = self.answers.get(m.get_type())
            if answer is not None:
                answer(m)
            for name, test, future in self.waiting:
                if name == m.get_type() and not future.done() and test(m):
                    future.set_result(m)

    def send(self, message: Any) -> None:
        self.write(message.pack(self.codec))
        self.codec.seq = (self.codec.seq + 1) & 0xFF

    def command(self, number: int, *params: float) -> None:
        given = [*params, *([0.0] * 7)][:7]
        self.send(mav.MAVLink_command_long_message(1, 1, number, 0, *given))

    def rate(self, msgid: int, hertz: float) -> None:
        self.command(mav.MAV_CMD_SET_MESSAGE_INTERVAL, msgid, 1e6 / hertz)

    def of(self, name: str, since: float = -1.0) -> list[Any]:
        return [m for t, m in self.heard if t >= since and m.get_type() == name]

    def times(self, name: str) -> list[float]:
        return [t for t, m in self.heard if m.get_type() == name]

    def texts(self, since: float = -1.0) -> list[str]:
        return [m.text for m in self.of("STATUSTEXT", since) if not m.text.startswith("Field Elevation")]

    def text_time(self, start: str, nth: int = 0) -> float:
        return [t for t, m in self.heard if m.get_type() == "STATUSTEXT" and m.text.startswith(start)][nth]

    def last(self, name: str) -> Any:
        return self.of(name)[-1]

    async def wait(self, name: str, timeout: float = 30.0, test: Callable[[Any], bool] = lambda m: True) -> Any:
        entry = (name, test, asyncio.get_running_loop().create_future())
        self.waiting.append(entry)
        try:
            async with asyncio.timeout(timeout):
                return await entry[2]
        except TimeoutError:
            raise AssertionError(f"no {name} within {timeout} s; texts: {self.texts()[-5:]}") from None
        finally:
            self.waiting.remove(entry)

    async def ask(self, number: int, *params: float) -> int:
        self.command(number, *params)
        return (await self.wait("COMMAND_ACK", 2.0, lambda m: m.command == number)).result

    def item(self, seq: int, spec: Any, kind: int = 0) -> Any:
        if isinstance(spec, tuple):
            spec = {"en": spec}
        lat, lon = spec.get("e7") or (e7(*spec["en"]) if "en" in spec else (0, 0))
        return mav.MAVLink_mission_item_int_message(
            1,
            1,
            seq,
            spec.get("frame", 3),
            spec.get("command", 16),
            0,
            1,
            spec.get("p1", 0.0),
            spec.get("p2", 0.0),
            0.0,
            0.0,
            lat,
            lon,
            0.0,
            kind,
        )

    async def upload(self, specs: Sequence[Any], kind: int = 0, timeout: float = 30.0) -> int:
        """Upload; a mission gets a home in front. Returns the MISSION_ACK."""
        items = [(0.0, 0.0), *specs] if kind == 0 else list(specs)
        self.answers["MISSION_REQUEST"] = lambda m: self.send(self.item(m.seq, items[m.seq], kind))
        self.send(mav.MAVLink_mission_count_message(1, 1, len(items), kind))
        ack = await self.wait("MISSION_ACK", timeout, lambda m: m.mission_type == kind)
        self.answers.pop("MISSION_REQUEST", None)
        return ack.type

    async def download(self, kind: int = 0) -> list[Any]:
        self.send(mav.MAVLink_mission_request_list_message(1, 1, kind))
        count = (await self.wait("MISSION_COUNT", 2.0, lambda m: m.mission_type == kind)).count
        out = []
        for seq in range(count):
            self.send(mav.MAVLink_mission_request_int_message(1, 1, seq, kind))
            out.append(await self.wait("MISSION_ITEM_INT", 2.0, lambda m, s=seq: m.seq == s))
        return out

    async def set_sail(self, specs: Sequence[Any]) -> None:
        assert await self.upload(specs) == 0
        assert await self.ask(mav.MAV_CMD_DO_SET_MODE, 1, 10) == 0
        assert await self.ask(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1) == 0


def sail(
    job: Callable[[Client], Awaitable[Any]],
    *,
    wind: WindModel | None = None,
    seed: int = 1,
    is_warm: bool = True,
    is_moored: bool = False,
    has_motor: bool = False,
    heading_deg: float = 0.0,
    **parameters: float,
) -> Any:
    """Run ``job`` with a client of a boat, under the virtual clock."""

    async def main() -> Any:
        config = AutopilotConfig(
            is_warm=is_warm,
            is_moored=is_moored,
            heading_rad=math.radians(heading_deg),
            parameters=parameters,
            has_motor=has_motor,
        )
        autopilot = SimulatedAutopilot(config, wind or Constant(0.0, 5.0), seed)
        link = MemoryLink(seed=seed)
        client = Client(link.near.write, autopilot)
        await link.near.open(client.on_bytes)
        async with serve(autopilot, [link.far]):
            return await job(client)

    return run_virtual(main())
