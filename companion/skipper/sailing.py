"""Under way: who steers, what is asked for, and Büsser's names for what the boat is doing."""

from __future__ import annotations

import math

from companion.geo.angles import difference_rad
from companion.messages import Mode
from companion.skipper.actions import CancelPlan, ReplanReason, Severity, SteerHeading
from companion.skipper.answers import hold
from companion.skipper.beating import IRONS_MEMORY_S
from companion.skipper.by_field import heading as by_field_heading
from companion.skipper.by_field import keeps_station, last_resort
from companion.skipper.config import Guidance
from companion.skipper.doubt import stands_off
from companion.skipper.failsafe import waits_for
from companion.skipper.geometry import distance_m
from companion.skipper.headings import desired_heading_rad
from companion.skipper.helm import check_current, hand_back, is_busy, make_current, repair, set_mode
from companion.skipper.manoeuvre import bear_away_rad
from companion.skipper.planning import request
from companion.skipper.snapshot import OperatorWish
from companion.skipper.state import Phase
from companion.skipper.traffic import near
from companion.skipper.triggers import find_trigger, is_buoy
from companion.skipper.turn import Turn
from companion.traffic.plans import MIN_INTERVAL_S

ARRIVED_BEFORE = "all goals were reached before this start; --again sails the mission again"
STEER_S = 25.0               # bearing away longer than this has failed
SAILS_MPS = 0.8              # out of irons
SAILS_TWA_RAD = math.radians(60.0)
# Reasons that can wait among vessels, where plans must not follow each other fast (Büsser 5.2).
ROUTINE = frozenset({
    ReplanReason.WAYPOINT, ReplanReason.FORECAST, ReplanReason.WIND_SHIFT, ReplanReason.PLAN_AGE, ReplanReason.OFF_LEG})


def sail(turn: Turn, fresh: tuple[str, ...]) -> None:
    """Act for one step under way."""
    if turn.gate is None:
        if not keeps_station(turn):
            _finish(turn)
        return
    if stands_off(turn):
        return
    stopped = turn.state.own_mode in {Mode.HOLD, Mode.LOITER}
    if stopped and turn.autopilot is not None and turn.autopilot.mode is turn.state.own_mode:
        _sail_on(turn, fresh)
        return
    if last_resort(turn):
        return
    if _steer(turn, fresh):
        return
    own = turn.state.own_mode
    if own is not None and turn.autopilot is not None and turn.autopilot.mode is own and not turn.steers:
        hand_back(turn)
        turn.phase(turn.state.phase, "waiting for AUTO after steering")
        return
    if repair(turn):
        return
    if turn.steers:
        _send_heading(turn)
    elif turn.config.guidance is not Guidance.PLAN:
        turn.say(Severity.WARNING, "guidance", f"guidance by {turn.config.guidance.value} is asked for and steering is "
                 "not permitted: by plan", every_s=600.0)
        check_current(turn)
    else:
        check_current(turn)
    if turn.is_raised("stuck waypoint") and turn.state.own_index > turn.state.index:
        make_current(turn, turn.state.own_index + 1)
    if turn.state.wish is OperatorWish.HOLD:
        if turn.state.pending_upload is None and turn.t_s >= turn.state.upload_retry.not_before_s:
            hold(turn, "the operator asked to hold")
        turn.phase(Phase.HOLDING, "holding: the operator asked for it")
        return
    if turn.state.pending_upload is None:
        _consider(turn, fresh)
    _name(turn)


def _sail_on(turn: Turn, fresh: tuple[str, ...]) -> None:
    """Out of a HOLD that nobody asked for, or a LOITER of ours: plan from where the boat is now, then AUTO."""
    why = waits_for(turn)
    if why or repair(turn):
        turn.phase(Phase.HOLDING, why or "the mission is put right before sailing on")
        return
    if turn.state.pending_upload is None:
        _consider(turn, fresh)
    if turn.state.pending_plan is not None or turn.state.pending_upload is not None:
        turn.phase(Phase.HOLDING, "planning from where the boat has drifted to")
    elif turn.state.after_operator and turn.is_way_shut:
        turn.phase(Phase.HOLDING, "no plan yet from where the boat has drifted to")
    else:
        hand_back(turn)
        turn.phase(Phase.HOLDING, "asking for AUTO: sailing on")


def _send_heading(turn: Turn) -> None:
    """Steer by Büsser's headings under GUIDED, and keep the autopilot's count in step for the moment we are gone."""
    status = turn.autopilot
    if status is None:
        return
    if status.mode is not Mode.GUIDED:
        set_mode(turn, Mode.GUIDED, "steering by headings")
        return
    turn.update(own_mode=Mode.GUIDED)
    if turn.config.guidance is Guidance.FIELD:
        told = by_field_heading(turn)
    else:
        wanted = desired_heading_rad(turn)
        told = None if wanted is None else (wanted, "leg")
    if told is not None:
        turn.act(SteerHeading(heading_rad=told[0], text=told[1]))
    if status.mission_seq is not None and status.mission_seq < turn.state.index + 1:
        make_current(turn, turn.state.index + 1)


def _finish(turn: Turn) -> None:
    route = turn.state.route
    if turn.state.pending_plan is not None:
        turn.act(CancelPlan(request_id=turn.state.pending_plan.request_id))
        turn.update(pending_plan=None)
    end = f"; the mission ends with {route.why}" if route is not None and route.rung == "hold" else ""
    done = f"all {len(turn.voyage.legs)} goals reached" if turn.state.reached else ARRIVED_BEFORE
    turn.phase(Phase.DONE, f"{done}{end}")
    turn.say(Severity.NOTICE, "done", turn.state.why, every_s=0.0)


def _consider(turn: Turn, fresh: tuple[str, ...]) -> None:
    trigger = find_trigger(turn, fresh)
    if trigger is None:
        return
    state = turn.state
    if state.pending_plan is not None and not (trigger.urgent and state.pending_plan.reason is not trigger.reason):
        return
    if turn.t_s < state.plan_retry.not_before_s and not trigger.urgent:
        return
    interval_s = trigger.interval_s
    if trigger.reason in ROUTINE and near(turn):
        interval_s = max(interval_s, MIN_INTERVAL_S)
    if turn.t_s - state.last_plan_s < interval_s:
        return
    if request(turn, trigger.reason, from_index=trigger.from_index, text=trigger.text):
        changes: dict[str, object] = {"after_operator": False}
        if state.wish in {OperatorWish.REPLAN, OperatorWish.GO_ON}:
            changes["wish"] = None
        if trigger.from_index is not None:
            changes["replanned_index"] = trigger.from_index
        turn.update(**changes)


def _steer(turn: Turn, fresh: tuple[str, ...]) -> bool:
    """Bear away out of irons under GUIDED; True while the helm is ours."""
    state, status, vehicle, boat, wind = (
        turn.state, turn.autopilot, turn.snapshot.vehicle, turn.boat_en, turn.wind_now)
    if state.steering_until_s is None:
        if "in irons" not in fresh or boat is None or vehicle is None or wind is None:
            return False
        recent = tuple(t for t in state.irons_s if turn.t_s - t < IRONS_MEMORY_S)
        turn.update(irons_s=(*recent, turn.t_s))
        if turn.snapshot.permissions.may_steer and set_mode(turn, Mode.GUIDED, "in irons: bearing away"):
            heading = bear_away_rad(boat, vehicle.heading_rad, wind[0], turn.voyage.area)
            turn.update(steering_until_s=turn.t_s + STEER_S, steering_heading_rad=heading)
        else:
            turn.update(wish=OperatorWish.REPLAN)
            return False
    heading_rad = turn.state.steering_heading_rad or 0.0
    until = turn.state.steering_until_s
    out = vehicle is not None and wind is not None and vehicle.speed_mps > SAILS_MPS and (
        abs(difference_rad(wind[0], vehicle.heading_rad)) > SAILS_TWA_RAD)
    refused = status is not None and status.mode is Mode.AUTO and not is_busy(turn, Mode.GUIDED.name)
    over = out or refused or (until is not None and turn.t_s > until)
    if over and (refused or set_mode(turn, Mode.AUTO, "sailing again" if out else "bearing away took too long")):
        # The mode we asked for ourselves stays ours until AUTO shows.
        turn.update(
            steering_until_s=None, steering_heading_rad=None, wish=OperatorWish.REPLAN,
            own_mode=None if refused else Mode.GUIDED)
        return False
    turn.act(SteerHeading(heading_rad=heading_rad, text="out of irons"))
    turn.phase(turn.state.phase, f"in irons: bearing away to {math.degrees(heading_rad) % 360.0:.0f}°")
    return True


def _name(turn: Turn) -> None:
    """Name what the boat is doing, with the sentence why."""
    state, route = turn.state, turn.state.route
    if route is None or state.phase is Phase.DONE:
        return
    step = f" ({route.rung})" if route.rung else ""
    if state.pending_plan is not None:
        turn.phase(Phase.NEW_CALCULATION, f"planning: {state.pending_plan.reason.value}")
        return
    raised = ", ".join(r.name for r in state.raised)
    tail = f"; {raised}" if raised else ""
    gate = turn.gate
    if not turn.ahead():
        wait = state.plan_retry.not_before_s - turn.t_s
        again = f"; trying again in {wait:.0f} s" if wait > 0.0 else ""
        turn.phase(Phase.HOLDING, f"loitering in the mission's safe end{again}{tail}")
    elif gate is not None and is_buoy(gate) and gate.buoy_en_m is not None and turn.boat_en is not None and (
        distance_m(turn.boat_en, gate.buoy_en_m) < 4.0 * distance_m(gate.en_m, gate.buoy_en_m)
    ):
        turn.phase(Phase.BUOY_APPROACH, f"{gate.name} to {gate.side.value}{step}{tail}")
    elif state.index == turn.last_waypoint() and route.gate_of[state.index] == len(turn.gates) - 1:
        turn.phase(Phase.DESTINATION_APPROACH, f"last waypoint before {gate.name if gate else 'the end'}{step}{tail}")
    else:
        where = f"item {state.index + 1} of {len(route.items)}"
        turn.phase(Phase.STANDARD, f"{where} to {gate.name if gate else 'the end'}{step}{tail}")
