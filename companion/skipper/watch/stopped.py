"""A boat that somebody or something has stopped, in words: where she drifts, what she meets and when, what to press.

A failsafe's stop is told every minute for as long as it lasts, whoever may end it. A person who has stopped her knows
that; he is told only when she drifts onto something.
"""

from __future__ import annotations

import math

from companion.geo.angles import wrap_two_pi
from companion.messages import Mode
from companion.skipper.deeds.failsafe import TOLD_S, is_answered
from companion.skipper.step.actions import Severity
from companion.skipper.step.causes import BY_NAME, HOMEWARD, PERSON
from companion.skipper.step.turn import Turn
from companion.skipper.way.drift import DriftAhead, drift_ahead
from companion.skipper.way.voyage import PointEn, outside_m, water_at

EVERY_S = 60.0
MOVES_MPS = 0.15      # slower than this the fixes' noise tells no drift
CARRIED_MPS = 3.0     # faster than this a disarmed boat is towed or carried
LOITER_M = 20.0       # so near to where RTL ends it loiters there
PATIENCE_S = 30.0     # an answer that is on its way is given this long before it is spoken of


def speak_of_stop(turn: Turn) -> None:
    """Say how she drifts while a stop lasts."""
    stop = turn.state.operator.stop
    if stop is None or turn.autopilot is None or turn.t_s - stop.t_s <= (
        PATIENCE_S if is_answered(turn) else TOLD_S
    ) or turn.is_said("adrift", EVERY_S):
        return
    here, vehicle = turn.snapshot.position_en_m, turn.snapshot.vehicle
    ahead = None if here is None or vehicle is None else _ahead(turn, here, vehicle.velocity_en_mps)
    meets = ahead is not None and not ahead.is_clear
    if stop.cause == PERSON and not (meets and ahead is not None and MOVES_MPS <= ahead.speed_mps <= CARRIED_MPS):
        return
    mode = stop.mode.name if stop.mode is not None else "an unknown mode"
    by = "a person" if stop.cause == PERSON else f"the {stop.cause} failsafe"
    what = f"{mode if stop.is_armed else 'disarmed'} by {by}"
    where = "; her position is not known" if here is None or ahead is None else _where(turn, here, ahead)
    turn.say(Severity.CRITICAL if meets or not is_answered(turn) else Severity.WARNING, "adrift",
             f"{what}{where}; {_remedy(turn)}", every_s=EVERY_S)


def _ahead(turn: Turn, here: PointEn, velocity: tuple[float, float]) -> DriftAhead:
    """Follow the drift; in RTL the straight way to where the autopilot takes her. A loiter goes nowhere.

    Outside the fence the fence is left out.
    """
    status, area = turn.snapshot.autopilot, water_at(turn.voyage.area, here)
    floor_m = min(turn.config.margin_floor_m, turn.config.margin_m)
    speed = math.hypot(*velocity)
    homeward = status is not None and status.mode in HOMEWARD
    far_m = status.waypoint_distance_m if status is not None and homeward else None
    course = status.target_bearing_rad if status is not None else None
    if status is not None and (status.mode is Mode.LOITER or (homeward and (far_m is None or far_m < LOITER_M))):
        return drift_ahead(area, here, (0.0, 0.0), floor_m=floor_m)
    if course is None or far_m is None:
        return drift_ahead(area, here, velocity, floor_m=floor_m)
    way = (speed * math.sin(course), speed * math.cos(course))
    return drift_ahead(area, here, way, floor_m=floor_m, horizon_s=max(1.0, far_m / max(speed, MOVES_MPS)))


def _where(turn: Turn, here: PointEn, ahead: DriftAhead) -> str:
    vehicle, far_m = turn.snapshot.vehicle, outside_m(turn.voyage.area, here)
    place = "" if vehicle is None else f" at {vehicle.position.lat_deg:.5f}, {vehicle.position.lon_deg:.5f}"
    fence = f", {far_m:.0f} m outside the fence" if far_m > 0.0 else ""
    if turn.autopilot is not None and turn.autopilot.mode in HOMEWARD and ahead.speed_mps > 0.0:
        course = math.degrees(wrap_two_pi(math.atan2(*ahead.velocity_en_mps)))
        way = f"sailing straight home, {course:03.0f}°"
        if ahead.floor_s is not None:
            meets = f"onto {ahead.name}" if ahead.contact_s is not None else f"past {ahead.name}"
            way += f", {meets} in {ahead.contact_s if ahead.contact_s is not None else ahead.floor_s:.0f} s"
    else:
        way = ahead.sentence() if ahead.speed_mps >= MOVES_MPS else "staying there"
    return f": {way}{place}{fence}"


def _remedy(turn: Turn) -> str:
    """Return what to press, and what would let the companion do it."""
    stop, may = turn.state.operator.stop, turn.snapshot.permissions
    if is_answered(turn):
        return turn.state.why
    if stop is not None and not stop.is_armed:
        return "arm her and press AUTO, or take her in MANUAL"
    cause = BY_NAME.get(stop.cause) if stop is not None else None
    if cause is None:
        return "press AUTO to sail on, or take her in MANUAL"
    leave = "" if may.may_set_mode else " (the mission's [operator] set_auto would let the companion)"
    return f"press {cause.press}{leave}"
