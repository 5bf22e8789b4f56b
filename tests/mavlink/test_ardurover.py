"""The same orders to the simulated autopilot and to the real ArduRover (needs the program: ``sitl fetch``)."""

import asyncio

import pytest

from companion import clock
from companion.clock import now_s
from companion.mavlink.autopilot import Autopilot
from companion.mavlink.link import Link
from companion.mavlink.microservices.command import TransferOutcome
from companion.mavlink.reception import LinkIdentity
from companion.mavlink.transports import open_link
from companion.mavlink.wire.companion_status import StatusReader
from companion.mavlink.wire.items import first_difference, mission_hash
from companion.messages import Command, CompanionStatus, GeoPoint, MissionItem, Mode, StatusText, sailed_part, waypoint
from sitl.ardurover.simulation import ArduRover, find
from sitl.autopilot import HOME, AutopilotConfig, MemoryLink, SimulatedAutopilot, serve
from sitl.autopilot.memory_link import frames
from sitl.world.environment import Constant

PROGRAM = find()
SPEEDUP = 10.0
LAT, LON = round(HOME.lat_deg * 1e7), round(HOME.lon_deg * 1e7)
SHORE = LinkIdentity(system=254, component=25)


def mission(count, north=0.0):
    points = [GeoPoint(lat_deg=HOME.lat_deg + north, lon_deg=HOME.lon_deg + 0.001 * (i + 1)) for i in range(count)]
    return [*(waypoint(p) for p in points), waypoint(points[-1], command=Command.NAV_LOITER_UNLIM)]


class Lossy:
    """A transport that loses a share of the frames both ways."""

    def __init__(self, transport, rng):
        self.transport, self.rng, self.loss = transport, rng, 0.0

    name = property(lambda self: self.transport.name)
    stats = property(lambda self: self.transport.stats)
    state = property(lambda self: self.transport.state)

    async def open(self, on_bytes):
        def filtered(data):
            for frame in frames(data):
                if self.rng.random() >= self.loss:
                    on_bytes(frame)

        await self.transport.open(filtered)

    def write(self, data):
        if self.rng.random() >= self.loss:
            self.transport.write(data)

    async def close(self):
        await self.transport.close()


async def ready(autopilot):
    async with asyncio.timeout(120.0):
        while not (autopilot.status and autopilot.status.ekf_ok):  # noqa: ASYNC110 - the telemetry is the event
            await asyncio.sleep(0.5)


async def holds(autopilot, items):
    read = await autopilot.read_mission()
    assert read.is_ok, read
    assert mission_hash(read.items) == mission_hash(items)
    return read


async def orders(near, shore_near):
    """Give every kind of order and look at the answers."""
    import random

    line = Lossy(near, random.Random(1))
    async with (
        Link(line) as link,
        Link(shore_near, identity=SHORE, streams=(), is_quiet=True) as shore,
        Autopilot(link, timeout_s=60.0) as autopilot,
    ):
        reader, texts = StatusReader(), []
        shore.subscribe(reader.take)
        autopilot.on_value(lambda v: texts.append(v.text) if isinstance(v, StatusText) else None)
        await ready(autopilot)
        refused = await autopilot.set_mode(Mode.AUTO)
        assert (refused.outcome, "No Mission" in refused.text) == (TransferOutcome.REFUSED, True)

        for method in ("items", "ftp"):
            assert (await autopilot.upload_mission(mission(29), method=method)).is_ok
            await holds(autopilot, mission(29))
        assert (await autopilot.set_mode(Mode.AUTO)).is_ok
        assert (await autopilot.arm()).is_ok
        await asyncio.sleep(15.0)

        texts.clear()
        short = mission(5, 0.0005)
        assert (await autopilot.upload_mission(short, set_current=1)).method == "ftp"
        restarts = [t for t in texts if "restarted command" in t]
        assert len(restarts) == 1, "one restart of the leg for a whole mission"
        read = await holds(autopilot, short)
        assert len(read.items) == 30, "a running autopilot does not shorten its mission"
        assert set(read.items[6:]) == {read.items[5]}, "padding instead of the old tail"

        new = [*short[:2], *mission(8, 0.001)[2:]]
        assert (await autopilot.upload_mission(new, method="partial", keep_first=2)).is_ok
        await holds(autopilot, new)
        assert (await autopilot.set_current(99)).outcome is TransferOutcome.REFUSED

        odd = [
            MissionItem(command=16, lat_e7=LAT, lon_e7=LON, alt_m=1.236, frame=6, params=(3.7, 2.0, 3.0, 4.0)),
            MissionItem(command=17, lat_e7=LAT, lon_e7=LON, params=(1.0, 2.0, -12.0, 45.0)),
            MissionItem(command=19, lat_e7=LAT, lon_e7=LON, params=(30.0, 0.0, 10.0, 1.0)),
            MissionItem(command=93, params=(10.0, 0.0, 0.0, 0.0)),
            MissionItem(command=178, params=(1.0, 2.5, 50.0, 0.0)),
            MissionItem(command=20, params=(1.0, 2.0, 3.0, 4.0)),
        ]
        assert (await autopilot.upload_mission(odd)).is_ok
        assert first_difference(odd[:1], (await autopilot.read_mission()).items[:1]) == ""

        ring = [(LAT + 90000, LON - 90000), (LAT + 90000, LON + 400000), (LAT - 90000, LON + 400000)]
        fence = [
            *(MissionItem(command=5001, lat_e7=a, lon_e7=o, params=(3.0, 0.0, 0.0, 0.0), frame=0) for a, o in ring),
            MissionItem(command=5004, lat_e7=LAT + 50000, lon_e7=LON + 200000, params=(25.5, 0.0, 0.0, 0.0), frame=0),
        ]
        assert (await autopilot.upload_fence(fence)).is_ok
        bad = await autopilot.upload_fence([fence[0]] * 2)
        assert (bad.outcome, "Fence validation failed" in bad.text) == (TransferOutcome.REFUSED, True)
        assert first_difference(fence, (await autopilot.read_fence()).items) == "", "the old fence stays"
        assert (await autopilot.upload_rally([MissionItem(command=5100, lat_e7=LAT, lon_e7=LON + 9000)])).is_ok

        assert (await autopilot.get_parameter("MAV_SYSID")).value == 1.0
        assert (await autopilot.set_parameter("SAIL_XTRACK_MAX", 25.0)).value == 25.0
        table = await autopilot.read_parameters()
        assert (table.outcome, table.get("SAIL_XTRACK_MAX")) == (TransferOutcome.OK, 25.0)

        for _ in range(6):
            autopilot.send_status(CompanionStatus(t_s=now_s(), state="standard", tws_mps=5.0, twd_from_rad=1.0))
            await asyncio.sleep(2.0)
        report = reader.report(now_s())
        assert report is not None
        assert (report.has_packed, report.status.state) == (True, "standard")
        assert {"status", "wind", "co_twd"} <= set(report.age_s)

        assert (await autopilot.set_mode(Mode.GUIDED)).is_ok
        assert (await autopilot.set_mode(Mode.HOLD)).is_ok

        for method in ("items", "ftp"):
            line.loss = 0.3
            for _ in range(3):
                if (await autopilot.upload_mission(mission(7, 0.0007), method=method)).is_ok:
                    break
            line.loss = 0.0
            await asyncio.sleep(10.0)
            await holds(autopilot, mission(7, 0.0007))

        for life in range(3):  # programs that die during an upload
            upload = asyncio.ensure_future(Autopilot(link).upload_mission(mission(20), method="ftp"))
            await asyncio.sleep(0.3 + 0.2 * life)
            upload.cancel()
            await asyncio.gather(upload, return_exceptions=True)
        assert (await Autopilot(link).upload_mission(mission(4))).is_ok
        await holds(autopilot, mission(4))
        assert sailed_part(mission(4))[-1].command == Command.NAV_LOITER_UNLIM

        assert (await link.command(400, 0.0)).is_ok  # MAV_CMD_COMPONENT_ARM_DISARM: armed, it does not reboot
        await link.command(246, 1.0)  # MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN
        async with asyncio.timeout(60.0):
            while not (link.stats.reboots == 1 and link.is_alive):  # noqa: ASYNC110 - the telemetry is the event
                await asyncio.sleep(0.5)
        await asyncio.sleep(20.0)
        assert link.monitor.below_rate(now_s()) == (), "they are asked for again after a reboot"


def test_orders_to_the_simulated_autopilot():
    async def main():
        boat = SimulatedAutopilot(AutopilotConfig(), Constant(0.0, 5.0), seed=1)
        wire, radio = MemoryLink("wire", seed=1), MemoryLink("radio", seed=2)
        async with serve(boat, [wire.far, radio.far]):
            await orders(wire.near, radio.near)

    clock.run_virtual(main())


@pytest.mark.ardurover
@pytest.mark.skipif(PROGRAM is None, reason="no ardurover: run 'sitl fetch' or set $ARDUROVER")
def test_orders_to_the_real_ardurover(tmp_path):
    async def main():
        async with ArduRover(PROGRAM, HOME, Constant(0.0, 5.0), speedup=SPEEDUP, folder=tmp_path) as boat:
            await orders(open_link(boat.link), open_link(boat.shore_link))

    clock.run(main(), speedup=SPEEDUP)
