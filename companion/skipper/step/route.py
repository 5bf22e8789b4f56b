"""The route: the mission that is sailed, point by point, and what was promised when it was planned."""

from __future__ import annotations

from dataclasses import dataclass

from companion.messages import MissionItem
from companion.skipper.way.voyage import PointEn


@dataclass(frozen=True, slots=True, kw_only=True)
class Route:
    """The mission that sails: its items and what each is for. Index i has seq i + 1.

    ``points_en_m[i]`` is where item i is (for the safe end: where it ends), ``leg_from_en_m[i]`` where the planned
    leg to it begins, ``gate_of[i]`` the gate (see ``companion.skipper.way.gates``) that reaching it completes, or -1.
    """

    items: tuple[MissionItem, ...] = ()
    points_en_m: tuple[PointEn, ...] = ()
    leg_from_en_m: tuple[PointEn, ...] = ()
    gate_of: tuple[int, ...] = ()
    plan_id: int
    plan_t_s: float                    # when the plan was asked for
    plan_twd_from_rad: float           # mean wind that the plan used
    plan_tws_mps: float
    plan_half_width_rad: float         # half width of the forecast's interval at config.wind_change_level
    margin_m: float
    delta_s: float
    rung: str = ""                     # the step of the ladder it was found on; empty: as configured
    risk: float | None = None          # of the whole path, wind and vessels
    plan_current_east_mps: float = 0.0   # the current that the plan reckons with
    plan_current_north_mps: float = 0.0
    vessel_risk: float = 0.0           # the vessels' part of it
    vessels_part: float = 0.0          # of 1 - delta_s, at each instant, the vessels' part
    expected_clearance_m: float | None = None   # of the hull on the predicted track, the prediction's error taken off
    cost_s: float | None = None
    median_s: float | None = None               # when half the winds of the forecast's spread are there ...
    late_s: float | None = None                 # ... and nine of ten; None: not told, or not in any time
    why: str = ""
    bound_for: str = ""                # the errand that its end serves; empty: the goals
