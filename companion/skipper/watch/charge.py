"""How long the charge lasts at the rate at which it has fallen, against the way to a place where she can wait.

The rate is the mean since the charge was last seen to rise: a figure in whole percents tells nothing over a minute. The
way is a straight one, lengthened by ``DETOUR``.
"""

from __future__ import annotations

import math
from dataclasses import replace

from companion.frozen import changed
from companion.skipper.planning.errands import home_trouble
from companion.skipper.step.actions import Severity
from companion.skipper.step.state import Charge
from companion.skipper.step.turn import Turn
from companion.skipper.way.geometry import distance_m

RISE = 0.015       # it is charged; the last percent trembles
FALL = 0.05        # the rate is told when the charge has fallen by this much ...
LOOK_S = 300.0     # ... and for this long
DETOUR = 2.0       # a beat is 1.4 times its straight way, and something lies between
LEAST_MPS = 0.5


def follow_charge(turn: Turn) -> None:
    """Remember where the fall of the charge began, and whether it still covers the way; say it when it does not."""
    status, before = turn.autopilot, turn.state.alarms.charge
    share = status.battery_remaining if status is not None else None
    if share is None:
        return
    if before is None or share > before.last + RISE:
        turn.set(alarms=changed(turn.state.alarms, charge=Charge(since_s=turn.t_s, first=share, last=share)))
        return
    now = replace(before, last=min(share, before.last))
    if now != before:
        turn.set(alarms=changed(turn.state.alarms, charge=now))
    left_s = lasts_s(turn)
    if now.is_short or left_s is None:
        return
    needed_s = way_s(turn)
    if needed_s is None or left_s >= turn.config.ends.battery_reserve * needed_s:
        return
    turn.set(alarms=changed(turn.state.alarms, charge=replace(now, is_short=True)))
    turn.say(Severity.WARNING, "charge", f"the charge lasts {math.floor(left_s / 60.0)} min at its rate, the way to "
             f"where she can wait takes {math.ceil(needed_s / 60.0)} min", every_s=0.0)


def lasts_s(turn: Turn) -> float | None:
    """Return how long the charge lasts [s], None while the rate is not known."""
    charge = turn.state.alarms.charge
    if charge is None or turn.t_s - charge.since_s < LOOK_S or charge.first - charge.last < FALL:
        return None
    return charge.last * (turn.t_s - charge.since_s) / (charge.first - charge.last)


def way_s(turn: Turn) -> float | None:
    """Return how long she needs to the nearest refuge, or home where there is none [s]; None: there is neither."""
    boat, wind, status = turn.boat_en, turn.wind_mean, turn.autopilot
    places = [refuge.en_m for refuge in turn.voyage.refuges]
    if not places and status is not None and status.home is not None and not home_trouble(turn):
        places.append(turn.voyage.frame.en_from_geo(status.home))
    if boat is None or wind is None or not places:
        return None
    speed_mps = max(LEAST_MPS, turn.voyage.boat.polar.max_speed_mps(wind[1]))
    return DETOUR * min(distance_m(boat, place) for place in places) / speed_mps
