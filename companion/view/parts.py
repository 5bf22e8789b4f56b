"""The parts of a view, each made of a step: state, boat, goals, orders, health, wind, way and other vessels."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache

from companion.boat import Boat
from companion.current import over_water
from companion.eta import Eta
from companion.figures import BY_NAME as FIGURES_BY_NAME
from companion.figures import vmg_mps
from companion.fold import Step
from companion.geo.angles import difference_rad, heading_of, unit_en
from companion.messages import Command, CompanionStatus, TrafficStatus, VehicleState, WindForecast
from companion.orders import Verb, permitted
from companion.planner import Leg, Plan
from companion.safety import BY_NAME
from companion.skipper import SkipperConfig, Voyage
from companion.skipper.planning import next_tack, on_leg, planned_forecast
from companion.skipper.step import Route, WindHealth
from companion.skipper.way import Goal, PointEn, Side, bearing_rad, gates_of, half_width_rad, mean_twd_rad
from companion.telemetry.console import DISK, GONE
from companion.telemetry.folder import VoyageFigures
from companion.traffic import Alarm, Assessment
from companion.view import values
from companion.view.values import compass, degrees, metres, place, rounded, signed, tack_of
from companion.words import counted

MOST = 40  # vessels in a view, the worst first


def vessels_of(step: Step) -> tuple[values.VesselView, ...]:
    """Return the vessels, the worst first; without our own position those heard last, with no approach."""
    if step.state.traffic.watch:
        return tuple(_seen(step, seen) for seen in step.state.traffic.watch[:MOST])
    picture = step.snapshot.traffic
    if picture is None:
        return ()
    newest = sorted(picture.vessels, key=picture.age_s)[:MOST]
    return tuple(
        values.VesselView(
            name=v.label,
            mmsi=v.mmsi,
            age_s=rounded(picture.age_s(v), 1),
            at_en_m=place(v.centre_en_m),
            course_deg=None if v.course_rad is None else compass(v.course_rad),
            speed_mps=rounded(v.speed_mps),
            length_m=metres(v.hull.length_m),
            beam_m=metres(v.hull.beam_m),
        )
        for v in newest
    )


def _seen(step: Step, seen: Assessment) -> values.VesselView:
    vessel, approach = seen.vessel, seen.approach
    ve, vn = vessel.velocity_en_mps
    east, north = vessel.centre_en_m
    at = (east + ve * seen.age_s, north + vn * seen.age_s)
    then_s = approach.time_s if approach.is_closing else None
    here, own = step.snapshot.position_en_m, step.snapshot.vehicle
    own_then = None
    if then_s is not None and here is not None and own is not None:
        own_then = place((here[0] + own.velocity_en_mps[0] * then_s, here[1] + own.velocity_en_mps[1] * then_s))
    return values.VesselView(
        name=vessel.label,
        mmsi=vessel.mmsi,
        age_s=rounded(seen.age_s, 1),
        at_en_m=place(at),
        course_deg=None if vessel.course_rad is None else compass(vessel.course_rad),
        speed_mps=rounded(vessel.speed_mps),
        heading_deg=None if vessel.bow_rad is None else compass(vessel.bow_rad),
        length_m=metres(vessel.hull.length_m),
        beam_m=metres(vessel.hull.beam_m),
        alarm=seen.alarm.name.lower(),
        role=seen.encounter.role.value,
        rule=seen.encounter.rule.value,
        range_m=metres(approach.now_m),
        bearing_deg=compass(approach.bearing_rad),
        cpa_m=metres(approach.distance_m),
        cpa_s=rounded(then_s, 0),
        own_cpa_en_m=own_then,
        cpa_en_m=None if then_s is None else place((at[0] + ve * then_s, at[1] + vn * then_s)),
    )


def alarms_of(step: Step) -> tuple[values.AlarmView, ...]:
    """Return the alarms of vessels that come too near."""
    levels: dict[Alarm, values.Level] = {Alarm.WARN: "warning", Alarm.ACT: "error", Alarm.TOUCH: "critical"}
    return tuple(
        values.AlarmView(code="vessel", level=levels[seen.alarm], text=seen.sentence())
        for seen in step.state.traffic.watch
        if seen.alarm in levels
    )


def heard_vessel(traffic: TrafficStatus | None, age_s: float | None) -> tuple[values.VesselView, ...]:
    """Return the one vessel that a radio's status tells of, the worst."""
    if traffic is None or not traffic.alarm:
        return ()
    return (
        values.VesselView(
            name=traffic.name,
            age_s=rounded(age_s, 1),
            alarm=traffic.alarm,
            role=traffic.role,
            rule=traffic.rule,
            range_m=rounded(traffic.range_m),
            cpa_m=rounded(traffic.cpa_m, 1),
            cpa_s=rounded(traffic.tcpa_s, 0),
            bearing_deg=None
            if traffic.bearing_rad is None or not math.isfinite(traffic.bearing_rad)
            else compass(traffic.bearing_rad),
        ),
    )


SILENT_S = 5.0  # what should come every second and has not for so long is bad ...
LATE_S = 2.5  # ... and poor
FEED_SILENT_S = 60.0
SHORE_LATE_S = 30.0
LEVELS: dict[int, values.Level] = {2: "critical", 3: "error", 4: "warning", 5: "notice"}


def level_of(severity: int) -> values.Level:
    """Return MAVLink's severity in words."""
    return "critical" if severity < 2 else LEVELS.get(severity, "info")


def state_of(step: Step, since_s: float) -> values.StateView:
    """Return what the boat does and why."""
    state, autopilot = step.state, step.snapshot.autopilot
    return values.StateView(
        phase=state.phase.value,
        why=state.why,
        task=state.progress.task,
        age_s=rounded(step.snapshot.t_s - since_s, 1),
        mode=None if autopilot is None or autopilot.mode is None else autopilot.mode.name,
        is_armed=None if autopilot is None else autopilot.is_armed,
        is_sailing=state.voyage.sailing,
        is_over=bool(state.voyage.over),
        has_arrived=state.voyage.arrived,
        is_planning=state.pending.plan is not None,
        wants=state.wants,
    )


def alarms(step: Step, status: CompanionStatus, said: Mapping[str, str]) -> tuple[values.AlarmView, ...]:
    """Return what somebody should look at: watchdogs, vessels too near, trouble with the disk."""
    t_s = step.snapshot.t_s
    out = [
        values.AlarmView(
            code=raised.name,
            level=level_of(BY_NAME[raised.name].severity),
            text=said.get(raised.name, BY_NAME[raised.name].watches),
            age_s=rounded(t_s - raised.since_s, 1),
        )
        for raised in step.state.alarms.raised
    ]
    out += alarms_of(step)
    out += [
        values.AlarmView(code=code, level="warning", text=text)
        for code, text in ((DISK, status.disk_trouble), (GONE, status.gone))
        if text
    ]
    return tuple(out)


def next_goal(step: Step, voyage: Voyage) -> int:
    """Return the index, over all laps, of the goal that is sailed to; behind the last one when all are reached."""
    gates = gates_of(voyage, step.state.progress.approaches)
    return gates[step.state.progress.gate].goal if step.state.progress.gate < len(gates) else len(voyage.legs)


def mark_en_m(step: Step, voyage: Voyage) -> PointEn | None:
    """Return what is sailed to: where the way on board leads if that is no goal, else the goal; None: nothing is."""
    route, number = step.state.mission.route, next_goal(step, voyage)
    if route is not None and route.bound_at is not None:
        return route.points_en_m[route.bound_at]
    return voyage.legs[number].en_m if number < len(voyage.legs) else None


def boat_of(step: Step, status: CompanionStatus, voyage: Voyage) -> values.BoatView:
    """Return where the boat is and how it moves."""
    snapshot, autopilot = step.snapshot, step.snapshot.autopilot
    vehicle, here, wind = snapshot.vehicle, snapshot.position_en_m, snapshot.wind
    at_rest = values.BoatView(
        length_m=voyage.boat.hull.length_m,
        battery_v=None if autopilot is None else rounded(autopilot.battery_v),
        battery_share=None if autopilot is None else rounded(autopilot.battery_remaining),
    )
    if vehicle is None or here is None:
        return at_rest
    mark = mark_en_m(step, voyage)
    cog_rad, twd_rad = heading_of(*vehicle.velocity_en_mps), wind.present_twd_from_rad
    twa_rad = None if twd_rad is None else difference_rad(twd_rad, vehicle.heading_rad)
    return replace(
        at_rest,
        age_s=rounded(snapshot.vehicle_age_s, 1),
        lat_deg=rounded(vehicle.position.lat_deg, 7),
        lon_deg=rounded(vehicle.position.lon_deg, 7),
        at_en_m=place(here),
        heading_deg=compass(vehicle.heading_rad),
        cog_deg=compass(cog_rad),
        sog_mps=rounded(vehicle.speed_mps),
        roll_deg=None if vehicle.roll_rad is None else signed(vehicle.roll_rad),
        tack=None if twa_rad is None else tack_of(twa_rad),
        vmg_mps=rounded(vmg_mps(step)),
        vmc_mps=None if mark is None else rounded(vehicle.speed_mps * math.cos(bearing_rad(here, mark) - cog_rad)),
        clearance_m=rounded(status.clearance_m),
        cross_track_m=rounded(on_leg(step).off_m),
        waypoint_m=rounded(on_leg(step).left_m),
        goal_m=None if mark is None else rounded(math.dist(here, mark)),
    )


def kind_of(goal: Goal) -> str:
    """Return what kind of goal it is."""
    if goal.line is not None:
        return "start line" if goal.line.is_start else "line"
    if goal.search is not None:
        return "search"
    if goal.field is not None:
        return "field"
    return "box" if goal.box is not None else "point" if goal.side is Side.NONE else "buoy"


def goals_of(step: Step, voyage: Voyage) -> tuple[values.GoalView, ...]:
    """Return the goals of one lap; of several laps ``is_reached`` tells of the present one."""
    here, following, lap = step.snapshot.position_en_m, next_goal(step, voyage), len(voyage.goals)
    begin = min(following, len(voyage.legs) - 1) // lap * lap
    out = []
    for number, goal in enumerate(voyage.goals):
        out.append(
            values.GoalView(
                name=goal.name or f"goal {number + 1}",
                kind=kind_of(goal),
                at_en_m=place(goal.en_m),
                radius_m=metres(goal.radius_m),
                side="" if goal.side is Side.NONE else goal.side.value,
                line_en_m=None if goal.line is None else (place(goal.line.port_en_m), place(goal.line.starboard_en_m)),
                is_next=begin + number == following,
                is_reached=begin + number in step.state.progress.reached,
                distance_m=None if here is None else metres(math.dist(here, goal.en_m)),
                bearing_deg=None
                if here is None
                else compass(heading_of(goal.en_m[0] - here[0], goal.en_m[1] - here[1])),
            )
        )
    return tuple(out)


def home_of(step: Step, voyage: Voyage) -> values.PlaceView | None:
    """Return where the boat was armed, as the autopilot tells."""
    autopilot = step.snapshot.autopilot
    if autopilot is None or autopilot.home is None:
        return None
    return values.PlaceView(name="home", at_en_m=place(voyage.frame.en_from_geo(autopilot.home)))


def refuges_of(voyage: Voyage) -> tuple[values.PlaceView, ...]:
    """Return the refuges; one whose name is its number alone is called so."""
    return tuple(
        values.PlaceView(
            name=f"refuge {r.name}" if r.name.isdecimal() else r.name,
            at_en_m=place(r.en_m),
            radius_m=rounded(r.radius_m, 1),
        )
        for r in voyage.refuges
    )


def orders_of(step: Step) -> values.OrdersView:
    """Return the order that stands, the last answer, and what is permitted on board."""
    state, t_s = step.state, step.snapshot.t_s
    standing, last = state.orders.standing, max(state.orders.answered, key=lambda a: a.t_s, default=None)
    return values.OrdersView(
        standing=None
        if standing is None
        else values.StandingView(
            verb=standing.verb.value,
            words=standing.words,
            by=standing.by,
            age_s=rounded(standing.age_s(t_s), 0),
            at_en_m=None if standing.en_m is None else place(standing.en_m),
        ),
        permitted=tuple(verb.value for verb in Verb if permitted(verb, step.snapshot.permissions.local_orders)),
        answer="" if last is None else f"{last.order.wanted.words}: {last.answer.text}",
        answer_age_s=None if last is None else rounded(t_s - last.t_s, 0),
    )


def figures_of(step: Step, figures: VoyageFigures, voyage: Voyage) -> values.Figures:
    """Return the voyage so far."""
    return values.Figures(
        time_s=rounded(figures.sailing.time_s, 0),
        distance_m=rounded(figures.distance_m, 1),
        tacks=figures.tacks,
        gybes=figures.gybes,
        plans=step.state.plans.made,
        replans=figures.replans,
        contacts=figures.contacts,
        no_go_entries=figures.no_go_entries,
        min_clearance_m=rounded(figures.min_clearance_m),
        promised_clearance_m=rounded(figures.promised_clearance_m),
        goals_reached=min(len(step.state.progress.reached), len(voyage.legs)),
        goals=len(voyage.legs),
    )


def shown(told: Mapping[str, float]) -> tuple[values.FigureView, ...]:
    """Return figures of the table by their names as the page shows them; those of another release are left out."""
    return tuple(
        values.FigureView(name=name, label=figure.label, kind=figure.kind, hint=figure.hint, value=rounded(value, 4))
        for name, value in told.items()
        if (figure := FIGURES_BY_NAME.get(name)) is not None
    )


def health_of(step: Step, status: CompanionStatus) -> tuple[values.Part, ...]:
    """Return every part with its age."""
    snapshot, state, wind = step.snapshot, step.state, step.snapshot.wind
    autopilot, mission = snapshot.autopilot, snapshot.mission
    wind_age = None if wind.forecast is None else max(0.0, snapshot.t_s - wind.forecast.t_s)
    wind_grade: values.Grade = (
        "unknown"
        if wind.health is WindHealth.NONE
        else "good"
        if wind.health is WindHealth.GOOD
        else "bad"
        if wind.health is WindHealth.UNTRUSTED
        else "poor"
    )
    ekf = autopilot is not None and autopilot.ekf_ok
    parts = [
        values.Part(
            name="autopilot",
            grade=by_age(snapshot.heartbeat_age_s),
            age_s=rounded(snapshot.heartbeat_age_s, 1),
            text="not heard yet"
            if autopilot is None
            else f"{'armed' if autopilot.is_armed else 'disarmed'}"
            f"{'' if autopilot.mode is None else f', {autopilot.mode.name}'}",
        ),
        values.Part(
            name="position",
            age_s=rounded(snapshot.vehicle_age_s, 1),
            grade=by_age(snapshot.vehicle_age_s) if ekf or autopilot is None else "bad",
            text="" if autopilot is None or ekf else "the autopilot does not believe its position",
        ),
        values.Part(name="wind", grade=wind_grade, age_s=rounded(wind_age, 1), text=wind.verdict or wind.health.value),
        _planner(step),
        values.Part(
            name="mission on board",
            grade="unknown" if mission.items is None else "bad" if state.mission.foreign else "good",
            age_s=None if mission.read_t_s is None else rounded(snapshot.t_s - mission.read_t_s, 0),
            text=state.mission.foreign or ("not read yet" if mission.items is None else "ours, as read back"),
        ),
        values.Part(
            name="records", grade="bad" if status.disk_trouble else "good", text=status.disk_trouble or "written"
        ),
    ]
    if status.gone:
        parts.append(values.Part(name="beside the voyage", grade="poor", text=status.gone))
    if status.traffic is not None:
        seen = status.traffic
        is_poor = seen.silent_feeds > 0 or seen.silence_s is None or seen.silence_s > FEED_SILENT_S
        parts.append(
            values.Part(
                name="AIS",
                grade="poor" if is_poor else "good",
                age_s=rounded(seen.silence_s, 0),
                text=f"{seen.feeds - seen.silent_feeds} of {counted(seen.feeds, 'feed')} heard"
                if seen.feeds
                else "by the autopilot",
            )
        )
    if snapshot.shore_age_s is not None:
        parts.append(
            values.Part(
                name="ground station",
                age_s=rounded(snapshot.shore_age_s, 0),
                grade="good" if snapshot.shore_age_s < SHORE_LATE_S else "poor",
            )
        )
    if autopilot is not None and autopilot.battery_v is not None:
        share = "" if autopilot.battery_remaining is None else f", {100.0 * autopilot.battery_remaining:.0f} %"
        parts.append(
            values.Part(
                name="battery",
                grade="bad" if state.alarms.battery_critical or autopilot.battery_failed else "good",
                age_s=rounded(snapshot.autopilot_age_s, 1),
                text=f"{autopilot.battery_v:.1f} V{share}",
            )
        )
    return tuple(parts)


def _planner(step: Step) -> values.Part:
    """Return the planner: whether it lives, what it does, and how long its answers take here."""
    state, is_alive = step.state, step.snapshot.planner_alive
    doing = "at work" if state.pending.plan is not None else "ready" if is_alive else "its process has died"
    is_slow = state.plans.latency.is_slow
    return values.Part(
        name="planner",
        grade="bad" if not is_alive else "poor" if is_slow else "good",
        text=", ".join(part for part in (doing, "slow" if is_slow else "", state.plans.latency.words) if part),
    )


def by_age(age_s: float | None) -> values.Grade:
    """Return how a part is that should be heard every second."""
    return "unknown" if age_s is None else "bad" if age_s > SILENT_S else "poor" if age_s > LATE_S else "good"


SHOWN_AHEAD_S = (0.0, 30.0, 60.0, 120.0, 300.0, 600.0)
WEDGES_S = (0.0, 60.0, 300.0)
INTERVAL_LEVELS = (0.5, 0.8, 0.95)
SWING_LEVEL = 0.8  # of the fan that a layline is drawn with
SIGMA_AT_S = 60.0  # the spread in figures is that of a minute ahead, as in the status
HAS_WAY_MPS = 0.2


@lru_cache(maxsize=64)  # asked for twice in every step, and the search takes longer than all else in a view
def best_angles(boat: Boat, tws_mps: float, no_go_rad: float) -> tuple[float, float]:
    """Return the bow's best angles to windward and to leeward [rad]."""
    return boat.best_beat(tws_mps, no_go_half_rad=no_go_rad).twa_rad, boat.best_run(tws_mps).twa_rad


def wind_of(step: Step) -> values.WindView | None:
    """Return the wind, None when none was ever heard."""
    wind, vehicle = step.snapshot.wind, step.snapshot.vehicle
    if wind.forecast is None and wind.present_twd_from_rad is None and wind.mean_twd_from_rad is None:
        return None
    forecast = wind.forecast
    twd_rad, tws_mps = wind.present_twd_from_rad, wind.present_tws_mps
    awa_rad, aws_mps = apparent(twd_rad, tws_mps, vehicle)
    return values.WindView(
        health=wind.health.value,
        verdict=wind.verdict,
        twd_from_deg=None if twd_rad is None else compass(twd_rad),
        tws_mps=rounded(tws_mps),
        mean_twd_from_deg=None if wind.mean_twd_from_rad is None else compass(wind.mean_twd_from_rad),
        mean_tws_mps=rounded(wind.mean_tws_mps),
        sigma_deg=None if forecast is None else degrees(_at(forecast, SIGMA_AT_S, "sigma_twd_rad")),
        tws_sigma_mps=None if forecast is None else rounded(_at(forecast, SIGMA_AT_S, "sigma_tws_mps")),
        twa_deg=None if twd_rad is None or vehicle is None else signed(difference_rad(twd_rad, vehicle.heading_rad)),
        awa_deg=None if awa_rad is None else signed(awa_rad),
        aws_mps=rounded(aws_mps),
        record_s=rounded(wind.record_s, 0),
        correlation_s=None if forecast is None else rounded(forecast.correlation_time_s, 1),
        age_s=None if forecast is None else rounded(max(0.0, step.snapshot.t_s - forecast.t_s), 1),
        levels=() if forecast is None else INTERVAL_LEVELS,
        bands=() if forecast is None else bands_of(forecast),
    )


def water_of(step: Step) -> values.WaterView | None:
    """Return the current, None before anything is known of the water."""
    current, wind = step.snapshot.current, step.snapshot.wind
    if current.sigma_mps == 0.0:
        return None
    over = (
        None
        if wind.present_twd_from_rad is None or wind.present_tws_mps is None
        else over_water(wind.present_twd_from_rad, wind.present_tws_mps, current.planned_en_mps)
    )
    return values.WaterView(
        set_deg=compass(current.set_rad),
        drift_mps=rounded(current.drift_mps),
        sigma_mps=rounded(current.sigma_mps),
        is_planned=current.is_significant,
        verdict=current.verdict,
        twd_from_deg=None if over is None else compass(over[0]),
        tws_mps=None if over is None else rounded(over[1]),
    )


def bands_of(forecast: WindForecast) -> tuple[values.Band, ...]:
    """Return the forecast at the view's horizons, as far as it reaches."""
    last_s = float(forecast.horizon_s[-1])
    return tuple(
        values.Band(
            horizon_s=at_s,
            twd_from_deg=compass(mean_twd_rad(forecast, at_s)),
            sigma_deg=degrees(_at(forecast, at_s, "sigma_twd_rad")),
            tws_mps=rounded(_at(forecast, at_s, "mean_tws_mps")),
            tws_sigma_mps=rounded(_at(forecast, at_s, "sigma_tws_mps")),
            half_deg=tuple(degrees(half_width_rad(forecast, at_s, level)) for level in INTERVAL_LEVELS),
        )
        for at_s in SHOWN_AHEAD_S
        if at_s <= last_s
    )


def apparent(
    twd_from_rad: float | None, tws_mps: float | None, vehicle: VehicleState | None
) -> tuple[float | None, float | None]:
    """Return the apparent wind, angle at the bow [rad] and speed [m/s], that a true wind makes on a moving boat."""
    if twd_from_rad is None or tws_mps is None or vehicle is None:
        return None, None
    east = -tws_mps * math.sin(twd_from_rad) - vehicle.velocity_en_mps[0]
    north = -tws_mps * math.cos(twd_from_rad) - vehicle.velocity_en_mps[1]
    return difference_rad(heading_of(-east, -north), vehicle.heading_rad), math.hypot(east, north)


def no_go_of(step: Step, voyage: Voyage, config: SkipperConfig) -> values.NoGo | None:
    """Return the no-go zone of courses now and later, widened as a plan that keeps the promise in force has it.

    None without a forecast, and of a boat that does not sail.
    """
    forecast, route = step.snapshot.wind.forecast, step.state.mission.route
    if forecast is None or not config.sails:
        return None
    delta_s = config.delta_s if route is None else route.delta_s
    boat, bow_rad = voyage.boat, config.planned_no_go_rad(voyage.boat, step.snapshot.limits)
    forecast, nearer_rad = planned_forecast(boat, forecast, bow_rad, step.snapshot.doubt)
    half_rad = boat.made_good_rad(bow_rad, float(forecast.mean_tws_mps[0])) + nearer_rad
    wedges = []
    for at_s in WEDGES_S:
        if at_s <= float(forecast.horizon_s[-1]):
            widening_rad = half_width_rad(forecast, at_s, max(0.0, 2.0 * delta_s - 1.0))
            wedges.append(
                values.Wedge(
                    horizon_s=at_s,
                    from_deg=compass(mean_twd_rad(forecast, at_s)),
                    half_deg=degrees(min(math.pi, half_rad + widening_rad)),
                    widening_deg=degrees(widening_rad),
                )
            )
    return values.NoGo(half_deg=degrees(half_rad), probability=round(delta_s, 4), wedges=tuple(wedges))


def laylines_of(
    step: Step, voyage: Voyage, config: SkipperConfig, name: str, mark_en: PointEn
) -> values.Laylines | None:
    """Return the laylines of a mark; None where it is fetched on one course, as any is of a boat that does not sail,
    or the wind is not known."""  # noqa: D205, D209
    snapshot, boat = step.snapshot, voyage.boat
    here, wind, vehicle = snapshot.position_en_m, snapshot.wind, snapshot.vehicle
    twd_rad, tws_mps, current = wind.mean_twd_from_rad, wind.mean_tws_mps, snapshot.current.planned_en_mps
    if here is None or vehicle is None or twd_rad is None or tws_mps is None or math.dist(here, mark_en) < 1.0:
        return None
    if not config.sails:
        return None
    twd_rad, tws_mps = over_water(twd_rad, tws_mps, current)
    no_go_rad = config.planned_no_go_rad(boat, snapshot.limits)
    beat, run = best_angles(boat, round(tws_mps, 1), no_go_rad)
    off_rad = abs(difference_rad(twd_rad, heading_of(mark_en[0] - here[0], mark_en[1] - here[1])))
    bow_rad = max(beat, no_go_rad)
    angle_rad = boat.made_good_rad(bow_rad, tws_mps)  # a line is of the course
    is_beat = off_rad < angle_rad
    if not is_beat:
        if off_rad <= run + 1e-3:
            return None
        bow_rad = angle_rad = run
    speed_mps = max(HAS_WAY_MPS, boat.polar.speed_mps(bow_rad, tws_mps))
    there_s = min(600.0, math.dist(here, mark_en) / speed_mps)
    swing = 0.0 if wind.forecast is None else half_width_rad(wind.forecast, there_s, SWING_LEVEL)
    lines = []
    for tack, side in (("starboard", 1.0), ("port", -1.0)):
        course_rad = twd_rad - side * angle_rad  # on starboard tack the wind is to the right of the bow
        if current != (0.0, 0.0):
            course_rad = heading_of(*(v * speed_mps + c for v, c in zip(unit_en(course_rad), current, strict=True)))
        lines.append(
            values.Layline(
                tack=tack,  # type: ignore[arg-type]
                course_deg=compass(course_rad),
                swing_deg=degrees(swing),
                reach_s=rounded(_meets_s(here, vehicle, mark_en, course_rad), 0),
            )
        )
    return values.Laylines(
        name=name,
        mark_en_m=place(mark_en),
        is_beat=is_beat,
        angle_deg=degrees(angle_rad),
        level=SWING_LEVEL,
        lines=tuple(lines),
    )


def _meets_s(here: PointEn, vehicle: VehicleState, mark_en: PointEn, course_rad: float) -> float | None:
    """Return when the boat, going on as it does, is on the line that fetches the mark [s]; None: not before it."""
    if vehicle.speed_mps < HAS_WAY_MPS:
        return None
    east, north = math.sin(course_rad), math.cos(course_rad)
    across_m = (here[0] - mark_en[0]) * north - (here[1] - mark_en[1]) * east
    across_mps = vehicle.velocity_en_mps[0] * north - vehicle.velocity_en_mps[1] * east
    if abs(across_mps) < 0.05:
        return None
    time_s = -across_m / across_mps
    along_m = sum(
        u * (p + v * time_s - m)
        for u, p, v, m in zip((east, north), here, vehicle.velocity_en_mps, mark_en, strict=True)
    )
    return time_s if time_s > 0.0 and along_m < 0.0 else None


def polar_of(step: Step, voyage: Voyage, config: SkipperConfig) -> values.PolarView | None:
    """Return the polar in the present wind with the boat's point, both over the water; None without a wind."""
    wind, vehicle = step.snapshot.wind, step.snapshot.vehicle
    tws_mps = wind.mean_tws_mps if wind.mean_tws_mps is not None else wind.present_tws_mps
    if tws_mps is None:
        return None
    polar = voyage.boat.polar
    no_go_rad = config.planned_no_go_rad(voyage.boat, step.snapshot.limits)
    twd_rad = wind.present_twd_from_rad
    current = step.snapshot.current.planned_en_mps
    if twd_rad is not None:
        twd_rad, tws_mps = over_water(twd_rad, tws_mps, current)
    angles, speeds = polar.curve(tws_mps)
    beat, run = best_angles(voyage.boat, round(tws_mps, 1), no_go_rad)
    has_way = vehicle is not None and twd_rad is not None
    return values.PolarView(
        name=polar.name,
        tws_mps=rounded(tws_mps),
        twa_deg=tuple(degrees(float(a)) for a in angles),
        speed_mps=tuple(rounded(float(v), 3) for v in speeds),
        beat_deg=degrees(beat),
        run_deg=degrees(run),
        live_twa_deg=signed(difference_rad(twd_rad, vehicle.heading_rad))
        if has_way and vehicle is not None and twd_rad is not None
        else None,
        live_mps=None
        if vehicle is None
        else rounded(math.hypot(*(v - c for v, c in zip(vehicle.velocity_en_mps, current, strict=True)))),
    )


def _at(forecast: WindForecast, at_s: float, name: str) -> float:
    import numpy as np

    return float(np.interp(at_s, forecast.horizon_s, getattr(forecast, name)))


SAME_M = 2.0  # a leg of the plan that ends so near a waypoint is the one that leads to it
AHEAD_STEP_S = 5.0  # between the places that the boat is expected at
MOST_AHEAD = 90  # of them


@dataclass(frozen=True, slots=True, kw_only=True)
class Chosen:
    """A plan as it was answered: when it was asked for, why, and what it says of itself."""

    t_s: float
    reason: str
    plan: Plan
    why: str = ""
    is_numbered: bool = False  # its legs are named as the mission on board numbers them


def plan_of(
    step: Step, voyage: Voyage, eta: Eta, chosen: Chosen | None, legs: tuple[Leg, ...]
) -> values.PlanView | None:
    """Return the plan that is sailed; ``legs`` are those of the plans that it was spliced from, the newest first.

    Where a field steers it is the plan that waits on board, without what is true only of a boat that sails it; where
    she was led aside it is the way that she was led, without what is true only of a plan.
    """
    route, sailed, state = step.state.mission.route, step.sailed, step.state
    if route is None:
        return None
    is_planned = route.cost_s is not None  # else she was led aside, by a way that no plan is behind
    chosen = chosen if is_planned else None
    begin, count = min(state.mission.index, len(route.items)), len(route.items)
    left = tuple(_leg(route, n, legs) for n in range(begin, count))
    tack = next_tack(step, voyage.boat)
    return values.PlanView(
        number=route.plan_id if is_planned else None,
        age_s=rounded(max(0.0, step.snapshot.t_s - route.plan_t_s), 1) if is_planned else None,
        reason="" if chosen is None else chosen.reason,
        why=(
            f"As it was made{'' if chosen.is_numbered else ', courses counted from its start'}: {chosen.why}"
            if chosen is not None and chosen.why
            else route.why
        ),
        rung=route.rung,
        bound_for=route.bound_for,
        twd_from_deg=compass(route.plan_twd_from_rad) if is_planned else None,
        tws_mps=rounded(route.plan_tws_mps) if is_planned else None,
        delta_s=rounded(route.delta_s, 4),
        promised_risk=None if sailed is None else rounded(1.0 - sailed.delta_s, 4),
        path_risk=None if sailed is None else rounded(_risk_left(sailed, left), 4),
        vessel_risk=None if sailed is None else rounded(sailed.vessel_risk, 4),
        margin_m=rounded(route.margin_m, 1),
        cost_s=rounded(route.cost_s, 1),
        median_s=rounded(route.median_s, 0),
        late_s=rounded(route.late_s, 0),
        there_s=rounded(eta.there_s, 0),
        there_late_s=rounded(eta.there_late_s, 0),
        expected_clearance_m=None if sailed is None else rounded(sailed.clearance_ahead_m(begin)),
        bound_s=_bound_s(route, chosen),
        replans=state.plans.replans,
        next_tack_s=None if tack is None else rounded(tack.in_s, 0),
        next_tack_is_planned=None if tack is None else tack.is_planned,
        leg=min(begin + 1, count) if count and sailed is not None else None,
        count=count,
        legs=left,
    )


def _bound_s(route: Route, chosen: Chosen | None) -> float | None:
    """Return what no plan is faster than [s]; None: it is not known of what is left of a plan that was kept."""
    is_whole = chosen is not None and route.cost_s == chosen.plan.cost_s
    return rounded(chosen.plan.lower_bound_s, 1) if chosen is not None and is_whole else None


def _risk_left(route: Route, left: tuple[values.LegView, ...]) -> float | None:
    """Return the chance of being forced off the plan on the legs left; a leg's own is that it happens first there."""
    risks = [leg.risk for leg in left if not leg.is_loiter]
    known = [risk for risk in risks if risk is not None]
    return route.risk if len(known) < len(risks) or not risks else min(1.0, sum(known))


def _leg(route: Route, number: int, legs: tuple[Leg, ...]) -> values.LegView:
    start, end = route.leg_from_en_m[number], route.points_en_m[number]
    is_loiter = route.items[number].command != Command.NAV_WAYPOINT
    course_rad = heading_of(end[0] - start[0], end[1] - start[1])
    known = None if is_loiter else next((leg for leg in legs if math.dist(leg.to_en, end) < SAME_M), None)
    if known is None:
        return values.LegView(
            from_en_m=place(start),
            to_en_m=place(end),
            is_loiter=is_loiter,
            course_deg=None if start == end else compass(course_rad),
            length_m=rounded(math.dist(start, end), 1),
            twa_deg=None if start == end else signed(difference_rad(route.plan_twd_from_rad, course_rad)),
        )
    return values.LegView(
        from_en_m=place(start),
        to_en_m=place(end),
        is_beat=known.is_beat,
        course_deg=compass(course_rad),
        twa_deg=signed(known.twa_rad),
        length_m=rounded(math.dist(start, end), 1),
        speed_mps=rounded(known.speed_mps),
        sigma_deg=degrees(known.sigma_rad),
        no_go_half_deg=degrees(known.no_go_half_rad),
        clearance_m=rounded(known.clearance_m),
        risk=rounded(known.risk, 4),
        manoeuvre=known.manoeuvre,
    )


def safe_end_of(route: Route | None) -> values.PlaceView | None:
    """Return where the mission on board ends: a loiter."""
    if route is None or not route.points_en_m:
        return None
    return values.PlaceView(name="safe end", at_en_m=place(route.points_en_m[-1]))


def predicted_of(eta: Eta) -> tuple[values.AheadView, ...]:
    """Return where the boat is expected: a place every few seconds, and one at each tack."""
    points: list[values.AheadView] = []
    for n, way in enumerate(eta.points):
        tack: values.Tack = "starboard" if way.is_starboard else "port"
        is_last = n == len(eta.points) - 1
        is_new = not points or way.in_s - points[-1].in_s >= AHEAD_STEP_S or points[-1].tack != tack
        if len(points) < MOST_AHEAD and (is_new or is_last):
            points.append(
                values.AheadView(
                    in_s=way.in_s, at_en_m=place(way.at_en_m), tack=tack, within_m=rounded(way.within_m, 1)
                )
            )
    return tuple(points)
