"""What is told of the way ahead: where the boat is on her leg, and when she tacks next."""

from __future__ import annotations

import math
from typing import NamedTuple, Protocol

from companion.boat import AutopilotLimits, Boat
from companion.geo.angles import difference_rad, heading_of
from companion.messages import Command, Mode
from companion.skipper.step import Phase, SkipperState, Snapshot
from companion.skipper.way import PointEn, along_m, cross_track_m, moved
from companion.words import brief_time

# A tack takes this long: who should have tacked a moment ago is tacking [s].
TACKING_S = 4.0
# Below this speed the time to a waypoint says nothing [m/s].
MIN_SPEED_MPS = 0.2
# A boat that makes less than this part of its polar's speed is gathering way, out of a tack: it will soon make it.
GATHERING_WAY = 0.8
LOSING_WAY = 0.4  # ... and in a tack, with less than this, it may fail
MANY_FAIL = 0.1  # of the tacks of a voyage: of the next nothing is promised
FOLLOWS = frozenset({Mode.AUTO, Mode.GUIDED})  # the modes in which the boat follows the legs on board


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

    @property
    def is_off_plan(self) -> bool:
        """Whether a field steers the boat, and not the plan on board."""
        ...


class OnLeg(NamedTuple):
    """How far it is to the present waypoint [m], and how far off its leg, to the right of it [m]; None: not known."""

    left_m: float | None
    off_m: float | None


def on_leg(seen: Seen) -> OnLeg:
    """Return where the boat is on its leg: as the autopilot tells, in GUIDED by her own position; by field on none.

    Steered by headings ArduRover knows of no waypoint, and tells 0 of both; in LOITER it tells of where she circles.
    """
    status, here, mission = seen.snapshot.autopilot, seen.snapshot.position_en_m, seen.state.mission
    if status is None or seen.is_off_plan or status.mode not in FOLLOWS:
        return OnLeg(None, None)
    if status.mode is not Mode.GUIDED or seen.state.steering.own_mode is not Mode.GUIDED:
        return OnLeg(status.waypoint_distance_m, status.cross_track_m)
    if here is None or mission.route is None or mission.index >= len(mission.route.points_en_m):
        return OnLeg(None, None)
    leg = mission.route.leg_from_en_m[mission.index], mission.route.points_en_m[mission.index]
    return OnLeg(math.dist(here, leg[1]), cross_track_m(here, *leg) if math.dist(*leg) > 0.0 else None)


class NextTack(NamedTuple):
    """The next tack: when she is through the wind [s], and whether it is the plan's and stays so.

    Else it is the autopilot's own, at or behind a waypoint for which a new plan is asked for on the way there, or one
    that may fail.
    """

    in_s: float
    is_planned: bool

    @property
    def words(self) -> str:
        """When it is, as console and radio tell it."""
        return f"{'' if self.is_planned else 'about '}{brief_time(self.in_s)}"


def next_tack_s(seen: Seen, boat: Boat) -> float | None:
    """Return the time until the next tack [s]; None: there is none, or no way on."""
    found = next_tack(seen, boat)
    return None if found is None else found.in_s


def next_tack(seen: Seen, boat: Boat) -> NextTack | None:
    """Return the next tack, planned or the autopilot's own; None: there is none, no way on, she is held, or by field.

    Nor has a boat one that does not get through the wind, or that goes under motor: she turns as she likes.
    On a leg inside its no-go zone the autopilot beats: it keeps the tack that it comes on until the edge of its
    corridor, or until the other tack fetches the waypoint; in GUIDED it does not beat, and such a leg is planned anew.
    The end of a mission, a loiter, is no course. Legs ahead are sailed at what the boat has shown of the polar's speed,
    this one at its own, once it has way on.
    """
    route, snapshot, status = seen.state.mission.route, seen.snapshot, seen.snapshot.autopilot
    vehicle, here, wind = snapshot.vehicle, snapshot.position_en_m, snapshot.wind
    wind_rad = wind.mean_twd_from_rad if wind.present_twd_from_rad is None else wind.present_twd_from_rad
    tws_mps = wind.mean_tws_mps if wind.present_tws_mps is None else wind.present_tws_mps
    if (
        route is None
        or not boat.tacks
        or seen.state.adrift.motor
        or seen.is_off_plan
        or seen.state.phase is Phase.HOLDING
        or (status is not None and status.mode not in FOLLOWS)
        or wind_rad is None
        or tws_mps is None
        or vehicle is None
        or here is None
        or (vehicle.speed_mps < MIN_SPEED_MPS)
    ):
        return None
    limits = snapshot.limits or AutopilotLimits()
    no_go_rad, begin = limits.sail_no_go_angle_rad, seen.state.mission.index
    legs = [
        (start, end)
        for item, start, end in zip(
            route.items[begin:], route.leg_from_en_m[begin:], route.points_en_m[begin:], strict=True
        )
        if item.command == Command.NAV_WAYPOINT
    ]
    tack_rad = difference_rad(wind_rad, vehicle.heading_rad)
    side = tack_rad > 0.0
    time_s = 0.0
    for number, leg in enumerate(legs):
        start, end = (here, leg[1]) if number == 0 else leg
        off_rad = difference_rad(wind_rad, heading_of(end[0] - start[0], end[1] - start[1]))
        is_closed = abs(off_rad) < no_go_rad
        expected_mps = snapshot.speed_seen.share * boat.polar.speed_mps(max(abs(off_rad), no_go_rad), tws_mps)
        if not is_closed and (off_rad > 0.0) != side and abs(off_rad) < math.pi / 2.0:
            # Of the leg that is sailed, too: the boat is turning to it.
            is_planned = _tacks_come_off(seen.state) and (
                vehicle.speed_mps > LOSING_WAY * expected_mps
                if number == 0
                else number == 1 and not _is_to_be_planned(seen.state)
            )
            return NextTack(time_s + abs(tack_rad) / boat.turn_rate_radps, is_planned)
        speed_mps = max(MIN_SPEED_MPS, expected_mps)
        has_way = number == 0 and vehicle.speed_mps > GATHERING_WAY * speed_mps
        if is_closed:
            if status is not None and status.mode is Mode.GUIDED:
                return None
            close_rad = wind_rad - no_go_rad if side else wind_rad + no_go_rad
            velocity_en = vehicle.velocity_en_mps if has_way else moved((0.0, 0.0), close_rad, speed_mps)
            own_s = _own_tack_s(start, velocity_en, leg, wind_rad, side=side, limits=limits)
            if own_s is None:
                return None
            if _is_fetched((start[0] + own_s * velocity_en[0], start[1] + own_s * velocity_en[1]), leg, limits):
                time_s += own_s
                continue
            turn_s = no_go_rad / boat.turn_rate_radps
            return NextTack(time_s + own_s + turn_s, is_planned=False)
        side, tack_rad = off_rad > 0.0, off_rad
        time_s += math.dist(start, end) / (vehicle.speed_mps if has_way else speed_mps)
    return None


def _is_to_be_planned(state: SkipperState) -> bool:
    """Return whether what follows the present waypoint is being planned, or will be on the way there."""
    route, index = state.mission.route, state.mission.index
    is_asked = state.plans.replanned_index >= index
    return state.pending.plan is not None or (route is not None and route.is_planned_from(index) and not is_asked)


def _tacks_come_off(state: SkipperState) -> bool:
    """Return whether the next tack will come off, by what those of this voyage have told."""
    tacking = state.tacking
    return not tacking.is_counted and tacking.failed <= MANY_FAIL * tacking.tried


def _is_fetched(there: PointEn, leg: tuple[PointEn, PointEn], limits: AutopilotLimits) -> bool:
    """Return whether a boat that is there has reached the end of a leg: beside it, or beyond.

    On a leg that is closed by a degree or two she fetches the waypoint without a tack.
    """
    return along_m(there, *leg) >= math.dist(*leg) - max(limits.wp_radius_m, limits.turn_radius_m)


def _own_tack_s(
    here: PointEn,
    velocity_en: PointEn,
    leg: tuple[PointEn, PointEn],
    wind_rad: float,
    *,
    side: bool,
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
