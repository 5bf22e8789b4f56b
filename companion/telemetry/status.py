"""The companion's status as one value, from a step: what goes over the radio and to whoever watches."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from companion.boat import AutopilotLimits
from companion.boat.polar import Polar
from companion.fold import Step
from companion.geo.angles import difference_rad, heading_of, wrap_two_pi
from companion.messages import Command, CompanionStatus, TrafficStatus
from companion.skipper.step import Announce, Phase, Route, Severity
from companion.skipper.way import PointEn, Voyage, cross_track_m, moved
from companion.telemetry.folder.records import sigma_ahead_rad
from companion.telemetry.folder.summary import VoyageFigures
from companion.traffic import TrafficCounts
from companion.traffic.feeds import AisFeed

# A tack takes this long: who should have tacked a moment ago is tacking [s].
TACKING_S = 4.0
# Below this speed the time to a waypoint says nothing [m/s].
MIN_SPEED_MPS = 0.2
# A boat that makes less than this part of her polar's speed is gathering way, out of a tack: she will soon make it.
GATHERING_WAY = 0.8


def companion_status(
    step: Step, voyage: Voyage, figures: VoyageFigures, clearance_m: float | None, bytes_out_per_s: float | None,
    feeds: Sequence[AisFeed] = (), ais_dropped: int = 0,
) -> CompanionStatus:
    """Return the status at ``step``. The wind's spread is that of a minute ahead, which the plan lives on."""
    snapshot, state = step.snapshot, step.state
    autopilot, wind, route, vehicle = snapshot.autopilot, snapshot.wind, state.route, snapshot.vehicle
    legs = voyage.legs
    goal = min(len(state.reached), len(legs) - 1)
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


def next_tack_s(step: Step, polar: Polar) -> float | None:
    """Return the time until the next tack [s], planned or the autopilot's own; None: there is none, or no way on.

    On a leg inside its no-go zone the autopilot beats: it keeps the tack that it comes on until the edge of its
    corridor, or until the other tack fetches the waypoint. The end of a mission, a loiter, is no course. Legs ahead
    are sailed at the polar's speed, this one at the boat's own, once she has way on.
    """
    route, snapshot = step.state.route, step.snapshot
    vehicle, here, wind = snapshot.vehicle, snapshot.position_en_m, snapshot.wind
    wind_rad = wind.mean_twd_from_rad if wind.present_twd_from_rad is None else wind.present_twd_from_rad
    tws_mps = wind.mean_tws_mps if wind.present_tws_mps is None else wind.present_tws_mps
    if route is None or wind_rad is None or tws_mps is None or vehicle is None or here is None or (
            vehicle.speed_mps < MIN_SPEED_MPS):
        return None
    limits = snapshot.limits or AutopilotLimits()
    no_go_rad, begin = limits.sail_no_go_angle_rad, step.state.index
    legs = [
        (start, end) for item, start, end in zip(
            route.items[begin:], route.leg_from_en_m[begin:], route.points_en_m[begin:], strict=True)
        if item.command == Command.NAV_WAYPOINT
    ]
    side = difference_rad(wind_rad, vehicle.heading_rad) > 0.0
    time_s = 0.0
    for number, leg in enumerate(legs):
        start, end = (here, leg[1]) if number == 0 else leg
        off_rad = difference_rad(wind_rad, heading_of(end[0] - start[0], end[1] - start[1]))
        is_closed = abs(off_rad) < no_go_rad
        if number and not is_closed and (off_rad > 0.0) != side and abs(off_rad) < math.pi / 2.0:
            return time_s
        speed_mps = max(MIN_SPEED_MPS, polar.speed_mps(max(abs(off_rad), no_go_rad), tws_mps))
        has_way = number == 0 and vehicle.speed_mps > GATHERING_WAY * speed_mps
        if is_closed:
            close_rad = wind_rad - no_go_rad if side else wind_rad + no_go_rad
            velocity_en = vehicle.velocity_en_mps if has_way else moved((0.0, 0.0), close_rad, speed_mps)
            own_s = _own_tack_s(start, velocity_en, leg, wind_rad, side=side, limits=limits)
            return None if own_s is None else time_s + own_s
        side = off_rad > 0.0
        time_s += math.dist(start, end) / (vehicle.speed_mps if has_way else speed_mps)
    return None


def _own_tack_s(
    here: PointEn, velocity_en: PointEn, leg: tuple[PointEn, PointEn], wind_rad: float, *, side: bool,
    limits: AutopilotLimits,
) -> float | None:
    """Return when a boat that beats along a leg meets its corridor's edge or the layline [s]; ``side``: as off_rad."""
    times = []
    in_a_second = (here[0] + velocity_en[0], here[1] + velocity_en[1])
    off_m = cross_track_m(here, *leg)
    out_mps = cross_track_m(in_a_second, *leg) - off_m
    if limits.sail_xtrack_max_m > 0.0 and abs(out_mps) > MIN_SPEED_MPS / 2.0:
        times.append((math.copysign(limits.sail_xtrack_max_m, out_mps) - off_m) / out_mps)
    # The course of the other tack that leads to the waypoint, and how soon the boat is on it.
    other_rad = wind_rad + (limits.sail_no_go_angle_rad if side else -limits.sail_no_go_angle_rad)
    layline = (moved(leg[1], other_rad, -1.0), leg[1])
    gap_m = cross_track_m(here, *layline)
    closing_mps = gap_m - cross_track_m(in_a_second, *layline)
    if abs(closing_mps) > MIN_SPEED_MPS / 2.0:
        times.append(gap_m / closing_mps)
    ahead = [max(0.0, t) for t in times if t > -TACKING_S]
    return min(ahead, default=None)


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
