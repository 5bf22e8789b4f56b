"""What the watchdogs watch: one figure for each row of the table, in its unit."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

from companion.frozen import changed
from companion.geo.angles import difference_rad
from companion.messages import Severity
from companion.safety import BY_NAME, JUMP_M, STOPPING, Watchdog
from companion.skipper.behaviors.drifting import meets_in_s, sails
from companion.skipper.behaviors.field_guidance import meets_in
from companion.skipper.behaviors.shoaling import depth_ahead_m
from companion.skipper.planning.autopilot_beats import beaten_within_m
from companion.skipper.planning.diversions import diversion, home_trouble, is_composed, off_place_m
from companion.skipper.planning.fallback import to_go
from companion.skipper.step import StepContext, WindHealth
from companion.skipper.step.state import Charge
from companion.skipper.step.wind_limits import too_light, too_strong
from companion.skipper.way.geometry import along_m, bearing_rad, cross_track_m, distance_m, moved

_J2000_UNIX_S = 946_728_000.0  # 2000-01-01 12:00 UTC
_DAY_S = 86_400.0


def sun_height_rad(lat_rad: float, lon_rad: float, unix_s: float) -> float:
    """Return how high the sun's centre stands over the horizon, negative below it, without refraction [rad].

    The almanac's low-precision formula (U.S. Naval Observatory, Astronomical Almanac, section C): within 0.01 deg of
    the true place until 2050.
    """
    days = (unix_s - _J2000_UNIX_S) / _DAY_S
    mean_longitude = math.radians((280.460 + 0.9856474 * days) % 360.0)
    anomaly = math.radians((357.528 + 0.9856003 * days) % 360.0)
    longitude = mean_longitude + math.radians(1.915) * math.sin(anomaly) + math.radians(0.020) * math.sin(2.0 * anomaly)
    obliquity = math.radians(23.439 - 4e-7 * days)
    ascension = math.atan2(math.cos(obliquity) * math.sin(longitude), math.cos(longitude))
    declination = math.asin(math.sin(obliquity) * math.sin(longitude))
    sidereal = math.radians((280.46062 + 360.98564737 * days) % 360.0)  # Greenwich mean
    hour_angle = sidereal + lon_rad - ascension
    return math.asin(
        math.sin(lat_rad) * math.sin(declination) + math.cos(lat_rad) * math.cos(declination) * math.cos(hour_angle)
    )


IRONS_TWA_RAD = math.radians(35.0)
IRONS_TWS_MPS = 1.5  # less wind than this is a calm, not irons
MOVING_MPS = 0.5
PROGRESS_WINDOW_S = 180.0
FIELDS_SHARE = 0.05  # of what she could sail in the window: by field less made good than this is none
CLEAR_SHARE = 1.5  # ... and this many times as much is progress again
RISE = 0.015  # it is charged; the last percent trembles
FALL = 0.05  # the rate is told when the charge has fallen by this much ...
LOOK_S = 300.0  # ... and for this long
DETOUR = 2.0  # a beat is 1.4 times its straight way, and something lies between
LEAST_MPS = 0.5
AHEAD_S = 30.0  # along her leg, beside it: so far it is looked whether that comes below the floor


def measure(ctx: StepContext, name: str) -> float | None:
    """Return the watched figure in the table's unit, None when it is not watched or cannot be told now."""
    dog = BY_NAME[name]
    if not ctx.config.is_watched(name, ctx.voyage.boat):
        return None
    if dog.sensor:
        return ctx.autopilot.sensor(dog.sensor) if ctx.autopilot is not None else None
    return _MEASURES[name](ctx)


def as_watched(ctx: StepContext, dog: Watchdog) -> Watchdog:
    """Return a row of the table with its thresholds as they are now.

    By field, circles before a barrier creep: a boat that sails 3 m/s about a place and is set 25 m on in three minutes
    makes no way there. A few metres of a boat that is led along her plan's legs are way made good.
    """
    wind = ctx.wind_mean
    if dog.name != "no progress" or wind is None or not ctx.is_field_steered:
        return dog
    could_mps = max(0.0, ctx.voyage.boat.polar.max_speed_mps(wind[1]) - math.hypot(*ctx.current_en_mps))
    least_m = FIELDS_SHARE * could_mps * PROGRESS_WINDOW_S
    return replace(dog, enter=max(dog.enter, least_m), exit=max(dog.exit, CLEAR_SHARE * least_m))


def _flag(value: bool | None) -> float | None:
    return None if value is None else float(value)


def _link(ctx: StepContext) -> float | None:
    return ctx.snapshot.heartbeat_age_s


def _position_lost(ctx: StepContext) -> float | None:
    return ctx.snapshot.vehicle_age_s


def _jump(ctx: StepContext) -> float | None:
    if ctx.snapshot.position_en_m is None:
        return None
    # it lasts as long as the doubt
    return ctx.jump_m if ctx.state.position.doubt is None else max(ctx.jump_m, JUMP_M)


def _wind(ctx: StepContext) -> float | None:
    health = ctx.snapshot.wind.health
    return float(health is WindHealth.UNTRUSTED or (health is WindHealth.NONE and ctx.state.voyage.sailing))


def _contradicted(ctx: StepContext) -> float | None:
    return float(bool(ctx.snapshot.unsure))


def _becalmed(ctx: StepContext) -> float | None:
    wind = ctx.wind_mean
    if wind is None:
        return None
    return max(wind[1], BY_NAME["becalmed"].exit) if sails(ctx) else wind[1]


def _irons(ctx: StepContext) -> float | None:
    wind, vehicle = ctx.wind_now, ctx.snapshot.vehicle
    if wind is None or vehicle is None or wind[1] < IRONS_TWS_MPS or ctx.boat_en is None or not ctx.config.sails:
        return None
    if abs(difference_rad(wind[0], vehicle.heading_rad)) > IRONS_TWA_RAD:
        return BY_NAME["in irons"].exit
    east, north = ctx.through_en_mps
    return max(0.0, east * math.sin(vehicle.heading_rad) + north * math.cos(vehicle.heading_rad))


def _too_near(ctx: StepContext) -> float | None:
    met = meets_in(ctx)
    return None if met is None else met[0]


def _progress(ctx: StepContext) -> float | None:
    """Way made good in the window; None before the window is full or while there is a reason to stand still."""
    if ctx.is_raised("becalmed") or ctx.snapshot.unsure or not to_go(ctx) or not ctx.state.progress.history:
        return None
    if ctx.state.mission.route is None or ctx.state.progress.history_plan != ctx.state.mission.route.plan_id:
        return None  # the history is of the plan before
    old = ctx.state.progress.history[0]
    if ctx.t_s - old[0] < PROGRESS_WINDOW_S:
        return None
    return old[3] - ctx.state.progress.history[-1][3]


def _heading(ctx: StepContext) -> float | None:
    vehicle = ctx.snapshot.vehicle
    if vehicle is None or ctx.boat_en is None:
        return None
    velocity = ctx.through_en_mps
    if math.hypot(*velocity) < MOVING_MPS:
        return 0.0
    return math.degrees(abs(difference_rad(math.atan2(*velocity), vehicle.heading_rad)))


def corridor_m(ctx: StepContext) -> float:
    """Return how far off its leg the boat may be before the margin's floor is in question [m]."""
    route = ctx.state.mission.route
    margin = route.margin_m if route is not None else ctx.config.margin_m
    return max(margin - ctx.config.margin_floor_m, ctx.config.manoeuvre_m)


def _corridor(ctx: StepContext) -> float | None:
    """Share of the corridor used; in open water the grid size bounds it, not the margin, and a beat its own boards."""
    boat, leg = ctx.boat_en, ctx.leg()
    is_stopped = ctx.state.steering.own_mode in STOPPING
    if boat is None or leg is None or not ctx.ahead() or is_stopped or ctx.is_field_steered or is_composed(ctx):
        return None  # stopped, or by field, it follows no leg
    if distance_m(*leg) < 1.0:
        return 0.0
    if along_m(boat, *leg) < 0.0:
        # Before its leg begins: by a little wherever a waypoint is announced early, by more after a jump.
        off = max(0.0, distance_m(boat, leg[0]) - 2.0 * ctx.config.announce_m)
    else:
        off = abs(cross_track_m(boat, *leg))
    beaten_m = beaten_within_m(ctx)
    ways = [[boat, leg[1]]]
    if beaten_m == 0.0:  # set off its leg by a steady current she sails beside it, not to its end
        left_m, course_rad = max(0.0, distance_m(*leg) - along_m(boat, *leg)), bearing_rad(*leg)
        ways.append([boat, moved(boat, course_rad, min(left_m, AHEAD_S * ctx.speed_mps))])
    clearance = min(ctx.voyage.area.path_clearance_m(way) for way in ways)
    allowed = max(ctx.config.grid_size_m, beaten_m)
    if clearance < ctx.config.margin_floor_m:
        allowed = min(allowed, corridor_m(ctx))
    return off / allowed


def _stuck(ctx: StepContext) -> float | None:
    passed = ctx.state.mission.passed_since_s
    return None if passed is None else ctx.t_s - passed


def _ended(ctx: StepContext) -> float | None:
    route = ctx.state.mission.route
    if route is None or ctx.gate is None or ctx.autopilot is None or diversion(ctx) is not None or (is_composed(ctx)):
        return None
    if ctx.snapshot.unsure:
        return None  # nothing is planned by a wind or a water that is doubted, and a leg to sea room ends in its loiter
    if ctx.is_by_field:
        return 0.0  # where the mission on board ends is nothing to her
    return float(ctx.state.mission.index >= len(route.items) - 1 or ctx.autopilot.mission_state.name == "COMPLETE")


def _breach(ctx: StepContext) -> float | None:
    return _flag(ctx.autopilot.fence_breached) if ctx.autopilot is not None else None


def _foreign(ctx: StepContext) -> float | None:
    return float(bool(ctx.state.mission.foreign))


def _reboot(ctx: StepContext) -> float | None:
    return float(ctx.state.vehicle.rebooted)


def _battery(ctx: StepContext, name: str, *, is_below: bool) -> float | None:
    """Return the charge, no more than the row's entry where the autopilot's own limit is passed."""
    status = ctx.autopilot
    if status is None:
        return None
    charge = None if status.battery_remaining is None else 100.0 * status.battery_remaining
    return min(charge if charge is not None else 100.0, BY_NAME[name].enter) if is_below else charge


def _battery_low(ctx: StepContext) -> float | None:
    is_below = ctx.autopilot is not None and bool(ctx.autopilot.battery_failed)
    return _battery(ctx, "battery low", is_below=is_below)


def _battery_critical(ctx: StepContext) -> float | None:
    status, least_v = ctx.autopilot, ctx.config.ends.figure("battery_v")
    volts = status.battery_v if status is not None else None
    is_empty = least_v is not None and volts is not None and volts <= least_v
    is_short = ctx.state.alarms.charge is not None and ctx.state.alarms.charge.is_short
    is_below = ctx.state.alarms.battery_critical or is_empty or is_short
    return _battery(ctx, "battery critical", is_below=is_below)


def _dark(ctx: StepContext) -> float | None:
    status, vehicle, below_deg = ctx.autopilot, ctx.snapshot.vehicle, ctx.config.ends.figure("dark_below_deg")
    unix_s = None if status is None else status.unix_s(ctx.t_s)
    if below_deg is None or vehicle is None or unix_s is None:
        return None
    height_rad = sun_height_rad(math.radians(vehicle.position.lat_deg), math.radians(vehicle.position.lon_deg), unix_s)
    return math.degrees(height_rad - math.radians(below_deg))


def _shore(ctx: StepContext) -> float | None:
    age_s, limit_s = ctx.snapshot.shore_age_s, ctx.config.ends.figure("shore_lost_s")
    return None if age_s is None or limit_s is None else age_s / limit_s


def _time(ctx: StepContext) -> float | None:
    limit_s = ctx.config.voyage_timeout_s
    return None if limit_s is None else ctx.state.voyage.under_way_s / limit_s


def _planner(ctx: StepContext) -> float | None:
    return float(not ctx.snapshot.planner_alive)


def _fence_off(ctx: StepContext) -> float | None:
    return None if ctx.autopilot is None else float(ctx.autopilot.fence_on is False)


def _shoaling(ctx: StepContext) -> float | None:
    return depth_ahead_m(ctx)


def _depth_lost(ctx: StepContext) -> float | None:
    if ctx.autopilot is None or ctx.config.least_depth_m is None:
        return None
    return float(ctx.autopilot.sounds is False)


_MEASURES: dict[str, Callable[[StepContext], float | None]] = {
    "link silent": _link,
    "position lost": _position_lost,
    "position jump": _jump,
    "wind untrusted": _wind,
    "wind contradicted": _contradicted,
    "strong wind": too_strong,
    "light wind": too_light,
    "becalmed": _becalmed,
    "drifting": meets_in_s,
    "in irons": _irons,
    "vessel too near": _too_near,
    "no progress": _progress,
    "heading against course": _heading,
    "off the corridor": _corridor,
    "stuck waypoint": _stuck,
    "mission ended": _ended,
    "fence breach": _breach,
    "fence off": _fence_off,
    "foreign mission": _foreign,
    "reboot": _reboot,
    "battery low": _battery_low,
    "battery critical": _battery_critical,
    "out of time": _time,
    "dragged off": off_place_m,
    "planner dead": _planner,
    "dark": _dark,
    "shore lost": _shore,
    "shoaling": _shoaling,
    "depth lost": _depth_lost,
}


# --------------------
# How long the charge lasts at the rate at which it has fallen, against the way to a place where it can wait.
# The rate is the mean since the charge was last seen to rise: a figure in whole percents tells nothing over a minute.
# The way is a straight one, lengthened by ``DETOUR``.


def follow_charge(ctx: StepContext) -> None:
    """Remember where the fall of the charge began, and whether it still covers the way; say it when it does not."""
    status, before = ctx.autopilot, ctx.state.alarms.charge
    share = status.battery_remaining if status is not None else None
    if share is None:
        return
    if before is None or share > before.last + RISE:
        ctx.set(alarms=changed(ctx.state.alarms, charge=Charge(since_s=ctx.t_s, first=share, last=share)))
        return
    now = replace(before, last=min(share, before.last))
    if now != before:
        ctx.set(alarms=changed(ctx.state.alarms, charge=now))
    left_s = lasts_s(ctx)
    if now.is_short or left_s is None:
        return
    needed_s = way_s(ctx)
    if needed_s is None or left_s >= (ctx.config.ends.figure("battery_reserve") or 0.0) * needed_s:
        return
    ctx.set(alarms=changed(ctx.state.alarms, charge=replace(now, is_short=True)))
    ctx.say(
        Severity.WARNING,
        "charge",
        f"the charge lasts {math.floor(left_s / 60.0)} min at its rate, the way to "
        f"where she can wait takes {math.ceil(needed_s / 60.0)} min",
        every_s=0.0,
    )


def lasts_s(ctx: StepContext) -> float | None:
    """Return how long the charge lasts [s], None while the rate is not known."""
    charge = ctx.state.alarms.charge
    if charge is None or ctx.t_s - charge.since_s < LOOK_S or charge.first - charge.last < FALL:
        return None
    return charge.last * (ctx.t_s - charge.since_s) / (charge.first - charge.last)


def way_s(ctx: StepContext) -> float | None:
    """Return how long the boat needs to the nearest refuge, or home where there is none [s]; None: there is neither."""
    boat, wind, status = ctx.boat_en, ctx.wind_mean, ctx.autopilot
    places = [refuge.en_m for refuge in ctx.voyage.refuges]
    if not places and status is not None and status.home is not None and not home_trouble(ctx):
        places.append(ctx.voyage.frame.en_from_geo(status.home))
    if boat is None or wind is None or not places:
        return None
    speed_mps = max(LEAST_MPS, ctx.voyage.boat.polar.max_speed_mps(wind[1]))
    return DETOUR * min(distance_m(boat, place) for place in places) / speed_mps
