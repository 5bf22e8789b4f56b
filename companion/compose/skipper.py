"""A mission's skipper: thresholds, safe ends and what the operator allows."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

from companion.compose.planner import planner_of
from companion.errors import InputError
from companion.geofence import Mission
from companion.orders import ALL, Verb, unknown
from companion.skipper.step import (
    CHOICES,
    SHORE,
    End,
    Ends,
    Guidance,
    Permissions,
    ReplanPolicy,
    SafeEnd,
    SkipperConfig,
)
from companion.traffic import Policy


def config_of(mission: Mission) -> SkipperConfig:
    """Return the skipper's thresholds; what the mission does not say keeps its default."""
    options = mission.skipper
    changes: dict[str, Any] = {
        "sails": mission.autopilot.frame == "sailboat",
        "delta_s": mission.risk.delta_s,
        "max_path_risk": mission.risk.max_path_risk,
        "delta_s_ladder": tuple(d for d in SkipperConfig().delta_s_ladder if d < mission.risk.delta_s),
        "margin_m": mission.margin_m,
        "margin_floor_m": mission.margin_floor_m,
        "planner": planner_of(mission),
        "plan_budget_s": options.planning_budget_s,
        "first_plan_budget_s": options.planning_budget_s,
        "autopilot_beats": options.autopilot_beats, "shifts": options.shifts,
        "shift_tacks_apart_s": 60.0 / options.tacks_per_minute,
        "replan_policy": ReplanPolicy(options.replan),
        "guidance": Guidance(options.guidance),
        "station_s": options.station_s,
        "adopts": mission.options.from_autopilot,
        "ends": _ends(mission),
        "voyage_timeout_s": options.voyage_timeout_s,
        "min_replan_interval_s": options.min_replan_s,
        "traffic_clearance_m": mission.traffic.safe_distance_m,
        "traffic_time_s": mission.traffic.safe_time_s,
        "traffic_policy": Policy(mission.traffic.policy),
        "wind_change_rad": math.radians(options.wind_shift_deg),
        "grid_size_m": options.off_track_m,
        "horizon_m": options.horizon_m,
        "safe_end": SafeEnd.RETURN if options.end == "home" else SafeEnd.LOITER,
    }
    if options.max_replan_s is not None:
        changes["plan_age_s"] = options.max_replan_s
    return replace(SkipperConfig(), **changes)


def _ends(mission: Mission) -> Ends:
    safety = mission.safety
    return Ends(
        battery=End(safety.battery), battery_v=safety.battery_v, leak=End(safety.leak),
        out_of_time=End(safety.out_of_time), strong_wind=End(safety.strong_wind),
        light_wind=End(safety.light_wind), dark=End(safety.dark),
        dark_below_rad=math.radians(safety.dark_below_deg), shore_lost=End(safety.shore_lost),
        shore_lost_s=safety.shore_lost_s, battery_reserve=safety.battery_reserve,
        failsafes=tuple((name, CHOICES[word]) for name, word in (
            ("position", safety.position_failsafe), ("battery", safety.battery_failsafe),
            ("fence", safety.fence_failsafe), (SHORE, safety.shore_failsafe))),
    )


def permissions_of(mission: Mission, *, dry_run: bool = False) -> Permissions:
    """Return what the operator allows. Uploading a mission goes with setting AUTO; a dry run allows nothing."""
    if dry_run:
        return Permissions()
    operator = mission.operator
    return Permissions(
        orders=_orders(mission, "orders", mission.operator.orders),
        local_orders=_orders(mission, "local_orders", mission.operator.local_orders),
        far_orders=_orders(mission, "far_orders", mission.operator.far_orders),
        may_upload=operator.set_auto, may_upload_fence=operator.upload_fence, may_arm=operator.arm,
        may_set_mode=operator.set_auto, may_steer=operator.guided, may_replace_foreign=operator.replace_foreign,
    )


def _orders(mission: Mission, key: str, given: tuple[str, ...] | str) -> tuple[str, ...]:
    """Return the verbs that a key of ``[operator]`` permits. Raises InputError for a word that is none."""
    words = (given,) if isinstance(given, str) else given
    for word in words:
        if word != ALL and word not in set(Verb):
            said, _, remedy = unknown(word).partition("; ")
            raise InputError(str(mission.path), f"[operator] {key}", said, f'{remedy}, or "{ALL}"')
    return tuple(words)
