"""Watches tacks: which come off, which fail; what is done about one that failed.

A tack is tried when the boat's heading, and not the wind, has brought the bow near the wind, or nearer and to a stop:
the wind over a boat in irons is not that of 5 s ago, and a vane may be turned. It has come off when it is settled on
the other tack, and failed when it is back on the old one, having lain near the wind for ``ABORTED_S`` or lost its way
there, or lies there for ``LIES_S``. A wind that heads it and makes it bear away is no tack: its heading has turned the
other way.
"""

from __future__ import annotations

import math
from dataclasses import replace

from companion.boat.failed_tack import SHOOT_S
from companion.frozen import changed
from companion.geo.angles import difference_rad
from companion.messages import Mode, Severity
from companion.skipper.planning.autopilot_beats import TACKS_FAIL_AFTER
from companion.skipper.step.actions import ReplanReason
from companion.skipper.step.context import StepContext
from companion.skipper.step.saved import MOST_IRONS_S, MOST_LEE_MPS
from companion.skipper.step.state import Tacking
from companion.skipper.way.voyage import PointEn

SETTLED_RAD = math.radians(30.0)
NEAR_RAD = math.radians(20.0)  # of the wind, of which the mean of 5 s is known
TURNED_RAD = math.radians(15.0)  # towards it, since it was settled
ABORTED_S = 5.0  # back sooner, the boat was told otherwise: an upload has begun its leg anew ...
STOPPED = 0.4  # ... unless its speed fell to less than this share: in a tack it falls to half
LIES_S = 8.0  # as the watchdog "in irons" has it
AGAIN_S = 12.0  # longer after that no single failure lies: it fell off for a moment, and what it tried failed again
FORGET_S = 20.0  # settled longer ago than this, whatever follows is no tack from there
LEAST_TWS_MPS = 1.5  # in less the boat does as it likes
NEAR_SOLID_M = 60.0  # a tack that failed so near something asks for a new plan
TACK_FAILED = "a tack failed"


def watch_tacks(ctx: StepContext) -> None:
    """Follow the boat's tacks for one step."""
    now, vehicle, wind, status = ctx.state.tacking, ctx.snapshot.vehicle, ctx.wind_now, ctx.autopilot
    sails = (
        ctx.state.voyage.sailing
        and ctx.config.sails
        and status is not None
        and (status.is_armed and status.mode in {Mode.AUTO, Mode.GUIDED})
    )
    if not sails or vehicle is None or wind is None or wind[1] < LEAST_TWS_MPS:
        if now.side or now.began_s is not None:
            ctx.set(tacking=replace(now, side=0, began_s=None, is_counted=False))
        return
    through_mps = math.dist(vehicle.velocity_en_mps, ctx.snapshot.current.en_mps)  # as it is believed to move
    then = followed(now, ctx.t_s, vehicle.heading_rad, wind[0], through_mps)
    if then.began_s is not None and now.began_s is None:
        then = replace(then, began_en_m=ctx.boat_en)
    elif now.began_s is not None and then.began_s is None and (now.is_counted or then.failed > now.failed):
        then = after_failure(now, then, ctx.t_s, ctx.boat_en, wind[0], ctx.snapshot.current.en_mps)
    if then != now:
        ctx.set(tacking=then)
    if then.failed > now.failed:
        _failed(ctx, then)


def followed(now: Tacking, t_s: float, heading_rad: float, twd_from_rad: float, speed_mps: float) -> Tacking:
    """Return what is known of tacks with one more look at the boat's heading, and at its speed through the water."""
    off = difference_rad(twd_from_rad, heading_rad)
    side = 1 if off > 0.0 else -1
    fresh = now.side != 0 and t_s - now.settled_s <= FORGET_S
    if now.began_s is not None and not now.is_counted and t_s - now.began_s >= LIES_S and abs(off) < SETTLED_RAD:
        now = _counted(replace(now, is_counted=True, settled_s=t_s), t_s, failed=True)
    elif now.is_counted and t_s - now.failed_s >= AGAIN_S and abs(off) < SETTLED_RAD:
        now = _counted(now, t_s, failed=True)
    # Yawing in a sea the boat is beyond that angle for a moment while it lies, and settled on no tack.
    lies = now.began_s is not None and speed_mps < STOPPED * now.settled_mps and side == now.side
    if abs(off) >= SETTLED_RAD and not lies:
        if now.began_s is not None and not now.is_counted:
            is_back = side == now.side
            is_stopped = now.slowest_mps < STOPPED * now.settled_mps
            if not is_back or is_stopped or t_s - now.began_s >= ABORTED_S:
                now = _counted(now, t_s, failed=is_back)
        elif fresh and now.began_s is None and side != now.side and _through_the_eye(now, heading_rad, off):
            now = _counted(now, t_s, failed=False)  # between two looks
        return replace(
            now,
            side=side,
            settled_rad=heading_rad,
            settled_s=t_s,
            settled_mps=speed_mps,
            began_s=None,
            is_counted=False,
        )
    turned = now.side * difference_rad(heading_rad, now.settled_rad)
    is_near = abs(off) < NEAR_RAD or speed_mps < STOPPED * now.settled_mps
    if fresh and now.began_s is None and is_near and turned >= TURNED_RAD:
        return replace(now, began_s=t_s, slowest_mps=speed_mps)
    return replace(now, slowest_mps=min(now.slowest_mps, speed_mps)) if now.began_s is not None else now


def after_failure(
    now: Tacking, then: Tacking, t_s: float, boat_en_m: PointEn | None, twd_from_rad: float, current_en_mps: PointEn
) -> Tacking:
    """Return ``then`` with what the failure that it ends has told: how long it lay, how fast it was set to lee.

    What the believed current and its way on (``companion.boat.failed_tack``) explain is not counted.
    """
    if now.began_s is None or t_s <= now.began_s:
        return then
    span_s = t_s - now.began_s
    then = replace(then, irons_s=max(then.irons_s, min(span_s, MOST_IRONS_S)))
    if boat_en_m is None or now.began_en_m is None or span_s < LIES_S:
        return then
    abeam_rad = twd_from_rad - math.copysign(0.5 * math.pi, now.side)
    shot_m = SHOOT_S * now.settled_mps
    up_rad = now.settled_rad + 0.5 * difference_rad(twd_from_rad, now.settled_rad)
    east_m = boat_en_m[0] - now.began_en_m[0] - shot_m * math.sin(up_rad) - span_s * current_en_mps[0]
    north_m = boat_en_m[1] - now.began_en_m[1] - shot_m * math.cos(up_rad) - span_s * current_en_mps[1]
    lee_mps = min(MOST_LEE_MPS, max(0.0, (east_m * math.sin(abeam_rad) + north_m * math.cos(abeam_rad)) / span_s))
    if now.side > 0:
        return replace(then, starboard_lee_mps=max(then.starboard_lee_mps, lee_mps))
    return replace(then, port_lee_mps=max(then.port_lee_mps, lee_mps))


def _counted(now: Tacking, t_s: float, *, failed: bool) -> Tacking:
    return replace(
        now,
        tried=now.tried + 1,
        failed=now.failed + failed,
        in_a_row=now.in_a_row + 1 if failed else 0,
        failed_s=t_s if failed else now.failed_s,
    )


def _through_the_eye(now: Tacking, heading_rad: float, off_rad: float) -> bool:
    """Return whether the boat has come to this side with the bow through the wind, by its own turn."""
    turned = now.side * difference_rad(heading_rad, now.settled_rad)
    return turned >= 2.0 * TURNED_RAD and abs(off_rad) < 0.5 * math.pi


def _failed(ctx: StepContext, tacking: Tacking) -> None:
    """Say so, and ask for a plan from here where the boat has little room, or has tried often enough."""
    given, boat = ctx.voyage.boat.tack_fails, ctx.boat_en
    told = (
        ""
        if given <= 0.0
        else (
            f": the next one does by {100.0 * tacking.chance(given):.0f} %, "
            f"give or take {100.0 * tacking.spread(given):.0f} %"
        )
    )
    ctx.say(
        Severity.NOTICE, "tack failed", f"{TACK_FAILED}, {tacking.failed} of {tacking.tried} so far{told}", every_s=0.0
    )
    if given <= 0.0 or boat is None:
        return
    is_near = float(ctx.voyage.area.clearance_m([boat])[0]) < NEAR_SOLID_M
    if tacking.in_a_row >= TACKS_FAIL_AFTER or is_near:
        ctx.set(plans=changed(ctx.state.plans, asked=TACK_FAILED, asked_as=ReplanReason.TACK_FAILED))
