"""The crew ashore: gives a scenario's orders and sets its parameters over real MAVLink, as ``companion`` does there."""

from __future__ import annotations

from companion.geo.frame import LocalFrame
from companion.mavlink.autopilot import Autopilot
from companion.mavlink.link import Link
from companion.mavlink.transports import Transport
from companion.mavlink.trust import SHORE
from companion.orders import Place, Verb, Wanted, give, phrase
from sitl.scene import EventSpec

HEARD_S = 30.0   # for the boat's autopilot to be heard


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


async def set_parameter(transport: Transport, event: EventSpec) -> str:
    """Set a parameter of the autopilot for good; return what went wrong, empty: nothing."""
    async with Link(transport, identity=SHORE, streams=(), is_quiet=True) as link, Autopilot(link) as pilot:
        await link.wait_autopilot(HEARD_S)
        answer = await pilot.set_parameter(event.parameter, event.value)
    return "" if answer.is_ok else f"{event.parameter} could not be set at {event.at_s:g} s: {answer.text}"
