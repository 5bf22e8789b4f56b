"""The companion's status as one value, from a step: what goes over the radio and to whoever watches."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from companion.fold import Step
from companion.geo.angles import wrap_two_pi
from companion.messages import CompanionStatus, TrafficStatus
from companion.skipper.planning import next_tack_s
from companion.skipper.step import Announce, Phase, Route, Severity
from companion.skipper.way import Voyage, gates_of
from companion.telemetry.folder.records import sigma_ahead_rad
from companion.telemetry.folder.summary import VoyageFigures
from companion.traffic import TrafficCounts
from companion.traffic.feeds import AisFeed


def companion_status(
    step: Step, voyage: Voyage, figures: VoyageFigures, clearance_m: float | None, bytes_out_per_s: float | None,
    feeds: Sequence[AisFeed] = (), ais_dropped: int = 0,
) -> CompanionStatus:
    """Return the status at ``step``. The wind's spread is that of a minute ahead, which the plan lives on."""
    snapshot, state = step.snapshot, step.state
    autopilot, wind, route, vehicle = snapshot.autopilot, snapshot.wind, state.route, snapshot.vehicle
    legs = voyage.legs
    gates = gates_of(voyage, state.approaches)
    goal = gates[state.gate].goal if state.gate < len(gates) else len(legs) - 1
    here = snapshot.position_en_m
    code, text = _alert(step)
    tws_sigma = None if wind.forecast is None else float(wind.forecast.sigma_tws_mps[0])
    return CompanionStatus(
        t_s=snapshot.t_s,
        state=state.phase.value,
        goal_index=goal,
        goal_count=len(legs),
        waypoint_seq=state.index + 1 if route is not None else None,
        waypoint_count=None if route is None else len(route.items),
        waypoint_distance_m=None if autopilot is None else autopilot.waypoint_distance_m,
        goal_distance_m=None if here is None else math.dist(here, legs[goal].en_m),
        cross_track_m=None if autopilot is None else autopilot.cross_track_m,
        clearance_m=clearance_m,
        twd_from_rad=None if wind.mean_twd_from_rad is None else wrap_two_pi(wind.mean_twd_from_rad),
        twd_sigma_rad=sigma_ahead_rad(snapshot),
        tws_mps=wind.mean_tws_mps,
        tws_sigma_mps=tws_sigma,
        current_set_rad=snapshot.current.set_rad if snapshot.current.is_significant else None,
        current_drift_mps=snapshot.current.drift_mps if snapshot.current.is_significant else None,
        next_tack_s=next_tack_s(step, voyage.boat.polar),
        promised_risk=None if route is None else risk_of(route),
        plan_id=None if route is None else route.plan_id,
        plan_age_s=None if route is None else max(0.0, snapshot.t_s - route.plan_t_s),
        replans=state.replans,
        tacks=figures.tacks,
        battery_v=None if autopilot is None else autopilot.battery_v,
        position=None if vehicle is None else vehicle.position,
        bytes_out_per_s=bytes_out_per_s,
        traffic=traffic_status(step, feeds, ais_dropped),
        order="" if state.standing is None else state.standing.verb.value,
        order_age_s=None if state.standing is None else state.standing.age_s(snapshot.t_s),
        alert_code=code,
        alert_text=text,
    )


def traffic_status(step: Step, feeds: Sequence[AisFeed], dropped: int) -> TrafficStatus | None:
    """Return what is seen of other vessels, the worst one's figures; None when nobody was heard and no feed is open."""
    picture = step.snapshot.traffic
    if picture is None and not feeds:
        return None
    counts = TrafficCounts() if picture is None else picture.counts
    route = step.state.route
    seen = TrafficStatus(
        vessels=0 if picture is None else len(picture.vessels),
        refused=counts.stale + counts.far + dropped + sum(feed.counts.refused for feed in feeds),
        feeds=len(feeds), silent_feeds=sum(feed.is_silent for feed in feeds), shared_mmsi=counts.shared_mmsi,
        clock_jumps=counts.clock_jumps, silence_s=None if picture is None else picture.silence_s,
        promised_risk=None if route is None else route.vessels_part,
        path_risk=None if route is None else route.vessel_risk,
    )
    if not step.state.watch:
        return seen
    worst = step.state.watch[0]
    approach = worst.approach
    return replace(
        seen, name=worst.vessel.label, alarm=worst.alarm.name.lower(), role=worst.encounter.role.value,
        rule=worst.encounter.rule.value, range_m=approach.now_m, bearing_rad=approach.bearing_rad,
        cpa_m=approach.distance_m, tcpa_s=approach.time_s if approach.is_closing else None)


def risk_of(route: Route) -> float:
    """Return what the plan promised: the probability, at each instant, of the no-go zone or a vessel too near."""
    return 1.0 - route.delta_s


def _alert(step: Step) -> tuple[str, str]:
    """Return the loudest thing said in this step, else the raised watchdog, else the sentence of the state."""
    said = [a for a in step.actions if isinstance(a, Announce) and a.severity <= Severity.WARNING]
    if said:
        worst = min(said, key=lambda a: a.severity)
        return worst.code, worst.text
    if step.state.raised:
        return step.state.raised[0].name, step.state.why
    if step.state.phase in {Phase.HOLDING, Phase.OPERATOR}:
        return step.state.phase.value, step.state.why
    return "", step.state.why
