"""What is done while it is doubted where the boat is.

A position in doubt: what is safe where it says that the boat is, and where it was and has sailed on from?
The autopilot takes a new position and sails by it, true or not. Until there is evidence (``companion.skipper.way
.integrity``) nothing is planned from it, and where the reckoned place is not clear ahead the boat loiters: ArduRover's
LOITER turns in circles of 12 m about a point, and where on earth that is does not matter to it, while HOLD drifts. That
the new place is not clear, either, is no reason against it: nobody sails inside a rock, and what jumps is false more
often than true.

Once held it stays held until the position is believed. A jump moves the point of a LOITER that is sailed already, and
it would make for it over whatever lies between: then it is put into HOLD and into LOITER again, which begins here. So
is a boat that was driven off the point, by a wrong wind or in a calm, until something lay between. In HOLD nobody
steers and the boat runs on: while that leads onto something, and LOITER is turning the boat away from it, HOLD waits.
"""

from __future__ import annotations

import math

from companion.frozen import changed
from companion.geo.angles import heading_of
from companion.messages import Mode, Severity
from companion.safety import CRITICAL, HOMEWARD, JUMP_M
from companion.skipper.behaviors.drifting import AWAY_M, stops_drift
from companion.skipper.behaviors.helm import is_busy, set_mode
from companion.skipper.step.context import FRESH_S, StepContext
from companion.skipper.step.saved import SavedPlace
from companion.skipper.step.state import Fix, Phase
from companion.skipper.way import PointEn, moved
from companion.skipper.way.position_plausibility import (
    DISPUTED_S,
    ERROR_M,
    LASTS_S,
    LOST_ERRS_MPS,
    LOST_S,
    SILENT_S,
    Evidence,
    PositionDoubt,
    is_impossible,
)

AHEAD_S = 20.0  # what the boat sails until a LOITER that is asked for now has it, and some more
SLOW_MPS = 1.0
GLITCH_S = 3.0  # a position that is back sooner has done no harm
SAVE_S = 30.0  # between two places that are saved ...
NEAR_M, NEAR_S = 100.0, 5.0  # ... and with something so near, where a jump matters that is no longer than that
UNKNOWN_S = 120.0  # how long a start has taken when no clock tells
POINT_S = 5.0  # after LOITER was accepted what is told may still be the distance of the leg before it
RUNS_S = 8.0  # how far a boat runs on in HOLD, where its sails are eased, in seconds at its speed of now
BESIDE_HULL_M = 2.0  # of what it runs on towards
POINT_SHUT = "the loiter's point cannot be sailed to from here"
CODE = "position doubted"


# --------------------------------------------------------------------------------------------- seen
def follow(ctx: StepContext) -> None:
    """Begin a doubt of the position, reckon on from where the boat was, and end it when there is evidence."""
    state, here, vehicle, age = (
        ctx.state,
        ctx.snapshot.position_en_m,
        ctx.snapshot.vehicle,
        ctx.snapshot.vehicle_age_s,
    )
    if here is None or vehicle is None or age is None or age > FRESH_S:
        return
    _follow_filter(ctx)
    seen = _evidence(ctx, here, ctx.t_s - age)
    doubt = _begun(ctx, seen) if state.position.doubt is None else state.position.doubt.after(seen)
    ctx.set(
        position=changed(
            ctx.state.position,
            restored=None if doubt is not None or ctx.utc_s is not None else ctx.state.position.restored,
        )
    )
    if doubt is None:
        _remember(ctx, here, None)
        return
    if (
        seen.is_jump
        and state.steering.own_mode is Mode.LOITER
        and ctx.autopilot is not None
        and (ctx.autopilot.mode is Mode.LOITER)
    ):
        ctx.set(position=changed(ctx.state.position, anew=Mode.HOLD))
    why = "" if state.position.doubt is None else doubt.believed_for(seen)
    if why:
        ctx.set(
            position=changed(ctx.state.position, doubt=None, back_s=ctx.t_s),
            alarms=changed(ctx.state.alarms, raised=tuple(r for r in state.alarms.raised if r.name != "position jump")),
        )
        code = "position back" if doubt.is_back(here) else "position believed"
        ctx.say(Severity.NOTICE, code, f"the position is believed again: {why}", every_s=0.0)
        _remember(ctx, here, None)
        return
    if state.position.doubt is None and not seen.is_jump:  # of a jump the watchdog speaks
        ctx.say(
            Severity.WARNING, CODE, f"the position is doubted: {doubt.why}; reckoned on from where she was", every_s=0.0
        )
    ctx.set(position=changed(ctx.state.position, doubt=doubt))
    _remember(ctx, here, doubt)


def _evidence(ctx: StepContext, here: PointEn, at_s: float) -> Evidence:
    """Return what this step shows of the position."""
    state, vehicle, status, solid = ctx.state, ctx.snapshot.vehicle, ctx.autopilot, ctx.always_solid
    jumped = ctx.jump_m >= JUMP_M
    velocity = (0.0, 0.0) if vehicle is None else vehicle.velocity_en_mps
    told = status.gps2 if status is not None else None
    second = None if told is None else ctx.voyage.frame.en_from_geo(told)
    if state.position.doubt is None:  # nothing of the rest matters
        return Evidence(t_s=at_s, en_m=here, velocity_en_mps=velocity, is_jump=jumped, second_en_m=second)
    place = state.position.doubt.reckoned_en_m
    room_m, other_m = (float(room) for room in solid.clearance_m([here, place]))
    return Evidence(
        t_s=at_s,
        en_m=here,
        velocity_en_mps=velocity,
        is_jump=jumped,
        is_possible=room_m > -ERROR_M,
        is_well=status is None or (status.ekf_ok and status.system_status != CRITICAL),
        is_other_possible=other_m > -(ERROR_M + state.position.doubt.error_m),
        room_m=min(room_m, other_m),
        second_en_m=second,
        is_given=state.operator.given_back_s >= state.position.doubt.since_s,
    )


def _begun(ctx: StepContext, seen: Evidence) -> PositionDoubt | None:
    """Return the doubt that this step begins, None: the position is believed."""
    state, last = ctx.state, ctx.state.position.last_seen
    lost_s = 0.0 if state.position.lost_s is None else ctx.t_s - state.position.lost_s
    lost_m = ERROR_M + LOST_ERRS_MPS * lost_s if lost_s >= LOST_S else 0.0
    if seen.is_jump and last is not None:
        silent_s = seen.t_s - last.t_s
        gap = f" in a silence of {silent_s:.0f} s" if silent_s > SILENT_S else ""
        begun = PositionDoubt(
            since_s=ctx.t_s,
            t_s=last.t_s,
            settled_s=seen.t_s,
            reckoned_en_m=last.en_m,
            velocity_en_mps=last.velocity_en_mps,
            lost_m=lost_m,
            why=f"it jumped {ctx.jump_m:.0f} m{gap}",
        )
        return begun.after(seen)
    if seen.is_contradicted and seen.second_en_m is not None:
        disputed_s = state.position.disputed_s if state.position.disputed_s is not None else ctx.t_s
        ctx.set(position=changed(ctx.state.position, disputed_s=disputed_s))
        if ctx.t_s - disputed_s >= DISPUTED_S:
            off_m = math.dist(seen.second_en_m, seen.en_m)
            return PositionDoubt(
                since_s=ctx.t_s,
                t_s=seen.t_s,
                settled_s=seen.t_s,
                reckoned_en_m=seen.second_en_m,
                velocity_en_mps=seen.velocity_en_mps,
                farthest_m=off_m,
                is_dispute=True,
                why=f"a second receiver is {off_m:.0f} m away from it",
            )
    elif state.position.disputed_s is not None:
        ctx.set(position=changed(ctx.state.position, disputed_s=None))
    if state.position.restored is not None:
        begun_anew = _since_the_last_start(ctx, state.position.restored, seen)
        if begun_anew is not None:
            return begun_anew
    if is_impossible(ctx.always_solid, seen.en_m, margin_m=ctx.config.margin_m):
        deep_m = -float(ctx.always_solid.clearance_m([seen.en_m])[0])
        name = ctx.always_solid.nearest_name(seen.en_m) or "an obstacle"
        return PositionDoubt(
            since_s=ctx.t_s,
            t_s=seen.t_s,
            settled_s=seen.t_s,
            reckoned_en_m=seen.en_m,
            velocity_en_mps=seen.velocity_en_mps,
            error_m=deep_m + ctx.config.margin_m,
            why=f"it is {deep_m:.0f} m inside {name}",
        )
    return None


def _since_the_last_start(ctx: StepContext, before: SavedPlace, seen: Evidence) -> PositionDoubt | None:
    """Return the doubt of a fix that is not where the boat can have come to since it was saved, or was in doubt."""
    now_s, saved, late_s = ctx.utc_s, ctx.state.mission.adoptable, ctx.t_s - seen.t_s
    if now_s is not None and now_s < before.utc_s:
        now_s = None  # a clock that was set back since tells nothing
    passed_s = UNKNOWN_S if now_s is None else max(0.0, now_s - late_s - before.utc_s)
    last = Fix(t_s=seen.t_s - passed_s, en_m=before.en_m, velocity_en_mps=before.velocity_en_mps)
    off_m = ctx.innovation_m(last, held_in=None if saved is None else saved.own_mode)
    was_doubted = before.farthest_m > 0.0 and passed_s < LASTS_S
    if not was_doubted and (now_s is None or off_m < JUMP_M):
        return None
    why = (
        "it is in doubt before this start"
        if was_doubted
        else (f"it jumped {off_m:.0f} m in the {passed_s:.0f} s before this start")
    )
    doubt = PositionDoubt(
        since_s=ctx.t_s,
        t_s=last.t_s,
        settled_s=seen.t_s,
        reckoned_en_m=last.en_m,
        velocity_en_mps=last.velocity_en_mps,
        error_m=before.error_m,
        farthest_m=before.farthest_m,
        why=why,
    ).after(seen)
    return None if was_doubted and doubt.is_back(seen.en_m) else doubt


def _follow_filter(ctx: StepContext) -> None:
    """Notice since when the filter has had no position; that is forgotten when a fix has come without a jump."""
    status = ctx.autopilot
    if status is None or status.ekf_ok:
        if ctx.jump_m < JUMP_M and ctx.state.position.lost_s is not None and ctx.state.position.doubt is None:
            ctx.set(position=changed(ctx.state.position, lost_s=None))
    elif ctx.state.position.lost_s is None:
        ctx.set(position=changed(ctx.state.position, lost_s=ctx.t_s))


def _remember(ctx: StepContext, here: PointEn, doubt: PositionDoubt | None) -> None:
    """Keep for who comes after a kill where the boat is, and how fast; and at once when a doubt begins or ends."""
    now_s, before, vehicle, age = (
        ctx.utc_s,
        ctx.state.position.place,
        ctx.snapshot.vehicle,
        ctx.snapshot.vehicle_age_s,
    )
    if now_s is None or vehicle is None or age is None or not ctx.state.voyage.sailing:
        return
    en_m = here if doubt is None else doubt.reckoned_en_m
    if before is not None and (before.farthest_m > 0.0) == (doubt is not None):
        passed_s = abs(now_s - age - before.utc_s)
        is_near = passed_s >= NEAR_S and float(ctx.voyage.area.unfenced.clearance_m([en_m])[0]) < NEAR_M
        if passed_s < SAVE_S and not is_near:
            return
    east, north = vehicle.velocity_en_mps
    ctx.set(
        position=changed(
            ctx.state.position,
            place=SavedPlace(
                utc_s=round(now_s - age, 1),
                en_m=(round(en_m[0], 1), round(en_m[1], 1)),
                velocity_en_mps=(round(east, 2), round(north, 2)),
                error_m=0.0 if doubt is None else round(doubt.error_m, 1),
                farthest_m=0.0 if doubt is None else max(JUMP_M, round(doubt.farthest_m, 1)),
            ),
        )
    )


# --------------------------------------------------------------------------------------------- held
def is_other_shut(ctx: StepContext) -> bool:
    """Return whether, from the reckoned place, the boat would soon come too near to something as it is steered now."""
    doubt, here = ctx.state.position.doubt, ctx.snapshot.position_en_m
    leg, vehicle = ctx.leg(), ctx.snapshot.vehicle
    if doubt is None or here is None or vehicle is None:
        return False
    place = doubt.reckoned_en_m
    way = (0.0, 0.0) if leg is None else (leg[1][0] - here[0], leg[1][1] - here[1])
    left_m = math.hypot(*way)
    share = min(1.0, AHEAD_S * max(vehicle.speed_mps, SLOW_MPS) / left_m) if left_m > 0.0 else 0.0
    drift = (AHEAD_S * vehicle.velocity_en_mps[0], AHEAD_S * vehicle.velocity_en_mps[1])
    floor_m = min(ctx.config.margin_floor_m, ctx.config.margin_m) + doubt.error_m
    return (
        min(
            ctx.voyage.area.path_clearance_m([place, (place[0] + d[0], place[1] + d[1])])
            for d in ((share * way[0], share * way[1]), drift)
        )
        < floor_m
    )


def _is_steered_falsely(ctx: StepContext) -> bool:
    """Return whether the autopilot has steered for a while by a place where no boat can be: inside something."""
    here, doubt = ctx.snapshot.position_en_m, ctx.state.position.doubt
    if here is None or doubt is None or ctx.t_s - doubt.since_s < GLITCH_S:
        return False
    return float(ctx.always_solid.clearance_m([here])[0]) < -ERROR_M


def stands_off(ctx: StepContext) -> bool:
    """Loiter while the position is in doubt and the reckoned place is not clear ahead; True while it does."""
    status, state = ctx.autopilot, ctx.state
    if status is None or not ctx.snapshot.permissions.may_set_mode:
        return False
    if not status.ekf_ok or status.system_status == CRITICAL:
        return False  # nor would it loiter then
    if state.position.anew is None and _is_point_shut(ctx):
        ctx.set(position=changed(ctx.state.position, anew=Mode.HOLD))
    if ctx.state.position.anew is not None:
        _begin_anew(ctx)
        if ctx.state.position.anew is not None:
            ctx.phase(Phase.HOLDING, f"{POINT_SHUT}: waiting to loiter anew")
            return True
    if state.position.doubt is None:
        return False
    is_held = status.mode is state.steering.own_mode and state.steering.own_mode is Mode.LOITER
    if is_held:
        stops_drift(ctx)  # which the reckoned track tells, too
        ctx.phase(
            Phase.HOLDING,
            f"the position is doubted, {state.position.doubt.why}: waiting in a loiter until it can be believed",
        )
        return True
    is_stopped = status.mode is state.steering.own_mode and state.steering.own_mode in {Mode.HOLD, *HOMEWARD}
    if not (is_stopped or ctx.steers or _is_steered_falsely(ctx) or is_other_shut(ctx)):
        return False
    if is_busy(ctx, Mode.LOITER.name):
        return is_stopped
    if set_mode(ctx, Mode.LOITER, "the position is doubted and the reckoned place is not clear ahead"):
        ctx.set(operator=changed(ctx.state.operator, is_back=True))
        ctx.say(
            Severity.WARNING,
            "standing off",
            f"the position is doubted ({state.position.doubt.why}) and the reckoned place is not clear ahead: "
            "loitering",
            every_s=0.0,
        )
    return True


def _is_point_shut(ctx: StepContext) -> bool:
    """Return whether a LOITER of ours, sailed back to the point that the autopilot tells, would lead over something."""
    status, boat = ctx.autopilot, ctx.boat_en
    if (
        status is None
        or boat is None
        or ctx.state.position.doubt is not None
        or (status.mode is not Mode.LOITER or ctx.state.steering.own_mode is not Mode.LOITER)
    ):
        return False
    far_m, course = status.waypoint_distance_m, status.target_bearing_rad
    name, accepted_s = ctx.state.pending.accepted or ("", -math.inf)
    is_of_the_leg = name == Mode.LOITER.name and ctx.t_s < accepted_s + POINT_S
    if far_m is None or course is None or is_of_the_leg or far_m < AWAY_M:
        return False
    return ctx.voyage.area.path_clearance_m([boat, moved(boat, course, far_m)]) < ctx.voyage.boat.hull.reach_m


def _begin_anew(ctx: StepContext) -> None:
    """Begin a LOITER anew whose point is not to be made for: HOLD, then LOITER, then it is over.

    A position that is believed is planned from meanwhile: with a plan on its way HOLD is left for that, unless the boat
    runs on onto something before the plan is on board.
    """
    status, state = ctx.autopilot, ctx.state
    shown = None if status is None else status.mode
    if shown not in {Mode.LOITER, Mode.HOLD} or state.steering.own_mode not in {Mode.LOITER, Mode.HOLD}:
        ctx.set(position=changed(ctx.state.position, anew=None))
    elif state.position.anew is Mode.HOLD and shown is Mode.LOITER:
        if _turns_away(ctx):
            return
        set_mode(ctx, Mode.HOLD, f"{POINT_SHUT}: loitering anew")
    elif shown is Mode.LOITER or (
        state.position.doubt is None
        and (state.pending.plan is not None or state.pending.upload is not None)
        and not _is_run_on_shut(ctx)
    ):
        ctx.set(position=changed(ctx.state.position, anew=None))
    elif set_mode(ctx, Mode.LOITER, "loitering anew where she is"):
        if ctx.state.adrift.loiter_en_m is not None:  # the drift is reckoned from there, too
            ctx.set(adrift=changed(ctx.state.adrift, loiter_en_m=ctx.boat_en, loiter_s=ctx.t_s))
        ctx.set(position=changed(ctx.state.position, anew=Mode.LOITER))


def _turns_away(ctx: StepContext) -> bool:
    """Return whether LOITER is turning the boat away from something that it would run onto in HOLD."""
    status, place = ctx.autopilot, ctx.reckoned_en
    if status is None or place is None or status.target_bearing_rad is None or not _is_run_on_shut(ctx):
        return False
    return _run_m(ctx, place, status.target_bearing_rad) > _run_m(ctx, place, _course_rad(ctx))


def _is_run_on_shut(ctx: StepContext) -> bool:
    """Return whether the boat, its sails eased, would run on onto something."""
    place = ctx.reckoned_en
    if place is None or ctx.snapshot.vehicle is None:
        return False
    near_m = min(ctx.voyage.boat.hull.reach_m + BESIDE_HULL_M, float(ctx.voyage.area.clearance_m([place])[0]))
    return _run_m(ctx, place, _course_rad(ctx)) < near_m


def _course_rad(ctx: StepContext) -> float:
    return 0.0 if ctx.snapshot.vehicle is None else heading_of(*ctx.snapshot.vehicle.velocity_en_mps)


def _run_m(ctx: StepContext, place: PointEn, course_rad: float) -> float:
    """Return how clear the water is that the boat runs on through on a course [m]."""
    speed_mps = 0.0 if ctx.snapshot.vehicle is None else ctx.snapshot.vehicle.speed_mps
    return ctx.voyage.area.path_clearance_m([place, moved(place, course_rad, RUNS_S * speed_mps)])
