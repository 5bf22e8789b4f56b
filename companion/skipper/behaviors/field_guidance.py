"""Steering by vector field under GUIDED: the last resort, a mode of its own, and the fields that goals have.

The last resort begins with the watchdog "vessel too near" and ends when it is over and a plan made since then, from
where the boat has come to, is in place. Headings go out every step: they die after 3 s. What stands still and the
fence are in the field; the no-go zone is ours to keep out of (``companion.field.guidance``). Other people's changes of
mode end it: a boat set to AUTO meanwhile is not taken again for a minute.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely

from companion.field.guidance import follow_line, go_to, hold_heading, step
from companion.field.look_ahead import way_out_rad
from companion.field.station import RETURNED_M, Station, StationPhase, StationState, keep
from companion.field.tree import LEAST, FieldConditions, field_of, lengths, zone_of
from companion.field.values import GuidanceSettings, Intent, MovingObstacle, Setpoint, Situation
from companion.frozen import changed
from companion.geo.angles import wrap_pi
from companion.messages import Mode, Severity
from companion.skipper.behaviors.helm import is_busy, set_mode
from companion.skipper.planning.asking import request
from companion.skipper.planning.diversions import diversion, is_at_rest, is_composed
from companion.skipper.planning.not_found import hold
from companion.skipper.planning.right_of_way import held_of
from companion.skipper.planning.vessels import GIVE_UP_RISK, near, timed_legs
from companion.skipper.planning.waits import stay_left_s
from companion.skipper.step import Guidance, ReplanReason, SteerHeading, StepContext
from companion.skipper.step.state import FieldSteering, Inside
from companion.skipper.step.state import Phase as Doing
from companion.skipper.way import Composed, Gate, PointEn, Until, distance_m
from companion.skipper.way.gates import marks_of
from companion.traffic import Vessel, predict
from companion.traffic.colregs import expected

NAME = "vessel too near"  # the watchdog's
KEEP_SHARE = 0.5  # of the distance that plans keep: what the last resort defends
GROWN_S = 30.0  # the growth of a vessel's disc is that of its next half minute
LOOK_S = 90.0
PLAN_EVERY_S = 20.0  # Büsser 5.2
LEFT_ALONE_S = 60.0  # after somebody set AUTO in the middle of it
LAG_S = 3.0  # a boat of a few metres gathers its speed in this time
HORIZON_S = 60.0
QUICK_RADPS = math.radians(20.0)  # a boat that turns faster ends its boards on the station by tacking
WEAK = 5.0  # of 10: what else a field says must be weaker for a station to be kept
AROUND_M = 60.0  # outside a vessel's disc: nearer than this it is not on a station
ROOM_M = 12.0  # of the boards and loops about a station, beyond what is kept clear of the shore
STOP_M = 3.0  # a motorboat lies still this near to its station
SLOW = 0.3  # of full thrust, at least: a motorboat is slower in a turn, or circles a mark inside it
PATIENCE_S = 5.0  # without a heading ArduRover's GUIDED stops it after 3 s: a field that is weak keeps its last
BACK_S = 10.0  # a field that was given up has said something for so long
LEAVE_S = 45.0  # a plan from here takes a few seconds; one that is not found is the ladder's
STEP_S = 1.5  # what made the boat leave, an order or the end, is seen a step after it asked for the plan
INSIDE_M = 1.5  # a vessel is in the water when it is so far in: its position is noisy


# ------------------------------------------------------------------------------------- what is seen
def obstacles(ctx: StepContext, vessels: Sequence[Vessel]) -> tuple[MovingObstacle, ...]:
    """Return the discs that the field keeps out of: hull, half the distance that plans keep, and what is not known."""
    hull = ctx.voyage.boat.hull
    ring_m = KEEP_SHARE * ctx.config.traffic_clearance_m
    own_m = hull.reach_m + ring_m
    out = []
    for vessel in vessels:
        motion = None if held_of(ctx, vessel) is None else expected(vessel)
        now, later = predict(vessel, ctx.t_s, motion), predict(vessel, ctx.t_s + GROWN_S, motion)
        radius_m = now.radius_m(GIVE_UP_RISK)
        out.append(
            MovingObstacle(
                en_m=now.mean_en_m,
                velocity_en_mps=now.velocity_en_mps,
                keep_m=radius_m + own_m,
                growth_mps=max(0.0, later.radius_m(GIVE_UP_RISK) - radius_m) / GROWN_S,
                ring_m=ring_m,
            )
        )
    return tuple(out)


def meets_in(ctx: StepContext) -> tuple[float, str] | None:
    """Return in how many seconds (at most ``LOOK_S``) the way being sailed enters a vessel's disc, and whose.

    The way is the route from where the boat is, at the polar's speeds, and the boat's place where it ends. A vessel
    that lies still is the planner's matter. None without vessels or position.
    """
    vessels, boat = [v for v in near(ctx) if not v.lies], ctx.boat_en
    if not vessels or boat is None:
        return None
    at_s, way = [0.0], [boat]
    for leg in timed_legs(ctx):
        at_s += [leg.start_s, leg.end_s]
        way += [leg.from_en, leg.to_en]
    t_s = np.arange(0.0, LOOK_S + 1.0)
    points = np.asarray(way)
    own = np.column_stack([np.interp(t_s, at_s, points[:, 0]), np.interp(t_s, at_s, points[:, 1])])
    first = (LOOK_S, "")
    for vessel, disc in zip(vessels, obstacles(ctx, vessels), strict=True):
        centre = np.asarray(disc.en_m) + t_s[:, None] * np.asarray(disc.velocity_en_mps)
        inside = np.hypot(*(own - centre).T) < disc.keep_m + disc.growth_mps * t_s
        if inside.any() and t_s[int(np.argmax(inside))] < first[0]:
            first = (float(t_s[int(np.argmax(inside))]), vessel.label)
    return first


def situation(ctx: StepContext) -> Situation | None:
    """Return what the guidance sees, None without position or, under sail, wind: a sailboat is not steered blind."""
    boat, vehicle, wind = ctx.boat_en, ctx.snapshot.vehicle, ctx.wind_now
    if boat is None or vehicle is None or (wind is None and ctx.config.sails):
        return None
    seen = obstacles(ctx, near(ctx))
    buoys = tuple(MovingObstacle(en_m=mark.en_m, keep_m=mark.keep_m) for mark in marks_of(ctx.voyage))
    return Situation(
        t_s=ctx.t_s,
        en_m=boat,
        velocity_en_mps=vehicle.velocity_en_mps,
        heading_rad=vehicle.heading_rad,
        twd_from_rad=wind[0] if wind is not None and ctx.config.sails else None,
        tws_mps=wind[1] if wind is not None else 0.0,
        obstacles=(*seen, *buoys),
        current_en_mps=ctx.current_en_mps,
    )


def habits(ctx: StepContext, tws_mps: float) -> GuidanceSettings:
    """Return what the voyage's boat can do in this wind, and the margins of its plans."""
    boat = ctx.voyage.boat
    twa, speed = boat.polar.curve(max(1.0, tws_mps))
    can = GuidanceSettings(
        is_sailing=ctx.config.sails,
        no_go_half_rad=ctx.planned_no_go_rad,
        polar_twa_rad=tuple(map(float, twa)),
        polar_mps=tuple(map(float, speed)),
        turn_rate_radps=boat.turn_rate_radps,
        tack_s=max(1.0, boat.tack_loss_s),
        lag_s=LAG_S,
        horizon_s=HORIZON_S,
        keep_m=ctx.config.margin_floor_m + boat.hull.reach_m,  # of the boat's place
    )
    return can if boat.can_tack else replace(can, tack_min_mps=math.inf)


def intent(ctx: StepContext, seen: Situation) -> Intent:
    """Return where to go: by field alone to the gate or a diversion's place, else back to the plan's leg.

    What stands still is in it.
    """
    leg, gate, bound, rest = ctx.leg(), ctx.gate, diversion(ctx), ctx.state.voyage.rest_en_m
    place = bound.en_m if bound is not None and bound.has_place else gate.en_m if gate is not None else None
    if ctx.guidance is Guidance.FIELD and place is not None:
        wanted = go_to(place, seen.twd_from_rad or 0.0)
    elif _is_at_rest(ctx):
        wanted = go_to(seen.en_m if rest is None else rest, seen.twd_from_rad or 0.0)
    elif leg is not None and distance_m(*leg) > 1.0:
        wanted = follow_line(*leg)
    else:
        wanted = go_to(leg[1] if leg is not None else seen.en_m, seen.twd_from_rad or 0.0)
    return replace(wanted, clearance=ctx.water_now.area.clearance_m)


def heading(ctx: StepContext) -> Setpoint | None:
    """Return the heading to send now and what it is for, None when nothing can be told: it then times out."""
    seen, gate = situation(ctx), ctx.gate
    if seen is None:
        return None
    if is_composed(ctx) and gate is not None and gate.field is not None:
        setpoint = _composed(ctx, seen, gate.field)
        setpoint = replace(setpoint, reason=f"{gate.name}: {setpoint.reason}")
    else:
        guidance, setpoint = step(ctx.state.by_field.guidance, seen, intent(ctx, seen), habits(ctx, seen.tws_mps))
        ctx.set(by_field=replace(ctx.state.by_field, guidance=guidance))
    return setpoint if ctx.config.sails else _slowed(setpoint, seen)


def _slowed(setpoint: Setpoint, seen: Situation) -> Setpoint:
    """Return what is told to a motorboat: the boat is slower through sharp turns."""
    ahead = math.cos(wrap_pi(setpoint.heading_rad - seen.heading_rad))
    return replace(setpoint, thrust=min(setpoint.thrust, max(SLOW, ahead)) if setpoint.thrust > 0.0 else 0.0)


# --------------------------------------------------------------------------------- a goal's own field
def strength(ctx: StepContext, seen: Situation, field: Composed) -> float:
    """Return how strong a goal's field is where the boat is; about its station it is as strong as need be."""
    place = field.tree.station_en
    if place is not None and distance_m(seen.en_m, place) < Station(at_en=place).far_m:
        return math.inf
    conditions = FieldConditions(seen=seen, habits=habits(ctx, seen.tws_mps), way_out_rad=0.0)
    return float(lengths(field.tree, conditions, np.array([seen.en_m]))[0])


def _composed(ctx: StepContext, seen: Situation, field: Composed) -> Setpoint:
    """Return what a goal's field says, kept clear of vessels and shore; about its station the station keeper."""
    memory, tree, can = ctx.state.by_field, field.tree, habits(ctx, seen.tws_mps)
    way_out = None if tree.leaves is None else way_out_rad(seen, tree.leaves, can, memory.way_out_rad)
    conditions = FieldConditions(seen=seen, habits=can, way_out_rad=way_out)
    station = _station(ctx, seen, field, conditions)
    if station is not None:
        after, setpoint = keep(memory.station, seen, station, can)
        ctx.set(by_field=replace(memory, station=after))
        return setpoint
    made, last = field_of(tree, conditions), memory.guidance.wanted_rad
    value = made(seen.en_m)[0]
    wanted = Intent(field=made, zone=zone_of(tree, conditions), clearance=ctx.water_now.area.clearance_m)
    is_weak = math.hypot(value[0], value[1]) < LEAST
    if is_weak:  # for a moment: over a point that is sailed to
        wanted = replace(hold_heading(seen.heading_rad if last is None else last), clearance=wanted.clearance)
    guidance, setpoint = step(memory.guidance, seen, wanted, can)
    ctx.set(by_field=replace(memory, guidance=guidance, station=StationState(), way_out_rad=way_out))
    place = tree.station_en
    lies = not ctx.config.sails and place is not None and distance_m(seen.en_m, place) < STOP_M
    return replace(setpoint, thrust=0.0) if lies else setpoint


def _station(ctx: StepContext, seen: Situation, field: Composed, conditions: FieldConditions) -> Station | None:
    """Return the station to keep by a goal's field: she can keep it, and nothing else presses."""
    place = field.tree.station_en
    station = None if place is None else _kept(ctx, seen, place)
    if station is None:
        return None
    rest = field_of(field.tree, conditions, without_station=True)(seen.en_m)[0]
    return station if math.hypot(rest[0], rest[1]) < WEAK else None


def _kept(ctx: StepContext, seen: Situation, place: PointEn) -> Station | None:
    """Return the station to keep at a place: the boat is there, under sail, with room, and nobody is near.

    Its boards and loops look out neither for the shore nor for vessels: else a field that does leads to the place.
    """
    if seen.twd_from_rad is None:
        return None
    station = _station_at(ctx, place)
    is_there = ctx.state.by_field.station.phase is not StationPhase.RETURN
    if distance_m(seen.en_m, place) > (station.far_m if is_there else RETURNED_M):
        return None
    if float(ctx.voyage.area.clearance_m([place])[0]) < ctx.config.margin_floor_m + ROOM_M:
        return None
    if any(distance_m(seen.en_m, o.en_m) < o.keep_m + AROUND_M for o in seen.obstacles):
        return None
    return station


def _station_at(ctx: StepContext, place: PointEn) -> Station:
    station = Station(at_en=place)
    return replace(station, tacks=True) if ctx.voyage.boat.turn_rate_radps >= QUICK_RADPS else station


# -------------------------------------------------------------------------------------- last resort
def last_resort(ctx: StepContext) -> bool:
    """Steer clear of a vessel that is too near to plan for; True while the helm is the field's."""
    memory, status, may = ctx.state.by_field, ctx.autopilot, ctx.snapshot.permissions
    raised = ctx.is_raised(NAME)
    if status is None or ctx.is_field_steered:
        return False
    if not memory.resort.engaged:
        if not raised or ctx.t_s < memory.not_before_s:
            return False
        if not (may.may_steer and may.may_set_mode):
            ctx.say(
                Severity.CRITICAL, "no last resort", "a vessel is too near to plan for, and steering is not permitted"
            )
            return False
        if situation(ctx) is None:
            return False
    elif memory.seen_guided and status.mode is Mode.AUTO and not is_busy(ctx, Mode.GUIDED.name):
        ctx.set(
            steering=changed(ctx.state.steering, own_mode=None),
            by_field=FieldSteering(not_before_s=ctx.t_s + LEFT_ALONE_S),
        )
        ctx.say(Severity.NOTICE, "last resort over", "somebody set AUTO: the field lets go", every_s=0.0)
        return False
    resort = memory.resort.step(ctx.t_s, too_near=raised, can_plan=_is_planned(ctx), clear_s=0.0)
    if memory.resort.engaged and not resort.engaged:
        bound = diversion(ctx)
        lies = _is_at_rest(ctx) or is_at_rest(ctx)
        ctx.set(by_field=FieldSteering(let_go_s=ctx.t_s) if lies else FieldSteering())
        back = "her place" if bound is None and _lies(ctx) else "the plan"
        if bound is not None and not bound.has_place:
            hold(ctx, bound.sentence, anew=True)
            back = "a loiter here"
        ctx.say(
            Severity.NOTICE,
            "last resort over",
            f"the way is clear again after {ctx.t_s - memory.resort.since_s:.0f} s: back to AUTO and {back}",
            every_s=0.0,
        )
        return False
    if not memory.resort.engaged:
        met = meets_in(ctx)
        whose = f"{met[1]}, met in {met[0]:.0f} s" if met is not None and met[1] else "a vessel"
        ctx.set(  # the guidance gets out of irons by itself
            steering=changed(ctx.state.steering, until_s=None, heading_rad=None)
        )
        ctx.say(Severity.WARNING, "last resort", f"too near to plan for: {whose}; steering by field", every_s=0.0)
    clear_s = None if raised else (memory.clear_s if memory.clear_s is not None else ctx.t_s)
    guided = status.mode is Mode.GUIDED
    ctx.set(by_field=replace(memory, resort=resort, clear_s=clear_s, seen_guided=memory.seen_guided or guided))
    if guided:
        ctx.set(steering=changed(ctx.state.steering, own_mode=Mode.GUIDED))
    else:
        set_mode(ctx, Mode.GUIDED, "too near to plan for: steering by field")
    _plan(ctx)
    told = heading(ctx)
    if told is None:
        ctx.phase(Doing.LAST_RESORT, "steering by field: no position or no wind, so no heading")
        return True
    ctx.act(SteerHeading(heading_rad=told.heading_rad, thrust=told.thrust, text=f"last resort: {told.reason}"))
    where = f"{math.degrees(told.heading_rad) % 360.0:.0f}°"
    ctx.phase(
        Doing.LAST_RESORT,
        f"keeping clear by field: {where} ({told.reason})" + ("" if raised else "; clear, waiting for the plan"),
    )
    return True


def _is_at_rest(ctx: StepContext) -> bool:
    """Return whether there is nothing to sail to but the place where she rests, and the straight way there is clear."""
    return bool(ctx.state.voyage.over) and diversion(ctx) is None


def _lies(ctx: StepContext) -> bool:
    """Return whether no plan leads on from here: all goals are passed, she is at rest, or is to stay where she is."""
    bound = diversion(ctx)
    return ctx.gate is None or _is_at_rest(ctx) if bound is None else not bound.has_place


def _is_planned(ctx: StepContext) -> bool:
    """Return whether a plan asked for since the water was clear has been answered and is on board."""
    state, clear_s = ctx.state, ctx.state.by_field.clear_s
    if _lies(ctx):
        return clear_s is not None and state.pending.upload is None  # the mission ends in a loiter
    return (
        clear_s is not None
        and state.plans.last_s >= clear_s
        and state.pending.plan is None
        and state.pending.upload is None
        and not state.mission.repair
    )


def _plan(ctx: StepContext) -> None:
    """Ask for a plan from where the field has brought the boat: now and then, and at once when the water is clear."""
    state = ctx.state
    is_busy_with = state.pending.plan is not None or state.pending.upload is not None
    if is_busy_with or _lies(ctx) or ctx.is_raised("becalmed"):
        return
    clear_s = state.by_field.clear_s
    due = clear_s is not None and state.plans.last_s < clear_s
    if due or ctx.t_s - state.plans.last_s >= PLAN_EVERY_S:
        request(ctx, ReplanReason.OBSTACLE, text="from where the field has brought the boat")


# ------------------------------------------------------------------------------------------ station
def keeps_station(ctx: StepContext, place: PointEn) -> bool:
    """Stay at a place by field; False where that is not the guidance: the loiter that ends the mission does it.

    A motorboat lies still in that, too.
    """
    if not ctx.is_field_steered or not ctx.config.sails:
        return False
    status, seen = ctx.autopilot, situation(ctx)
    if status is not None and status.mode is not Mode.GUIDED:
        set_mode(ctx, Mode.GUIDED, "keeping station by field")
    elif seen is not None:
        ctx.set(steering=changed(ctx.state.steering, own_mode=Mode.GUIDED))
        setpoint = _at_station(ctx, seen, place)
        ctx.act(
            SteerHeading(heading_rad=setpoint.heading_rad, thrust=setpoint.thrust, text=f"station: {setpoint.reason}")
        )
    return True


def _at_station(ctx: StepContext, seen: Situation, place: PointEn) -> Setpoint:
    """Return how the station is kept, or sailed to clear of shore and vessels where its boards have no room."""
    memory, can, station = ctx.state.by_field, habits(ctx, seen.tws_mps), _kept(ctx, seen, place)
    if station is not None:
        after, setpoint = keep(memory.station, seen, station, can)
        ctx.set(by_field=replace(memory, station=after))
        return setpoint
    wanted = replace(go_to(place, seen.twd_from_rad or 0.0), clearance=ctx.water_now.area.clearance_m)
    guidance, setpoint = step(memory.guidance, seen, wanted, can)
    ctx.set(by_field=replace(memory, guidance=guidance, station=StationState()))
    return setpoint


# -------- Goals that are sailed by a field of their own: when it steers, when it is over, and when it leads nowhere.
# A field that says nothing of where to go, or that cannot be steered by, is given up by name: it makes for the goal's
# place by plan, in AUTO, and loiters there until it says something again. From a field to a plan it is steered on by
# the plain one to where it is bound for, until a plan from where it has come to is on board.


def follow_field(ctx: StepContext) -> None:
    """See whether the goal that is next is sailed by its field, and let go of one that is over or leads nowhere."""
    gate, memory = ctx.gate, ctx.state.by_field
    has_field = gate is not None and gate.field is not None and ctx.state.voyage.sailing and not ctx.state.voyage.over
    if gate is not None and gate.field is not None and has_field:
        _weigh(ctx, gate.name, gate.field)
        memory = ctx.state.by_field
    elif memory.lost:
        memory = replace(memory, lost="", weak_since_s=None, strong_since_s=None)
        ctx.set(by_field=memory)
    if has_field and diversion(ctx) is None:
        if gate is not None and gate.field is not None and not (memory.composed and memory.left_s is None):
            ctx.say(
                Severity.NOTICE,
                "field",
                f"{gate.name}: steered by {gate.field.tree.text}, {gate.field.until_words}",
                every_s=0.0,
            )
        ctx.set(by_field=replace(memory, composed=True, left_s=None))
    elif memory.composed:
        left_s = ctx.t_s if memory.left_s is None else memory.left_s
        ctx.set(by_field=replace(memory, composed=not _is_left(ctx, left_s), left_s=left_s))
        if not ctx.state.by_field.composed:
            ctx.set(by_field=replace(ctx.state.by_field, left_s=None, way_out_rad=None))


def _is_left(ctx: StepContext, since_s: float) -> bool:
    """Return whether nothing need be steered on: a plan asked for since then is in place, or none can be waited for."""
    state, bound = ctx.state, diversion(ctx)
    goes_on = (
        state.voyage.sailing
        and not state.voyage.over
        and (bound.has_place if bound is not None else ctx.gate is not None)
    )
    if not goes_on or ctx.config.guidance is Guidance.FIELD or situation(ctx) is None:
        return True
    is_planned = state.plans.last_s >= since_s - STEP_S and state.pending.plan is None and state.pending.upload is None
    return is_planned or ctx.t_s - since_s > LEAVE_S


def _weigh(ctx: StepContext, name: str, field: Composed) -> None:
    """Give a field up that says nothing for a while, and take it again when it does."""
    memory, seen = ctx.state.by_field, situation(ctx)
    if seen is None:
        lacks = "no position is known" if ctx.boat_en is None else "no wind is known"
        why, is_weak = f"it cannot be sailed by its field, for {lacks}", True
    else:
        found = strength(ctx, seen, field)
        is_weak = found < LEAST
        why = f"its field {field.tree.text} has no value here ({found:.2f} of 10)"
    weak = (memory.weak_since_s if memory.weak_since_s is not None else ctx.t_s) if is_weak else None
    strong = None if is_weak else memory.strong_since_s if memory.strong_since_s is not None else ctx.t_s
    lost = memory.lost
    if lost and strong is not None and ctx.t_s - strong >= BACK_S:
        lost = ""
        ctx.say(Severity.NOTICE, "field", f"{name}: its field leads on again", every_s=0.0)
    elif not lost and weak is not None and ctx.t_s - weak >= PATIENCE_S:
        lost = why
        ctx.say(Severity.WARNING, "no field", f"{name}: {why}: by plan to its place, and a loiter there", every_s=0.0)
    ctx.set(by_field=replace(memory, weak_since_s=weak, strong_since_s=strong, lost=lost))


def has_sailed(ctx: StepContext, gate: Gate, boat: PointEn) -> bool:
    """Count the time by a goal's field; True when it is over, which is said."""
    field, inside = gate.field, ctx.state.progress.inside
    assert field is not None
    if inside is None or inside.goal != gate.goal:
        inside = Inside(goal=gate.goal, t_s=ctx.t_s, utc_s=ctx.utc_s)
        ctx.set(progress=changed(ctx.state.progress, inside=inside))
    why = _over(ctx, gate, field, boat)
    if not why:
        return False
    ctx.set(
        progress=changed(
            ctx.state.progress,
            gate=ctx.state.progress.gate + 1,
            reached=(*ctx.state.progress.reached, gate.goal),
            closest_m=math.inf,
            inside=None,
        )
    )
    ctx.say(
        Severity.NOTICE,
        "goal",
        f"{gate.name}: {why} after {inside.age_s(ctx.t_s, ctx.utc_s):.0f} s by field",
        every_s=0.0,
    )
    return True


def _over(ctx: StepContext, gate: Gate, field: Composed, boat: PointEn) -> str:
    """Return why a goal's field is over, empty: it is not."""
    if ctx.state.progress.released == gate.goal:
        return "told to go on"
    if stay_left_s(ctx, gate) <= 0.0:
        return "her time is over"
    if field.until is Until.PLACE and ctx.state.progress.closest_m <= gate.radius_m:
        return f"{distance_m(boat, gate.en_m):.1f} m from its place"
    if field.water_en is None:
        return ""
    if field.until is Until.OUTSIDE and not shapely.covers(field.water_en, shapely.points(boat)):
        return "she is outside"
    picture = ctx.snapshot.traffic
    if field.until is Until.VESSEL and picture is not None:
        well_inside = shapely.buffer(field.water_en, -INSIDE_M)
        for vessel in picture.vessels:
            if shapely.covers(well_inside, shapely.points(predict(vessel, ctx.t_s).mean_en_m)):
                return f"{vessel.label} is in its water"
    return ""
