"""State, boat, goals, orders, figures and health in the view."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from companion.fold import Step
from companion.geo.angles import difference_rad, heading_of
from companion.messages import CompanionStatus
from companion.orders import Verb, permitted
from companion.skipper.step import WindHealth
from companion.skipper.watch.watchdogs import BY_NAME
from companion.skipper.way import Goal, PointEn, Side, Voyage, gates_of
from companion.telemetry.console import DISK, GONE
from companion.telemetry.folder import VoyageFigures
from companion.view import values
from companion.view.company import alarms_of
from companion.view.numbers import compass, metres, place, rounded, signed, tack_of

SILENT_S = 5.0        # what should come every second and has not for so long is bad ...
LATE_S = 2.5          # ... and poor
FEED_SILENT_S = 60.0
SHORE_LATE_S = 30.0
LEVELS: dict[int, values.Level] = {2: "critical", 3: "error", 4: "warning", 5: "notice"}


def level_of(severity: int) -> values.Level:
    """Return MAVLink's severity in words."""
    return "critical" if severity < 2 else LEVELS.get(severity, "info")


def state_of(step: Step, since_s: float) -> values.State:
    """Return what she does and why."""
    state, autopilot = step.state, step.snapshot.autopilot
    return values.State(
        phase=state.phase.value, why=state.why, task=state.task, age_s=rounded(step.snapshot.t_s - since_s, 1),
        mode=None if autopilot is None or autopilot.mode is None else autopilot.mode.name,
        is_armed=None if autopilot is None else autopilot.is_armed, is_sailing=state.sailing,
        is_over=bool(state.over), has_arrived=state.arrived, is_planning=state.pending_plan is not None,
        wants=state.wants)


def alarms(step: Step, status: CompanionStatus, said: Mapping[str, str]) -> tuple[values.Alarm, ...]:
    """Return what somebody should look at: watchdogs, vessels too near, trouble with the disk."""
    t_s = step.snapshot.t_s
    out = [values.Alarm(
        code=raised.name, level=level_of(BY_NAME[raised.name].severity),
        text=said.get(raised.name, BY_NAME[raised.name].watches), age_s=rounded(t_s - raised.since_s, 1),
    ) for raised in step.state.raised]
    out += alarms_of(step)
    if status.alert_code in {DISK, GONE}:
        out.append(values.Alarm(code=status.alert_code, level="warning", text=status.alert_text))
    return tuple(out)


def next_goal(step: Step, voyage: Voyage) -> int:
    """Return the index, over all laps, of the goal that is sailed to; behind the last one when all are reached."""
    gates = gates_of(voyage, step.state.approaches)
    return gates[step.state.gate].goal if step.state.gate < len(gates) else len(voyage.legs)


def boat_of(step: Step, status: CompanionStatus, voyage: Voyage) -> values.Boat:
    """Return where she is and how she moves."""
    snapshot, autopilot = step.snapshot, step.snapshot.autopilot
    vehicle, here, wind = snapshot.vehicle, snapshot.position_en_m, snapshot.wind
    at_rest = values.Boat(
        length_m=voyage.boat.hull.length_m, battery_v=None if autopilot is None else rounded(autopilot.battery_v),
        battery_share=None if autopilot is None else rounded(autopilot.battery_remaining))
    if vehicle is None or here is None:
        return at_rest
    goal = voyage.legs[min(next_goal(step, voyage), len(voyage.legs) - 1)].en_m
    cog_rad, twd_rad = heading_of(*vehicle.velocity_en_mps), wind.present_twd_from_rad
    to_goal_rad = heading_of(goal[0] - here[0], goal[1] - here[1])
    twa_rad = None if twd_rad is None else difference_rad(twd_rad, vehicle.heading_rad)
    return replace(
        at_rest, age_s=rounded(snapshot.vehicle_age_s, 1), lat_deg=rounded(vehicle.position.lat_deg, 7),
        lon_deg=rounded(vehicle.position.lon_deg, 7), at_en_m=place(here), heading_deg=compass(vehicle.heading_rad),
        cog_deg=compass(cog_rad), sog_mps=rounded(vehicle.speed_mps),
        roll_deg=None if vehicle.roll_rad is None else signed(vehicle.roll_rad),
        tack=None if twa_rad is None else tack_of(twa_rad),
        vmg_mps=None if twd_rad is None else rounded(vehicle.speed_mps * math.cos(twd_rad - cog_rad)),
        vmc_mps=rounded(vehicle.speed_mps * math.cos(to_goal_rad - cog_rad)),
        clearance_m=rounded(status.clearance_m, 1),
        cross_track_m=None if autopilot is None else rounded(autopilot.cross_track_m, 1),
        waypoint_m=None if autopilot is None else rounded(autopilot.waypoint_distance_m, 1),
        goal_m=rounded(math.dist(here, goal), 1))


def kind_of(goal: Goal) -> str:
    """Return what kind of goal it is."""
    if goal.line is not None:
        return "start line" if goal.line.is_start else "line"
    if goal.search is not None:
        return "search"
    if goal.field is not None:
        return "field"
    return "box" if goal.box is not None else "point" if goal.side is Side.NONE else "buoy"


def goals_of(step: Step, voyage: Voyage) -> tuple[values.Goal, ...]:
    """Return the goals of one lap; of several laps ``is_reached`` tells of the present one."""
    here, following, lap = step.snapshot.position_en_m, next_goal(step, voyage), len(voyage.goals)
    begin = min(following, len(voyage.legs) - 1) // lap * lap
    out = []
    for number, goal in enumerate(voyage.goals):
        out.append(values.Goal(
            name=goal.name or f"goal {number + 1}", kind=kind_of(goal), at_en_m=place(goal.en_m),
            radius_m=metres(goal.radius_m), side="" if goal.side is Side.NONE else goal.side.value,
            line_en_m=None if goal.line is None else (
                place(goal.line.port_en_m), place(goal.line.starboard_en_m)),
            is_next=begin + number == following, is_reached=begin + number in step.state.reached,
            distance_m=None if here is None else metres(math.dist(here, goal.en_m)),
            bearing_deg=None if here is None else compass(heading_of(goal.en_m[0] - here[0], goal.en_m[1] - here[1]))))
    return tuple(out)


def home_of(step: Step, voyage: Voyage) -> values.Place | None:
    """Return where she was armed, as the autopilot tells."""
    autopilot = step.snapshot.autopilot
    home: PointEn | None = voyage.home_en_m
    if autopilot is not None and autopilot.home is not None:
        home = voyage.frame.en_from_geo(autopilot.home)
    return None if home is None else values.Place(name="home", at_en_m=place(home))


def refuges_of(voyage: Voyage) -> tuple[values.Place, ...]:
    """Return the refuges."""
    return tuple(
        values.Place(name=r.name, at_en_m=place(r.en_m), radius_m=rounded(r.radius_m, 1)) for r in voyage.refuges)


def orders_of(step: Step) -> values.Orders:
    """Return the order that stands, the last answer, and what is permitted on board."""
    state, t_s = step.state, step.snapshot.t_s
    standing, last = state.standing, max(state.answered, key=lambda a: a.t_s, default=None)
    return values.Orders(
        standing=None if standing is None else values.Standing(
            verb=standing.verb.value, words=standing.words, by=standing.by, age_s=rounded(standing.age_s(t_s), 0),
            at_en_m=None if standing.en_m is None else place(standing.en_m)),
        permitted=tuple(verb.value for verb in Verb if permitted(verb, step.snapshot.permissions.local_orders)),
        answer="" if last is None else f"{last.order.wanted.words}: {last.answer.text}",
        answer_age_s=None if last is None else rounded(t_s - last.t_s, 0))


def figures_of(step: Step, figures: VoyageFigures, voyage: Voyage) -> values.Figures:
    """Return the voyage so far."""
    return values.Figures(
        time_s=None if figures.first_s is None else rounded(figures.last_s - figures.first_s, 0),
        distance_m=rounded(figures.distance_m, 1), tacks=figures.tacks, gybes=figures.gybes, plans=figures.plans,
        replans=figures.replans, contacts=figures.contacts, no_go_entries=figures.no_go_entries,
        min_clearance_m=rounded(figures.min_clearance_m, 1),
        promised_clearance_m=rounded(figures.promised_clearance_m, 1),
        goals_reached=min(len(step.state.reached), len(voyage.legs)), goals=len(voyage.legs))


def health_of(step: Step, status: CompanionStatus) -> tuple[values.Part, ...]:
    """Return every part with its age."""
    snapshot, state, wind = step.snapshot, step.state, step.snapshot.wind
    autopilot, mission = snapshot.autopilot, snapshot.mission
    wind_age = None if wind.forecast is None else max(0.0, snapshot.t_s - wind.forecast.t_s)
    wind_grade: values.Grade = "unknown" if wind.health is WindHealth.NONE else \
        "good" if wind.health is WindHealth.GOOD else "bad" if wind.health is WindHealth.UNTRUSTED else "poor"
    ekf = autopilot is not None and autopilot.ekf_ok
    parts = [
        values.Part(name="autopilot", grade=by_age(snapshot.heartbeat_age_s),
                    age_s=rounded(snapshot.heartbeat_age_s, 1), text="not heard yet" if autopilot is None else
                    f"{'armed' if autopilot.is_armed else 'disarmed'}"
                    f"{'' if autopilot.mode is None else f', {autopilot.mode.name}'}"),
        values.Part(name="position", age_s=rounded(snapshot.vehicle_age_s, 1),
                    grade=by_age(snapshot.vehicle_age_s) if ekf or autopilot is None else "bad",
                    text="" if autopilot is None or ekf else "the autopilot does not believe its position"),
        values.Part(name="wind", grade=wind_grade, age_s=rounded(wind_age, 1), text=wind.verdict or wind.health.value),
        values.Part(name="planner", grade="good" if snapshot.planner_alive else "bad",
                    text="at work" if state.pending_plan is not None else
                    "ready" if snapshot.planner_alive else "its process has died"),
        values.Part(name="mission on board", grade="unknown" if mission.items is None else
                    "bad" if state.foreign else "good",
                    age_s=None if mission.read_t_s is None else rounded(snapshot.t_s - mission.read_t_s, 0),
                    text=state.foreign or ("not read yet" if mission.items is None else "ours, as read back")),
        values.Part(name="records", grade="bad" if status.alert_code == DISK else "good",
                    text=status.alert_text if status.alert_code == DISK else "written"),
    ]
    if status.alert_code == GONE:
        parts.append(values.Part(name="beside the voyage", grade="poor", text=status.alert_text))
    if status.traffic is not None:
        seen = status.traffic
        is_poor = seen.silent_feeds > 0 or seen.silence_s is None or seen.silence_s > FEED_SILENT_S
        parts.append(values.Part(
            name="AIS", grade="poor" if is_poor else "good", age_s=rounded(seen.silence_s, 0),
            text=f"{seen.feeds - seen.silent_feeds} of {seen.feeds} feeds heard" if seen.feeds else "by the autopilot"))
    if snapshot.shore_age_s is not None:
        parts.append(values.Part(
            name="ground station", age_s=rounded(snapshot.shore_age_s, 0),
            grade="good" if snapshot.shore_age_s < SHORE_LATE_S else "poor"))
    if autopilot is not None and autopilot.battery_v is not None:
        share = "" if autopilot.battery_remaining is None else f", {100.0 * autopilot.battery_remaining:.0f} %"
        parts.append(values.Part(
            name="battery", grade="bad" if state.battery_critical or autopilot.battery_failed else "good",
            age_s=rounded(snapshot.autopilot_age_s, 1), text=f"{autopilot.battery_v:.1f} V{share}"))
    return tuple(parts)


def by_age(age_s: float | None) -> values.Grade:
    """Return how a part is that should be heard every second."""
    return "unknown" if age_s is None else "bad" if age_s > SILENT_S else "poor" if age_s > LATE_S else "good"
