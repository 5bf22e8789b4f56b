"""The lookout: every vessel's approach, alarm and rule each step, and what is said of them.

An alarm needs CPA and TCPA both under their limits, and is said when it rises, then again every half minute. The rules
of the road are shown, never relied upon: the boat keeps clear of everyone (``companion.traffic.colregs``).
"""

from __future__ import annotations

from companion.skipper.actions import Severity
from companion.skipper.config import SkipperConfig
from companion.skipper.turn import Turn
from companion.traffic import Alarm, AlarmLimits, OwnShip, assess

SHOWN = 8                # vessels kept in the state: the worst
# Acting begins nearer than warning: the shares of a lake's limits (``companion.traffic.LAKE``).
ACT_CPA, ACT_TCPA = 0.4, 0.5
SEVERITY = {Alarm.WARN: Severity.WARNING, Alarm.ACT: Severity.CRITICAL, Alarm.TOUCH: Severity.CRITICAL}


def limits(config: SkipperConfig) -> AlarmLimits:
    """Return when to warn and to act, from the distance and the time that the mission calls safe."""
    return AlarmLimits(
        warn_cpa_m=config.traffic_clearance_m, warn_tcpa_s=config.traffic_time_s,
        act_cpa_m=ACT_CPA * config.traffic_clearance_m, act_tcpa_s=ACT_TCPA * config.traffic_time_s)


def look_out(turn: Turn) -> None:
    """Judge the vessels in view and announce alarms that are new or go on."""
    picture, vehicle, boat = turn.snapshot.traffic, turn.snapshot.vehicle, turn.boat_en
    if picture is None or vehicle is None or boat is None or not picture.vessels:
        if turn.state.watch:
            turn.update(watch=())
        return
    hull, wind = turn.voyage.boat.hull, turn.wind_now
    own = OwnShip(
        t_s=turn.t_s, en_m=boat, velocity_en_mps=vehicle.velocity_en_mps, heading_rad=vehicle.heading_rad,
        radius_m=hull.reach_m)
    before = {(a.vessel.mmsi, a.vessel.branch): a.alarm for a in turn.state.watch}
    found = assess(own, picture, limits(turn.config), None if wind is None else wind[0])[:SHOWN]
    turn.update(watch=found)
    for seen in found:
        if seen.alarm is Alarm.NONE:
            break                           # the worst come first
        rises = seen.alarm > before.get((seen.vessel.mmsi, seen.vessel.branch), Alarm.NONE)
        if rises or seen is found[0]:
            turn.say(SEVERITY[seen.alarm], "vessel near", seen.sentence(), every_s=0.0 if rises else None)
