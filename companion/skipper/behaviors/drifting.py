"""A boat that does not sail and moves all the same: seen from its track against its heading, and stopped.

Without wind, head to wind or with its sails eased it goes where the water and the wind take it. Where that is within
five minutes is held against the area (``companion.skipper.way.drift``) and said; what there is to stop it with stands
in ``MEANS``, the first that will do is used, and the crew is called to the anchor where none will.

In a calm it is put into LOITER where it found it: when the wind comes back it then circles there until a way from
where the current has taken it is planned, in place of sailing for its old waypoint across whatever lies between.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from companion.frozen import changed
from companion.geo.angles import difference_rad, direction, heading_of
from companion.messages import Mode, Severity
from companion.safety import LIGHT_MPS, SAILS_MPS
from companion.skipper.behaviors.helm import is_busy, run_motor, set_mode
from companion.skipper.step.context import StepContext
from companion.skipper.step.missions import ROOMIER_M
from companion.skipper.step.state import Fix, Phase
from companion.skipper.way import PointEn, distance_m, water_at
from companion.skipper.way.drift import DriftAhead, drift_ahead, floor_from_m
from companion.skipper.way.voyage import water_to_keep

STEERAGE_MPS = 0.4  # less wind than this moves no boat that could be steered
DRIFT_MPS = 0.15  # a slower velocity is a receiver's noise
SLOW_MPS = 0.04  # of a drift seen in places: 2.4 m in a minute; slower is a receiver's noise, too
PLACE_S, SLOW_PLACES, LEAST_S = 10.0, 6, 30.0  # places of a boat that hardly moves: one in 10 s, a minute, half of it
AGAINST_RAD = math.radians(60.0)  # a boat that sails makes less leeway than this, in any current that it can stem
ASTERN_MPS = 0.3  # slower going astern shows nothing: a turn, a wave, a noisy receiver
ASTERN_RAD = math.radians(30.0)  # the course is so near to dead astern of the bow
AWAY_M = 25.0  # LOITER has been measured to stay within 12 m of its point
TAU_S = 10.0  # of the mean velocity: longer than a wave, shorter than a board
BOW_TAU_S = 3.0  # of the mean as seen from the bow: a boat that has stopped shows it at once, a tack is no stop
SPARE = 1.3  # what can stem a drift is this much faster
FAILED_S = 60.0  # a means that has not stopped the drift within this will not
CALL = "anchor"  # the code under which the crew is called
CALL_S = 60.0  # between two calls to the anchor
NEAR_S = 120.0  # the anchor is called for beside every other means when there is no more time than this
CLEAR_S = 600.0  # what the watchdog is told where nothing is met


# ---------------------------------------------------------------------------------------- seen
def follow_ground(ctx: StepContext) -> None:
    """Keep the mean velocity over ground, and the places of the last minute of a boat that hardly moves."""
    vehicle, boat, memory = ctx.snapshot.vehicle, ctx.reckoned_en, ctx.state.adrift
    if vehicle is None or boat is None:
        ctx.set(adrift=replace(memory, ground_en_mps=None, bow_mps=None, places=()))
        return
    since_s = ctx.t_s - memory.ground_t_s
    after = _mean(memory.ground_en_mps, vehicle.velocity_en_mps, since_s, TAU_S)
    bow = _mean(memory.bow_mps, _from_the_bow(vehicle.velocity_en_mps, vehicle.heading_rad), since_s, BOW_TAU_S)
    places = memory.places
    if math.hypot(*after) >= DRIFT_MPS:
        places = ()
    elif not places or ctx.t_s - places[-1].t_s >= PLACE_S:
        places = (*places[-SLOW_PLACES:], Fix(t_s=ctx.t_s, en_m=boat))
    ctx.set(adrift=replace(memory, ground_en_mps=after, bow_mps=bow, ground_t_s=ctx.t_s, places=places))


def _mean(
    before: tuple[float, float] | None, now: tuple[float, float], since_s: float, tau_s: float
) -> tuple[float, float]:
    if before is None:
        return now
    share = -math.expm1(-max(0.0, since_s) / tau_s)
    return before[0] + share * (now[0] - before[0]), before[1] + share * (now[1] - before[1])


def _from_the_bow(velocity_en_mps: tuple[float, float], heading_rad: float) -> tuple[float, float]:
    """Return a velocity over ground to starboard and ahead [m/s]."""
    (east, north), sin, cos = velocity_en_mps, math.sin(heading_rad), math.cos(heading_rad)
    return east * cos - north * sin, east * sin + north * cos


def over_ground(ctx: StepContext) -> tuple[float, float] | None:
    """Return how the boat moves over ground [m/s, east north], None when it lies still or it is not known.

    By its velocity; a slow drift, which a receiver's noise would hide, by the places where it has been.
    """
    ground, places = ctx.state.adrift.ground_en_mps, ctx.state.adrift.places
    if ground is None or math.hypot(*ground) >= DRIFT_MPS:
        return ground
    if len(places) < 2 or ctx.t_s - places[0].t_s < LEAST_S:
        return None
    span_s = places[-1].t_s - places[0].t_s
    slow = tuple((b - a) / span_s for a, b in zip(places[0].en_m, places[-1].en_m, strict=True))
    return (slow[0], slow[1]) if math.hypot(*slow) >= SLOW_MPS else None


def sails(ctx: StepContext) -> bool:
    """Return whether the boat goes where its bow points, in a wind that it can be steered in."""
    ground, wind = over_ground(ctx), ctx.wind_now
    if ground is None or wind is None or wind[1] < STEERAGE_MPS:
        return False
    return math.hypot(*ground) >= SAILS_MPS and not _is_against(ctx, ground)


def _is_against(ctx: StepContext, ground: tuple[float, float]) -> bool:
    """Return whether the boat goes elsewhere than its bow points.

    A boat that tacks does not: the mean over ground is still of the board before, as seen from the bow it makes way.
    """
    vehicle, bow = ctx.snapshot.vehicle, ctx.state.adrift.bow_mps
    if vehicle is None or abs(difference_rad(heading_of(*ground), vehicle.heading_rad)) <= AGAINST_RAD:
        return False
    return bow is None or bow[1] < SAILS_MPS or abs(heading_of(*bow)) > AGAINST_RAD


def goes_astern(ctx: StepContext) -> bool:
    """Return whether the boat goes astern in a loiter: there it lies with its bow in the wind and is driven by it."""
    status, vehicle = ctx.autopilot, ctx.snapshot.vehicle
    if status is None or vehicle is None or vehicle.speed_mps < ASTERN_MPS:
        return False
    if status.mode is not Mode.LOITER and (status.mode is not Mode.AUTO or ctx.ahead()):
        return False
    east, north = vehicle.velocity_en_mps
    return abs(difference_rad(heading_of(-east, -north), vehicle.heading_rad)) < ASTERN_RAD


def is_driven_astern(ctx: StepContext) -> bool:
    """Return whether a loiter by a wind that is doubted is driven astern: as surely a drift as one in a calm."""
    return bool(ctx.snapshot.unsure) and goes_astern(ctx)


def _is_carried(ctx: StepContext, boat: PointEn, ground: tuple[float, float]) -> bool:
    """Return whether the boat goes where it is not steered, in a wind to steer by.

    In HOLD nobody steers. In LOITER it turns in circles, and is carried when it leaves the place of them, or goes
    astern by a wind that is doubted.
    """
    if is_driven_astern(ctx):
        return True
    mode = ctx.autopilot.mode if ctx.autopilot is not None else None
    place = ctx.state.adrift.loiter_en_m
    if mode is Mode.LOITER:
        return place is not None and distance_m(boat, place) > AWAY_M and _goes_away(boat, place, ground)
    return mode is Mode.HOLD or _is_against(ctx, ground)


def _goes_away(boat: PointEn, place: PointEn, ground: tuple[float, float]) -> bool:
    return (boat[0] - place[0]) * ground[0] + (boat[1] - place[1]) * ground[1] > 0.0


def drift(ctx: StepContext) -> DriftAhead | None:
    """Return where the boat drifts, None when it sails, lies still, or it cannot be told."""
    ground, wind, boat, vehicle = over_ground(ctx), ctx.wind_now, ctx.reckoned_en, ctx.snapshot.vehicle
    if vehicle is not None and is_driven_astern(ctx):
        ground = vehicle.velocity_en_mps  # of now: the mean is still of how the boat sailed
    if ground is None or wind is None or boat is None:
        return None
    if not (wind[1] < STEERAGE_MPS or _is_carried(ctx, boat, ground)):
        return None
    water = water_to_keep(ctx.voyage.area, boat)
    here_m = float(water.clearance_m([boat])[0])
    floor_m = floor_from_m(here_m, min(ctx.config.margin_floor_m, ctx.config.margin_m))
    return drift_ahead(water, boat, ground, floor_m=floor_m)


def meets_in_s(ctx: StepContext) -> float | None:
    """Return in how many seconds the drift comes too near to something, None when the boat does not drift."""
    ahead = drift(ctx)
    if ahead is None:
        return None
    return CLEAR_S if ahead.floor_s is None else ahead.floor_s


# ------------------------------------------------------------------------------------- stopped
@dataclass(frozen=True, slots=True, kw_only=True)
class Means:
    """Something to stop a drift with: when it will do, what it does. ``use`` is called each step."""

    name: str
    when: str
    will_do: Callable[[StepContext, DriftAhead], bool]
    use: Callable[[StepContext], None]


def _has_motor(ctx: StepContext, ahead: DriftAhead) -> bool:  # noqa: ARG001 - all means are asked alike
    return ctx.voyage.boat.has_motor and ctx.snapshot.permissions.may_set_mode


def _run_motor(ctx: StepContext) -> None:
    if not ctx.state.adrift.motor:
        run_motor(ctx, on=True, text="drifting: the motor holds her")


def _stems(ctx: StepContext, ahead: DriftAhead) -> bool:
    """Whether the boat can sail against the drift, faster than it, in the wind that there is, and may be told to."""
    wind, boat = ctx.wind_now, ctx.voyage.boat
    if wind is None or wind[1] < STEERAGE_MPS or not ctx.snapshot.permissions.may_set_mode or ctx.snapshot.unsure:
        return False
    against_rad = heading_of(-ahead.velocity_en_mps[0], -ahead.velocity_en_mps[1])
    twa = abs(difference_rad(wind[0], against_rad))
    speed = boat.polar.speed_mps(max(twa, ctx.no_go_half_rad), wind[1])
    if twa < ctx.no_go_half_rad:
        speed *= math.cos(ctx.no_go_half_rad) / math.cos(twa)  # by tacking
    return speed >= SPARE * ahead.speed_mps


def _nothing(ctx: StepContext) -> None:
    """LOITER is asked for whenever the boat drifts."""


def _always(ctx: StepContext, ahead: DriftAhead) -> bool:  # noqa: ARG001
    return True


MEANS: tuple[Means, ...] = (
    Means(
        name="motor",
        when="the mission says that there is one, and setting modes is permitted",
        will_do=_has_motor,
        use=_run_motor,
    ),
    Means(
        name="loiter",
        when="the wind is enough to sail against the drift, and setting modes is permitted",
        will_do=_stems,
        use=_nothing,
    ),
    Means(name="anchor", when="always", will_do=_always, use=_nothing),
)


def stops_drift(ctx: StepContext) -> bool:
    """Hold a boat that is becalmed or drifts onto something; True while LOITER is ours and to be kept."""
    state, status = ctx.state, ctx.autopilot
    if status is None or state.steering.until_s is not None or state.by_field.resort.engaged:
        return False
    is_calm, is_danger = ctx.is_raised("becalmed"), ctx.is_raised("drifting")
    # What has been stopped stays so until there is a wind to sail by again.
    waits = state.adrift.loitered and ctx.wind_now is not None and ctx.wind_now[1] < LIGHT_MPS
    if not (is_calm or is_danger or waits):
        _let_go(ctx)
        return False
    ahead = drift(ctx)
    if ahead is not None:
        if is_danger and not ahead.is_clear:
            _stop(ctx, ahead)
        else:
            ctx.say(Severity.NOTICE, "drift", ahead.sentence(), every_s=CALL_S)
    return _loiters(ctx, ahead)


def _let_go(ctx: StepContext) -> None:
    memory = ctx.state.adrift
    if memory.motor:
        run_motor(ctx, on=False, text="the boat sails again")
    if memory.since_s is not None or memory.loitered:
        ctx.set(adrift=replace(ctx.state.adrift, since_s=None, loitered=False, loiter_en_m=None))


def _stop(ctx: StepContext, ahead: DriftAhead) -> None:
    """Use the first means that will do; call for the anchor where it has not done, or there is no time."""
    memory = ctx.state.adrift
    since_s = memory.since_s if memory.since_s is not None else ctx.t_s
    ctx.set(adrift=replace(memory, since_s=since_s))
    means = next(m for m in MEANS if m.will_do(ctx, ahead))
    means.use(ctx)
    left_s = ahead.contact_s if ahead.contact_s is not None else ahead.floor_s
    if means is MEANS[-1] or ctx.t_s - since_s > FAILED_S or (left_s is not None and left_s < NEAR_S):
        vehicle = ctx.snapshot.vehicle
        where = "" if vehicle is None else f", now at {vehicle.position.lat_deg:.5f} {vehicle.position.lon_deg:.5f}"
        ctx.say(Severity.CRITICAL, CALL, f"anchor! {ahead.sentence()}{where}", every_s=CALL_S)
    else:
        ctx.say(Severity.WARNING, "drift", f"{ahead.sentence()}: {means.name}", every_s=CALL_S)


def lies_in_loiter(ctx: StepContext) -> bool:
    """Return whether the boat is at the loiter that ends the mission, or has a clear way to it near by.

    Its place was chosen for its room; a loiter begun where it lies would have what room there is.
    """
    route, boat = ctx.state.mission.route, ctx.boat_en
    if route is None or boat is None or ctx.ahead():
        return False
    place = route.points_en_m[-1]
    away_m = distance_m(boat, place)
    return away_m <= AWAY_M or (
        away_m <= AWAY_M + ROOMIER_M
        and water_at(ctx.voyage.area, boat).path_clearance_m([boat, place]) >= ctx.config.margin_floor_m
    )


def is_cramped(ctx: StepContext) -> bool:
    """Return whether a loiter begun here would be sailed onto something, in a wind that fills the sails.

    Who lies in irons beside a wall is better helped by the boat's way on, which was planned clear of it.
    """
    wind, boat = ctx.wind_now, ctx.reckoned_en
    if wind is None or boat is None or wind[1] < LIGHT_MPS:
        return False
    return float(water_at(ctx.voyage.area, boat).clearance_m([boat])[0]) < ctx.loiter_swing_m


def _motion(ctx: StepContext) -> str:
    """Return how a boat moves that drifts nowhere: in a loiter it goes in circles, and its mean is nothing."""
    vehicle = ctx.snapshot.vehicle
    if vehicle is None or ctx.reckoned_en is None:
        return "her motion not known"
    if vehicle.speed_mps < DRIFT_MPS:
        return "lying still"
    return f"making {vehicle.speed_mps:.2g} m/s towards {direction(heading_of(*vehicle.velocity_en_mps))}°"


def _makes_way(ctx: StepContext) -> bool:
    """Return whether she sails in a wind to steer by: round in a loiter, too, where her mean velocity is nothing."""
    wind, vehicle = ctx.wind_now, ctx.snapshot.vehicle
    has_wind = wind is not None and wind[1] >= STEERAGE_MPS
    return has_wind and vehicle is not None and vehicle.speed_mps >= SAILS_MPS


def _loiters(ctx: StepContext, ahead: DriftAhead | None) -> bool:
    """Keep LOITER, or ask for it where it drifts; a person who sets AUTO meanwhile is let have it."""
    status, state, memory = ctx.autopilot, ctx.state, ctx.state.adrift
    if status is None or not ctx.snapshot.permissions.may_set_mode:
        return False
    what, until = "becalmed" if ctx.is_raised("becalmed") else "adrift", "she can sail"
    if ahead is None and _makes_way(ctx):
        is_calm = ctx.is_raised("becalmed") or not ctx.is_raised("drifting")
        what, until = ("out of the calm", "the wind has lasted") if is_calm else ("adrift no more", "that has lasted")
    how = _motion(ctx) if ahead is None else ahead.sentence()
    if status.mode is Mode.LOITER and state.steering.own_mode is Mode.LOITER:
        place = memory.loiter_en_m if memory.loiter_en_m is not None else ctx.reckoned_en
        ctx.set(adrift=replace(memory, loitered=True, loiter_en_m=place))
        ctx.phase(Phase.HOLDING, f"{what}, {how}: waiting in a loiter until {until}")
        return True
    if status.mode not in {Mode.AUTO, ctx.sails_in} or memory.loitered or ahead is None:
        return False
    if ahead.is_clear and lies_in_loiter(ctx):
        return False
    if is_cramped(ctx):
        return False
    if not is_busy(ctx, Mode.LOITER.name) and set_mode(ctx, Mode.LOITER, f"{what}, {how}"):
        ctx.set(operator=changed(ctx.state.operator, is_back=True))
    ctx.phase(state.phase, f"{what}, {how}: waiting for the autopilot to take LOITER")
    return True
