"""Fault injection: each kind of a scenario's event, as what it does to the simulated world.

Wind events are in the wind already; that the companion is killed is the runner's business.
"""

from __future__ import annotations

import asyncio
import math
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from typing import Any, Protocol

from pymavlink.dialects.v20 import ardupilotmega as mav

from companion.clock import now_s
from companion.geo.frame import LocalFrame
from companion.mavlink.autopilot import Autopilot
from companion.mavlink.link import Link
from companion.mavlink.reception import OWN_COMPONENT, LinkIdentity
from companion.mavlink.transports import Transport
from companion.mavlink.wire import Codec
from companion.messages import GeoPoint, MissionItem, Mode, waypoint
from sitl.autopilot import (
    AutopilotConfig,
    GpsFault,
    MemoryEnd,
    MemoryLink,
    RadioChannel,
    SimulatedAutopilot,
    VaneFault,
    VaneState,
    serve,
)
from sitl.faults.computer_faults import FaultyDisk, FaultyPlanner, KillablePlanner
from sitl.faults.ground_station import REDRAWN, give_order, redraw, set_parameter, wanted_by
from sitl.faults.link_faults import LINK_EVENTS, impair
from sitl.faults.satellite_link import Satellite, order_far
from sitl.faults.spoofing import Forger, forgery_named
from sitl.scenario import TRAFFIC, EventSpec, Motion, Others, TrueTrack
from sitl.world import WindModel

BEAT_S = 1.0
PING_S = 0.5
PERSONS = frozenset({"mode", "arm", "disarm", "set_current"})
FAILURES = frozenset({"radio_lost", "station", "knockdown", "battery", "leak", "sensor", "sounder"})


async def play(event: EventSpec, autopilot: SimulatedAutopilot, station: MemoryEnd) -> None:
    """Let one event happen, and end it after ``for_s``; ``station`` is the ground station's own end of a link."""
    lasts_s = math.inf if event.for_s is None else event.for_s
    if event.kind == "mode" and event.by == "radio":
        if not autopilot.pilot.radio.select(Mode[event.mode or "HOLD"]):
            raise ValueError(f"no place of the mode switch has {event.mode}: set MODE1 to MODE6 in [parameters]")
    elif event.kind == "mode":
        autopilot.set_mode(Mode[event.mode or "HOLD"])
    elif event.kind == "arm":
        autopilot.pilot.arming.arm(force=False)
    elif event.kind == "disarm":
        autopilot.pilot.arming.disarm()
    elif event.kind == "set_current":
        until_s = now_s() + (event.for_s or 0.0)
        autopilot.pilot.helm.set_current(event.seq, resets=False)
        while now_s() < until_s:
            await asyncio.sleep(BEAT_S)
            autopilot.pilot.helm.set_current(event.seq, resets=False)
    elif event.kind == "battery":
        autopilot.set_battery(event.volts or 0.0)
    elif event.kind == "leak":
        autopilot.set_sensor("LEAK", 1.0)
        await asyncio.sleep(lasts_s)
        autopilot.set_sensor("LEAK", 0.0)
    elif event.kind == "sensor":
        before = autopilot.core.sensors.get(event.sensor)
        autopilot.set_sensor(event.sensor, event.value)
        await asyncio.sleep(lasts_s)
        autopilot.set_sensor(event.sensor, before)
    elif event.kind == "sounder":
        began_s, core = now_s(), autopilot.core
        before_m = event.value if core.depth_m is None else core.depth_m
        while (share := (now_s() - began_s) / event.over_s if event.over_s else 1.0) < 1.0:
            core.depth_m = before_m + share * (event.value - before_m)
            await asyncio.sleep(PING_S)
        core.depth_m = event.value
        if event.for_s is not None:
            await asyncio.sleep(began_s + event.for_s - now_s())
            core.depth_m = None
    elif event.kind == "radio_lost":
        autopilot.pilot.radio.switch(is_on=False)
        await asyncio.sleep(lasts_s)
        autopilot.pilot.radio.switch(is_on=True)
    elif event.kind == "knockdown":
        autopilot.set_roll(math.radians(event.roll_deg))
        await asyncio.sleep(lasts_s)
        autopilot.set_roll(0.0)
    elif event.kind == "station":
        await _station(station, now_s() + lasts_s)


async def _station(shore: MemoryEnd, until_s: float) -> None:
    """Be a ground station: nothing but a heartbeat a second."""
    codec = mav.MAVLink(None, srcSystem=255, srcComponent=mav.MAV_COMP_ID_MISSIONPLANNER)
    await shore.open(lambda _: None)  # nobody looks at its screen
    try:
        while now_s() < until_s:
            shore.write(mav.MAVLink_heartbeat_message(mav.MAV_TYPE_GCS, 8, 0, 0, mav.MAV_STATE_ACTIVE, 3).pack(codec))
            codec.seq = (codec.seq + 1) & 0xFF
            await asyncio.sleep(BEAT_S)
    finally:
        await shore.close()


class Observer(Protocol):
    """Whoever looks at a run from the outside, beside its judge."""

    def truth(self, t_s: float, autopilot: SimulatedAutopilot, link: MemoryLink) -> None:
        """Look at the autopilot; called every ``TRUTH_EVERY_S`` of a run, from its first moment."""

    def life(self, start_s: float, end_s: float) -> None:
        """Take one life of the companion's process."""


@dataclass(slots=True)
class SimulatedWorld:
    """What a running scenario shares between its tasks."""

    autopilot: SimulatedAutopilot
    link: MemoryLink
    shore: MemoryLink
    station: MemoryLink  # a ground station that beats, where a scenario has one
    others: Others
    frame: LocalFrame
    wind: WindModel
    seed: int
    neighbours: dict[int, MemoryLink] = field(default_factory=dict)  # lines of those that are ever heard, by system
    forgers: list[Forger] = field(default_factory=list)
    air: RadioChannel | None = None  # where there is more than one who speaks on the companion's channel
    ordered: list[int] = field(default_factory=list)  # systems of neighbours that were given orders
    truth: TrueTrack = field(default_factory=TrueTrack)
    status_s: list[float] = field(default_factory=list)
    alerts: dict[str, int] = field(default_factory=dict)
    errors: list[str] = field(default_factory=list)
    summary: dict[str, Any] = field(default_factory=dict)  # of the last life
    lives: list[dict[str, Any]] = field(default_factory=list)  # the summary that each left
    set_sail_s: float | None = None
    planner: FaultyPlanner | KillablePlanner = field(default_factory=FaultyPlanner)
    disk: FaultyDisk = field(default_factory=FaultyDisk)
    observer: Observer | None = None
    satellite: Satellite | None = None
    stranger: asyncio.Lock = field(default_factory=asyncio.Lock)  # one ground station, one upload at a time
    called: asyncio.Event = field(default_factory=asyncio.Event)  # the companion calls its crew to the anchor
    called_at_s: list[float] = field(default_factory=list)

    def heard_by(self) -> Transport:
        """Return the companion's end of its channel."""
        return self.link.near if self.air is None else self.air


def channel(world: SimulatedWorld, events: tuple[EventSpec, ...]) -> None:
    """Let neighbours and forgers that there will be have a place on the companion's channel."""
    for event in events:
        if event.kind == "neighbour" and event.system not in world.neighbours:
            world.neighbours[event.system] = MemoryLink(f"neighbour {event.system}", seed=world.seed + event.system)
    is_forged = any(e.kind in {"spoof", "company"} for e in events)
    if world.neighbours or is_forged:

        def overheard(data: bytes) -> None:
            for forger in world.forgers:
                forger.hear(now_s(), data)

        others = (line.near for line in world.neighbours.values())
        world.air = RadioChannel(world.link.near, *others, on_heard=overheard)


async def inject(world: SimulatedWorld, event: EventSpec) -> None:
    """Make one event happen at its time, and end after ``for_s``."""
    if event.kind in _BY_KIND:
        await _BY_KIND[event.kind](world, event)


# ------------------------------------------------------------------------------------- one by one
async def _begins(event: EventSpec) -> None:
    await asyncio.sleep(max(0.0, event.at_s - now_s()))


def _switched(do: Callable[[SimulatedWorld, EventSpec], None], undo: Callable[[SimulatedWorld], None]) -> _Inject:
    """Return an event that is there from its time on, for ``for_s``."""

    async def happens(world: SimulatedWorld, event: EventSpec) -> None:
        await _begins(event)
        do(world, event)
        if event.for_s is not None:
            await asyncio.sleep(event.for_s)
            undo(world)

    return happens


def _at(do: Callable[[SimulatedWorld, EventSpec], None]) -> _Inject:
    return _switched(do, lambda _: None)


def _ashore(ask: Callable[[SimulatedWorld, EventSpec], Awaitable[str]]) -> _Inject:
    """Have a ground station of a person's do something, one at a time; what went wrong is an error of the voyage."""

    async def inject(world: SimulatedWorld, event: EventSpec) -> None:
        await _begins(event)
        async with world.stranger:
            trouble = await ask(world, event)
        if trouble:
            world.errors.append(trouble)

    return inject


async def _failsafe(world: SimulatedWorld, event: EventSpec) -> None:
    await _begins(event)
    await play(event, world.autopilot, world.station.near)


async def _link(world: SimulatedWorld, event: EventSpec) -> None:
    await _begins(event)
    await impair(world.link, event)


async def _vane(world: SimulatedWorld, event: EventSpec) -> None:
    await _begins(event)
    await break_vane(world.autopilot.set_vane, event)


async def _crew(world: SimulatedWorld, event: EventSpec) -> None:
    await _begins(event)
    await world.called.wait()
    await asyncio.sleep(event.react_s)
    world.autopilot.core.vehicle.anchor(down=True)
    if event.for_s is not None:
        await asyncio.sleep(event.for_s)
        world.autopilot.core.vehicle.anchor(down=False)


async def _traffic(world: SimulatedWorld, event: EventSpec) -> None:
    await _begins(event)
    await world.others.play(event, 0.0, lambda: _ours(world.autopilot, world.frame))


async def _foreign(world: SimulatedWorld, event: EventSpec) -> None:
    await _begins(event)
    away = world.frame.geo_from_en(event.east_m, event.north_m)
    async with world.stranger:
        await _upload_foreign(world.shore.near, [waypoint(away)])


async def _company(world: SimulatedWorld, event: EventSpec) -> None:
    """Be another companion with our ids, at work: it says so once a second."""
    await _begins(event)
    other, until_s = Codec(1, OWN_COMPONENT), math.inf if event.for_s is None else event.at_s + event.for_s
    beat = mav.MAVLink_heartbeat_message(
        mav.MAV_TYPE_ONBOARD_CONTROLLER, mav.MAV_AUTOPILOT_INVALID, 0, 0x0BAD, mav.MAV_STATE_ACTIVE, 3
    )
    while now_s() < until_s and world.air is not None:
        world.air.say(other.pack(beat))
        await asyncio.sleep(1.0)


def _refuse(world: SimulatedWorld, event: EventSpec) -> None:
    world.autopilot.pilot.refuse(event.its_state)


async def _neighbour(world: SimulatedWorld, event: EventSpec) -> None:
    """Be another boat's autopilot that comes into range; it is nobody's to order about."""
    await _begins(event)
    here = world.autopilot.truth.position
    other = SimulatedAutopilot(
        AutopilotConfig(
            home=GeoPoint(lat_deg=here.lat_deg + 0.01, lon_deg=here.lon_deg),
            sysid=event.system,
            uid=b"neighbour",
            vehicle_type=event.vehicle_type,
            is_warm=True,
            is_moored=True,
        ),
        world.wind,
        seed=world.seed + event.system,
    )
    async with serve(other, [world.neighbours[event.system].far]):
        try:
            await asyncio.sleep(math.inf if event.for_s is None else event.for_s)
        finally:
            if other.truth.is_armed or other.pilot.helm.mission.total > 1:
                world.ordered.append(event.system)


async def _far_order(world: SimulatedWorld, event: EventSpec) -> None:
    await _begins(event)
    assert world.satellite is not None
    await order_far(world.satellite, event, world.frame, wanted_by, world.errors)


async def _spoof(world: SimulatedWorld, event: EventSpec) -> None:
    forger, forgery = Forger(listens=event.listens, seed=world.seed), forgery_named(event.forgery)
    world.forgers.append(forger)
    await _begins(event)
    until_s = math.inf if event.for_s is None else event.at_s + event.for_s
    while now_s() < until_s and world.air is not None:
        world.air.say(forger.frame(now_s(), forgery))
        await asyncio.sleep(1.0 / event.rate_hz)
    world.forgers.remove(forger)


def _ours(autopilot: SimulatedAutopilot, frame: LocalFrame) -> tuple[Motion, float]:
    """Return how our boat truly moves, and its heading [rad]."""
    now = autopilot.truth
    return (frame.en_from_geo(now.position), now.velocity_en_mps), now.heading_rad


async def break_vane(set_vane: Callable[[VaneFault], None], event: EventSpec) -> None:
    """Break the vane as ``event`` says, and mend it after ``for_s``."""
    set_vane(VaneFault(state=VaneState(event.its_state), value_rad=math.radians(event.value_deg)))
    if event.for_s is not None:
        await asyncio.sleep(event.for_s)
        set_vane(VaneFault())


async def _upload_foreign(end: MemoryEnd, items: list[MissionItem]) -> None:
    """Upload ``items`` as a ground station does: over a link of its own, as 255/190."""
    async with (
        Link(end, identity=LinkIdentity(system=255, component=190), streams=()) as link,
        Autopilot(link) as pilot,
    ):
        await pilot.upload_mission(items, method="items")


_Inject = Callable[[SimulatedWorld, EventSpec], Awaitable[None]]
_BY_KIND: dict[str, _Inject] = {
    **dict.fromkeys(PERSONS | FAILURES, _failsafe),
    **dict.fromkeys(LINK_EVENTS, _link),
    **dict.fromkeys(TRAFFIC, _traffic),
    "reboot": _at(lambda world, _: world.autopilot.reboot()),
    "gps_jump": _switched(
        lambda world, e: world.autopilot.set_gps(
            GpsFault(
                east_m=e.east_m, north_m=e.north_m, is_resisted=e.is_resisted, over_s=e.over_s, is_of_one=e.is_of_one
            )
        ),
        lambda world: world.autopilot.set_gps(GpsFault()),
    ),
    "gps_lost": _switched(
        lambda world, _: world.autopilot.set_gps(GpsFault(is_lost=True)),
        lambda world: world.autopilot.set_gps(GpsFault()),
    ),
    "compass": _switched(
        lambda world, e: world.autopilot.set_compass(math.radians(e.value_deg)),
        lambda world: world.autopilot.set_compass(0.0),
    ),
    "current": _switched(
        lambda world, e: world.autopilot.set_current(math.radians(e.set_deg), e.drift_mps),
        lambda world: world.autopilot.set_current(0.0, 0.0),
    ),
    "disk": _switched(lambda world, e: world.disk.become(e.its_state), lambda world: world.disk.become("ok")),
    "kill_planner": _at(lambda world, _: world.planner.die()),
    "planner_hang": _at(lambda world, e: world.planner.hang(math.inf if e.for_s is None else now_s() + e.for_s)),
    "planner_starved": _at(lambda world, _: world.planner.starve()),
    "vane": _vane,
    "crew": _crew,
    "order": _ashore(lambda world, e: give_order(world.shore.near, e, world.frame)),
    "far_order": _far_order,
    "foreign_mission": _foreign,
    "parameter": _ashore(lambda world, e: set_parameter(world.shore.near, e)),
    **dict.fromkeys(REDRAWN, _ashore(lambda world, e: redraw(world.shore.near, e, world.frame))),
    "company": _company,
    "refused": _switched(_refuse, lambda world: world.autopilot.pilot.refuse("")),
    "neighbour": _neighbour,
    "spoof": _spoof,
}
