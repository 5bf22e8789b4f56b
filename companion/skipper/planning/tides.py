"""The tide over water that dries: what a plan is told of it, and the way being sailed held against it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from companion.current import hour_words, span_words
from companion.skipper.planning.vessels import timed_legs
from companion.skipper.step.context import StepContext
from companion.skipper.way import PointEn
from companion.skipper.way.drying import DryingWater, TimedWater, timed
from companion.traffic.plans import TimedLeg

DAY_S = 86_400.0
LEAVES_S = 120.0  # what leaving water that is about to dry takes: a plan and a turn ...
LEAVES_MPS = 0.5  # ... and a slow way out


def told(ctx: StepContext, start_en: PointEn, after_s: float, margin_m: float) -> TimedWater:
    """Return what a plan is told of water that dries which begins at a place ``after_s`` from now."""
    now_s = ctx.utc_s
    return timed(
        ctx.voyage.drying,
        ctx.config.tide,
        None if now_s is None else now_s + after_s,
        margin_m=margin_m,
        start_en=start_en,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Closes:
    """Water that the way leads over while it is too shallow: what it is called, and in how long she is there."""

    name: str
    in_s: float


def closes_ahead(ctx: StepContext) -> Closes | None:
    """Return the first water that dries which what is left of the route meets at its hours; None: none."""
    waters, boat = ctx.voyage.drying, ctx.boat_en
    if not waters or boat is None or ctx.config.tide is None or ctx.utc_s is None:
        return None
    floor_m = min(ctx.config.margin_floor_m, ctx.config.margin_m)
    here = shapely.points(boat)
    left = [w for w in waters if float(shapely.distance(w.polygon, here)) > floor_m]  # else she has to come out of it
    return first_met(timed_legs(ctx), left, ctx, floor_m)


def dries_under(ctx: StepContext, place_en: PointEn) -> str:
    """Return which water that dries a boat who stays at a place has to leave by now, empty: none.

    It is left in time to sail out of it, slowly, before it may be too shallow.
    """
    place, floor_m = shapely.points(place_en), min(ctx.config.margin_floor_m, ctx.config.margin_m)
    for water in ctx.voyage.drying:
        if float(shapely.distance(water.polygon, place)) > floor_m:
            continue
        windows = water.doubtful_s(ctx.config.tide, ctx.utc_s)
        out_m = floor_m + float(shapely.distance(water.polygon.exterior, place))
        if windows and windows[0][0] < LEAVES_S + out_m / LEAVES_MPS:
            return water.name
    return ""


def first_met(
    legs: Sequence[TimedLeg], waters: Sequence[DryingWater], ctx: StepContext, clear_m: float
) -> Closes | None:
    """Return the first water that legs, timed from now on, come nearer to than ``clear_m`` while it is closed."""
    shapes = np.asarray([w.polygon for w in waters], dtype=object)
    for leg in legs:
        line = shapely.linestrings([leg.from_en, leg.to_en])
        for n in map(int, np.flatnonzero(shapely.dwithin(shapes, line, clear_m)) if len(shapes) else ()):
            for begin, end in waters[n].closed_s(ctx.config.tide, ctx.utc_s):
                part = _part(leg, begin, end)
                if part is not None and bool(shapely.dwithin(shapes[n], part, clear_m)):
                    return Closes(name=waters[n].name, in_s=max(leg.start_s, begin))
    return None


def _part(leg: TimedLeg, begin_s: float, end_s: float) -> shapely.LineString | None:
    """Return what of a leg is sailed between two times; None: nothing."""
    lo, hi = max(leg.start_s, begin_s), min(leg.end_s, end_s)
    span = leg.end_s - leg.start_s
    if hi < lo or not math.isfinite(lo) or span <= 0.0:
        return None
    at = [(t - leg.start_s) / span for t in (lo, hi)] if math.isfinite(span) else [0.0, 1.0]
    (ax, ay), (bx, by) = leg.from_en, leg.to_en
    return shapely.LineString([(ax + share * (bx - ax), ay + share * (by - ay)) for share in at])


@dataclass(frozen=True, slots=True, kw_only=True)
class Opens:
    """Which water that is too shallow now opens first, in how long [s], and both in words."""

    in_s: float
    words: str


def opens_next(ctx: StepContext) -> Opens | None:
    """Return which of the water that is too shallow now opens first, and when; None: none does by the table."""
    now_s, table = ctx.utc_s, ctx.config.tide
    if now_s is None or table is None:
        return None
    soonest: tuple[float, str] | None = None
    for water in ctx.voyage.drying:
        windows = water.closed_s(table, now_s)
        if windows and windows[0][0] <= 0.0 and math.isfinite(windows[0][1]):
            found = (windows[0][1], water.name)
            soonest = found if soonest is None else min(soonest, found)
    if soonest is None:
        return None
    in_s, name = soonest
    is_today = (now_s + in_s) // DAY_S == now_s // DAY_S
    at = hour_words(now_s + in_s)
    words = f"{name} opens at {f'{at[-6:-1]} UTC' if is_today else at}"
    unknown = "" if table.height_m(now_s) is not None else f"; nothing is known of the tide now: {span_words(table)}"
    return Opens(in_s=in_s, words=words + unknown)
