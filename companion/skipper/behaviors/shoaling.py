"""What is done about water that shoals: she goes back the way that she came, and is planned for with what was found.

The water that she has sailed over is the only water that is known to be deep. So an upload puts her onto a
loiter in it, past a place abeam that turns her at once. The autopilot sails it: it needs no plan, and holds when the
companion dies. What lay ahead is a shoal of the voyage's water from then on (``companion.skipper.way.shoals``), and
once she is on her way back a plan is made in what is left.
"""

from __future__ import annotations

import math

import numpy as np
import shapely

from companion.frozen import changed
from companion.geo.angles import difference_rad
from companion.messages import Command, Severity, waypoint
from companion.skipper.behaviors.helm import hand_back, make_current
from companion.skipper.planning.uploads import upload
from companion.skipper.step import CancelPlan, Phase, ReplanReason, StepContext
from companion.skipper.step.state import Sounded
from companion.skipper.way.geometry import bearing_rad, distance_m, is_tack, moved
from companion.skipper.way.shoals import MOST_SHOALS, Shoal, found, over, water_taken
from companion.skipper.way.voyage import PointEn

SHOALING = "shoaling"  # the watchdog
BACK = "back to deep water"  # the rung of a route that leads there
TURN_S = 20.0  # from the alarm until she goes the other way: a person, or a tack of 7 s and its mission
STEP_M = 4.0  # between two soundings that are kept ...
KEPT = 150  # ... of her track
LEAST_BACK_M, BACK_M = 25.0, 80.0  # how far back along it she goes
BESIDE_M = 12.0  # of her own track: there the water is as deep as on it
SPARE_M = 0.5  # more than the least depth, where she loiters
RUNS_S = 3.0  # what she sails on until she turns
THERE_M = 20.0  # from the loiter's point
OPENED_M = 25.0  # away from where she turned: then a plan is made
ABEAM_RAD = (math.radians(110.0), math.radians(80.0))  # where she turns to first: what the wind leaves of these ...
ABEAM_M = 25.0  # ... so far off
ROOMY_M = 60.0  # more clearance is no better
ALIKE_M = 5.0  # a difference that is none
WAY_MPS = 0.3  # made good towards it: slower she has not turned yet
GIVES_UP_S = 90.0  # of a leg back that comes to nothing: the plan must do
AGAIN_S = 10.0  # between two shoals that are found ahead
APART_M = 12.0  # between the middles of two shoals: nearer they are the same


def depth_ahead_m(ctx: StepContext) -> float | None:
    """Return the room over the least depth in ``TURN_S`` at the present rate [m]; None: not told, or not watched."""
    status, least_m = ctx.autopilot, ctx.config.least_depth_m
    if status is None or status.depth_m is None or least_m is None:
        return None
    here_m = status.depth_m - least_m
    ahead_m = here_m + min(0.0, status.depth_rate_mps or 0.0) * TURN_S
    charted_m = _charted_m(ctx) if ahead_m <= 0.0 else None
    return ahead_m if charted_m is None else max(ahead_m, min(here_m, charted_m))


def _charted_m(ctx: StepContext) -> float | None:
    """Return the room that the chart tells of the water ahead that dries and is open now [m]; None: of none.

    The slope up to a bar says nothing of its top that the chart does not: there only what is sounded counts.
    """
    boat, vehicle, now_s = ctx.boat_en, ctx.snapshot.vehicle, ctx.utc_s
    tide_m = None if ctx.config.tide is None else ctx.config.tide.height_m(now_s)
    if not ctx.voyage.drying or boat is None or vehicle is None or tide_m is None:
        return None
    course_rad = math.atan2(*vehicle.velocity_en_mps)
    ahead = shapely.linestrings([boat, moved(boat, course_rad, TURN_S * vehicle.speed_mps)])
    rooms = [w.room_m(tide_m) for w in ctx.voyage.drying if bool(shapely.intersects(w.polygon, ahead))]
    return min(rooms) if rooms and min(rooms) > 0.0 else None


def follow_soundings(ctx: StepContext) -> None:
    """Remember where the water was deep, and what was found to be shoal."""
    status, boat, vehicle, least_m = ctx.autopilot, ctx.boat_en, ctx.snapshot.vehicle, ctx.config.least_depth_m
    ahead_m = depth_ahead_m(ctx)
    if least_m is None or status is None or boat is None or vehicle is None:
        return
    track = ctx.state.soundings.track
    if not track or distance_m(track[-1].en_m, boat) >= STEP_M:
        depth_m = None if status.depth_m is None else round(status.depth_m, 2)
        ctx.set(soundings=changed(ctx.state.soundings, track=(*track, Sounded(en_m=boat, depth_m=depth_m))[-KEPT:]))
    if status.depth_m is None:
        return
    if not ctx.is_raised(SHOALING) or ahead_m is None or ahead_m > 0.0:
        return
    known = ctx.state.soundings.shoals
    tide_m = None if ctx.config.tide is None else ctx.config.tide.height_m(ctx.utc_s)
    is_sailing_on = not (_is_on_board(ctx) or _is_coming(ctx)) and ctx.t_s - ctx.state.soundings.found_s > AGAIN_S
    if SHOALING in ctx.fresh or is_sailing_on:
        shoal = found(
            known,
            boat,
            course_rad=math.atan2(*vehicle.velocity_en_mps),
            speed_mps=vehicle.speed_mps,
            depth_m=status.depth_m,
            rate_mps=status.depth_rate_mps or 0.0,
            least_m=least_m,
            tide_m=tide_m,
        )
        if all(distance_m(each.en_m, shoal.en_m) >= APART_M for each in known):
            ctx.learn_shoals((*known, shoal)[-MOST_SHOALS:])
            ctx.set(soundings=changed(ctx.state.soundings, found_s=ctx.t_s))
            ctx.say(Severity.WARNING, "shoal", _words(ctx, boat, shoal, status.depth_m), every_s=0.0)
    elif status.depth_m <= least_m and all(distance_m(each.en_m, boat) >= APART_M for each in known):
        ctx.learn_shoals((*known, over(boat, status.depth_m, tide_m))[-MOST_SHOALS:])


def _words(ctx: StepContext, boat: PointEn, shoal: Shoal, depth_m: float) -> str:
    place = ctx.voyage.frame.geo_from_en(*shoal.en_m)
    far_m = max(0.0, distance_m(boat, shoal.en_m) - shoal.radius_m)
    return (
        f"{depth_m:.1f} m sounded, and less {far_m:.0f} m ahead: a shoal of {shoal.radius_m:.0f} m about "
        f"{place.lat_deg:.5f} {place.lon_deg:.5f} is in the area from now on, {shoal.doubt_m:.0f} m of doubt about it"
    )


def _is_on_board(ctx: StepContext) -> bool:
    route = ctx.state.mission.route
    return route is not None and route.rung == BACK


def _is_coming(ctx: StepContext) -> bool:
    pending = ctx.state.pending.upload
    return pending is not None and pending.route.rung == BACK


def turns_back(ctx: StepContext) -> bool:
    """Sail back over water known to be deep, where it shoals; True while she does."""
    state, boat, route, vehicle = ctx.state, ctx.boat_en, ctx.state.mission.route, ctx.snapshot.vehicle
    if ctx.config.least_depth_m is None or boat is None or route is None or vehicle is None:
        return False
    if not state.voyage.sailing or state.mission.foreign or state.by_field.resort.engaged:
        return False
    if _is_coming(ctx):
        ctx.phase(Phase.HOLDING, state.pending.upload.route.why if state.pending.upload is not None else "")
        return True
    if _is_on_board(ctx) and not state.plans.asked and state.soundings.turned_en_m is not None:
        return _goes_back(ctx, boat, vehicle.velocity_en_mps)
    ahead_m = depth_ahead_m(ctx)
    if not ctx.is_raised(SHOALING) or ahead_m is None or ahead_m > 0.0 or _is_on_board(ctx):
        return False
    if state.pending.upload is not None or ctx.t_s < state.pending.upload_retry.not_before_s:
        return False
    if not ctx.snapshot.permissions.may_upload:
        return False
    place = deep_place(state.soundings.track, boat, ctx.config.least_depth_m)
    course_rad = math.atan2(*vehicle.velocity_en_mps)
    ahead = moved(boat, course_rad, RUNS_S * vehicle.speed_mps)
    solid = ctx.voyage.area.unfenced
    if place is None or solid.path_clearance_m([boat, ahead, place]) < ctx.voyage.boat.hull.reach_m:
        ctx.set(
            plans=changed(
                ctx.state.plans,
                asked="it shoals, and no deep water is known behind her",
                asked_as=ReplanReason.OBSTACLE,
            )
        )
        return False
    if state.pending.plan is not None:
        ctx.act(CancelPlan(request_id=state.pending.plan.request_id))
        ctx.set(pending=changed(ctx.state.pending, plan=None))
    keep = min(state.mission.index, len(route.items) - 1)
    text = f"it shoals: back {distance_m(boat, place):.0f} m over water that she has sounded, waiting for a plan there"
    frame = ctx.voyage.frame
    way = [(waypoint(frame.geo_from_en(*abeam)), abeam) for abeam in _aside(ctx, boat, course_rad, place)]
    way.append((waypoint(frame.geo_from_en(*place), command=Command.NAV_LOITER_UNLIM), place))
    upload(ctx, route.led_aside(keep, boat, way, rung=BACK, why=text), keep + 1, text)
    ctx.set(
        soundings=changed(ctx.state.soundings, turned_en_m=boat, turned_s=ctx.t_s),
        plans=changed(ctx.state.plans, rung=0, asked=""),
    )
    ctx.say(Severity.WARNING, "turning back", text, every_s=0.0)
    ctx.phase(Phase.HOLDING, text)
    return True


def _aside(ctx: StepContext, boat: PointEn, course_rad: float, place: PointEn) -> tuple[PointEn, ...]:
    """Return the place abeam that turns her at once, off shoals found before, clear, no tack; none: there is none.

    ArduRover begins a leg to what lies straight behind where it could stop, and has turned six seconds later; to what
    is abeam it turns within a second.
    """
    water, wind = ctx.voyage.area.unfenced, ctx.wind_now
    floor_m = min(ctx.config.margin_floor_m, ctx.config.margin_m)
    before = ctx.state.soundings.shoals[:-1]  # the last is right ahead
    shoal = water_taken(before) if before else None
    best: tuple[tuple[float, bool, float], PointEn] | None = None
    for turn_rad in (side * off_rad for off_rad in ABEAM_RAD for side in (1.0, -1.0)):
        abeam = moved(boat, course_rad + turn_rad, ABEAM_M)
        clear_m = water.path_clearance_m([boat, abeam, place])
        if clear_m < floor_m or ctx.is_closed(boat, abeam, wind):
            continue
        tacks = wind is not None and is_tack(course_rad, course_rad + turn_rad, wind[0])
        off_m = ROOMY_M if shoal is None else float(shapely.distance(shoal, shapely.linestrings([boat, abeam, place])))
        rank = (-round(min(off_m, ROOMY_M) / ALIKE_M), tacks, -min(clear_m, ROOMY_M))
        if best is None or rank < best[0]:
            best = rank, abeam
    return () if best is None else (best[1],)


def _goes_back(ctx: StepContext, boat: PointEn, velocity_en_mps: tuple[float, float]) -> bool:
    """Wait until she has turned and opened the shoal; then ask for a plan."""
    route, memory = ctx.state.mission.route, ctx.state.soundings
    if route is None or memory.turned_en_m is None:
        return False
    if ctx.state.steering.own_mode is not None:
        hand_back(ctx)
    place = route.points_en_m[-1]
    left_m = distance_m(boat, place)
    made_good_mps = 0.0
    if left_m > 0.0:
        east, north = place[0] - boat[0], place[1] - boat[1]
        made_good_mps = (velocity_en_mps[0] * east + velocity_en_mps[1] * north) / left_m
    depth_m, least_m = ctx.autopilot.depth_m if ctx.autopilot is not None else None, ctx.config.least_depth_m
    is_deep = depth_m is not None and least_m is not None and depth_m >= least_m + SPARE_M
    has_opened = made_good_mps >= WAY_MPS and distance_m(boat, memory.turned_en_m) >= OPENED_M and is_deep
    course_rad = math.atan2(*velocity_en_mps)
    is_turned = abs(difference_rad(course_rad, bearing_rad(boat, place))) <= max(ABEAM_RAD)
    if is_turned and ctx.state.mission.index < len(route.items) - 1:
        make_current(ctx, len(route.items))  # the place abeam has served: nobody has sounded there
    if left_m <= THERE_M or has_opened or ctx.t_s - memory.turned_s > GIVES_UP_S:
        ctx.set(
            plans=changed(ctx.state.plans, asked="it shoaled: with what was found", asked_as=ReplanReason.OBSTACLE),
            soundings=changed(memory, turned_en_m=None),
        )
        return False
    ctx.phase(Phase.HOLDING, f"{route.why}; {left_m:.0f} m left")
    return True


def deep_place(track: tuple[Sounded, ...], boat_en: PointEn, least_m: float) -> PointEn | None:
    """Return where to on her own track: the deepest place that water known to be deep leads to; None: there is none.

    Known is what lies near to the track but where it was too shallow, in whatever order she was there: she may have
    turned since. Where nothing was sounded she floated; it is where to only if no deep sounding is in reach.
    """
    deep = [s for s in track if s.depth_m is None or s.depth_m >= least_m]
    if not deep:
        return None
    known = shapely.multipoints(np.array([s.en_m for s in deep]))
    best: tuple[float, PointEn] | None = None
    for place in reversed(deep):
        far_m, depth_m = distance_m(boat_en, place.en_m), 0.0 if place.depth_m is None else place.depth_m
        if not LEAST_BACK_M <= far_m <= BACK_M or (place.depth_m is not None and depth_m < least_m + SPARE_M):
            continue
        if best is not None and depth_m < best[0] + (SPARE_M if far_m > LEAST_BACK_M else 0.0):
            continue
        way = np.linspace(boat_en, place.en_m, max(2, math.ceil(far_m / STEP_M)))
        if float(shapely.distance(known, shapely.points(way)).max()) <= BESIDE_M:
            best = depth_m, place.en_m
    return None if best is None else best[1]
