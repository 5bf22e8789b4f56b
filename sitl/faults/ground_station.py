"""The crew ashore: gives a scenario's orders, sets its parameters and redraws lists over real MAVLink."""

from __future__ import annotations

import contextlib
from collections.abc import AsyncIterator
from dataclasses import replace

from pymavlink.dialects.v20 import ardupilotmega as mav

from companion.geo.frame import LocalFrame
from companion.mavlink.autopilot import Autopilot
from companion.mavlink.link import Link
from companion.mavlink.reception import SHORE
from companion.mavlink.transports import Transport
from companion.messages import Command, GeoPoint, waypoint
from companion.orders import Place, Verb, Wanted, give, phrase
from sitl.scenario import EventSpec

REDRAWN = frozenset({"home", "fence", "rally", "edit_item"})  # by the ground station
HEARD_S = 30.0  # for the boat's autopilot to be heard


def wanted_by(event: EventSpec, frame: LocalFrame) -> Wanted:
    """Return what an event orders; a goal without a position is at its ``east_m`` and ``north_m``."""
    if event.order.strip() != Verb.GOAL:
        return phrase(event.order.split())
    there = frame.geo_from_en(event.east_m, event.north_m)
    return Wanted(verb=Verb.GOAL, place=Place(lat_deg=there.lat_deg, lon_deg=there.lon_deg))


async def give_order(transport: Transport, event: EventSpec, frame: LocalFrame) -> str:
    """Give an event's order; return what was wrong with its answer, empty: it was the one that is expected."""
    wanted = wanted_by(event, frame)
    async with Link(transport, identity=SHORE, streams=(), is_quiet=True) as link:
        await link.wait_autopilot(HEARD_S)
        answer = await give(link, wanted)
    if answer.result.value == event.answer:
        return ""
    return f"the order {wanted.words} at {event.at_s:g} s was answered {answer.result.value!r}: {answer.text}"


@contextlib.asynccontextmanager
async def _station(transport: Transport) -> AsyncIterator[Autopilot]:
    async with Link(transport, identity=SHORE, streams=(), is_quiet=True) as link, Autopilot(link) as pilot:
        await link.wait_autopilot(HEARD_S)
        yield pilot


async def set_parameter(transport: Transport, event: EventSpec) -> str:
    """Set a parameter of the autopilot for good; return what went wrong, empty: nothing."""
    async with _station(transport) as pilot:
        answer = await pilot.set_parameter(event.parameter, event.value)
    return "" if answer.is_ok else f"{event.parameter} could not be set at {event.at_s:g} s: {answer.text}"


async def redraw(transport: Transport, event: EventSpec, frame: LocalFrame) -> str:
    """Move home, or draw a list of the autopilot's anew; return what went wrong, empty: nothing."""
    there = frame.geo_from_en(event.east_m, event.north_m)
    async with _station(transport) as pilot:
        if event.kind == "home":
            answer = await pilot.link.command(mav.MAV_CMD_DO_SET_HOME, message=_home_at(pilot, there))
            return "" if answer.is_ok else f"home could not be moved at {event.at_s:g} s: {answer.text}"
        if event.kind == "rally":
            done = await pilot.upload_rally([waypoint(there, command=Command.NAV_RALLY_POINT)])
        elif event.kind == "edit_item":
            read = await pilot.read_mission()
            items = list(read.items or ())
            items[event.seq - 1] = replace(
                items[event.seq - 1], lat_e7=round(there.lat_deg * 1e7), lon_e7=round(there.lon_deg * 1e7)
            )
            done = await pilot.upload_mission(items, method="items")
        else:
            answer = await pilot.enable_fence(enabled=False)
            if event.its_state == "off":
                return "" if answer.is_ok else f"the fence could not be switched off at {event.at_s:g} s"
            circle = waypoint(there, command=Command.NAV_FENCE_CIRCLE_INCLUSION)
            done = await pilot.upload_fence([replace(circle, params=(event.radius_m, 0.0, 0.0, 0.0))])
            await pilot.enable_fence()
    return "" if done.is_ok else f"the {event.kind} could not be drawn at {event.at_s:g} s: {done.text}"


def _home_at(pilot: Autopilot, there: GeoPoint) -> mav.MAVLink_message:
    return mav.MAVLink_command_int_message(
        pilot.link.party.target_system,
        1,
        0,
        mav.MAV_CMD_DO_SET_HOME,
        0,
        0,
        0.0,
        0.0,
        0.0,
        0.0,
        round(there.lat_deg * 1e7),
        round(there.lon_deg * 1e7),
        0.0,
    )
