"""The end of a voyage, and of a diversion: the boat loiters, and is watched.

A voyage is over when all goals are reached (and home, where the mission ends there), or its time is up. From then on
nothing is planned but the way back to its place, should it be off it and the straight way not be clear; the watch goes
on until somebody ends the program.
"""

from __future__ import annotations

import math

from companion.frozen import changed
from companion.geo.angles import difference_rad
from companion.messages import Mode, Severity
from companion.safety import BY_NAME, BY_RANK, ENDINGS, OUT_OF_TIME, SHORE, STOPPING, End
from companion.skipper.behaviors.drifting import is_cramped
from companion.skipper.behaviors.failsafe import waits_for
from companion.skipper.behaviors.field_guidance import keeps_station
from companion.skipper.behaviors.helm import hand_back, is_busy, repair, set_mode
from companion.skipper.planning.diversions import (
    DRAGGED,
    HOME,
    OFF_HOME,
    ROOM,
    home_trouble,
    is_at_rest,
    is_shut_off,
    off_place_m,
    place_to_keep,
    pressing,
    station_left_s,
)
from companion.skipper.step import Diversion, DiversionKind, Phase, Route, SafeEnd, StepContext
from companion.skipper.step.state import Since
from companion.skipper.way import bearing_rad, distance_m
from companion.words import goals_reached

ANSWERED = {"": "for a person", SHORE: "until the link to the shore is back, or a person gives AUTO"}
TAKEN = "until a person takes her and gives AUTO back"
BACK_RAD = math.radians(60.0)  # off her place: what is farther astern she is turned to first
TURNS_S = 30.0
NEAR_M = 35.0  # a loiter so far off a place is at it
LIES = {  # behind the last goal
    HOME: "; home",
    ROOM: "; she lies where a loiter has room",
    OFF_HOME: "; home; she lies where a loiter has room",
}
UNTIL_TOLD = "until told to go on"


def comes_to_rest(ctx: StepContext, bound: Diversion) -> bool:
    """Lie at the end of a diversion; True while the boat does."""
    is_station = bound.kind is DiversionKind.STATION
    if is_station and station_left_s(ctx) > 0.0 and keeps_station(ctx, bound.en_m):
        _begin_station(ctx, bound)
        return True
    if not is_at_rest(ctx) or is_shut_off(ctx):
        return False
    if bound.kind is not DiversionKind.REST and _comes_about(ctx):
        return True
    if ctx.state.steering.own_mode in STOPPING:
        return False
    if (
        ctx.is_raised(OUT_OF_TIME)
        and ctx.config.ends.end(OUT_OF_TIME) is not End.SAY
        and not (ctx.state.operator.answering or pressing(ctx) is not None or bound.is_ordered)
    ):
        reached = len(ctx.state.progress.reached)
        _end(ctx, f"out of time: {reached} of {len(ctx.voyage.legs)} goals reached", arrived=False)
        return True
    if bound.name in LIES and ctx.gate is None and not ctx.state.operator.answering and not bound.is_ordered:
        _moved_to_room(ctx, bound)
        ctx.set(voyage=changed(ctx.state.voyage, home_reached=True))
        rest(ctx)
        return True
    if bound.kind is DiversionKind.REST:
        return False
    ctx.let_go_of_plan()
    if repair(ctx):
        return True
    hand_back(ctx)
    if is_station:
        _begin_station(ctx, bound)
        return True
    off_m = off_place_m(ctx) or 0.0
    if ctx.is_raised(DRAGGED) or off_m >= BY_NAME[DRAGGED].enter:
        where = f"{off_m:.0f} m off the place where she is to stay"
    else:
        where = "staying near by" if bound.kind is DiversionKind.STAY else _at(ctx, bound)
    how_long = UNTIL_TOLD if bound.is_ordered else bound.until or _how_long(ctx)
    ctx.phase(Phase.HOLDING, f"{where}: {bound.why}; waiting {how_long}")
    return True


def _comes_about(ctx: StepContext) -> bool:
    """Ask for LOITER once, of a boat that leaves where she is to stay: it turns her, and AUTO leads her back."""
    text = "she leaves the place where she is to stay: LOITER, then back to it"
    is_asked = ctx.is_raised(DRAGGED) and is_busy(ctx, Mode.LOITER.name)
    if not is_asked:
        is_stopped = ctx.state.steering.own_mode in STOPPING
        if DRAGGED not in ctx.fresh or is_stopped or is_cramped(ctx) or not set_mode(ctx, Mode.LOITER, text):
            return False
    ctx.phase(Phase.HOLDING, f"{text}; waiting for the autopilot to take it")
    return True


def turns_back_to_place(ctx: StepContext) -> bool:
    """Keep the LOITER of a boat that has left the place where she is to stay, until her bow points back; True then.

    AUTO does not turn a boat whose point is dead astern in every autopilot. What does not turn here turns nowhere.
    """
    since_s = next((r.since_s for r in ctx.state.alarms.raised if r.name == DRAGGED), None)
    place, boat, vehicle, status = place_to_keep(ctx), ctx.boat_en, ctx.snapshot.vehicle, ctx.autopilot
    if since_s is None or ctx.t_s - since_s > TURNS_S or ctx.state.voyage.over or ctx.snapshot.unsure:
        return False
    if place is None or boat is None or vehicle is None or status is None or status.mode is not Mode.LOITER:
        return False
    if abs(difference_rad(bearing_rad(boat, place), vehicle.heading_rad)) < BACK_RAD:
        return False
    off_m = distance_m(boat, place)
    ctx.phase(Phase.HOLDING, f"{off_m:.0f} m off the place where she is to stay: waiting in LOITER for her to turn")
    return True


def _begin_station(ctx: StepContext, bound: Diversion) -> None:
    """Say that the boat stays at the last goal, which is for as long as the mission asks from the first time on."""
    boat, voyage = ctx.boat_en, ctx.state.voyage
    if voyage.station_since is None:
        ctx.set(voyage=changed(voyage, station_since=Since(t_s=ctx.t_s, utc_s=ctx.utc_s)))
    off = "" if boat is None else f", {distance_m(boat, bound.en_m):.0f} m off"
    ctx.phase(Phase.HOLDING, f"keeping station: waiting {bound.until}{off}")


def _at(ctx: StepContext, bound: Diversion) -> str:
    """Return where she lies at the end of a diversion, in words: a creek may have no room for a loiter."""
    route = ctx.state.mission.route
    if bound.en_m is None or route is None or not route.points_en_m:
        return f"at {bound.name}"
    off_m = distance_m(route.points_en_m[-1], bound.en_m)
    return f"at {bound.name}" if off_m < NEAR_M else f"{off_m:.0f} m from {bound.name}, where a loiter has room"


def _moved_to_room(ctx: StepContext, bound: Diversion) -> None:
    """Rest from now on where there is room, of a voyage that was over in what had none."""
    voyage, route = ctx.state.voyage, ctx.state.mission.route
    is_moved = route is not None and voyage.rest_en_m != route.points_en_m[-1]
    if bound.kind is DiversionKind.ROOM and voyage.over and is_moved:
        _end(ctx, f"{voyage.over.removesuffix(LIES[ROOM])}{LIES[ROOM]}", arrived=voyage.arrived)


def _how_long(ctx: StepContext) -> str:
    """Return how long a diversion that nobody ordered keeps the boat."""
    raised = {r.name: r for r in ctx.state.alarms.raised}
    name = next((n for n in BY_RANK if ENDINGS[n].until and n in raised and ctx.config.ends.end(n) is not End.SAY), "")
    since_s = raised[name].clear_since_s if name else None
    if since_s is not None:  # what she waits for has come, and may not stay
        over_s = ctx.t_s - since_s
        return f"{max(0.0, BY_NAME[name].exit_s - over_s):.0f} s more: over for {over_s:.0f} s, and may come back"
    until = ENDINGS[name].until if name else ""
    return until or ANSWERED.get(ctx.state.operator.answering, TAKEN)


def reached_words(ctx: StepContext) -> str:
    """Return how many of the goals were reached, of a voyage that has none left."""
    return goals_reached(len(ctx.voyage.legs), ctx.state.orders.skipped)


def rest(ctx: StepContext) -> None:
    """Lie in the loiter that ends the mission: the voyage is over when nothing is left to sail to."""
    if not ctx.state.voyage.over:
        if _is_on_to_its_place(ctx):
            return
        ends_home = ctx.config.safe_end is SafeEnd.RETURN and not ctx.state.voyage.home_reached
        trouble = home_trouble(ctx) if ends_home else ""
        route = ctx.state.mission.route
        lies = LIES.get(route.bound_for, "") if ctx.state.voyage.home_reached and route is not None else ""
        home = (f"; not home: {trouble}" if trouble else lies) + _lies_off(route)
        end = f"; the mission ends with {route.why}" if route is not None and route.rung == "hold" else ""
        before = " before this start" if ctx.state.voyage.arrived else ""
        _end(ctx, f"{reached_words(ctx)}{before}{home}{end}", arrived=not trouble)
        return
    stopped = (
        ctx.state.steering.own_mode in STOPPING
        and ctx.autopilot is not None
        and (ctx.autopilot.mode is ctx.state.steering.own_mode)
    )
    # the loiter's place is the same wherever the boat has been
    ctx.set(operator=changed(ctx.state.operator, is_back=False))
    why = waits_for(ctx) if stopped else ""
    if why:
        ctx.phase(Phase.HOLDING, why)
    elif not repair(ctx):
        hand_back(ctx)
        ctx.phase(Phase.DONE, ctx.state.voyage.over + ("; waiting for AUTO" if stopped else _raised(ctx)))


def _lies_off(route: Route | None) -> str:
    """Return how far off the last waypoint the loiter lies that ends the mission, where it is not by it."""
    if route is None or route.bound_for not in {"", HOME} or len(route.points_en_m) < 2:
        return ""
    off_m = distance_m(*route.points_en_m[-2:])
    return f"; she lies {off_m:.0f} m off, where a loiter has room" if off_m > NEAR_M else ""


def _is_on_to_its_place(ctx: StepContext) -> bool:
    """Say so while she still sails to the loiter that ends her mission, which a place without room has farther off."""
    route, boat, status = ctx.state.mission.route, ctx.boat_en, ctx.autopilot
    if route is None or boat is None or status is None or not (status.is_armed and status.mode is Mode.AUTO):
        return False
    off_m = distance_m(boat, route.points_en_m[-1])
    is_open = ctx.voyage.area.path_clearance_m([boat, *ctx.ahead(), route.points_en_m[-1]]) >= ctx.config.margin_floor_m
    if off_m <= max(NEAR_M, ctx.loiter_swing_m) or not is_open:
        return False  # where the straight way is shut, the way back to her place is planned, of a voyage that is over
    ctx.phase(Phase.STANDARD, f"no goal is left; {off_m:.0f} m to where she is to lie")
    return True


def _raised(ctx: StepContext) -> str:
    names = ", ".join(r.name for r in ctx.state.alarms.raised if r.name != OUT_OF_TIME)
    return f"; {names}" if names else ""


def _end(ctx: StepContext, why: str, *, arrived: bool) -> None:
    """The voyage is over: remember where the boat is to rest."""
    ctx.let_go_of_plan()
    route = ctx.state.mission.route
    place = route.points_en_m[-1] if route is not None and route.points_en_m else ctx.boat_en
    ctx.set(voyage=changed(ctx.state.voyage, over=why, arrived=arrived, rest_en_m=place))
    hand_back(ctx)
    ctx.phase(Phase.DONE, why)
    ctx.say(Severity.NOTICE if arrived else Severity.WARNING, "done", why, every_s=0.0)
    room_m = math.inf if place is None else float(ctx.to_stay_in.area.clearance_m([place])[0])
    if room_m < ctx.loiter_swing_m:
        ctx.say(
            Severity.CRITICAL,
            "no room",
            f"she loiters with {room_m:.0f} m of room, in this wind a loiter takes {ctx.loiter_swing_m:.0f}: take her",
        )
