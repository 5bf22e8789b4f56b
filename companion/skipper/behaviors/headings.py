"""Headings to send, where the boat is steered by headings instead of a mission (Büsser 2009, chapter 3).

Per leg the heading is that from the previous waypoint to the current one, not from the boat: the plan's angle to
the wind is what makes it fast. Near the destination it is the course from the boat; near a buoy the course to the
buoy plus 30 degrees, and no manoeuvre there leads to the buoy's side of what is wanted (section 3.2.4: "to the left of
the desired heading", for a buoy to port). Drift is added as in equation 3 of chapter 2. What plans promise of clearance
is of the leg's line, and his heading leads along it from wherever the last turn ended: so it is led back to it
(``back_to_line_rad``), which is ours. Heading setpoints have no protection of ArduRover's against the no-go zone
either: ``sailable_rad`` is ours, too.

[1] G.-A. Büsser, Design and Implementation of a Navigation Algorithm for an Autonomous Sailboat, ETH Zürich, 2009.
"""

from __future__ import annotations

import math

from companion.field.guidance import wearing_rad
from companion.frozen import changed
from companion.geo.angles import difference_rad, wrap_pi
from companion.messages import Mode, Severity
from companion.skipper.behaviors.helm import is_busy, set_mode
from companion.skipper.planning.autopilot_beats import tacks_fail
from companion.skipper.planning.diversions import is_shut_off
from companion.skipper.step import Phase, StepContext
from companion.skipper.way import Gate, PointEn, Side, bearing_rad, cross_track_m, distance_m, moved, water_at
from companion.skipper.way.drift import DriftAhead, drift_ahead, floor_from_m
from companion.skipper.way.gates import marks_of
from companion.skipper.way.voyage import water_to_keep

DRIFT_LIMIT_RAD = math.radians(20.0)  # more is not leeway but a current or a compass error
STEERAGE_MPS = 0.5  # slower than this the drift angle means nothing
AT_BUOY = 3.0  # rounding radii
TACK_HYSTERESIS_RAD = math.radians(10.0)
BACK_S, BACK_M = 4.0, 8.0  # the line is aimed at so far ahead, in time and at the least
BACK_LIMIT_RAD = math.radians(45.0)
ASTERN_RAD = math.radians(5.0)  # beyond half a turn: by so much the stern's way is the shorter one, to be sure
ABOUT_S = 3.5  # a step to see it, the heading, and the turn until the boat goes no farther that way
BOARD_S, BETTER_M = 8.0, 1.0  # of the other tack, which must be clearer by so much


def drift_correction_rad(velocity_en_mps: tuple[float, float], heading_rad: float) -> float:
    """Return arctan(v_drift / v_boat), [1] eq. (3): what to add to the heading so that the course is made good.

    Positive (to starboard) when the boat is pushed to port; limited, and 0 without way on.
    """
    ahead = velocity_en_mps[0] * math.sin(heading_rad) + velocity_en_mps[1] * math.cos(heading_rad)
    to_port = velocity_en_mps[1] * math.sin(heading_rad) - velocity_en_mps[0] * math.cos(heading_rad)
    if ahead < STEERAGE_MPS:
        return 0.0
    return max(-DRIFT_LIMIT_RAD, min(DRIFT_LIMIT_RAD, math.atan2(to_port, ahead)))


def back_to_line_rad(off_m: float, speed_mps: float) -> float:
    """Return what to add to a leg's course to come back to its line, ``off_m`` to the right of it [m].

    >>> round(math.degrees(back_to_line_rad(8.0, 1.0)))
    -45
    """
    wanted = -math.atan2(off_m, max(BACK_M, BACK_S * speed_mps))
    return max(-BACK_LIMIT_RAD, min(BACK_LIMIT_RAD, wanted))


def buoy_heading_rad(boat_en: PointEn, buoy_en: PointEn, side: Side, angle_rad: float) -> float:
    """Return the course to the buoy turned away from it by ``angle_rad`` ([1] Figure 3.5), to leave it on ``side``."""
    return wrap_pi(bearing_rad(boat_en, buoy_en) + _hand(side) * angle_rad)


def sailable_rad(
    wanted_rad: float, heading_rad: float, twd_from_rad: float, no_go_half_rad: float, buoy: Side = Side.NONE
) -> float:
    """Return the wanted heading, or the edge of the no-go zone if it lies inside.

    The edge is that of the tack the boat is on; the other one only when the wanted heading is nearer to it by more
    than 10 degrees, so that a course dead to windward does not make the boat tack to and fro. With a ``buoy`` to be
    left on that side nothing leads to its side of the wanted heading ([1] 3.2.4): the edge is the far one, unless the
    boat is on the near one already and that within 10 degrees of what is wanted, for staying there is no manoeuvre.
    """
    to_wanted = difference_rad(wanted_rad, twd_from_rad)
    if abs(to_wanted) >= no_go_half_rad:
        return wanted_rad
    side = 1.0 if difference_rad(heading_rad, twd_from_rad) >= 0.0 else -1.0
    if buoy is not Side.NONE:
        far = _hand(buoy)
        if side != far and far * to_wanted + no_go_half_rad > TACK_HYSTERESIS_RAD:
            side = far
    elif side * to_wanted < -TACK_HYSTERESIS_RAD / 2.0:
        side = -side
    return wrap_pi(twd_from_rad + side * no_go_half_rad)


def _hand(side: Side) -> float:
    """Return which way leads away from a buoy that is left on ``side``: 1 to starboard, -1 to port."""
    return 1.0 if side is Side.PORT else -1.0


def desired_heading_rad(ctx: StepContext) -> float | None:
    """Return the heading to send now, None when it cannot be told: nothing is sent, and the setpoint times out."""
    wanted, vehicle, wind = _wanted_rad(ctx), ctx.snapshot.vehicle, ctx.wind_now
    if wanted is None or vehicle is None or wind is None or ctx.voyage.boat.can_tack:
        return wanted
    return by_the_stern_rad(wanted, vehicle.heading_rad, wind[0])


def by_the_stern_rad(wanted_rad: float, heading_rad: float, twd_from_rad: float) -> float:
    """Return the wanted heading, or the next one by the stern where the short way leads through the wind's eye."""
    off, to = difference_rad(heading_rad, twd_from_rad), difference_rad(wanted_rad, twd_from_rad)
    if off * to >= 0.0 or abs(off) + abs(to) >= math.pi + ASTERN_RAD:
        return wanted_rad
    return wearing_rad(heading_rad, twd_from_rad, -1 if to > 0.0 else 1)


def _wanted_rad(ctx: StepContext) -> float | None:
    """Return the heading of the leg, or round the buoy, whatever turn leads to it."""
    boat, leg, vehicle, wind, gate = ctx.boat_en, ctx.leg(), ctx.snapshot.vehicle, ctx.wind_now, ctx.gate
    if boat is None or leg is None or vehicle is None or wind is None or not ctx.ahead():
        return None
    drift, half, twd = drift_correction_rad(vehicle.velocity_en_mps, vehicle.heading_rad), ctx.no_go_half_rad, wind[0]
    if _is_at_buoy(gate, boat) and gate is not None and gate.buoy_en_m is not None:
        wanted = bearing_rad(boat, leg[1])
        if gate.is_first and distance_m(boat, gate.buoy_en_m) > distance_m(gate.en_m, gate.buoy_en_m):
            # The scheme is for the approach: kept up all the way round it would spiral into the buoy.
            clear = buoy_heading_rad(boat, gate.buoy_en_m, gate.side, ctx.config.buoy_angle_rad)
            if _hand(gate.side) * difference_rad(clear, wanted) > 0.0:
                wanted = clear
        return sailable_rad(wrap_pi(wanted + drift), vehicle.heading_rad, twd, half, gate.side)
    return _past_marks(
        ctx, boat, vehicle.heading_rad, _on_leg_rad(ctx, boat, leg, vehicle.heading_rad, drift, twd), twd
    )


def _on_leg_rad(
    ctx: StepContext, boat: PointEn, leg: tuple[PointEn, PointEn], heading_rad: float, drift: float, twd: float
) -> float:
    """Return the heading along a leg, led back to its line, or to its end where that is near or the wind shut it."""
    half = ctx.no_go_half_rad
    along = wrap_pi(bearing_rad(*leg) + drift)
    off_wind = difference_rad(along, twd)
    is_last = ctx.state.mission.index == ctx.last_waypoint() and distance_m(boat, leg[1]) < ctx.config.grid_size_m
    if is_last or distance_m(*leg) < 1.0 or abs(off_wind) < half:
        # On a leg that the wind has closed the boat goes about where the other tack is nearer to its end.
        wanted = sailable_rad(wrap_pi(bearing_rad(boat, leg[1]) + drift), heading_rad, twd, half)
        return _other_tack_rad(wanted, twd) if _must_go_about(ctx, boat, wanted, twd) else wanted
    # Back to the line on the leg's own tack: through the wind the boat would come to it sooner, and be on the wrong
    # one.
    back = back_to_line_rad(cross_track_m(boat, *leg), ctx.speed_mps)
    side = math.copysign(1.0, off_wind)
    return wrap_pi(twd + side * max(half, side * off_wind + side * back))


def _must_go_about(ctx: StepContext, boat: PointEn, wanted_rad: float, twd: float) -> bool:
    """Return whether a board close to the wind is about to come below the floor, and the other tack is clearer."""
    if not _is_board(ctx, wanted_rad, twd):
        return False
    floor_m = min(ctx.config.margin_floor_m, ctx.config.margin_m)
    now_m = _board_m(ctx, boat, wanted_rad, ABOUT_S)
    return now_m < floor_m and _board_m(ctx, boat, _other_tack_rad(wanted_rad, twd), BOARD_S) > now_m + BETTER_M


def _goes_about_ahead(ctx: StepContext, boat: PointEn, wanted_rad: float, twd: float) -> bool:
    """Return whether she need not be stopped before what a board leads to: the other tack is clearer, and in time."""
    if not _is_board(ctx, wanted_rad, twd):
        return False
    other_m = _board_m(ctx, boat, _other_tack_rad(wanted_rad, twd), BOARD_S)
    return other_m > _board_m(ctx, boat, wanted_rad, BOARD_S) + BETTER_M


def _is_board(ctx: StepContext, wanted_rad: float, twd: float) -> bool:
    is_close = abs(difference_rad(wanted_rad, twd)) < ctx.no_go_half_rad + TACK_HYSTERESIS_RAD
    return is_close and ctx.voyage.boat.can_tack and not tacks_fail(ctx)


def _other_tack_rad(wanted_rad: float, twd: float) -> float:
    return wrap_pi(twd - difference_rad(wanted_rad, twd))


def _board_m(ctx: StepContext, boat: PointEn, course_rad: float, span_s: float) -> float:
    """Return how clear the water is that a board goes through in ``span_s`` at the polar's speed [m].

    The speed that she has is that of a turn while she turns: by it a tack would be taken back in the middle.
    """
    wind, (east, north) = ctx.wind_now, ctx.current_en_mps
    speed = 0.0 if wind is None else ctx.voyage.boat.polar.speed_mps(ctx.no_go_half_rad, wind[1])
    there = moved((boat[0] + east * span_s, boat[1] + north * span_s), course_rad, speed * span_s)
    return water_to_keep(ctx.voyage.area, boat).path_clearance_m([boat, there])


def _past_marks(ctx: StepContext, boat: PointEn, heading_rad: float, wanted_rad: float, twd: float) -> float:
    """Return the wanted heading, or one that leaves a mark on the hand where it lies until it is passed.

    A turn across a mark that is no farther off than the turn is wide leads over it.
    """
    half, wide_m = ctx.no_go_half_rad, ctx.speed_mps / ctx.voyage.boat.turn_rate_radps
    for mark in marks_of(ctx.voyage):
        away_m, at = distance_m(boat, mark.en_m), bearing_rad(boat, mark.en_m)
        bow, off = difference_rad(heading_rad, at), difference_rad(wanted_rad, at)
        if away_m > mark.keep_m + wide_m or abs(bow) > 0.5 * math.pi or bow * off >= 0.0 or abs(off - bow) > math.pi:
            continue
        clear = at + math.copysign(max(abs(bow), math.asin(min(1.0, mark.keep_m / max(away_m, 1e-9)))), bow)
        to_wind = difference_rad(clear, twd)
        return wrap_pi(twd + math.copysign(half, to_wind)) if abs(to_wind) < half else wrap_pi(clear)
    return wanted_rad


def course_rad(ctx: StepContext) -> float | None:
    """Return the course over ground that the boat is steered on now, None when it cannot be told."""
    heading, vehicle = desired_heading_rad(ctx), ctx.snapshot.vehicle
    if heading is None or vehicle is None:
        return None
    return wrap_pi(heading - drift_correction_rad(vehicle.velocity_en_mps, vehicle.heading_rad))


def _is_at_buoy(gate: Gate | None, boat: PointEn) -> bool:
    """Return whether the boat is at the buoy that it is to round: within three of its rounding radii."""
    if gate is None or gate.buoy_en_m is None:
        return False
    return distance_m(boat, gate.buoy_en_m) < AT_BUOY * distance_m(gate.en_m, gate.buoy_en_m)


REACT_S = 8.0  # a step to see it, a plan, its upload and reading back, the turn: six seconds; and two to spare
OFF_LINE_M = 2.0  # how far the autopilot wanders off its line
SLOW_MPS = 0.5  # slower the boat does not come far in that time


def ahead_of(ctx: StepContext) -> DriftAhead | None:
    """Return what the way to the present waypoint meets within ``REACT_S``, None when nothing or nobody sails it.

    In the loiter that ends a mission it is the way back to its place.
    """
    boat, leg, status = ctx.boat_en, ctx.leg(), ctx.autopilot
    if boat is None or leg is None or status is None or not (ctx.ahead() or is_shut_off(ctx)):
        return None
    if status.mode not in {Mode.AUTO, ctx.sails_in} or ctx.is_by_field:
        return None  # the field looks ahead by itself, and follows no leg
    speed, left_m = ctx.speed_mps, distance_m(boat, leg[1])
    if speed < SLOW_MPS or left_m < 1.0:
        return None
    course = bearing_rad(boat, leg[1])
    if status.mode is Mode.GUIDED and ctx.is_closed(boat, leg[1], ctx.wind_now):
        steered = course_rad(ctx)  # nothing turns the boat there but another plan
        wanted = desired_heading_rad(ctx)
        if steered is None or wanted is None:
            return None
        if ctx.wind_now is not None and _goes_about_ahead(ctx, boat, wanted, ctx.wind_now[0]):
            return None  # a loiter's circle takes more room, and time, than a tack
        course, left_m = steered, math.inf
    hull_m, water = ctx.voyage.boat.hull.reach_m, water_at(ctx.voyage.area, boat)
    here_m = float(water.clearance_m([boat])[0])
    found = drift_ahead(
        water,
        boat,
        (speed * math.sin(course), speed * math.cos(course)),
        floor_m=floor_from_m(here_m, hull_m + OFF_LINE_M),
        horizon_s=min(REACT_S, left_m / speed),
    )
    return None if found.is_clear else found


def brakes(ctx: StepContext) -> bool:
    """Ask for LOITER where the leg is shut too near to plan; True in the step in which it is asked for.

    It happens to a boat that has not come where it is by a plan: handed back by a person, put right after a false
    position. A plan, its upload, the reading back and the turn take six seconds, a command one: LOITER first, whose
    circle begins where the boat could stop, then a plan from there.
    """
    state = ctx.state
    if state.steering.until_s is not None or state.by_field.resort.engaged:
        return False
    if state.pending.upload is not None or not ctx.snapshot.permissions.may_set_mode:
        return False
    met = ahead_of(ctx)
    if met is None or is_busy(ctx, Mode.LOITER.name):
        return False
    text = f"{met.name} is {met.floor_s or 0.0:.0f} s ahead, too near to plan round: waiting in a loiter for a plan"
    if not set_mode(ctx, Mode.LOITER, text):
        return False
    ctx.set(operator=changed(ctx.state.operator, is_back=True))
    ctx.say(Severity.WARNING, "too near", text, every_s=0.0)
    ctx.phase(Phase.HOLDING, text)
    return True
