"""Under way: who steers, what is asked for, Büsser's names for what the boat is doing, and tacks that are asked for."""

from __future__ import annotations

import math

from companion.boat.failed_tack import (
    AGAIN_SHARE,
    IRONS_S,
    MOST_FAILURES,
    RISKY,
    SET_SHARE,
    TRIES,
    failed_tack,
    gybing_centre,
    lee_set,
)
from companion.current import UNTOLD_MPS
from companion.frozen import changed
from companion.geo.angles import difference_rad, wrap_pi
from companion.messages import Mode, Severity
from companion.safety import HOMEWARD, STOPPING
from companion.skipper.behaviors.drifting import stops_drift
from companion.skipper.behaviors.failsafe import waits_for
from companion.skipper.behaviors.field_guidance import heading as by_field_heading
from companion.skipper.behaviors.field_guidance import last_resort
from companion.skipper.behaviors.headings import desired_heading_rad
from companion.skipper.behaviors.helm import (
    TACK,
    check_current,
    hand_back,
    is_busy,
    leave_passed,
    make_current,
    push_on,
    repair,
    set_mode,
    tack,
)
from companion.skipper.behaviors.position_doubt import stands_off
from companion.skipper.behaviors.rest import comes_to_rest, rest, turns_back_to_place
from companion.skipper.planning.asking import is_out_of_reach_said, out_of_reach, request
from companion.skipper.planning.autopilot_beats import IRONS_MEMORY_S, is_left_to_beat, tacks_fail
from companion.skipper.planning.diversions import diversion, is_at_rest, is_composed, is_shut_off
from companion.skipper.planning.not_found import FOUL, hold
from companion.skipper.planning.right_of_way import stands_on
from companion.skipper.planning.triggers import find_trigger, is_buoy
from companion.skipper.planning.uploads import is_way_clear
from companion.skipper.planning.vessels import near
from companion.skipper.planning.waits import stay_left_s
from companion.skipper.step import Diversion, Guidance, Phase, ReplanReason, SteerHeading, StepContext
from companion.skipper.step.wind_shifts import shifting
from companion.skipper.way.geometry import along_m, bear_away_rad, bearing_rad, cross_track_m, distance_m, moved
from companion.skipper.way.voyage import PointEn, water_to_keep
from companion.traffic.plans import MIN_INTERVAL_S

LEAD_S = 3.5  # a step to see it, the command, and the turn until the boat goes no farther that way
LEAST_MPS = 1.0  # slower the boat may not get through the wind
APART_S = 6.0  # between two tacks: the autopilot's own 5 s, and a step
LOOK_S = 8.0  # of the other tack, which must be better
GAIN_M = 1.0
NEXT_S = 2.0  # the tack that is asked for in the next step begins so far on
LAST_S = 20.0  # so near the leg's end the layline decides, which the autopilot sees
TURNING = 0.5  # of the boat's angle to the wind, more or less: then it is turning, or has borne away


def short_tack(ctx: StepContext) -> None:
    """Ask for a tack where the present one is about to come below the margin's floor and the other is clearer.

    On a leg that the wind has closed ArduRover sails at its no-go angle until it is SAIL_XTRACK_MAX off the line,
    whatever lies there; a margin narrower than that corridor does not bear it. A plan takes seconds and, after a great
    shift, may not be found at all. The autopilot tacks at once when it is asked to (DO_AUX_FUNCTION 63), on such a leg
    and 5 s after its last tack at the earliest. Where tacks can fail it is asked while there is room for one that does.
    """
    boat, leg, wind, vehicle = ctx.boat_en, ctx.leg(), ctx.wind_now, ctx.snapshot.vehicle
    status = ctx.autopilot
    if boat is None or leg is None or wind is None or vehicle is None or status is None or not ctx.ahead():
        return
    if status.mode is not Mode.AUTO or ctx.speed_mps < LEAST_MPS or not ctx.voyage.boat.can_tack:
        return
    is_uploading = ctx.state.pending.upload is not None
    if ctx.t_s - ctx.state.steering.tacked_s < APART_S or is_busy(ctx, TACK) or is_uploading:
        return
    if not ctx.is_closed(boat, leg[1], wind):
        return  # the leg is open: the autopilot follows it
    off = difference_rad(wind[0], vehicle.heading_rad)
    if not 0.5 * ctx.no_go_half_rad < abs(off) < 1.5 * ctx.no_go_half_rad:
        return  # the boat is not close-hauled: turning, or bearing away
    side = 1.0 if off >= 0.0 else -1.0
    floor_m = min(ctx.config.margin_floor_m, ctx.config.margin_m)
    now_m = _clearance_m(ctx, boat, vehicle.heading_rad, LEAD_S)
    why = f"{now_m:.0f} m clear ahead on this tack in {LEAD_S:g} s"
    if now_m >= floor_m:
        here_m = float(water_to_keep(ctx.voyage.area, boat).clearance_m([boat])[0])
        if now_m >= here_m - HAIR_M or _may_fail(ctx, boat, wind, floor_m):
            return
        why = "a tack that failed later would bring her below the floor"
    other_rad = wrap_pi(wind[0] + side * ctx.no_go_half_rad)
    if _clearance_m(ctx, boat, other_rad, LOOK_S) > now_m + GAIN_M:
        tack(ctx, "short tack", f"{why}: tacking before the corridor's edge")


def _may_fail(ctx: StepContext, boat: PointEn, wind: tuple[float, float], floor_m: float) -> bool:
    """Return whether a tack in the next step may fail, as often in a row as is likely, and the boat keeps the floor.

    While it lies the current that is believed carries it, planned for or not, and as much as is not told brings it
    nearer to whatever is near; it is blown back, or is not, or is set to lee.
    """
    vehicle, water = ctx.snapshot.vehicle, ctx.snapshot.current
    area = water_to_keep(ctx.voyage.area, boat)
    chance = ctx.state.tacking.chance(ctx.voyage.boat.tack_fails)
    if vehicle is None or chance <= 0.0:
        return True
    course, speed = vehicle.heading_rad, math.hypot(*ctx.through_en_mps)
    there = _there(ctx, boat, course, NEXT_S)
    tacking, is_starboard = ctx.state.tacking, difference_rad(wind[0], course) > 0.0
    irons_s = max(IRONS_S, tacking.irons_s)
    need_m = floor_m + irons_s * min(water.sigma_mps, UNTOLD_MPS)
    learned_mps = tacking.starboard_lee_mps if is_starboard else tacking.port_lee_mps
    lee = lee_set(course_rad=course, twd_from_rad=wind[0], lee_mps=max(learned_mps, SET_SHARE * wind[1]))
    set_en_mps = (water.en_mps[0] + lee[0], water.en_mps[1] + lee[1])
    radius_m = speed / ctx.voyage.boat.turn_rate_radps
    for failures in range(1, MOST_FAILURES + 1):
        blown, still = _failed(there, course, speed, wind, water.en_mps, irons_s)
        _, aside = _failed(there, course, speed, wind, set_en_mps, irons_s)
        if min(area.path_clearance_m(way) for way in (blown, still, aside)) < need_m:
            return False
        if chance ** (failures + 1) <= RISKY:
            return True
        there, speed = aside[-1], AGAIN_SHARE * math.hypot(*ctx.through_en_mps)
        if failures == TRIES:  # then she gybes round, where there is room
            centre = gybing_centre(there, course_rad=course, twd_from_rad=wind[0], radius_m=radius_m)
            if float(area.clearance_m([centre])[0]) - radius_m >= need_m:
                return True
    return True


def _failed(
    there: PointEn,
    course_rad: float,
    speed_mps: float,
    wind: tuple[float, float],
    carried_en_mps: PointEn,
    irons_s: float,
) -> tuple[list[PointEn], list[PointEn]]:
    """Return the tracks of a tack that fails, blown back and not, as lists of places."""
    blown, still = failed_tack(
        there,
        course_rad=course_rad,
        speed_mps=speed_mps,
        twd_from_rad=wind[0],
        tws_mps=wind[1],
        current_en_mps=carried_en_mps,
        irons_s=irons_s,
    )
    return [(float(e), float(n)) for e, n in blown], [(float(e), float(n)) for e, n in still]


def _clearance_m(ctx: StepContext, boat: PointEn, course_rad: float, span_s: float) -> float:
    """Return how clear the water is that a heading takes the boat through in ``span_s``, the current with it [m]."""
    return water_to_keep(ctx.voyage.area, boat).path_clearance_m([boat, _there(ctx, boat, course_rad, span_s)])


def _there(ctx: StepContext, boat: PointEn, course_rad: float, span_s: float) -> PointEn:
    """Return where a heading takes the boat in ``span_s``."""
    (east, north), through_m = ctx.current_en_mps, math.hypot(*ctx.through_en_mps) * span_s
    return moved((boat[0] + east * span_s, boat[1] + north * span_s), course_rad, through_m)


# --------------------
# A tack on a shift: on a leg that the autopilot beats, where the table of the wind's shifts says that it pays.
# The autopilot would stand on to its corridor's edge whatever the wind does. The tack is asked for within that
# corridor, which the plan's scorer found clear to both edges, so nothing is sailed that was not judged.


def shift_tack(ctx: StepContext) -> None:
    """Ask for a tack where it gains more than it costs."""
    boat, leg, wind, vehicle, status = ctx.boat_en, ctx.leg(), ctx.wind_now, ctx.snapshot.vehicle, ctx.autopilot
    if not ctx.config.shifts or boat is None or leg is None or wind is None or vehicle is None or status is None:
        return
    if (
        not ctx.ahead()
        or status.mode is not Mode.AUTO
        or ctx.speed_mps < LEAST_MPS
        or tacks_fail(ctx)
        or (not ctx.voyage.boat.can_tack)
    ):
        return
    is_too_soon = ctx.t_s - ctx.state.steering.tacked_s < ctx.config.shift_tacks_apart_s
    if is_too_soon or is_busy(ctx, TACK) or ctx.state.pending.upload is not None:
        return
    half_rad = ctx.no_go_half_rad
    off_rad = difference_rad(wind[0], vehicle.heading_rad)
    if not ctx.is_closed(boat, leg[1], wind) or abs(abs(off_rad) - half_rad) > TURNING * half_rad:
        return
    beat = shifting(ctx, bearing_rad(*leg), distance_m(*leg) - along_m(boat, *leg))
    if beat is None:
        return
    to_go_s = math.dist(boat, leg[1]) / beat.table.made_good_mps
    if to_go_s < LAST_S:
        return
    is_port = off_rad < 0.0
    shift_rad = difference_rad(wind[0], beat.mean_rad)
    gain_s = beat.table.gain_s(cross_track_m(boat, *leg), shift_rad, is_port=is_port)
    if gain_s <= 0.0 or not is_left_to_beat(ctx, boat, leg[1]):
        return
    headed_deg = math.degrees(shift_rad if is_port else -shift_rad)
    edge = "layline" if beat.table.corridor_m < ctx.tack_corridor_m - 0.1 else "corridor's edge"
    words = (
        f"headed {headed_deg:.0f}°" if headed_deg >= 0.5 else (f"lifted {max(0.0, -headed_deg):.0f}°, near the {edge}")
    )
    tack(ctx, "shift tack", f"{words}: tack; expected gain {gain_s:.1f} s of {to_go_s:.0f} to go")


HAIR_M = 0.5
STEER_S = 25.0  # bearing away longer than this has failed
SAILS_MPS = 0.8  # out of irons
IN_IRONS = "she was in irons"
SAILS_TWA_RAD = math.radians(60.0)
# Reasons that can wait among vessels, where plans must not follow each other fast (Büsser 5.2).
ROUTINE = frozenset(
    {ReplanReason.WAYPOINT, ReplanReason.FORECAST, ReplanReason.WIND_SHIFT, ReplanReason.PLAN_AGE, ReplanReason.OFF_LEG}
)


def is_at_end(ctx: StepContext) -> bool:
    """Return whether nothing is left to sail to: the voyage is over or its goals are passed, and no diversion is on."""
    return diversion(ctx) is None and (ctx.gate is None or bool(ctx.state.voyage.over))


def stand_off(ctx: StepContext) -> bool:
    """Keep off what a doubted position may hide."""
    if not stands_off(ctx):
        return False
    if not is_at_end(ctx) and ctx.state.position.doubt is None and ctx.state.pending.upload is None:
        _consider(ctx)  # from where the boat is known to be, while its loiter is begun anew
    return True


def stop_drift(ctx: StepContext) -> bool:
    """Stop a boat that drifts and does not sail."""
    return (bool(ctx.state.voyage.over) or not is_at_end(ctx)) and stops_drift(ctx)


def rest_at_end(ctx: StepContext) -> bool:
    """Loiter at the voyage's end; a LOITER for a doubted wind comes first, until the wind is known."""
    is_held = bool(ctx.snapshot.unsure) and ctx.state.steering.own_mode is Mode.LOITER and not ctx.state.voyage.over
    if is_held or not is_at_end(ctx):
        return False
    if last_resort(ctx):
        return True  # at rest she keeps clear as under way, and goes back to her place
    rest(ctx)
    return True


def sail_on(ctx: StepContext) -> bool:
    """Sail on out of a stop that the boat shows and that was asked for."""
    stopped = ctx.state.steering.own_mode in STOPPING
    if not stopped or ctx.autopilot is None or ctx.autopilot.mode is not ctx.state.steering.own_mode:
        return False
    if not turns_back_to_place(ctx):
        _plan_and_resume(ctx)
    return True


def lie_at_diversion(ctx: StepContext) -> bool:
    """Lie at the end of a diversion."""
    bound = diversion(ctx)
    return bound is not None and comes_to_rest(ctx, bound)


def give_back_helm(ctx: StepContext) -> bool:
    """Give the helm back to AUTO after steering."""
    own = ctx.state.steering.own_mode
    if own is None or ctx.autopilot is None or ctx.autopilot.mode is not own or ctx.steers:
        return False
    hand_back(ctx)
    ctx.phase(ctx.state.phase, "waiting for AUTO after steering")
    return True


def follow_route(ctx: StepContext) -> bool:
    """Sail the mission on board, and plan anew when there is a reason to."""
    if ctx.steers:
        _send_heading(ctx)
    elif ctx.guidance is not Guidance.PLAN:
        if not ctx.may_guide:
            ctx.say(
                Severity.WARNING,
                "guidance",
                f"guidance by {ctx.guidance.value} is asked for and steering is not permitted: by plan",
                every_s=600.0,
            )
        check_current(ctx)
    else:
        leave_passed(ctx)
        check_current(ctx)
        short_tack(ctx)
        shift_tack(ctx)
    if ctx.is_raised("stuck waypoint"):
        push_on(ctx)
    bound = diversion(ctx)
    if bound is not None and not bound.has_place:
        _stay(ctx, bound)
        return True
    if ctx.state.pending.upload is None:
        _consider(ctx)
    _name(ctx)
    return True


def _plan_and_resume(ctx: StepContext) -> None:
    """End a stop that nobody asked for, or our own LOITER: plan from where the boat is now, then set AUTO."""
    why = waits_for(ctx)
    if why or repair(ctx):
        ctx.phase(Phase.HOLDING, why or "waiting for the mission to be put right before sailing on")
        return
    if _goes_on_at_once(ctx):
        hand_back(ctx)
        ctx.phase(Phase.HOLDING, "the way on board is clear: waiting for AUTO, a new plan follows under way")
        return
    bound = diversion(ctx)
    stays = bound is not None and not bound.has_place
    if bound is not None and stays and not (is_at_rest(ctx) and (_is_outside(ctx) or is_way_clear(ctx))):
        _stay(ctx, bound, anew=True)
    elif ctx.state.pending.upload is None:
        _consider(ctx)
    if ctx.state.pending.plan is not None or ctx.state.pending.upload is not None:
        ctx.phase(Phase.HOLDING, "waiting for the plan from where the boat has drifted to, and for its upload")
    elif not stays and (is_shut_off(ctx) or (ctx.state.operator.is_back and (ctx.is_way_shut or _is_outside(ctx)))):
        wait_s = ctx.state.plans.retry.not_before_s - ctx.t_s
        again = f"; trying again in {wait_s:.0f} s" if wait_s > 0.0 else ""
        ctx.phase(Phase.HOLDING, f"no plan yet from where the boat has drifted to: waiting for one{again}")
    else:
        hand_back(ctx)
        ctx.phase(Phase.HOLDING, "waiting for the autopilot to take AUTO: sailing on")


def _goes_on_at_once(ctx: StepContext) -> bool:
    """Return whether the boat is sailed home by the autopilot, straight, while the way on board is clear from here.

    RTL and SmartRTL turn it, at full speed, towards whatever lies between it and home, in the three seconds or more
    that a plan and its upload take; AUTO takes one, and a plan made under way begins where it will be.
    """
    state = ctx.state
    return (
        state.steering.own_mode in HOMEWARD
        and state.pending.upload is None
        and bool(ctx.ahead())
        and (not _is_outside(ctx) and is_way_clear(ctx))
    )


def _is_outside(ctx: StepContext) -> bool:
    """Return whether the boat is where no mission may lead: outside the fence, or over something."""
    here = ctx.snapshot.position_en_m
    return here is not None and float(ctx.voyage.area.clearance_m([here])[0]) <= 0.0


def _stay(ctx: StepContext, bound: Diversion, *, anew: bool = False) -> None:
    """Loiter where there is room near by; ``anew``: the loiter on board cannot be sailed to from here."""
    if ctx.state.pending.upload is None and ctx.t_s >= ctx.state.pending.upload_retry.not_before_s:
        hold(ctx, bound.sentence, anew=anew or is_shut_off(ctx))
    ctx.phase(Phase.HOLDING, f"{bound.sentence}; waiting for the loiter's upload")


def _send_heading(ctx: StepContext) -> None:
    """Steer by Büsser's headings under GUIDED, and keep the autopilot's count in step for the moment we are gone."""
    status = ctx.autopilot
    if status is None:
        return
    own = ctx.state.steering.own_mode
    is_stopping = own in STOPPING and is_busy(ctx, own.name)  # asked for, and not shown yet
    if status.mode is not Mode.GUIDED:
        if not is_stopping:
            set_mode(ctx, Mode.GUIDED, f"steering by {'field' if ctx.guidance is Guidance.FIELD else 'headings'}")
        return
    if not is_stopping:
        ctx.set(steering=changed(ctx.state.steering, own_mode=Mode.GUIDED))
    if ctx.guidance is Guidance.FIELD:
        told = by_field_heading(ctx)
        if told is not None:
            ctx.act(SteerHeading(heading_rad=told.heading_rad, thrust=told.thrust, text=told.reason))
        _say_carried(ctx)
    else:
        wanted = desired_heading_rad(ctx)
        if wanted is not None:
            ctx.act(SteerHeading(heading_rad=wanted, text="leg"))
    if status.mission_seq is not None and status.mission_seq < ctx.state.mission.index + 1:
        make_current(ctx, ctx.state.mission.index + 1)


def _say_carried(ctx: StepContext) -> None:
    """Say so where the current keeps her from her goal: steered by field no plan is asked for that would tell it."""
    water, boat, gate = ctx.water, ctx.boat_en, ctx.gate
    if water is None or boat is None or gate is None or ctx.is_said(FOUL, ctx.config.announce_interval_s):
        return
    foul = water.trouble(boat, gate.en_m)
    if foul:
        ctx.say(Severity.CRITICAL, FOUL, f"{foul}: {gate.name} is not reached by field until it is weaker")


def _consider(ctx: StepContext) -> None:
    trigger = find_trigger(ctx, ctx.fresh)
    if trigger is None:
        return
    state = ctx.state
    if state.pending.plan is not None and not (trigger.urgent and state.pending.plan.reason is not trigger.reason):
        return
    if ctx.t_s < state.plans.retry.not_before_s and not trigger.urgent:
        return
    interval_s = trigger.interval_s
    if trigger.reason in ROUTINE and near(ctx):
        interval_s = max(interval_s, MIN_INTERVAL_S)
    if trigger.reason in ROUTINE - {ReplanReason.OFF_LEG} and stands_on(ctx):
        return  # rule 17 a i: course and speed are kept
    if ctx.t_s - state.plans.last_s < interval_s:
        return
    if request(ctx, trigger.reason, from_index=trigger.from_index, text=trigger.text):
        at = ctx.state.plans.replanned_index if trigger.from_index is None else trigger.from_index
        ctx.set(
            operator=changed(ctx.state.operator, is_back=False),
            plans=changed(ctx.state.plans, asked="", replanned_index=at),
        )


def bear_away(ctx: StepContext) -> bool:
    """Bear away out of irons under GUIDED; True while the helm is ours."""
    state, status, vehicle, boat, wind = (ctx.state, ctx.autopilot, ctx.snapshot.vehicle, ctx.boat_en, ctx.wind_now)
    if state.steering.until_s is None:
        if "in irons" not in ctx.fresh or boat is None or vehicle is None or wind is None:
            return False
        recent = tuple(t for t in state.steering.irons_s if ctx.t_s - t < IRONS_MEMORY_S)
        ctx.set(steering=changed(ctx.state.steering, irons_s=(*recent, ctx.t_s)))
        if ctx.snapshot.permissions.may_steer and set_mode(ctx, Mode.GUIDED, "in irons: bearing away"):
            heading = bear_away_rad(boat, vehicle.heading_rad, wind[0], ctx.voyage.area)
            ctx.set(steering=changed(ctx.state.steering, until_s=ctx.t_s + STEER_S, heading_rad=heading))
        else:
            ctx.set(plans=changed(ctx.state.plans, asked=IN_IRONS, asked_as=ReplanReason.IN_IRONS))
            return False
    heading_rad = ctx.state.steering.heading_rad or 0.0
    until = ctx.state.steering.until_s
    out = (
        vehicle is not None
        and wind is not None
        and vehicle.speed_mps > SAILS_MPS
        and (abs(difference_rad(wind[0], vehicle.heading_rad)) > SAILS_TWA_RAD)
    )
    refused = status is not None and status.mode is Mode.AUTO and not is_busy(ctx, Mode.GUIDED.name)
    over = out or refused or (until is not None and ctx.t_s > until)
    if over and (
        refused or ctx.steers or set_mode(ctx, Mode.AUTO, "sailing again" if out else "bearing away took too long")
    ):
        # The mode we asked for ourselves stays ours until AUTO shows.
        ctx.set(
            steering=changed(
                ctx.state.steering, until_s=None, heading_rad=None, own_mode=None if refused else Mode.GUIDED
            ),
            plans=changed(ctx.state.plans, asked=IN_IRONS, asked_as=ReplanReason.IN_IRONS),
        )
        return False
    ctx.act(SteerHeading(heading_rad=heading_rad, text="out of irons"))
    ctx.phase(ctx.state.phase, f"in irons: waiting for her to bear away to {math.degrees(heading_rad) % 360.0:.0f}°")
    return True


def _name(ctx: StepContext) -> None:
    """Name what the boat is doing, with the sentence why."""
    state, route = ctx.state, ctx.state.mission.route
    if route is None:
        return
    step = f" ({route.rung})" if route.rung else ""
    if state.pending.plan is not None:
        ctx.phase(Phase.NEW_CALCULATION, f"planning: {state.pending.plan.reason.words}")
        return
    raised = ", ".join(r.name for r in state.alarms.raised)
    tail = (f"; {state.progress.task}" if state.progress.task else "") + (f"; {raised}" if raised else "")
    tail = (f"; by plan in AUTO: {state.fallback.why}" if ctx.falls_back else "") + tail
    gate, bound = ctx.gate, diversion(ctx)
    if is_composed(ctx) and gate is not None and gate.field is not None:
        left_s = stay_left_s(ctx, gate)
        field, time = gate.field, "" if math.isinf(left_s) else f"; {left_s:.0f} s left"
        ctx.phase(Phase.STANDARD, f"{gate.name}: by field {field.tree.text}, {field.until_words}{time}{tail}")
    elif ctx.is_by_field and not ctx.ahead():
        ctx.phase(Phase.STANDARD, f"by field{f' to {gate.name}' if gate is not None else ''}, no plan on board{tail}")
    elif not ctx.ahead():
        wait = state.plans.retry.not_before_s - ctx.t_s
        again = f", trying again in {wait:.0f} s" if wait > 0.0 else ""
        waits = f"waiting for a plan{again}" if state.pending.upload is None else "waiting for a plan's upload"
        if gate is not None and is_out_of_reach_said(ctx, gate) and (shut := out_of_reach(ctx, gate)):
            waits += f"; {shut}"
        if not ctx.snapshot.permissions.may_upload:
            waits = "waiting, for uploading is not permitted"
        ctx.phase(Phase.HOLDING, f"loitering in the mission's safe end: {waits}{tail}")
    elif bound is not None:
        ctx.phase(Phase.STANDARD, f"item {state.mission.index + 1} of {len(route.items)} {bound.sentence}{step}{tail}")
    elif (
        gate is not None
        and is_buoy(gate)
        and gate.buoy_en_m is not None
        and ctx.boat_en is not None
        and (distance_m(ctx.boat_en, gate.buoy_en_m) < 4.0 * distance_m(gate.en_m, gate.buoy_en_m))
    ):
        ctx.phase(Phase.BUOY_APPROACH, f"{gate.name} to {gate.side.value}{step}{tail}")
    elif state.mission.index == ctx.last_waypoint() and route.gate_of[state.mission.index] == len(ctx.gates) - 1:
        ctx.phase(Phase.DESTINATION_APPROACH, f"last waypoint before {gate.name if gate else 'the end'}{step}{tail}")
    else:
        where = f"item {state.mission.index + 1} of {len(route.items)}"
        ctx.phase(Phase.STANDARD, f"{where} to {gate.name if gate else 'the end'}{step}{tail}")
