"""Where the boat is bound for when it is not the next goal: a refuge, home, its place to rest, or just to stay.

A diversion is found anew in every step from what is raised and what is being answered; the route says which one its end
serves. It is planned like any leg and ends in a loiter, so that nothing is ever sailed straight and unlooked at.
"""

from __future__ import annotations

import math
from dataclasses import replace

from companion.boat import Boat
from companion.messages import Severity
from companion.orders import Verb
from companion.safety import BATTERY, BY_RANK, ENDINGS, FAILSAFES, SHORE, STOPPING, End, Recovery
from companion.skipper.planning.statement import aim_near
from companion.skipper.planning.track import steps
from companion.skipper.planning.waits import gun_in_s, stay_left_s, waiting_en, waits_for_gun
from companion.skipper.step import Diversion, DiversionKind, SafeEnd, SkipperConfig, StepContext
from companion.skipper.step.missions import ROOMIER_BY_M, lacking_m, loiter_place, place_with_room, roomy_m
from companion.skipper.step.route import HOME_RADIUS_M
from companion.skipper.way.autopilot_fence import Drawn, HomeCircle
from companion.skipper.way.gates import Gate
from companion.skipper.way.geometry import distance_m
from companion.skipper.way.shoals import beyond_words
from companion.skipper.way.shortest import way_m
from companion.skipper.way.voyage import PointEn, Refuge
from companion.traffic import Policy
from companion.words import below_words

DRAGGED = "dragged off"  # a watchdog
HOME, REST, ROOM = "home", "the place to rest", "water with room"
OFF_HOME = f"{ROOM} off {HOME}"
AFTER_LAST_GOAL = {HOME, ROOM, OFF_HOME}  # where she may be bound for then
HOLD_ROOM = 2.0  # times the loiter's radius: it may lie here for hours, and a HOLD carries it off before help comes
LACK_M = 1.0  # of the room that a loiter takes: she is not moved for less, as the wind freshens
LIES_THERE = {DiversionKind.HOME, DiversionKind.REFUGE, DiversionKind.GOAL, DiversionKind.STATION}
NO_ROOM = "{} has no room for a loiter"
SWINGS = 1.25  # of what her loiter takes in this wind: within it she is at her place
COMES_BACK_S = 120.0  # from where the field has led her she is back at her place: so long she is not dragged off
ROOM_TRIES = 3  # to find a way to water with room, behind the last goal
GOAL_RADIUS_M = 10.0  # a place that is named under way: there within this
ABOUT_M = 10.0  # how far off a refuge is by water is told from so near
FENCE_SAID_S = 600.0  # between two words on a fence that is drawn


def diversion(ctx: StepContext) -> Diversion | None:
    """Return where the boat is bound for instead of the next goal, None: nowhere.

    It is found once, and anew only when a part of the state that it is made of has been replaced.
    """
    state = ctx.state
    parts = (
        state.mission,
        state.operator,
        state.alarms,
        state.orders,
        state.voyage,
        state.plans,
        state.progress,
        state.by_field,
        state.steering,
        state.position,
    )
    if ctx.found is None or any(new is not old for new, old in zip(parts, ctx.found[0], strict=True)):
        ctx.found = parts, _find(ctx)
    return ctx.found[1]


def _find(ctx: StepContext) -> Diversion | None:
    bound, route = _wanted(ctx), ctx.state.mission.route
    if bound is None or route is None or not route.points_en_m:
        return bound
    if bound.kind in LIES_THERE and route.bound_for == _off(bound):  # on the way there, or there
        place = route.points_en_m[ctx.last_waypoint() if ctx.ahead() else -1]
        return replace(bound, kind=DiversionKind.ROOM, name=_off(bound), why=NO_ROOM.format(bound.name), en_m=place)
    return bound if ctx.ahead() else room_behind(ctx, bound) or bound


def room_behind(ctx: StepContext, bound: Diversion) -> Diversion | None:
    """Return the way on to water with room, where the place that the route is bound for has none for a loiter."""
    route, wind = ctx.state.mission.route, ctx.wind_mean
    if bound.kind not in LIES_THERE or route is None or not route.points_en_m or route.bound_for != bound.name:
        return None
    lies_en = route.points_en_m[-1]
    if float(ctx.to_stay_in.area.clearance_m([lies_en])[0]) >= ctx.loiter_swing_m - LACK_M:
        return None
    place = place_with_room(ctx.to_stay_in, ctx.known_config, lies_en, wind[0] if wind is not None else 0.0)
    if place is None:
        return None
    why = NO_ROOM.format(bound.name)
    return replace(bound, kind=DiversionKind.ROOM, name=_off(bound), why=why, en_m=place)


def _off(bound: Diversion) -> str:
    return f"{ROOM} off {bound.name}"


def _wanted(ctx: StepContext) -> Diversion | None:
    return (
        pressing(ctx)
        or _ordered(ctx)
        or _at_the_end(ctx)
        or _kept_in(ctx)
        or _before_start(ctx)
        or (_in_box(ctx) or _off_field(ctx))
        or _waits_with_room(ctx)
    )


def is_composed(ctx: StepContext) -> bool:
    """Return whether it is the field of the goal that is next that steers it now."""
    memory, gate = ctx.state.by_field, ctx.gate
    return memory.composed and memory.left_s is None and gate is not None and gate.field is not None


def _off_field(ctx: StepContext) -> Diversion | None:
    """Return where the boat waits while the field of the goal that is next cannot be sailed, None: it can."""
    gate, may = ctx.gate, ctx.snapshot.permissions
    if gate is None or gate.field is None or ctx.state.voyage.over:
        return None
    why = ctx.state.by_field.lost or (
        "" if may.may_steer and may.may_set_mode else "its field is not sailed, for steering is not permitted"
    )
    if not why:
        return None
    left_s = stay_left_s(ctx, gate)
    until = "until it can be sailed, or told to go on" if math.isinf(left_s) else f"{left_s:.0f} s more"
    return Diversion(
        kind=DiversionKind.FIELD,
        name=f"the place of {gate.name}",
        why=why,
        en_m=gate.en_m,
        radius_m=gate.radius_m,
        until=until,
    )


def _in_box(ctx: StepContext) -> Diversion | None:
    """Return where the boat stays in the box that is next."""
    gate = ctx.gate
    if gate is None or gate.box is None or ctx.state.voyage.over:
        return None
    left_s = stay_left_s(ctx, gate)
    until = "until told to go on" if gate.box.for_s is None else f"{left_s:.0f} s more"
    return Diversion(
        kind=DiversionKind.BOX,
        name=f"the box {gate.name}",
        why="to stay in it",
        en_m=gate.en_m,
        radius_m=gate.radius_m,
        until=until,
    )


def _before_start(ctx: StepContext) -> Diversion | None:
    """Return where the boat waits for the gun of the start line that is next."""
    gate = ctx.gate
    if gate is None or gate.line is None or ctx.state.voyage.over or not waits_for_gun(ctx, gate):
        return None
    left_s = gun_in_s(ctx, gate.line)
    why = "the autopilot does not know the time of day yet" if left_s is None else "waiting for the gun"
    until = "" if left_s is None else f"{left_s:.0f} s"
    name = f"the water before {gate.name}"
    route = ctx.state.mission.route
    is_bound = route is not None and route.bound_for == name and route.points_en_m
    place = route.points_en_m[ctx.last_waypoint()] if route is not None and is_bound else waiting_en(ctx, gate)
    return Diversion(kind=DiversionKind.START, name=name, why=why, en_m=place, until=until)


def pressing(ctx: StepContext) -> Diversion | None:
    """Return the diversion that comes before every order: battery, leak, or a failsafe that is answered."""
    state, ends = ctx.state, ctx.config.ends
    answer = ends.answer(state.operator.answering)
    why = (
        "the autopilot has lost its link to the shore"
        if state.operator.answering == SHORE
        else (f"the autopilot's {state.operator.answering} failsafe")
    )
    if answer is Recovery.SHELTER:
        is_battery = state.operator.answering == "battery"
        # the boat is stopped: something must be done
        end = End.REFUGE if not is_battery or ends.end(BATTERY) is End.SAY else ends.end(BATTERY)
        why = ENDINGS[BATTERY].because if is_battery and ctx.is_raised(BATTERY) else why
        return _found(ctx, end, why) or _stay(ctx, why)
    ended = _ended_early(ctx, over_orders=True)
    if ended is not None:
        return ended
    if answer is Recovery.STAY:
        return (_home(ctx, why) if state.operator.sent_home else None) or _stay(ctx, why)
    return None


def _ordered(ctx: StepContext) -> Diversion | None:
    """Return the diversion of the order that stands, None: there is none, or the boat is given up."""
    order = ctx.state.orders.standing
    if order is None or order.verb is Verb.STOP:
        return None
    if order.verb is Verb.HOLD or order.en_m is None:
        found = to_be_held(ctx, order.why)
        return None if found is None else replace(found, is_ordered=True)
    kind, name, radius_m = {
        Verb.REFUGE: (DiversionKind.REFUGE, f"the refuge {order.name}".rstrip(), HOME_RADIUS_M),
        Verb.HOME: (DiversionKind.HOME, HOME, HOME_RADIUS_M),
    }.get(order.verb, (DiversionKind.GOAL, order.name, GOAL_RADIUS_M))
    radius_m = next((r.radius_m for r in ctx.voyage.refuges if r.en_m == order.en_m), radius_m)
    return Diversion(kind=kind, name=name, why=order.why, en_m=order.en_m, radius_m=radius_m, is_ordered=True)


def _at_the_end(ctx: StepContext) -> Diversion | None:
    """Return where the boat is bound for when time, light, shore or wind are gone, or the goals are reached, or
    it is off its place."""  # noqa: D205, D209
    state = ctx.state
    if not state.voyage.over:
        ended = _ended_early(ctx, over_orders=False)
        if ended is not None:
            return ended
    if state.voyage.over:
        return _back(ctx) or _off_narrow_rest(ctx)
    return _on_station(ctx) or after_last_goal(ctx) if ctx.gate is None else None


def _ended_early(ctx: StepContext, *, over_orders: bool) -> Diversion | None:
    """Return the diversion of the first watchdog in the table's rank that ends the voyage early, None: none does."""
    for name in BY_RANK:
        ending = ENDINGS[name]
        if ending.over_orders is not over_orders or not ctx.is_raised(name):
            continue
        end = ctx.config.ends.end(name)
        if end is End.SAY:
            continue
        found = _found(ctx, end, ending.because)
        if found is None and not ending.sails_on:
            found = _stay(ctx, ending.because)
        if found is not None:
            return found
    return None


def _kept_in(ctx: StepContext) -> Diversion | None:
    """Return where the boat waits when the autopilot's own fence lies between it and the next goal."""
    fence, trouble = _fence_before(ctx, ctx.gate)
    here = ctx.boat_en
    if fence is None:
        return None
    # From the edge a loiter strays across it: it goes so far in, and is there when it has come there.
    room_m = min(ctx.config.margin_m + 2.0 * ctx.config.loiter_radius_m, fence.most_room_m)
    name = f"a place inside {fence.words}"
    route = ctx.state.mission.route
    is_bound = route is not None and route.bound_for == name
    if here is None or (fence.inside_m(here) >= room_m and not is_bound):
        staying = _stay(ctx, trouble)
        if staying is not None or here is None:
            return staying
    place = (
        route.points_en_m[ctx.last_waypoint()]
        if route is not None and is_bound
        else (fence.place_inside(ctx.voyage.area, here, room_m))
    )
    return Diversion(kind=DiversionKind.INSIDE, name=name, why=trouble, en_m=place)


def fenced_off(ctx: StepContext, gate: Gate | None) -> str:
    """Return why a goal cannot be sailed to for the autopilot's own fence (empty: it can)."""
    return _fence_before(ctx, gate)[1]


def _fence_before(ctx: StepContext, gate: Gate | None) -> tuple[HomeCircle | Drawn | None, str]:
    """Return the autopilot's own fence that a goal cannot be sailed to for, and why; None: there is none."""
    if gate is not None and not ctx.state.voyage.over:
        floor_m = min(ctx.config.margin_floor_m, ctx.config.margin_m)
        for fence in ctx.fences:
            trouble = fence.trouble(gate.name or "the goal", gate.en_m, floor_m)
            if trouble:
                return fence, trouble
    return None, ""


def speak_of_fence(ctx: StepContext) -> None:
    """Say that somebody has drawn a fence on the autopilot that takes water which the mission leaves."""
    if ctx.drawn is not None:
        ctx.say(
            Severity.WARNING,
            "fence drawn",
            f"{ctx.drawn.words} takes water of the mission's: plans keep inside of it",
            every_s=FENCE_SAID_S,
        )


def _found(ctx: StepContext, end: End, why: str) -> Diversion | None:
    """Return the diversion that ends a voyage so, None: there is no such place, or words are all that is asked."""
    ends_home = end is End.HOME or ctx.state.operator.sent_home or ctx.config.safe_end is SafeEnd.RETURN
    home = _home(ctx, why) if end in {End.HOME, End.REFUGE} and ends_home else None
    if end is End.STAY:
        return _stay(ctx, why)
    if end is End.SAY:
        return None
    return home or _refuge(ctx, why) if end is End.HOME else _refuge(ctx, why) or home


def after_last_goal(ctx: StepContext) -> Diversion | None:
    """Return the way behind the last goal: home where the mission ends there, to water with room where the goal has
    none for a loiter; None: there is none, or she has come there.
    """  # noqa: D205
    if ctx.state.voyage.home_reached or ctx.state.voyage.over or _on_station(ctx) is not None:
        return None
    ends_home = ctx.config.safe_end is SafeEnd.RETURN
    home = _home(ctx, "all goals are reached") if ends_home else None
    if home is not None or ctx.state.plans.retry.failures >= ROOM_TRIES:
        return home
    last, config, wind = ctx.gates[-1], ctx.known_config, ctx.wind_mean
    _, room_m = loiter_place(
        ctx.to_stay_in, config, last.en_m, wind[0] if wind is not None else 0.0, wanted_m=roomy_m(config)
    )
    if room_m >= config.loiter_radius_m:
        return None
    return _to_room(ctx, last.en_m, f"{last.name or 'the goal'} has no room for a loiter")


def _waits_with_room(ctx: StepContext) -> Diversion | None:
    """Return where the boat waits for a plan that was not found, where what it lies in has no room for a loiter."""
    route, state = ctx.state.mission.route, ctx.state
    if route is None or not route.points_en_m or not state.voyage.sailing or state.voyage.over or ctx.gate is None:
        return None
    is_bound = route.bound_for == ROOM
    if is_bound != bool(ctx.ahead()) or (not is_bound and state.plans.retry.failures == 0):
        return None
    here = route.points_en_m[-1]
    if not is_bound and float(ctx.to_stay_in.area.clearance_m([here])[0]) >= ctx.loiter_swing_m - LACK_M:
        return None
    return _to_room(ctx, here, "no plan was found, and here a loiter has no room")


def _to_room(ctx: StepContext, end_en: PointEn, why: str) -> Diversion | None:
    """Return the way to the nearest place by water with room for a loiter; None: there is none, or none is needed."""
    route, wind = ctx.state.mission.route, ctx.wind_mean
    if route is not None and route.bound_for == ROOM and ctx.ahead():
        place: PointEn | None = route.points_en_m[ctx.last_waypoint()]
    else:
        place = place_with_room(ctx.to_stay_in, ctx.known_config, end_en, wind[0] if wind is not None else 0.0)
    if place is None:
        return None
    return Diversion(kind=DiversionKind.ROOM, name=ROOM, why=why, en_m=place)


def _stay(ctx: StepContext, why: str) -> Diversion | None:
    """Return a diversion to stay, None outside the fence or over something: from there the boat sails on first."""
    here = ctx.snapshot.position_en_m
    if here is not None and float(ctx.voyage.area.clearance_m([here])[0]) <= 0.0:
        return None
    return Diversion(kind=DiversionKind.STAY, name="", why=why)


def to_be_held(ctx: StepContext, why: str) -> Diversion | None:
    """Return a diversion to stay, or to water with room where here is too little of it; None: as ``_stay``.

    That is planned to where it is near by, too: the turn towards it may be what there is no room for.
    """
    boat, water, config = ctx.boat_en, ctx.to_stay_in.area, ctx.known_config
    if boat is None or not ctx.ahead():
        return _stay(ctx, why)
    is_bound = _is_bound(ctx, ROOM)
    if is_bound or lacking_m(config, water, boat) > LACK_M:
        room = _to_room(ctx, boat, why)
        if room is not None and room.en_m is not None:
            near_m, there_m = water.clearance_m([held_at(ctx, boat)[0], room.en_m])
            if is_bound or there_m > near_m + min(roomy_m(config) - near_m, ROOMIER_BY_M) - LACK_M:
                return room
    return _stay(ctx, why)


def room_lacking_m(ctx: StepContext, boat: PointEn) -> float:
    """Return how much room a loiter lacks to keep the margin's floor where a boat is held [m], below 0: none."""
    return lacking_m(ctx.known_config, ctx.to_stay_in.area, held_at(ctx, boat)[0])


def held_at(ctx: StepContext, boat: PointEn) -> tuple[PointEn, float]:
    """Return where a boat at a place loiters when it is held, and the room there, to leeward too [m]."""
    wind, config = ctx.wind_mean, ctx.known_config
    wanted_m = max(HOLD_ROOM * ctx.config.loiter_radius_m, roomy_m(config))
    return loiter_place(ctx.to_stay_in, config, boat, wind[0] if wind else 0.0, wanted_m=wanted_m)


def _refuge(ctx: StepContext, why: str) -> Diversion | None:
    """Return the refuge that the route is bound for, else the nearest by water; the next after each that had no way."""
    refuges = refuges_by_way(ctx)
    if not refuges:
        return None
    route = ctx.state.mission.route
    bound = route.bound_for if route is not None else ""
    chosen = next((r for r in refuges if refuge_name(r) == bound), None)
    if chosen is None:
        chosen = refuges[ctx.state.plans.retry.failures % len(refuges)]
    return Diversion(
        kind=DiversionKind.REFUGE, name=refuge_name(chosen), why=why, en_m=chosen.en_m, radius_m=chosen.radius_m
    )


def refuges_by_way(ctx: StepContext) -> list[Refuge]:
    """Return the refuges, the nearest by water first; those in water that dries are none."""
    here, deep = ctx.boat_en or ctx.snapshot.position_en_m, ctx.to_stay_in.area
    lasting = [r for r in ctx.voyage.refuges if not ctx.voyage.drying or float(deep.clearance_m([r.en_m])[0]) > 0.0]
    return sorted(lasting, key=lambda r: _off_m(ctx, here, r.en_m))


def _off_m(ctx: StepContext, here: PointEn | None, place: PointEn) -> tuple[float, float]:
    """Return how far a place is off by water, and straight [m]: round a spit is farther than across."""
    if here is None:
        return 0.0, 0.0
    clear_m = min(ctx.config.margin_floor_m, ctx.config.margin_m)
    about = (ABOUT_M * round(here[0] / ABOUT_M), ABOUT_M * round(here[1] / ABOUT_M))  # asked for at every step
    return way_m(ctx.voyage.area, about, place, clear_m), distance_m(here, place)


def refuge_name(refuge: Refuge) -> str:
    """Return what a refuge is called in sentences."""
    return f"the refuge {refuge.name}".rstrip()


def home_trouble(ctx: StepContext) -> str:
    """Return why the way home cannot be planned (empty: it can)."""
    status = ctx.snapshot.autopilot
    if status is None or status.home is None:
        return "the autopilot has not told where home is"
    return place_trouble(ctx, HOME, ctx.voyage.frame.en_from_geo(status.home), HOME_RADIUS_M)


def place_trouble(ctx: StepContext, what: str, en_m: PointEn, radius_m: float) -> str:
    """Return why no way can be planned to within ``radius_m`` of a place to stay in (empty: one can be looked for).

    Water that dries is none, whatever the tide is now: she would take the ground there.
    """
    far_m = math.hypot(*en_m)
    if not far_m <= ctx.voyage.far_m:
        return f"{what} is {far_m / 1000.0:.0f} km from this water"
    area = ctx.to_stay_in.area
    if far_m > area.reach_m:
        return ""  # what lies there is seen when the boat comes there
    clearance = float(area.clearance_m([en_m])[0])
    floor_m = min(ctx.config.margin_floor_m, ctx.config.margin_m)
    if clearance < floor_m:
        near, bare = area.nearest_name(en_m), float(area.unfenced.clearance_m([en_m])[0])
        near += ", which dries" if near in {water.name for water in ctx.voyage.drying} else ""
        where = (
            f"{below_words(clearance, floor_m, 0)} m from {near}"
            if clearance > 0.0
            else (beyond_words(area, en_m) if bare > 0.0 else f"not in free water but in {near}")
        )
        return f"{what} is {where}: the margin's floor is {floor_m:g} m"
    if clearance >= ctx.config.margin_m:
        return ""
    least_m = steps(ctx)[-1].margin_m
    if aim_near(area, ctx.config, en_m, radius_m, least_m) is not None:
        return ""
    off = below_words(clearance, least_m)
    return f"{what} is {off} m from {area.nearest_name(en_m)}: no plan leads nearer than {least_m:g} m"


def _home(ctx: StepContext, why: str) -> Diversion | None:
    status = ctx.snapshot.autopilot
    if home_trouble(ctx) or status is None or status.home is None:
        return None
    return Diversion(kind=DiversionKind.HOME, name=HOME, why=why, en_m=ctx.voyage.frame.en_from_geo(status.home))


def station_left_s(ctx: StepContext) -> float:
    """Return how long the boat is to stay at the last goal yet [s], 0: not at all, or no longer."""
    since = ctx.state.voyage.station_since
    return max(0.0, ctx.config.station_s - (0.0 if since is None else since.age_s(ctx.t_s, ctx.utc_s)))


def _on_station(ctx: StepContext) -> Diversion | None:
    """Return the last goal while the boat is to stay there, and until the mission on board ends there or leads on."""
    left_s, last, route = station_left_s(ctx), ctx.gates[-1], ctx.state.mission.route
    if ctx.config.station_s <= 0.0 or (left_s <= 0.0 and route is not None and route.bound_for in AFTER_LAST_GOAL):
        return None
    station = Diversion(
        kind=DiversionKind.STATION,
        name=f"the station {last.name}".rstrip(),
        why="to stay there",
        en_m=last.en_m,
        radius_m=last.radius_m,
        until=f"{left_s:.0f} s more",
    )
    is_over = left_s <= 0.0 and (is_led_to(ctx, station) or ctx.state.plans.retry.failures >= ROOM_TRIES)
    return None if is_over else station


def is_led_to(ctx: StepContext, bound: Diversion) -> bool:
    """Return whether the mission on board ends where the boat is bound for; that of the last goal ends on its station.

    One that was cut short by a loiter leads nowhere.
    """
    route = ctx.state.mission.route
    if route is None or route.rung == "hold":
        return False
    if bound.kind is DiversionKind.STATION and not route.bound_for:
        return len(ctx.gates) - 1 in route.gate_of
    return route.bound_for == bound.name


def is_shut_off(ctx: StepContext) -> bool:
    """Return whether the straight way back to the loiter that ends the mission, which the boat is off, is not clear.

    The autopilot sails it all the same: led off by a field, carried by a stream or brought by a person. From below the
    floor it is clear where it comes no nearer.
    """
    route, boat, area = ctx.state.mission.route, ctx.boat_en, ctx.voyage.area
    if route is None or boat is None or ctx.ahead() or not route.points_en_m:
        return False
    lies_en = route.points_en_m[-1]
    if distance_m(boat, lies_en) <= SWINGS * ctx.loiter_swing_m:
        return False
    here_m = float(area.clearance_m([boat])[0])
    floor_m = min(ctx.config.margin_floor_m, ctx.config.margin_m, here_m - LACK_M)
    return area.path_clearance_m([boat, lies_en]) < max(0.0, floor_m)


def _back(ctx: StepContext) -> Diversion | None:
    """Return the way back to where the boat is to rest, when it is off it and the straight way is not clear."""
    rest, boat = ctx.state.voyage.rest_en_m, ctx.boat_en
    off = ctx.is_raised(DRAGGED) or bool(ctx.state.operator.answering) or is_led_off(ctx) or is_shut_off(ctx)
    if rest is None or boat is None or not (off or _is_bound(ctx, REST)):
        return None
    if not _is_bound(ctx, REST) and ctx.voyage.area.path_clearance_m([boat, rest]) >= ctx.config.margin_floor_m:
        return None  # the autopilot's own loiter goes back there
    return Diversion(kind=DiversionKind.REST, name=REST, why="she is off the place where she was to rest", en_m=rest)


def is_led_off(ctx: StepContext) -> bool:
    """Return whether the field keeps the boat off her place to rest for a vessel, or she is on her way back."""
    memory = ctx.state.by_field
    return memory.resort.engaged or ctx.t_s - memory.let_go_s < COMES_BACK_S


def _off_narrow_rest(ctx: StepContext) -> Diversion | None:
    """Return the way to water with room, where the boat is to rest in what has none for a loiter."""
    rest = ctx.state.voyage.rest_en_m
    if rest is None or float(ctx.to_stay_in.area.clearance_m([rest])[0]) >= ctx.loiter_swing_m - LACK_M:
        return None
    return _to_room(ctx, rest, "where she is to rest a loiter has no room")


def _is_bound(ctx: StepContext, name: str) -> bool:
    route = ctx.state.mission.route
    return route is not None and route.bound_for == name and bool(ctx.ahead())


def gate_for(bound: Diversion) -> Gate:
    """Return a diversion as a gate that completes nothing."""
    return Gate(en_m=bound.en_m, radius_m=bound.radius_m, goal=-1, ends_goal=False, name=bound.name, from_en_m=None)


def is_at_rest(ctx: StepContext) -> bool:
    """Return whether the boat is in the loiter at the end of the diversion that it is on."""
    bound, route = diversion(ctx), ctx.state.mission.route
    if bound is None or route is None or ctx.ahead():
        return False
    return bound.kind is DiversionKind.STAY or is_led_to(ctx, bound)


def place_to_keep(ctx: StepContext) -> PointEn | None:
    """Return the place of the loiter that the boat is told to stay in, None: there is none, or she lies elsewhere."""
    state, route, bound = ctx.state, ctx.state.mission.route, diversion(ctx)
    if state.voyage.over and (bound is None or bound.kind is DiversionKind.REST):
        return state.voyage.rest_en_m
    if route is None or not route.points_en_m or not is_at_rest(ctx) or state.pending.upload is not None:
        return None
    is_stopped = state.steering.own_mode in STOPPING and not ctx.is_raised(DRAGGED)  # its LOITER is elsewhere
    return None if is_stopped or ctx.is_field_steered else route.points_en_m[-1]


def follow_place(ctx: StepContext) -> None:
    """Keep how near she has been to the loiter that ends the mission on board, since nothing else of it is left."""
    memory, route, boat, since_s = ctx.state.adrift, ctx.state.mission.route, ctx.boat_en, ctx.state.mission.uploaded_s
    if route is None or not route.points_en_m or boat is None:
        return
    before_m = memory.nearest_m if memory.nearest_s == since_s else math.inf
    nearest_m = math.inf if ctx.ahead() else min(before_m, distance_m(boat, route.points_en_m[-1]))
    if (nearest_m, since_s) != (memory.nearest_m, memory.nearest_s):
        ctx.set(adrift=replace(memory, nearest_m=nearest_m, nearest_s=since_s))


def off_place_m(ctx: StepContext) -> float | None:
    """Return how far the boat is off the place where she is to stay [m], 0: she is at it or comes to it.

    None where there is no such place, or a field keeps her off it.
    """
    place, boat = place_to_keep(ctx), ctx.boat_en
    if place is None or boat is None or is_led_off(ctx):
        return None
    off_m, swing_m, nearest_m = distance_m(boat, place), SWINGS * ctx.loiter_swing_m, ctx.state.adrift.nearest_m
    comes = not ctx.state.voyage.over and swing_m < nearest_m and off_m < nearest_m + swing_m
    return 0.0 if off_m <= swing_m or comes else off_m


POLICY_WORDS = {
    Policy.KEEP_CLEAR: "vessels: kept clear of, whoever must give way",
    Policy.RULES: "vessels: by the rules of the road",
}


def words(config: SkipperConfig, name: str) -> str:
    """Return what is done about a watchdog that ends a voyage, in words."""
    end = config.ends.end(name)
    last = "say so" if ENDINGS[name].sails_on else "loiter near by"
    home = "home, " if config.safe_end is SafeEnd.RETURN else ""
    return {
        End.SAY: "say so",
        End.STAY: "loiter near by",
        End.REFUGE: f"to the nearest refuge, else {home}{last}",
        End.HOME: f"home, else to the nearest refuge, {last}",
    }[end]


def announcement(config: SkipperConfig, boat: Boat) -> str:
    """Return all of it in one sentence, and how vessels are met, to be said before setting sail."""
    said = [f"{name}: {words(config, name)}" for name in ENDINGS if config.is_watched(name, boat)]
    for name in (cause.name for cause in FAILSAFES):
        answer = config.ends.answer(name)
        if answer is not None:
            said.append(f"{name} failsafe: {answer.words}")
    return "; ".join([*said, POLICY_WORDS[config.traffic_policy]])
