"""The track of a plan as the skipper sees it: what a problem says of it, and whether a way's track keeps the floor."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from companion.boat import AutopilotLimits, Boat
from companion.boat.tracking import GuidanceModel, stated_error_m
from companion.messages import WindForecast
from companion.planner import Problem
from companion.planner.track import ExpectedTrack, expected
from companion.skipper.planning.ladder import Rung, rungs
from companion.skipper.planning.statement import Start
from companion.skipper.step.config import SkipperConfig
from companion.skipper.step.context import StepContext
from companion.skipper.way.voyage import AreaLike, PointEn, water_to_keep

BOWS_RAD = np.linspace(0.0, np.pi, 37)
# What a straight leg's track may need, in steps: water that is grown by a margin is kept, and made before sailing.
TRACKS_M = (2.0, 2.5, 4.0, 8.0)


def problem_tracking(
    ctx: StepContext, start: Start, from_index: int | None, *, area: AreaLike, floor_m: float, forecast: WindForecast
) -> dict[str, Any]:
    """Return the ``tracking`` of a problem: the autopilot's parameters, the hull, and what is solid of ``area``."""
    helm, route, tws_mps = _helm(ctx), ctx.state.mission.route, float(np.max(forecast.mean_tws_mps))
    boat, before = ctx.voyage.boat, None
    if from_index is not None and route is not None:
        before = route.leg_from_en_m[from_index]
    elif start.lead_in:
        before = ctx.boat_en
    return {
        **helm.stated(),
        "no_go_half_deg": float(np.degrees(ctx.no_go_half_rad)),
        "floor_m": floor_m,
        "reach_m": boat.hull.reach_m,
        **({} if boat.leeway_rad == 0.0 else {"leeway_deg": np.degrees(boat.leeways_rad(BOWS_RAD, tws_mps)).tolist()}),
        "solids": area.obstacles_wkt(0.0),
        "limits": (water_to_keep(area, start.en_m) if start.back_en else area).fence_wkt(0.0, start.en_m),
        "before": None if before is None else {"x": before[0], "y": before[1]},
        "correlation_s": forecast.correlation_time_s,
        "known": _is_known(ctx),
    }


def steps(ctx: StepContext) -> tuple[Rung, ...]:
    """Return the ladder: its margins end where the floor is what is left beside a straight leg's track."""
    wind, in_current = ctx.wind_mean, ctx.snapshot.current.is_significant
    if wind is None:
        return rungs(ctx.config, in_current=in_current)
    track_m = _straight_m(ctx.voyage.boat, wind[1], _helm(ctx), is_known=_is_known(ctx))
    return rungs(ctx.config, track_m=track_m, in_current=in_current)


def straight_track_m(config: SkipperConfig, boat: Boat, tws_mps: float) -> float:
    """Return what a straight leg's track takes beside it in a wind [m], by an autopilot with its defaults."""
    helm = GuidanceModel.of(AutopilotLimits(sail_xtrack_max_m=config.tack_corridor_m))
    return _straight_m(boat, tws_mps, helm, is_known=True)


def _straight_m(boat: Boat, tws_mps: float, helm: GuidanceModel, *, is_known: bool) -> float:
    """Return what a straight leg's track takes beside it in a wind [m], in steps, the hull with it."""
    track_m = stated_error_m(boat.polar.max_speed_mps(tws_mps), helm, has_short=not is_known) + boat.hull.reach_m
    return next((step for step in TRACKS_M if step >= track_m), track_m)


def _helm(ctx: StepContext) -> GuidanceModel:
    return GuidanceModel.of(ctx.snapshot.limits or AutopilotLimits(sail_xtrack_max_m=ctx.tack_corridor_m))


def _is_known(ctx: StepContext) -> bool:
    """Return whether the parameters that shape the track were read."""
    limits = ctx.snapshot.limits
    return limits is not None and limits.wp_speed_mps is not None


def of_way(
    problem: Problem,
    way: Sequence[PointEn],
    *,
    heading_rad: float,
    before_en: PointEn | None,
    sailed_m: float = 0.0,
    has_loops: bool = True,
) -> ExpectedTrack:
    """Return what is expected of a way that begins elsewhere than the problem, its beats left aside.

    ``before_en``: where the leg begins that ends at its start; or its start is on its first leg, ``sailed_m`` along.
    ``has_loops``: allow for loops about legs that are too short to be followed.
    """
    tracking = problem.tracking
    if tracking is None or len(way) < 2:
        return ExpectedTrack()
    from_here = replace(
        problem, start_en=way[0], start_heading_rad=heading_rad, tracking=replace(tracking, before_en=before_en)
    )
    return expected(from_here, np.asarray(way), has_boards=False, has_loops=has_loops, sailed_m=sailed_m)


def clearance_text(clearance_m: float | None, floor_m: float) -> str:
    """Return an expected clearance in words, behind a plan's reason."""
    return "" if clearance_m is None else f"; passes {clearance_m:.1f} m clear or more (floor {floor_m:g} m)"
