"""Learns the boat under way: which seconds may be learned from, and what is said when plans are told of it.

What is learned, and how, is ``companion.boat.afloat``'s. Nothing that may be poisoned comes there: a vane, a position
or a wind in doubt, a motor, a person, a boat that does not follow a leg of her plan.
"""

from __future__ import annotations

import math

from companion.boat import Afloat, LearnedAfloat, Look, Why, factor, followed
from companion.mavlink.wire import Effect, effect_of
from companion.messages import Mode, Severity
from companion.skipper.step.config import Learning
from companion.skipper.step.context import StepContext
from companion.skipper.step.snapshot import ParameterChanged, Snapshot, WindHealth
from companion.skipper.step.state import Phase

LATE_S = 1.5  # an older position is no second of its own
SETTLES_S = 60.0  # after a position was doubted
SAILED = frozenset({Phase.STANDARD, Phase.NEW_CALCULATION, Phase.DESTINATION_APPROACH, Phase.BUOY_APPROACH})
ANEW = frozenset({Effect.WIND, Effect.HEADING, Effect.BOAT})  # of a parameter that was set: what was learned is void
CODE = "boat learned"


def learn_boat(ctx: StepContext) -> None:
    """Let the boat be learned from one more second; say when plans are told of it, and when no more."""
    if ctx.config.learn is Learning.OFF or not ctx.config.sails:
        return
    if any(isinstance(e, ParameterChanged) and effect_of(e.name) in ANEW for e in ctx.snapshot.events):
        known = ctx.state.afloat.known
        ctx.set(afloat=Afloat().with_known(LearnedAfloat(of=known.of, is_frozen=known.is_frozen)))
    now, why = ctx.state.afloat, poison(ctx)
    look = None if why is not None else _look(ctx.snapshot)
    if look is None:
        then = now.without(why or Why.UNKNOWN)
    else:
        then = followed(now, look, ctx.boat_of_file)
    if then is now:
        return
    ctx.set(afloat=then)
    if then.known.is_used != now.known.is_used:
        ctx.say(Severity.NOTICE, CODE, _said(then.known, ctx), every_s=0.0)


def poison(ctx: StepContext) -> Why | None:
    """Return why this second must not be learned from, None: it may."""
    state, snapshot, status = ctx.state, ctx.snapshot, ctx.autopilot
    position, wind = state.position, snapshot.wind
    if status is None or not (state.voyage.sailing and status.is_armed and status.mode is Mode.AUTO):
        return Why.NOT_SAILED
    if state.phase not in SAILED or state.voyage.over or not state.vehicle.is_ours:
        return Why.NOT_SAILED
    if state.adrift.motor:
        return Why.MOTOR
    if (
        not status.ekf_ok
        or position.doubt is not None
        or position.lost_s is not None
        or position.disputed_s is not None
        or ctx.t_s - position.back_s < SETTLES_S
    ):
        return Why.RESET
    if wind.health is WindHealth.UNTRUSTED:
        return Why.FROZEN_VANE
    if snapshot.unsure or snapshot.wind_before is not None:
        return Why.DOUBTED
    return None if wind.health is WindHealth.GOOD else Why.LIGHT


def _look(snapshot: Snapshot) -> Look | None:
    vehicle, wind, here, age_s = snapshot.vehicle, snapshot.wind, snapshot.position_en_m, snapshot.vehicle_age_s
    if vehicle is None or here is None or age_s is None or age_s > LATE_S:
        return None
    if wind.present_twd_from_rad is None or wind.present_tws_mps is None:
        return None
    current = snapshot.current
    east, north = current.en_mps
    return Look(
        t_s=snapshot.t_s,
        here_en_m=here,
        velocity_en_mps=(vehicle.velocity_en_mps[0] - east, vehicle.velocity_en_mps[1] - north),
        heading_rad=vehicle.heading_rad,
        # The wind over the water, where it comes from: that over the ground, and what the water moves towards it.
        wind_en_mps=(
            wind.present_tws_mps * math.sin(wind.present_twd_from_rad) + east,
            wind.present_tws_mps * math.cos(wind.present_twd_from_rad) + north,
        ),
        doubt_mps=current.sigma_along_mps(math.sin(vehicle.heading_rad), math.cos(vehicle.heading_rad)),
    )


def _said(known: LearnedAfloat, ctx: StepContext) -> str:
    if not known.is_used:
        return "the boat's file predicts her speed as well as what was learned: plans are of her file"
    wind = ctx.wind_mean
    tws_mps = 5.0 if wind is None else wind[1]
    shares = ", ".join(
        f"{100.0 * float(factor(known.told.x, math.radians(angle), tws_mps)):.0f} % at {angle}°"
        for angle in (50, 90, 150)
    )
    how = f"it was {100.0 * (1.0 - known.own_error / max(known.file_error, 1e-9)):.0f} % less wrong in the last hour"
    what = "plans are of the boat as she sails" if ctx.config.learn is Learning.USE else "it is not used (shadow)"
    return f"learned speeds predict better than her file, {how}; {shares} of it: {what}"
