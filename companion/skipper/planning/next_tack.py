"""When she tacks next: planned, or the autopilot's own on a leg that it beats."""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

from companion.boat import AutopilotLimits, Polar
from companion.geo.angles import difference_rad, heading_of
from companion.messages import Command, Mode
from companion.skipper.step.snapshot import Snapshot
from companion.skipper.step.state import SkipperState
from companion.skipper.way.geometry import cross_track_m, moved
from companion.skipper.way.voyage import PointEn

# A tack takes this long: who should have tacked a moment ago is tacking [s].
TACKING_S = 4.0
# Below this speed the time to a waypoint says nothing [m/s].
MIN_SPEED_MPS = 0.2
# A boat that makes less than this part of her polar's speed is gathering way, out of a tack: she will soon make it.
GATHERING_WAY = 0.8


class Seen(Protocol):
    """A step, being made or made: what was seen and what is remembered."""

    @property
    def snapshot(self) -> Snapshot:
        """What was seen."""
        ...

    @property
    def state(self) -> SkipperState:
        """What is remembered."""
        ...


class NextTack(NamedTuple):
    """The next tack: when [s], and whether the plan has it; else it is the autopilot's own."""

    in_s: float
    is_planned: bool


def next_tack_s(seen: Seen, polar: Polar) -> float | None:
    """Return the time until the next tack [s]; None: there is none, or no way on."""
    found = next_tack(seen, polar)
    return None if found is None else found.in_s


def next_tack(seen: Seen, polar: Polar) -> NextTack | None:
    """Return the next tack, planned or the autopilot's own; None: there is none, or no way on.

    On a leg inside its no-go zone the autopilot beats: it keeps the tack that it comes on until the edge of its
    corridor, or until the other tack fetches the waypoint; in GUIDED it does not beat, and such a leg is planned anew.
    The end of a mission, a loiter, is no course. Legs ahead are sailed at the polar's speed, this one at the boat's
    own, once she has way on.
    """
    route, snapshot = seen.state.mission.route, seen.snapshot
    vehicle, here, wind = snapshot.vehicle, snapshot.position_en_m, snapshot.wind
    wind_rad = wind.mean_twd_from_rad if wind.present_twd_from_rad is None else wind.present_twd_from_rad
    tws_mps = wind.mean_tws_mps if wind.present_tws_mps is None else wind.present_tws_mps
    if route is None or wind_rad is None or tws_mps is None or vehicle is None or here is None or (
            vehicle.speed_mps < MIN_SPEED_MPS):
        return None
    limits = snapshot.limits or AutopilotLimits()
    no_go_rad, begin = limits.sail_no_go_angle_rad, seen.state.mission.index
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
            return NextTack(time_s, is_planned=True)
        speed_mps = max(MIN_SPEED_MPS, polar.speed_mps(max(abs(off_rad), no_go_rad), tws_mps))
        has_way = number == 0 and vehicle.speed_mps > GATHERING_WAY * speed_mps
        if is_closed:
            if snapshot.autopilot is not None and snapshot.autopilot.mode is Mode.GUIDED:
                return None
            close_rad = wind_rad - no_go_rad if side else wind_rad + no_go_rad
            velocity_en = vehicle.velocity_en_mps if has_way else moved((0.0, 0.0), close_rad, speed_mps)
            own_s = _own_tack_s(start, velocity_en, leg, wind_rad, side=side, limits=limits)
            return None if own_s is None else NextTack(time_s + own_s, is_planned=False)
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
