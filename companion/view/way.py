"""The way in the view: the plan with its legs and risks, and where she is expected along it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from companion.boat import AutopilotLimits
from companion.fold import Step
from companion.geo.angles import difference_rad, heading_of
from companion.messages import Command, Mode
from companion.planner import Leg, Plan
from companion.skipper.planning import next_tack_s
from companion.skipper.step import Route
from companion.skipper.way import PointEn, Voyage, cross_track_m, moved
from companion.view import air, values
from companion.view.numbers import compass, degrees, place, rounded, signed, tack_of

SAME_M = 2.0          # a leg of the plan that ends so near a waypoint is the one that leads to it
AHEAD_S = 900.0       # she is shown so far ahead ...
AHEAD_STEP_S = 5.0    # ... reckoned in these steps
MOST_AHEAD = 90       # points of it
SLOW_MPS = 0.2


@dataclass(frozen=True, slots=True, kw_only=True)
class Chosen:
    """A plan as it was answered: when it was asked for, why, and what it says of itself."""

    t_s: float
    reason: str
    plan: Plan
    why: str = ""


def plan_of(step: Step, voyage: Voyage, chosen: Chosen | None, legs: tuple[Leg, ...]) -> values.Plan | None:
    """Return the plan that is sailed; ``legs`` are those of the plans that it was spliced from, the newest first."""
    route, state = step.state.route, step.state
    if route is None:
        return None
    begin, count = min(state.index, len(route.items)), len(route.items)
    return values.Plan(
        number=route.plan_id, age_s=rounded(max(0.0, step.snapshot.t_s - route.plan_t_s), 1),
        reason="" if chosen is None else chosen.reason,
        why=(chosen.why if chosen is not None and chosen.why else route.why), rung=route.rung,
        bound_for=route.bound_for, twd_from_deg=compass(route.plan_twd_from_rad), tws_mps=rounded(route.plan_tws_mps),
        delta_s=rounded(route.delta_s, 4), promised_risk=rounded(1.0 - route.delta_s, 4),
        path_risk=rounded(route.risk, 4), vessel_risk=rounded(route.vessel_risk, 4),
        margin_m=rounded(route.margin_m, 1), cost_s=rounded(route.cost_s, 1),
        median_s=rounded(route.median_s, 0), late_s=rounded(route.late_s, 0),
        expected_clearance_m=rounded(route.expected_clearance_m, 1),
        bound_s=None if chosen is None else rounded(chosen.plan.lower_bound_s, 1), replans=state.replans,
        next_tack_s=rounded(next_tack_s(step, voyage.boat.polar), 0),
        leg=min(begin + 1, count) if count else None, count=count,
        legs=tuple(_leg(route, n, legs) for n in range(begin, count)))


def _leg(route: Route, number: int, legs: tuple[Leg, ...]) -> values.Leg:
    start, end = route.leg_from_en_m[number], route.points_en_m[number]
    is_loiter = route.items[number].command != Command.NAV_WAYPOINT
    course_rad = heading_of(end[0] - start[0], end[1] - start[1])
    known = None if is_loiter else next((leg for leg in legs if math.dist(leg.to_en, end) < SAME_M), None)
    if known is None:
        return values.Leg(
            from_en_m=place(start), to_en_m=place(end), is_loiter=is_loiter,
            course_deg=None if start == end else compass(course_rad), length_m=rounded(math.dist(start, end), 1),
            twa_deg=None if start == end else signed(difference_rad(route.plan_twd_from_rad, course_rad)))
    return values.Leg(
        from_en_m=place(start), to_en_m=place(end), is_beat=known.is_beat, course_deg=compass(course_rad),
        twa_deg=signed(known.twa_rad), length_m=rounded(math.dist(start, end), 1), speed_mps=rounded(known.speed_mps),
        starts_s=rounded(known.start_s, 1), ends_s=rounded(known.end_s, 1), sigma_deg=degrees(known.sigma_rad),
        no_go_half_deg=degrees(known.no_go_half_rad), clearance_m=rounded(known.clearance_m, 1),
        risk=rounded(known.risk, 4), manoeuvre=known.manoeuvre)


def safe_end_of(route: Route | None) -> values.Place | None:
    """Return where the mission on board ends: a loiter."""
    if route is None or not route.points_en_m:
        return None
    return values.Place(name="safe end", at_en_m=place(route.points_en_m[-1]))


def predicted_of(step: Step, voyage: Voyage) -> tuple[values.Ahead, ...]:
    """Return where she is expected: along the legs left, at her polar's speed, beating where the wind asks for it.

    As the autopilot steers: straight to the waypoint where it can be sailed, else close-hauled within its corridor.
    GUIDED has none.
    """
    snapshot, state, route = step.snapshot, step.state, step.state.route
    here, wind, vehicle = snapshot.position_en_m, snapshot.wind, snapshot.vehicle
    twd_rad, tws_mps = wind.mean_twd_from_rad, wind.mean_tws_mps
    if here is None or vehicle is None or route is None or twd_rad is None or tws_mps is None or not state.sailing \
            or state.over:
        return ()
    limits = snapshot.limits or AutopilotLimits()
    if snapshot.autopilot is not None and snapshot.autopilot.mode is Mode.GUIDED:
        limits = replace(limits, sail_xtrack_max_m=0.0)
    legs = [(start, end) for item, start, end in zip(
        route.items[state.index:], route.leg_from_en_m[state.index:], route.points_en_m[state.index:], strict=True)
        if item.command == Command.NAV_WAYPOINT]
    walker = _Walker(twd_rad, tws_mps, voyage, limits, is_right=difference_rad(twd_rad, vehicle.heading_rad) > 0.0)
    at, time_s = here, 0.0
    points = [values.Ahead(in_s=0.0, at_en_m=place(at), tack=tack_of(difference_rad(twd_rad, vehicle.heading_rad)))]
    for start, end in legs:
        while time_s < AHEAD_S and len(points) < MOST_AHEAD:
            to_go_m = math.dist(at, end)
            course_rad, speed_mps = walker.steer(at, start, end)
            step_s = min(AHEAD_STEP_S, to_go_m / speed_mps)
            at = moved(at, course_rad, speed_mps * step_s)
            time_s += step_s
            if to_go_m <= max(limits.wp_radius_m, speed_mps * step_s):
                break
            if len(points) < 2 or time_s - points[-1].in_s >= AHEAD_STEP_S or points[-1].tack != walker.tack:
                points.append(values.Ahead(in_s=round(time_s, 1), at_en_m=place(at), tack=walker.tack))
        points.append(values.Ahead(in_s=round(time_s, 1), at_en_m=place(at), tack=walker.tack))
        if time_s >= AHEAD_S or len(points) >= MOST_AHEAD:
            break
    return tuple(points)


class _Walker:
    """Steers as the autopilot does in a steady wind; ``is_right``: the wind is to the right of the bow."""

    def __init__(
        self, twd_rad: float, tws_mps: float, voyage: Voyage, limits: AutopilotLimits, *, is_right: bool,
    ) -> None:
        self._twd_rad, self._tws_mps, self._polar, self._limits = twd_rad, tws_mps, voyage.boat.polar, limits
        self._is_right = is_right

    @property
    def tack(self) -> air.Tack:
        """The tack that she is on."""
        return "starboard" if self._is_right else "port"

    def steer(self, at: PointEn, start: PointEn, end: PointEn) -> tuple[float, float]:
        """Return the course [rad] and speed [m/s] from ``at`` along the leg."""
        no_go_rad = self._limits.sail_no_go_angle_rad
        course_rad = heading_of(end[0] - at[0], end[1] - at[1])
        off_rad = difference_rad(self._twd_rad, course_rad)
        if abs(off_rad) < no_go_rad:
            self._tack_at(at, start, end)
            course_rad = self._twd_rad - no_go_rad if self._is_right else self._twd_rad + no_go_rad
            off_rad = no_go_rad
        else:
            self._is_right = off_rad > 0.0
        return course_rad, max(SLOW_MPS, self._polar.speed_mps(off_rad, self._tws_mps))

    def _tack_at(self, at: PointEn, start: PointEn, end: PointEn) -> None:
        """Tack at the corridor's edge, as the autopilot does."""
        most_m, off_m = self._limits.sail_xtrack_max_m, cross_track_m(at, start, end)
        if most_m <= 0.0 or abs(off_m) < most_m:
            return
        no_go_rad = self._limits.sail_no_go_angle_rad
        course_rad = self._twd_rad - no_go_rad if self._is_right else self._twd_rad + no_go_rad
        if abs(cross_track_m(moved(at, course_rad, 1.0), start, end)) > abs(off_m):
            self._is_right = not self._is_right
