"""What the watchdogs watch: one figure for each row of the table, in its unit."""

from __future__ import annotations

import math
from collections.abc import Callable

from companion.geo.angles import difference_rad
from companion.geo.sun import sun_height_rad
from companion.skipper.deeds.adrift import meets_in_s, sails
from companion.skipper.deeds.by_field import meets_in
from companion.skipper.planning.autopilot_beats import beaten_within_m
from companion.skipper.planning.errands import errand, is_composed
from companion.skipper.step.causes import STOPPING
from companion.skipper.step.route import Kind
from companion.skipper.step.snapshot import WindHealth
from companion.skipper.step.turn import JUMP_M, Turn
from companion.skipper.step.wind_limits import too_light, too_strong
from companion.skipper.watch.watchdogs import BY_NAME
from companion.skipper.way.geometry import along_m, cross_track_m, distance_m

IRONS_TWA_RAD = math.radians(35.0)
IRONS_TWS_MPS = 1.5            # less wind than this is a calm, not irons
MOVING_MPS = 0.5
PROGRESS_WINDOW_S = 180.0


def measure(turn: Turn, name: str) -> float | None:
    """Return the watched figure in the table's unit, None when it cannot be told now."""
    return _MEASURES[name](turn)


def _flag(value: bool | None) -> float | None:
    return None if value is None else float(value)


def _link(turn: Turn) -> float | None:
    return turn.snapshot.heartbeat_age_s


def _position_lost(turn: Turn) -> float | None:
    return turn.snapshot.vehicle_age_s


def _jump(turn: Turn) -> float | None:
    if turn.snapshot.position_en_m is None:
        return None
    # it lasts as long as the doubt
    return turn.jump_m if turn.state.position.doubt is None else max(turn.jump_m, JUMP_M)


def _wind(turn: Turn) -> float | None:
    health = turn.snapshot.wind.health
    return float(health is WindHealth.UNTRUSTED or (health is WindHealth.NONE and turn.state.voyage.sailing))


def _contradicted(turn: Turn) -> float | None:
    return float(bool(turn.snapshot.unsure))


def _becalmed(turn: Turn) -> float | None:
    wind = turn.wind_mean
    if wind is None:
        return None
    return max(wind[1], BY_NAME["becalmed"].exit) if sails(turn) else wind[1]


def _irons(turn: Turn) -> float | None:
    wind, vehicle = turn.wind_now, turn.snapshot.vehicle
    if wind is None or vehicle is None or wind[1] < IRONS_TWS_MPS or turn.boat_en is None or not turn.config.sails:
        return None
    if abs(difference_rad(wind[0], vehicle.heading_rad)) > IRONS_TWA_RAD:
        return BY_NAME["in irons"].exit
    east, north = turn.through_en_mps
    return max(0.0, east * math.sin(vehicle.heading_rad) + north * math.cos(vehicle.heading_rad))


def _too_near(turn: Turn) -> float | None:
    met = meets_in(turn)
    return None if met is None else met[0]


def _progress(turn: Turn) -> float | None:
    """Way made good in the window; None before the window is full or while there is a reason to stand still."""
    if turn.is_raised("becalmed") or not turn.ahead() or not turn.state.progress.history:
        return None
    if turn.state.mission.route is None or turn.state.progress.history_plan != turn.state.mission.route.plan_id:
        return None   # the history is of the plan before
    old = turn.state.progress.history[0]
    if turn.t_s - old[0] < PROGRESS_WINDOW_S:
        return None
    return old[3] - turn.state.progress.history[-1][3]


def _heading(turn: Turn) -> float | None:
    vehicle = turn.snapshot.vehicle
    if vehicle is None or turn.boat_en is None:
        return None
    velocity = turn.through_en_mps
    if math.hypot(*velocity) < MOVING_MPS:
        return 0.0
    return math.degrees(abs(difference_rad(math.atan2(*velocity), vehicle.heading_rad)))


def corridor_m(turn: Turn) -> float:
    """Return how far off its leg the boat may be before the margin's floor is in question [m]."""
    route = turn.state.mission.route
    margin = route.margin_m if route is not None else turn.config.margin_m
    return max(margin - turn.config.margin_floor_m, turn.config.manoeuvre_m)


def _corridor(turn: Turn) -> float | None:
    """Share of the corridor used; in open water the grid size bounds it, not the margin, and a beat its own boards."""
    boat, leg = turn.boat_en, turn.leg()
    if boat is None or leg is None or not turn.ahead() or turn.state.steering.own_mode in STOPPING or is_composed(turn):
        return None      # stopped, or by a field of her own, she follows no leg
    if distance_m(*leg) < 1.0:
        return 0.0
    if along_m(boat, *leg) < 0.0:
        # Before its leg begins: by a little wherever a waypoint is announced early, by more after a jump.
        off = max(0.0, distance_m(boat, leg[0]) - 2.0 * turn.config.announce_m)
    else:
        off = abs(cross_track_m(boat, *leg))
    clearance = turn.voyage.area.path_clearance_m([boat, leg[1]])
    allowed = max(turn.config.grid_size_m, beaten_within_m(turn))
    if clearance < turn.config.margin_floor_m:
        allowed = min(allowed, corridor_m(turn))
    return off / allowed


def _stuck(turn: Turn) -> float | None:
    passed = turn.state.mission.passed_since_s
    return None if passed is None else turn.t_s - passed


def _ended(turn: Turn) -> float | None:
    route = turn.state.mission.route
    if route is None or turn.gate is None or turn.autopilot is None or errand(turn) is not None or (
        is_composed(turn)):
        return None
    return float(turn.state.mission.index >= len(route.items) - 1 or turn.autopilot.mission_state.name == "COMPLETE")


def _breach(turn: Turn) -> float | None:
    return _flag(turn.autopilot.fence_breached) if turn.autopilot is not None else None


def _foreign(turn: Turn) -> float | None:
    return float(bool(turn.state.mission.foreign))


def _reboot(turn: Turn) -> float | None:
    return float(turn.state.vehicle.rebooted)


def _battery(turn: Turn, name: str, *, is_below: bool) -> float | None:
    """Return the charge, no more than the row's entry where the autopilot's own limit is passed."""
    status = turn.autopilot
    if status is None:
        return None
    charge = None if status.battery_remaining is None else 100.0 * status.battery_remaining
    return min(charge if charge is not None else 100.0, BY_NAME[name].enter) if is_below else charge


def _battery_low(turn: Turn) -> float | None:
    is_below = turn.autopilot is not None and bool(turn.autopilot.battery_failed)
    return _battery(turn, "battery low", is_below=is_below)


def _battery_critical(turn: Turn) -> float | None:
    status, least_v = turn.autopilot, turn.config.ends.battery_v
    volts = status.battery_v if status is not None else None
    is_empty = least_v is not None and volts is not None and volts <= least_v
    is_short = turn.state.alarms.charge is not None and turn.state.alarms.charge.is_short
    is_below = turn.state.alarms.battery_critical or is_empty or is_short
    return _battery(turn, "battery critical", is_below=is_below)


def _leak(turn: Turn) -> float | None:
    return _flag(turn.autopilot.leaks) if turn.autopilot is not None else None


def _dark(turn: Turn) -> float | None:
    status, vehicle = turn.autopilot, turn.snapshot.vehicle
    if status is None or vehicle is None or status.utc_at_boot_s is None or status.boot_s is None:
        return None
    height_rad = sun_height_rad(
        math.radians(vehicle.position.lat_deg), math.radians(vehicle.position.lon_deg),
        status.utc_at_boot_s + status.boot_s)
    return math.degrees(height_rad - turn.config.ends.dark_below_rad)


def _shore(turn: Turn) -> float | None:
    age_s = turn.snapshot.shore_age_s
    return None if age_s is None else age_s / turn.config.ends.shore_lost_s


def _time(turn: Turn) -> float | None:
    limit_s = turn.config.voyage_timeout_s
    return None if limit_s is None else turn.state.voyage.under_way_s / limit_s


def _dragged(turn: Turn) -> float | None:
    rest, boat = turn.state.voyage.rest_en_m, turn.boat_en
    if rest is None or boat is None:
        return None
    bound = errand(turn)
    return distance_m(boat, rest) if bound is None or bound.kind is Kind.REST else None


def _planner(turn: Turn) -> float | None:
    return float(not turn.snapshot.planner_alive)


def _fence_off(turn: Turn) -> float | None:
    return None if turn.autopilot is None else float(turn.autopilot.fence_on is False)


_MEASURES: dict[str, Callable[[Turn], float | None]] = {
    "link silent": _link, "position lost": _position_lost, "position jump": _jump, "wind untrusted": _wind,
    "wind contradicted": _contradicted,
    "strong wind": too_strong, "light wind": too_light,
    "becalmed": _becalmed, "drifting": meets_in_s, "in irons": _irons, "vessel too near": _too_near,
    "no progress": _progress,
    "heading against course": _heading, "off the corridor": _corridor, "stuck waypoint": _stuck,
    "mission ended": _ended, "fence breach": _breach, "fence off": _fence_off, "foreign mission": _foreign,
    "reboot": _reboot,
    "battery low": _battery_low, "battery critical": _battery_critical, "out of time": _time, "dragged off": _dragged,
    "planner dead": _planner, "leaking": _leak, "dark": _dark, "shore lost": _shore,
}
