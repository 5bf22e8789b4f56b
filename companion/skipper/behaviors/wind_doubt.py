"""What is done while the wind is doubted: a vane that was turned, an offset that somebody set, a motion against it.

Nothing is planned: a plan for a wind that is not there leads anywhere, and each step of the ladder gives up some of
what keeps the boat clear. It waits in LOITER. But the autopilot sails LOITER by the wind that it is told, too: with the
told no-go zone elsewhere it points the bow at the loiter's point, straight into the true wind, and is driven astern,
away from the point, as long as that lasts. So a LOITER by a wrong wind is a drift dead to leeward of the true wind, and
it is foreseen. The true wind is the one before the doubt; where nobody remembers that, a boat that goes astern in
LOITER shows it: the wind comes from where the bow points.

Where that drift meets something within ``HORIZON_S``, the boat first seeks sea room: one straight clear leg, in AUTO,
to a place with nothing to leeward, on a course that is sailed in both winds. It waits in the loiter that ends that leg.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from companion.frozen import changed
from companion.geo.angles import difference_rad, wrap_pi
from companion.messages import Command, Mode, Severity, waypoint
from companion.skipper.behaviors.drifting import goes_astern
from companion.skipper.behaviors.helm import hand_back, is_busy, set_mode
from companion.skipper.planning.uploads import is_way_clear, upload
from companion.skipper.step import CancelPlan, Phase, StepContext, WindBefore
from companion.skipper.way.drift import HORIZON_S, floor_after_s
from companion.skipper.way.geometry import distance_m, moved
from companion.skipper.way.voyage import AreaLike, PointEn, water_at

WAITS = "waiting in a loiter until the wind is known"
SAID_S = 60.0  # between two words on a wind that is not known
SEA_ROOM = "sea room"  # the rung of a route that leads there, and the code under which it is said
ASTERN_SHARE = 0.2  # of the wind's speed: how fast a LOITER by a wrong wind is driven astern
SPREAD_RAD = math.radians(15.0)  # of the true wind while it is not measured
PAD_RAD = math.radians(10.0)  # outside the true no-go zone, for the same reason
EASED_RAD = math.radians(10.0)  # a sheet that is eased farther than this for the true wind does not draw
LOOKS_EVERY_S = 5.0  # for sea room: hundreds of legs and drifts are tried
ROOMY_S = 60.0  # of drift gained: for less the boat is not sent elsewhere
AWAY_S = 150.0  # of drift: so long from something it is led where its circles come too near to something here
RINGS_M = (40.0, 60.0, 80.0, 120.0, 160.0, 240.0)
DIRECTIONS = 36
AHEAD_S = 3.0  # what the boat sails on until it turns on to a leg that is being uploaded
WAY_MPS = 0.3  # made good towards it: slower the leg is not sailed
TURNS_S = 20.0  # from lying head to wind until it is
STRAYS_M = 15.0  # from the loiter's point: LOITER turns in circles of 12 m
LEG_CLEAR_M = 1.0  # beside the hull: what the rest of a leg that it was set off must keep
SAILS_MPS = 0.8  # ahead: she sails
HAIR_M = 0.5


@dataclass(frozen=True, slots=True, kw_only=True)
class DoubtedWind:
    """The winds of a boat whose wind is doubted, and where a LOITER would be driven by them.

    Attributes:
        true_from_rad: where the wind comes from, as far as that is known.
        told_from_rad: where it comes from as the autopilot is told: sheet and no-go zone go by that.
        drift_en_mps: the drift of a LOITER over ground [m/s, east north].
    """

    true_from_rad: float
    told_from_rad: float
    drift_en_mps: tuple[float, float]

    def sails(self, course_rad: float, no_go_half_rad: float) -> bool:
        """Return whether a course is sailed: outside both no-go zones, and by a sheet that draws in the true wind."""
        true = abs(difference_rad(self.true_from_rad, course_rad))
        told = abs(difference_rad(self.told_from_rad, course_rad))
        return true >= no_go_half_rad + PAD_RAD and told >= no_go_half_rad and told <= true + EASED_RAD


def doubted_wind(ctx: StepContext) -> DoubtedWind | None:
    """Return the winds of now, None where the true one is not known, or LOITER can be sailed by the told one."""
    told, vehicle = ctx.wind_now, ctx.snapshot.vehicle
    if told is not None and vehicle is not None and goes_astern(ctx):
        return DoubtedWind(
            true_from_rad=vehicle.heading_rad, told_from_rad=told[0], drift_en_mps=vehicle.velocity_en_mps
        )
    before, route = ctx.snapshot.wind_before, ctx.state.mission.route
    was_trimmed = ctx.state.vane.trimmed_s > ctx.state.mission.uploaded_s  # planned by a vane that was turned
    if before is None and not was_trimmed and told is not None and route is not None and route.plan_tws_mps > 0.0:
        # Not remembered over a restart: the wind that the way on board was planned in is.
        before = WindBefore(
            twd_from_rad=route.plan_twd_from_rad,
            tws_mps=route.plan_tws_mps,
            turned_rad=difference_rad(told[0], route.plan_twd_from_rad),
        )
    if before is None or abs(before.turned_rad) < ctx.no_go_half_rad:
        return None  # within that the told no-go zone keeps the bow off the true wind
    leeward, speed = before.twd_from_rad + math.pi, ASTERN_SHARE * before.tws_mps
    return DoubtedWind(
        true_from_rad=before.twd_from_rad,
        told_from_rad=wrap_pi(before.twd_from_rad + before.turned_rad),
        drift_en_mps=(speed * math.sin(leeward), speed * math.cos(leeward)),
    )


# ------------------------------------------------------------------------------------------ sea room
def seeks_sea_room(ctx: StepContext) -> bool:
    """Sail to water with nothing to leeward, where a LOITER by this wind drifts onto something; True while it does."""
    status, state, may = ctx.autopilot, ctx.state, ctx.snapshot.permissions
    boat, vehicle, route = ctx.boat_en, ctx.snapshot.vehicle, ctx.state.mission.route
    if not ctx.snapshot.unsure or status is None or boat is None or vehicle is None or route is None:
        return False
    if not (may.may_set_mode and may.may_upload and status.ekf_ok and state.voyage.sailing) or (
        state.by_field.resort.engaged or state.mission.foreign
    ):
        return False
    wind = doubted_wind(ctx)
    water = water_at(ctx.voyage.area, boat)
    circles = _circles_near(ctx, water, boat)
    if wind is None and circles and ctx.wind_now is not None:
        told_rad = ctx.wind_now[0]  # by which LOITER is sailed: it is not driven off, and needs room for its circle
        wind = DoubtedWind(true_from_rad=told_rad, told_from_rad=told_rad, drift_en_mps=(0.0, 0.0))
    floor_m = min(
        ctx.config.margin_floor_m, ctx.config.margin_m, max(0.0, float(water.clearance_m([boat])[0]) - HAIR_M)
    )
    if state.pending.upload is not None:
        leads_there = state.pending.upload.route.rung == SEA_ROOM
        if leads_there:
            ctx.phase(Phase.HOLDING, state.pending.upload.route.why)
        return leads_there
    left_s = HORIZON_S if wind is None else _left_s(water, boat, wind, floor_m)
    if route.rung == SEA_ROOM and _is_on_the_way(ctx, water, boat, route.points_en_m[-1]):
        if state.steering.own_mode is not None:
            hand_back(ctx)
        left_m = distance_m(boat, route.points_en_m[-1])
        waits = WAITS if left_m < STRAYS_M else f"{left_m:.0f} m to where a loiter has more room; waiting until there"
        ctx.phase(Phase.HOLDING, f"{ctx.snapshot.unsure}: {waits}")
        return True
    if (
        wind is None
        or (not circles and (left_s >= HORIZON_S or _stays(ctx, boat, wind)))
        or ctx.t_s < max(state.pending.upload_retry.not_before_s, state.adrift.looked_s + LOOKS_EVERY_S)
    ):
        return False
    ctx.set(adrift=replace(state.adrift, looked_s=ctx.t_s))
    runs_s = 0.0 if goes_astern(ctx) else AHEAD_S  # a sheet that draws stops the boat at once
    east, north = vehicle.velocity_en_mps
    # In AUTO she turns on to the leg as it comes on board, which takes its time or does not; in LOITER, anywhere about.
    shares = (1.0,) if status.mode is Mode.LOITER else (1.0, 0.5, 0.0)
    starts = [(boat[0] + share * runs_s * east, boat[1] + share * runs_s * north) for share in shares]
    if status.mode is Mode.LOITER:
        starts += [moved(boat, math.radians(off), AHEAD_S * vehicle.speed_mps) for off in (0.0, 90.0, 180.0, 270.0)]
    found = sea_room(
        water, boat, starts, wind, no_go_half_rad=ctx.no_go_half_rad, clear_m=(ctx.config.margin_m, floor_m)
    )
    if found is None or found[1] < (min(left_s, AWAY_S) if circles else min(left_s + ROOMY_S, HORIZON_S)):
        return False  # where it circles too near already, a drift that is some way off is the better
    _stop_planning(ctx)
    place, gained_s = found
    keep = min(state.mission.index, len(route.items) - 1)
    onto = water.nearest_name(boat) or "something"
    here = f"circle too near to {onto}" if circles else f"drift onto {onto} in {left_s:.0f} s"
    text = (
        f"{ctx.snapshot.unsure}: a loiter here would {here}; waiting until there is "
        f"{'sea room' if gained_s >= HORIZON_S else f'room for {gained_s:.0f} s'}"
    )
    end = waypoint(ctx.voyage.frame.geo_from_en(*place), command=Command.NAV_LOITER_UNLIM)
    upload(ctx, route.led_aside(keep, boat, [(end, place)], rung=SEA_ROOM, why=text), keep + 1, text)
    if not state.adrift.loitered:
        ctx.set(adrift=replace(ctx.state.adrift, loiter_en_m=None))  # the next LOITER begins elsewhere
    ctx.say(Severity.WARNING, SEA_ROOM, text, every_s=0.0)
    ctx.phase(Phase.HOLDING, text)
    return True


def _circles_near(ctx: StepContext, water: AreaLike, boat: PointEn) -> bool:
    """Return whether the circles of a LOITER that begins here, or was begun, come below the floor of what is near."""
    begun, status = ctx.state.adrift.loiter_en_m, ctx.autopilot
    is_begun = status is not None and status.mode is Mode.LOITER and begun is not None
    place = begun if is_begun and begun is not None else boat
    floor_m = min(ctx.config.margin_floor_m, ctx.config.margin_m)
    return float(water.clearance_m([place])[0]) < STRAYS_M + floor_m


def _stays(ctx: StepContext, boat: PointEn, wind: DoubtedWind) -> bool:
    """Return whether LOITER has kept its place for so long that the drift foreseen would have left it twice over."""
    memory, status = ctx.state.adrift, ctx.autopilot
    if status is None or status.mode is not Mode.LOITER or memory.loiter_en_m is None or goes_astern(ctx):
        return False
    drifts_m = (ctx.t_s - memory.loiter_s) * math.hypot(*wind.drift_en_mps)
    return distance_m(boat, memory.loiter_en_m) < STRAYS_M and drifts_m >= 2.0 * STRAYS_M


def _is_on_the_way(ctx: StepContext, water: AreaLike, boat: PointEn, place: PointEn) -> bool:
    """Return whether the leg to sea room is clear, and sailed, just begun, or ends in a loiter that is not driven off.

    Not whether the winds of now allow it: what a turned vane tells of the true wind changes with the boat's own speed.
    """
    left_m, vehicle = distance_m(boat, place), ctx.snapshot.vehicle
    if vehicle is None or water.path_clearance_m([boat, place]) < ctx.voyage.boat.hull.reach_m + LEG_CLEAR_M:
        return False
    if left_m < STRAYS_M:
        return not goes_astern(ctx)
    east, north = vehicle.velocity_en_mps
    made_good_mps = (east * (place[0] - boat[0]) + north * (place[1] - boat[1])) / left_m
    return made_good_mps >= WAY_MPS or ctx.t_s - ctx.state.mission.uploaded_s < TURNS_S


def _left_s(water: AreaLike, place: PointEn, wind: DoubtedWind, floor_m: float, *, beyond_s: float = 0.0) -> float:
    """Return for how long a LOITER that begins at a place keeps the floor [s], at most ``HORIZON_S``.

    Anything up to ``beyond_s`` where it does so for no longer than that.
    """
    east, north = wind.drift_en_mps
    least_s = HORIZON_S
    for off in (0.0, -SPREAD_RAD, SPREAD_RAD):
        velocity = (east * math.cos(off) + north * math.sin(off), north * math.cos(off) - east * math.sin(off))
        least_s = min(least_s, floor_after_s(water, place, velocity, floor_m=floor_m))
        if least_s <= beyond_s:
            break
    return least_s


def sea_room(
    water: AreaLike,
    boat: PointEn,
    starts: Sequence[PointEn],
    wind: DoubtedWind,
    *,
    no_go_half_rad: float,
    clear_m: Sequence[float],
) -> tuple[PointEn, float] | None:
    """Return the nearest place from which a LOITER drifts clear, else the one from which it does so longest [s].

    It is reached straight from each of the ``starts``, where the boat may have come to when it turns, ``clear_m`` of
    everything:
    the first of these with which a clear place is found, else any. The told wind may be right after all (a front): then
    the boat circles there, and a place has room for that. None where no such leg is clear.
    """
    best: tuple[PointEn, float] | None = None
    for least_m in clear_m:
        for place in _places(boat, wind, no_go_half_rad):
            if float(water.clearance_m(np.array([place]))[0]) < least_m + STRAYS_M or (
                min(water.path_clearance_m([boat, start, place]) for start in starts) < least_m
            ):
                continue
            left_s = _left_s(water, place, wind, least_m, beyond_s=0.0 if best is None else best[1])
            if best is None or left_s > best[1]:
                best = place, left_s
            if left_s >= HORIZON_S:
                return best
    return best


def _places(boat: PointEn, wind: DoubtedWind, no_go_half_rad: float) -> Iterator[PointEn]:
    """Yield the places that a straight leg leads to, near ones first."""
    courses = [2.0 * math.pi * n / DIRECTIONS for n in range(DIRECTIONS)]
    for ring_m, course in itertools.product(RINGS_M, courses):
        if wind.sails(course, no_go_half_rad):
            yield moved(boat, course, ring_m)


# --------------------------------------------------------------------------------------------- held
def holds(ctx: StepContext) -> bool:
    """Loiter while wind and water are not to be planned with; True while LOITER is ours, or asked for."""
    status, state, why = ctx.autopilot, ctx.state, ctx.snapshot.unsure
    memory = state.adrift
    if not why and memory.loiter_en_m is not None and not memory.loitered:
        ctx.set(adrift=replace(memory, loiter_en_m=None))
    if not why or status is None:
        return False
    _stop_planning(ctx)
    ctx.say(Severity.ERROR, "held", f"{why}: no plan is made until it is known again", every_s=SAID_S)
    if state.by_field.resort.engaged or not ctx.snapshot.permissions.may_set_mode or not status.ekf_ok:
        return False
    if status.mode is Mode.LOITER and state.steering.own_mode is Mode.LOITER:
        if memory.loiter_en_m is None:  # by a wrong wind the boat may be carried off it, which is a drift
            ctx.set(adrift=replace(memory, loiter_en_m=ctx.boat_en, loiter_s=ctx.t_s))
        ctx.phase(Phase.HOLDING, f"{why}: {WAITS}")
        return True
    if _sails_where_no_loiter_has_room(ctx):
        ctx.phase(Phase.HOLDING, f"{why}: sailing on, waiting until a loiter's circles have room")
        return True
    if state.steering.until_s is not None:  # out of irons, it was believed
        ctx.set(steering=changed(ctx.state.steering, until_s=None, heading_rad=None))
    if not is_busy(ctx, Mode.LOITER.name) and set_mode(ctx, Mode.LOITER, why):
        ctx.set(operator=changed(ctx.state.operator, is_back=True))
    ctx.phase(Phase.HOLDING, f"{why}: waiting for the autopilot to take LOITER")
    return True


def _sails_where_no_loiter_has_room(ctx: StepContext) -> bool:
    """Return whether she makes way along what is on board, and a LOITER here would circle into what is near.

    A front that turns the wind farther than it is believed to looks like a vane that was turned, but then she sails by
    it; by a wind that is wrong she soon does not.
    """
    status, boat, vehicle = ctx.autopilot, ctx.boat_en, ctx.snapshot.vehicle
    if status is None or boat is None or vehicle is None or status.mode is not Mode.AUTO or not ctx.ahead():
        return False
    east, north = vehicle.velocity_en_mps
    ahead_mps = east * math.sin(vehicle.heading_rad) + north * math.cos(vehicle.heading_rad)
    return ahead_mps >= SAILS_MPS and _circles_near(ctx, water_at(ctx.voyage.area, boat), boat) and is_way_clear(ctx)


def _stop_planning(ctx: StepContext) -> None:
    """Call off a plan that is being made, and come down from the ladder."""
    if ctx.state.pending.plan is not None:
        ctx.act(CancelPlan(request_id=ctx.state.pending.plan.request_id))
        ctx.set(pending=changed(ctx.state.pending, plan=None))
    ctx.set(plans=changed(ctx.state.plans, rung=0))
