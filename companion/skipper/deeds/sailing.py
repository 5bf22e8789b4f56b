"""Under way: who steers, what is asked for, and Büsser's names for what the boat is doing."""

from __future__ import annotations

import math

from companion.frozen import changed
from companion.geo.angles import difference_rad
from companion.messages import Mode
from companion.skipper.deeds.adrift import stops_drift
from companion.skipper.deeds.by_field import heading as by_field_heading
from companion.skipper.deeds.doubt import stands_off
from companion.skipper.deeds.failsafe import waits_for
from companion.skipper.deeds.headings import desired_heading_rad
from companion.skipper.deeds.helm import check_current, hand_back, is_busy, leave_passed, make_current, repair, set_mode
from companion.skipper.deeds.rest import comes_to_rest, rest
from companion.skipper.deeds.shift_tack import shift_tack
from companion.skipper.deeds.short_tack import short_tack
from companion.skipper.planning.asking import request
from companion.skipper.planning.autopilot_beats import IRONS_MEMORY_S
from companion.skipper.planning.errands import errand, is_at_rest, is_composed
from companion.skipper.planning.manners import stands_on
from companion.skipper.planning.not_found import hold
from companion.skipper.planning.triggers import find_trigger, is_buoy
from companion.skipper.planning.vessels import near
from companion.skipper.planning.waits import stay_left_s
from companion.skipper.step.actions import ReplanReason, Severity, SteerHeading
from companion.skipper.step.causes import HOMEWARD, STOPPING
from companion.skipper.step.config import Guidance
from companion.skipper.step.route import Errand
from companion.skipper.step.state import Phase
from companion.skipper.step.turn import Turn
from companion.skipper.way.geometry import distance_m
from companion.skipper.way.manoeuvre import bear_away_rad
from companion.traffic.plans import MIN_INTERVAL_S

HAIR_M = 0.5
STEER_S = 25.0               # bearing away longer than this has failed
SAILS_MPS = 0.8              # out of irons
IN_IRONS = "she was in irons"
SAILS_TWA_RAD = math.radians(60.0)
# Reasons that can wait among vessels, where plans must not follow each other fast (Büsser 5.2).
ROUTINE = frozenset({
    ReplanReason.WAYPOINT, ReplanReason.FORECAST, ReplanReason.WIND_SHIFT, ReplanReason.PLAN_AGE, ReplanReason.OFF_LEG})


def is_at_end(turn: Turn) -> bool:
    """Return whether nothing is left to sail to: the voyage is over or its goals are passed, and no errand is on."""
    return errand(turn) is None and (turn.gate is None or bool(turn.state.voyage.over))


def stand_off(turn: Turn) -> bool:
    """Keep off what a doubted position may hide."""
    if not stands_off(turn):
        return False
    if not is_at_end(turn) and turn.state.position.doubt is None and turn.state.pending.upload is None:
        _consider(turn)   # from where she is known to be, while her loiter is begun anew
    return True


def stop_drift(turn: Turn) -> bool:
    """Stop a boat that drifts and does not sail."""
    return (bool(turn.state.voyage.over) or not is_at_end(turn)) and stops_drift(turn)


def rest_at_end(turn: Turn) -> bool:
    """Loiter at the voyage's end."""
    if not is_at_end(turn):
        return False
    rest(turn)
    return True


def sail_on(turn: Turn) -> bool:
    """Sail on out of a stop that the boat shows and that was asked for."""
    stopped = turn.state.steering.own_mode in STOPPING
    if not stopped or turn.autopilot is None or turn.autopilot.mode is not turn.state.steering.own_mode:
        return False
    _sail_on(turn)
    return True


def lie_at_diversion(turn: Turn) -> bool:
    """Lie at the end of a diversion."""
    bound = errand(turn)
    return bound is not None and comes_to_rest(turn, bound)


def give_back_helm(turn: Turn) -> bool:
    """Give the helm back to AUTO after steering."""
    own = turn.state.steering.own_mode
    if own is None or turn.autopilot is None or turn.autopilot.mode is not own or turn.steers:
        return False
    hand_back(turn)
    turn.phase(turn.state.phase, "waiting for AUTO after steering")
    return True


def follow_route(turn: Turn) -> bool:
    """Sail the mission on board, and plan anew when there is a reason to."""
    if turn.steers:
        _send_heading(turn)
    elif turn.guidance is not Guidance.PLAN:
        turn.say(Severity.WARNING, "guidance", f"guidance by {turn.guidance.value} is asked for and steering is "
                 "not permitted: by plan", every_s=600.0)
        check_current(turn)
    else:
        leave_passed(turn)
        check_current(turn)
        short_tack(turn)
        shift_tack(turn)
    if turn.is_raised("stuck waypoint") and turn.state.mission.own_index > turn.state.mission.index:
        make_current(turn, turn.state.mission.own_index + 1)
    bound = errand(turn)
    if bound is not None and not bound.has_place:
        _stay(turn, bound)
        return True
    if turn.state.pending.upload is None:
        _consider(turn)
    _name(turn)
    return True


def _sail_on(turn: Turn) -> None:
    """Out of a stop that nobody asked for, or a LOITER of ours: plan from where the boat is now, then AUTO."""
    why = waits_for(turn)
    if why or repair(turn):
        turn.phase(Phase.HOLDING, why or "waiting for the mission to be put right before sailing on")
        return
    if _goes_on_at_once(turn):
        hand_back(turn)
        turn.phase(Phase.HOLDING, "the way on board is clear: waiting for AUTO, a new plan follows under way")
        return
    bound = errand(turn)
    stays = bound is not None and not bound.has_place
    if bound is not None and stays and not (is_at_rest(turn) and (_is_outside(turn) or _is_way_clear(turn))):
        _stay(turn, bound, anew=True)
    elif turn.state.pending.upload is None:
        _consider(turn)
    if turn.state.pending.plan is not None or turn.state.pending.upload is not None:
        turn.phase(Phase.HOLDING, "waiting for the plan from where the boat has drifted to, and for its upload")
    elif turn.state.operator.is_back and not stays and (turn.is_way_shut or _is_outside(turn)):
        wait_s = turn.state.plans.retry.not_before_s - turn.t_s
        again = f"; trying again in {wait_s:.0f} s" if wait_s > 0.0 else ""
        turn.phase(Phase.HOLDING, f"no plan yet from where the boat has drifted to: waiting for one{again}")
    else:
        hand_back(turn)
        turn.phase(Phase.HOLDING, "waiting for the autopilot to take AUTO: sailing on")


def _goes_on_at_once(turn: Turn) -> bool:
    """Return whether she is sailed home by the autopilot, straight, while the way on board is clear from here.

    RTL and SmartRTL turn her, at full speed, towards whatever lies between her and home, in the three seconds or more
    that a plan and its upload take; AUTO takes one, and a plan made under way begins where she will be.
    """
    state = turn.state
    return state.steering.own_mode in HOMEWARD and state.pending.upload is None and bool(turn.ahead()) and (
        not _is_outside(turn) and _is_way_clear(turn))


def _is_way_clear(turn: Turn) -> bool:
    """Return whether what is left of the way on board, straight from where she is, comes no nearer than it may.

    That is the margin's floor, or what she has about her now where that is less.
    """
    boat, leg, area = turn.boat_en, turn.leg(), turn.voyage.area
    if boat is None or leg is None:
        return False
    floor_m = min(turn.config.margin_floor_m, turn.config.margin_m, float(area.clearance_m([boat])[0]) - HAIR_M)
    return area.path_clearance_m([boat, leg[1], *turn.ahead()[1:]]) >= max(0.0, floor_m)


def _is_outside(turn: Turn) -> bool:
    """Return whether she is where no mission may lead: outside the fence, or over something."""
    here = turn.snapshot.position_en_m
    return here is not None and float(turn.voyage.area.clearance_m([here])[0]) <= 0.0


def _stay(turn: Turn, bound: Errand, *, anew: bool = False) -> None:
    """Loiter where there is room near by; ``anew``: the loiter on board cannot be sailed to from here."""
    if turn.state.pending.upload is None and turn.t_s >= turn.state.pending.upload_retry.not_before_s:
        hold(turn, bound.sentence, anew=anew)
    turn.phase(Phase.HOLDING, f"{bound.sentence}; waiting for the loiter's upload")


def _send_heading(turn: Turn) -> None:
    """Steer by Büsser's headings under GUIDED, and keep the autopilot's count in step for the moment we are gone."""
    status = turn.autopilot
    if status is None:
        return
    own = turn.state.steering.own_mode
    is_stopping = own in STOPPING and is_busy(turn, own.name)   # asked for, and not shown yet
    if status.mode is not Mode.GUIDED:
        if not is_stopping:
            set_mode(turn, Mode.GUIDED, f"steering by {'field' if turn.guidance is Guidance.FIELD else 'headings'}")
        return
    if not is_stopping:
        turn.set(steering=changed(turn.state.steering, own_mode=Mode.GUIDED))
    if turn.guidance is Guidance.FIELD:
        told = by_field_heading(turn)
        if told is not None:
            turn.act(SteerHeading(heading_rad=told.heading_rad, thrust=told.thrust, text=told.reason))
    else:
        wanted = desired_heading_rad(turn)
        if wanted is not None:
            turn.act(SteerHeading(heading_rad=wanted, text="leg"))
    if status.mission_seq is not None and status.mission_seq < turn.state.mission.index + 1:
        make_current(turn, turn.state.mission.index + 1)


def _consider(turn: Turn) -> None:
    trigger = find_trigger(turn, turn.fresh)
    if trigger is None:
        return
    state = turn.state
    if state.pending.plan is not None and not (trigger.urgent and state.pending.plan.reason is not trigger.reason):
        return
    if turn.t_s < state.plans.retry.not_before_s and not trigger.urgent:
        return
    interval_s = trigger.interval_s
    if trigger.reason in ROUTINE and near(turn):
        interval_s = max(interval_s, MIN_INTERVAL_S)
    if trigger.reason in ROUTINE - {ReplanReason.OFF_LEG} and stands_on(turn):
        return   # rule 17 a i: course and speed are kept
    if turn.t_s - state.plans.last_s < interval_s:
        return
    if request(turn, trigger.reason, from_index=trigger.from_index, text=trigger.text):
        at = turn.state.plans.replanned_index if trigger.from_index is None else trigger.from_index
        turn.set(
            operator=changed(turn.state.operator, is_back=False),
            plans=changed(turn.state.plans, asked="", replanned_index=at))


def bear_away(turn: Turn) -> bool:
    """Bear away out of irons under GUIDED; True while the helm is ours."""
    state, status, vehicle, boat, wind = (
        turn.state, turn.autopilot, turn.snapshot.vehicle, turn.boat_en, turn.wind_now)
    if state.steering.until_s is None:
        if "in irons" not in turn.fresh or boat is None or vehicle is None or wind is None:
            return False
        recent = tuple(t for t in state.steering.irons_s if turn.t_s - t < IRONS_MEMORY_S)
        turn.set(steering=changed(turn.state.steering, irons_s=(*recent, turn.t_s)))
        if turn.snapshot.permissions.may_steer and set_mode(turn, Mode.GUIDED, "in irons: bearing away"):
            heading = bear_away_rad(boat, vehicle.heading_rad, wind[0], turn.voyage.area)
            turn.set(steering=changed(turn.state.steering, until_s=turn.t_s + STEER_S, heading_rad=heading))
        else:
            turn.set(plans=changed(turn.state.plans, asked=IN_IRONS))
            return False
    heading_rad = turn.state.steering.heading_rad or 0.0
    until = turn.state.steering.until_s
    out = vehicle is not None and wind is not None and vehicle.speed_mps > SAILS_MPS and (
        abs(difference_rad(wind[0], vehicle.heading_rad)) > SAILS_TWA_RAD)
    refused = status is not None and status.mode is Mode.AUTO and not is_busy(turn, Mode.GUIDED.name)
    over = out or refused or (until is not None and turn.t_s > until)
    if over and (refused or turn.steers or set_mode(
            turn, Mode.AUTO, "sailing again" if out else "bearing away took too long")):
        # The mode we asked for ourselves stays ours until AUTO shows.
        turn.set(
            steering=changed(
                turn.state.steering, until_s=None, heading_rad=None, own_mode=None if refused else Mode.GUIDED),
            plans=changed(turn.state.plans, asked=IN_IRONS))
        return False
    turn.act(SteerHeading(heading_rad=heading_rad, text="out of irons"))
    turn.phase(turn.state.phase, f"in irons: waiting for her to bear away to {math.degrees(heading_rad) % 360.0:.0f}°")
    return True


def _name(turn: Turn) -> None:
    """Name what the boat is doing, with the sentence why."""
    state, route = turn.state, turn.state.mission.route
    if route is None:
        return
    step = f" ({route.rung})" if route.rung else ""
    if state.pending.plan is not None:
        turn.phase(Phase.NEW_CALCULATION, f"planning: {state.pending.plan.reason.value}")
        return
    raised = ", ".join(r.name for r in state.alarms.raised)
    tail = (f"; {state.progress.task}" if state.progress.task else "") + (f"; {raised}" if raised else "")
    gate, bound = turn.gate, errand(turn)
    if is_composed(turn) and gate is not None and gate.field is not None:
        left_s = stay_left_s(turn, gate)
        field, time = gate.field, "" if math.isinf(left_s) else f"; {left_s:.0f} s left"
        turn.phase(Phase.STANDARD, f"{gate.name}: by field {field.tree.text}, {field.until_words}{time}{tail}")
    elif not turn.ahead():
        wait = state.plans.retry.not_before_s - turn.t_s
        again = f", trying again in {wait:.0f} s" if wait > 0.0 else ""
        turn.phase(Phase.HOLDING, f"loitering in the mission's safe end: waiting for a plan{again}{tail}")
    elif bound is not None:
        turn.phase(Phase.STANDARD, f"item {state.mission.index + 1} of {len(route.items)} {bound.sentence}{step}{tail}")
    elif gate is not None and is_buoy(gate) and gate.buoy_en_m is not None and turn.boat_en is not None and (
        distance_m(turn.boat_en, gate.buoy_en_m) < 4.0 * distance_m(gate.en_m, gate.buoy_en_m)
    ):
        turn.phase(Phase.BUOY_APPROACH, f"{gate.name} to {gate.side.value}{step}{tail}")
    elif state.mission.index == turn.last_waypoint() and route.gate_of[state.mission.index] == len(turn.gates) - 1:
        turn.phase(Phase.DESTINATION_APPROACH, f"last waypoint before {gate.name if gate else 'the end'}{step}{tail}")
    else:
        where = f"item {state.mission.index + 1} of {len(route.items)}"
        turn.phase(Phase.STANDARD, f"{where} to {gate.name if gate else 'the end'}{step}{tail}")
