"""The lookout: every vessel's approach, alarm and rule each step, and what is said of them.

An alarm needs CPA and TCPA both under their limits. Of each vessel one line is said in half a minute, one vessel a
step and the worst first: among many nobody can read more. The rules of the road are shown, never relied upon: the boat
keeps clear of everyone (``companion.traffic.colregs``).
"""

from __future__ import annotations

from collections.abc import Sequence

from companion.skipper.step.actions import Severity
from companion.skipper.step.config import SkipperConfig
from companion.skipper.step.turn import Turn
from companion.traffic import Alarm, AlarmLimits, Assessment, OwnShip, assess

SHOWN = 8                # vessels kept in the state: the worst
EVERY_S = 30.0           # between two lines of one vessel
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
    found = assess(own, picture, limits(turn.config), None if wind is None else wind[0])[:SHOWN]
    turn.update(watch=found)
    _say(turn, found)


def _say(turn: Turn, found: Sequence[Assessment]) -> None:
    """Say the worst of the alarms that were not said lately."""
    lately = tuple(told for told in turn.state.watch_told if turn.t_s - told[2] < EVERY_S)
    known = {told[:2] for told in lately}
    news = next((a for a in found if a.alarm is not Alarm.NONE and (a.vessel.mmsi, a.vessel.branch) not in known), None)
    if news is not None:
        turn.say(SEVERITY[news.alarm], "vessel near", news.sentence(), every_s=0.0)
        lately = (*lately, (news.vessel.mmsi, news.vessel.branch, turn.t_s))
    turn.update(watch_told=lately)
