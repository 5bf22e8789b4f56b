"""Under way: when to plan again, what the watchdogs make of it, and Büsser's names for what the boat is doing."""

from __future__ import annotations

import math
from dataclasses import dataclass

from companion.geo.angles import difference_rad
from companion.messages import Mode
from companion.skipper.actions import CancelPlan, ReplanReason, Severity, SteerHeading
from companion.skipper.beating import IRONS_MEMORY_S, is_left_to_beat, may_restart_leg
from companion.skipper.by_field import heading as by_field_heading
from companion.skipper.by_field import keeps_station, last_resort
from companion.skipper.config import Guidance, ReplanPolicy
from companion.skipper.failsafe import waits_for
from companion.skipper.gates import Gate
from companion.skipper.geometry import bearing_rad, distance_m
from companion.skipper.headings import desired_heading_rad
from companion.skipper.helm import check_current, hand_back, is_busy, make_current, repair, set_mode
from companion.skipper.judge import predicted_beat
from companion.skipper.manoeuvre import bear_away_rad
from companion.skipper.planning import hold, request, seeks_refuge
from companion.skipper.route import path_length_m
from companion.skipper.snapshot import OperatorWish
from companion.skipper.state import Phase, Route
from companion.skipper.traffic import meetings, near
from companion.skipper.turn import Turn
from companion.traffic import Decision, decide
from companion.traffic.plans import MIN_INTERVAL_S

STEER_S = 25.0               # bearing away longer than this has failed
SAILS_MPS = 0.8              # out of irons
SAILS_TWA_RAD = math.radians(60.0)
TOO_LATE_S = 2.0             # a plan asked for this shortly before the waypoint cannot be there in time
BEND_RAD = math.radians(6.0)     # a smaller change of course at a waypoint is not worth a plan of its own ...
BEND_PLAN_AGE_S = 60.0           # ... unless the last one is this old
FORECAST_SHARE = 0.5         # of the interval that the plan used: a smaller change of the mean does not matter
FORECAST_RAD = math.radians(5.0)
FORECAST_SPEED = 0.3         # share of the wind speed
# Reasons that can wait among vessels, where plans must not follow each other fast (Büsser 5.2).
ROUTINE = frozenset({
    ReplanReason.WAYPOINT, ReplanReason.FORECAST, ReplanReason.WIND_SHIFT, ReplanReason.PLAN_AGE, ReplanReason.OFF_LEG})


@dataclass(frozen=True, slots=True, kw_only=True)
class Trigger:
    """A reason to plan now; ``from_index`` None: from the boat. ``urgent`` may replace a plan being made."""

    reason: ReplanReason
    text: str
    from_index: int | None = None
    interval_s: float = 0.0
    urgent: bool = False


def sail(turn: Turn, fresh: tuple[str, ...]) -> None:
    """Act for one step under way."""
    if turn.gate is None:
        if not keeps_station(turn):
            _finish(turn)
        return
    if turn.state.own_mode is Mode.HOLD and turn.autopilot is not None and turn.autopilot.mode is Mode.HOLD:
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
    """Out of a HOLD that nobody asked for: plan from where the boat has drifted to, then AUTO."""
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
    turn.phase(Phase.DONE, f"all {len(turn.state.reached)} goals reached{end}")
    turn.say(Severity.NOTICE, "done", turn.state.why, every_s=0.0)


# ---------------------------------------------------------------------------------------- triggers
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


def find_trigger(turn: Turn, fresh: tuple[str, ...]) -> Trigger | None:
    """Return the most pressing reason to plan again, None when there is none."""
    state, config = turn.state, turn.config
    if turn.boat_en is None or turn.snapshot.wind.forecast is None or turn.is_raised("becalmed"):
        return None
    if state.after_operator:
        return Trigger(reason=ReplanReason.OPERATOR_BACK, text="the operator gave the boat back")
    if "battery critical" in fresh and turn.voyage.refuges:
        return Trigger(reason=ReplanReason.REFUGE, text="the battery is critical", urgent=True)
    if state.wish in {OperatorWish.REPLAN, OperatorWish.GO_ON}:
        return Trigger(reason=ReplanReason.OPERATOR_WISH, text="the operator asked for it")
    if state.missed_gate is not None:
        return Trigger(reason=ReplanReason.MISSED_BUOY, text="missed: again", interval_s=config.settle_s)
    if "fence breach" in fresh:
        return Trigger(reason=ReplanReason.OBSTACLE, text="fence breach", urgent=True)
    if turn.config.guidance is Guidance.FIELD and turn.steers:
        return _at_end(turn) or _extension(turn)   # the mission on board need not be the way that is sailed
    trigger = _traffic(turn)
    if trigger is None and not turn.is_raised("wind untrusted"):
        trigger = _no_go(turn)
    trigger = trigger or _position(turn)
    if seeks_refuge(turn):
        return trigger
    return trigger or _extension(turn) or _wind(turn) or _waypoint(turn)


def _traffic(turn: Turn) -> Trigger | None:
    """The route meets another vessel (Büsser 5.2: planned again at most every 20 s)."""
    met = meetings(turn)
    if not met:
        return None
    first = met[0]
    text = f"{first.name}: in {first.time_s:.0f} s {first.depth_m:.0f} m inside the distance to keep"
    turn.say(Severity.WARNING, "traffic", text)
    since_s = turn.t_s - turn.state.last_plan_s
    interval_s = max(MIN_INTERVAL_S, turn.config.min_replan_interval_s)
    if since_s < interval_s or decide(met, since_replan_s=since_s, urgent_s=0.0) is not Decision.REPLAN:
        return None
    return Trigger(reason=ReplanReason.OBSTACLE, text=text, interval_s=interval_s, urgent=True)


def _no_go(turn: Turn) -> Trigger | None:
    """The present wind has closed the leg: the autopilot will beat in its corridor. How far, and is that clear?"""
    boat, leg, wind, vehicle = turn.boat_en, turn.leg(), turn.wind_now, turn.snapshot.vehicle
    if boat is None or leg is None or wind is None or vehicle is None or not turn.ahead():
        turn.update(no_go_since_s=None)
        return None
    target = leg[1]
    twa = abs(difference_rad(wind[0], bearing_rad(boat, target)))
    is_near = distance_m(boat, target) < turn.config.announce_m + turn.speed_mps
    if twa >= turn.no_go_half_rad or is_near or is_left_to_beat(turn, *leg):
        turn.update(no_go_since_s=None)
        return None
    since = turn.state.no_go_since_s if turn.state.no_go_since_s is not None else turn.t_s
    turn.update(no_go_since_s=since)
    drift = predicted_beat(
        boat, vehicle.heading_rad, leg[0], target, twd_from_rad=wind[0], no_go_half_rad=turn.no_go_half_rad,
        corridor_m=turn.tack_corridor_m, area=turn.voyage.area)
    floor = min(turn.config.margin_floor_m, turn.config.margin_m)
    straight = turn.voyage.area.path_clearance_m([boat, target])
    text = (f"TWA {math.degrees(twa):.0f}° to the waypoint is inside {math.degrees(turn.no_go_half_rad):.0f}°: "
            f"{drift.off_leg_m:.0f} m off the leg, {drift.clearance_m:.0f} m clear")
    if drift.clearance_m < floor and drift.clearance_m < straight - 1.0 and turn.t_s - since >= 1.0:
        interval_s = turn.config.no_go_replan_interval_s
        return Trigger(reason=ReplanReason.NO_GO, text=text, interval_s=interval_s, urgent=True)
    if drift.off_leg_m > turn.config.no_go_off_leg_m and turn.t_s - since >= turn.config.no_go_patience_s:
        return Trigger(reason=ReplanReason.NO_GO, text=text, interval_s=turn.config.min_replan_interval_s)
    return None


def _position(turn: Turn) -> Trigger | None:
    """The boat is not where the plan has it, or is nowhere on it."""
    if turn.is_raised("position jump"):   # with a position all the same: see Turn.is_way_shut
        return Trigger(reason=ReplanReason.OFF_LEG, text="the position jumped, and the way from there is not clear",
                       interval_s=turn.config.no_go_replan_interval_s, urgent=True)
    if turn.is_raised("off the corridor"):
        return Trigger(reason=ReplanReason.OFF_LEG, text="off the leg", interval_s=_patience_off_leg_s(turn))
    if turn.is_raised("no progress"):
        return Trigger(reason=ReplanReason.NO_PROGRESS, text="no progress", interval_s=120.0)
    return _at_end(turn)


def _at_end(turn: Turn) -> Trigger | None:
    """The mission on board is at its end and goals remain."""
    if (turn.is_raised("mission ended") or not turn.ahead()) and not seeks_refuge(turn):
        reason = ReplanReason.RETRY if turn.state.phase is Phase.HOLDING else ReplanReason.NEXT_GOAL
        return Trigger(reason=reason, text="at the end of the mission with goals left", interval_s=turn.config.settle_s)
    return None


def _patience_off_leg_s(turn: Turn) -> float:
    """Return how long after the last plan the next may be made; less when something stands before the waypoint."""
    boat, leg, config = turn.boat_en, turn.leg(), turn.config
    blocked = boat is not None and leg is not None and (
        turn.voyage.area.path_clearance_m([boat, leg[1]]) < config.margin_floor_m)
    if blocked:
        return config.no_go_replan_interval_s
    return config.min_replan_interval_s


def _wind(turn: Turn) -> Trigger | None:
    """Büsser's 20° against the wind that the plan used, outside the interval that it allowed for; and 60 minutes."""
    route, mean, config = turn.state.route, turn.wind_mean, turn.config
    if route is None or mean is None or turn.is_raised("wind untrusted"):
        return None
    turned = abs(difference_rad(mean[0], route.plan_twd_from_rad))
    if turned > config.wind_change_rad and turned > route.plan_half_width_rad:
        text = (f"the 90 s mean has turned {math.degrees(turned):.0f}° from the plan's wind; it allowed for "
                f"±{math.degrees(route.plan_half_width_rad):.0f}°")
        return Trigger(reason=ReplanReason.WIND_SHIFT, text=text, interval_s=config.min_replan_interval_s)
    if turn.t_s - route.plan_t_s > config.plan_age_s:
        return Trigger(
            reason=ReplanReason.PLAN_AGE, text="the plan is 60 minutes old", interval_s=config.min_replan_interval_s)
    return None


def _extension(turn: Turn) -> Trigger | None:
    """The mission ends soon and goals remain: plan on from its last waypoint."""
    route, boat, last = turn.state.route, turn.boat_en, turn.last_waypoint()
    if route is None or boat is None or last < turn.state.index:
        return None
    ends = route.gate_of[last]
    if ends >= len(turn.gates) - 1:
        return None
    left = path_length_m([boat, *turn.ahead()])
    if left > turn.config.look_ahead_s * max(turn.speed_mps, 1.0) or not may_restart_leg(turn):
        return None
    return Trigger(
        reason=ReplanReason.NEXT_GOAL, text=f"the mission reaches {left:.0f} m ahead, goals remain", from_index=last,
        interval_s=turn.config.settle_s)


def _waypoint(turn: Turn) -> Trigger | None:
    """Wolsieffer's rule: near a waypoint, plan again from it with the wind measured since."""
    state, route, boat, leg = turn.state, turn.state.route, turn.boat_en, turn.leg()
    if route is None or boat is None or leg is None or state.replanned_index >= state.index:
        return None
    last = turn.last_waypoint()
    if state.index >= last or any(g >= 0 for g in route.gate_of[state.index:last]) or _is_buoy(turn.gate):
        return None   # the tail to the next goal is there already: see _extension
    left_s = distance_m(boat, leg[1]) / max(turn.speed_mps, 0.3)
    if not TOO_LATE_S < left_s <= turn.config.lead_s or turn.is_raised("wind untrusted"):
        return None
    if not may_restart_leg(turn):
        return None
    if _is_bend(route, state.index) and turn.t_s - state.last_plan_s < BEND_PLAN_AGE_S:
        return None
    if turn.config.replan_policy is ReplanPolicy.FORECAST and not forecast_matters(turn):
        turn.update(replanned_index=state.index)
        return None
    reason = (ReplanReason.WAYPOINT if turn.config.replan_policy is ReplanPolicy.WAYPOINT else ReplanReason.FORECAST)
    return Trigger(
        reason=reason, text=f"waypoint {state.index + 1} in {left_s:.0f} s", from_index=state.index,
        interval_s=turn.config.min_replan_interval_s)


def _is_bend(route: Route, index: int) -> bool:
    """Return whether the course hardly changes at a waypoint: a leg bent as the no-go zone widens, no manoeuvre."""
    if index + 1 >= len(route.points_en_m) or distance_m(*route.points_en_m[index:index + 2]) < 1.0:
        return False
    before = bearing_rad(route.leg_from_en_m[index], route.points_en_m[index])
    after = bearing_rad(route.points_en_m[index], route.points_en_m[index + 1])
    return abs(difference_rad(after, before)) < BEND_RAD


def forecast_matters(turn: Turn) -> bool:
    """Return whether the wind has changed enough against the plan's to make another plan worth its upload."""
    route, mean = turn.state.route, turn.wind_mean
    if route is None or mean is None:
        return False
    turned = abs(difference_rad(mean[0], route.plan_twd_from_rad))
    if turned > max(FORECAST_RAD, FORECAST_SHARE * route.plan_half_width_rad):
        return True
    return abs(mean[1] - route.plan_tws_mps) > FORECAST_SPEED * max(route.plan_tws_mps, 1.0)


def _is_buoy(gate: Gate | None) -> bool:
    return gate is not None and gate.buoy_en_m is not None


# ---------------------------------------------------------------------------------------- irons
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


# ---------------------------------------------------------------------------------------- naming
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
    elif gate is not None and _is_buoy(gate) and gate.buoy_en_m is not None and turn.boat_en is not None and (
        distance_m(turn.boat_en, gate.buoy_en_m) < 4.0 * distance_m(gate.en_m, gate.buoy_en_m)
    ):
        turn.phase(Phase.BUOY_APPROACH, f"{gate.name} to {gate.side.value}{step}{tail}")
    elif state.index == turn.last_waypoint() and route.gate_of[state.index] == len(turn.gates) - 1:
        turn.phase(Phase.DESTINATION_APPROACH, f"last waypoint before {gate.name if gate else 'the end'}{step}{tail}")
    else:
        where = f"item {state.index + 1} of {len(route.items)}"
        turn.phase(Phase.STANDARD, f"{where} to {gate.name if gate else 'the end'}{step}{tail}")
