"""What makes the autopilot's failsafes act, and what a person does about it, on the embedded autopilot."""

from __future__ import annotations

import asyncio
import math

from pymavlink.dialects.v20 import ardupilotmega as mav

from companion.clock import now_s
from companion.messages import Mode
from sitl.autopilot import Autopilot, MemoryEnd
from sitl.scene import EventSpec

BEAT_S = 1.0
PERSONS = frozenset({"mode", "arm", "disarm", "set_current"})
FAILURES = frozenset({"radio_lost", "station", "knockdown", "battery", "leak"})


async def play(event: EventSpec, autopilot: Autopilot, station: MemoryEnd) -> None:
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
        autopilot.set_leak(leaks=True)
        await asyncio.sleep(lasts_s)
        autopilot.set_leak(leaks=False)
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
    await shore.open(lambda _: None)   # nobody looks at its screen
    try:
        while now_s() < until_s:
            shore.write(mav.MAVLink_heartbeat_message(mav.MAV_TYPE_GCS, 8, 0, 0, mav.MAV_STATE_ACTIVE, 3).pack(codec))
            codec.seq = (codec.seq + 1) & 0xFF
            await asyncio.sleep(BEAT_S)
    finally:
        await shore.close()
