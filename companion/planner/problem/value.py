"""The planning problem as a value: where from, where to, what is in the way, which wind, which boat.

The JSON format (metres, degrees) and its extensions are in docs/problem-format.md. Inside, angles are radians and
geometry is shapely's, in local east-north metres. ``Problem.from_json`` raises ``InputError`` for what cannot be
read; what can be read but not planned (zero wind, NaN, delta_s out of range, a start inside an obstacle) is found
by ``defect_of`` and becomes ``PlanStatus.INVALID``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from statistics import NormalDist
from typing import TYPE_CHECKING, Any

import shapely

from companion.planner.problem.json_read import read_fields
from companion.planner.problem.parts import (
    NO_CURRENT,
    TOUCH_M,
    Beat,
    BoatLimits,
    Current,
    RiskLimit,
    Target,
    Wind,
    Zone,
    interpolated,
)

if TYPE_CHECKING:
    from companion.planner.problem.tracking import Tracking

BEAT_CLEAR_SHARE = 0.98
"""Of a beaten leg's clearance that is checked: the arcs of a grown obstacle are polygons inside the circle."""
VESSELS_SHARE = 0.1
"""Of 1 - delta_s, given to vessels where the problem does not say: a zone a few percent wider costs less than discs."""
LEG_SAVING = 1e-5


@dataclass(frozen=True, kw_only=True, eq=False)
class Problem:
    """One planning problem (see the module's text). Times count from the start of the plan, t = 0.

    ``vessels_part`` is what uncertain targets get of 1 - delta_s, at each instant and together; None: a tenth of it.
    ``tracking`` says how the plan will be sailed, and what that track keeps clear of; without it the legs alone count.
    ``adrift`` is a current that is believed and not sure enough to be planned with: it carries her where a tack fails.
    ``leg_saving`` is what a leg must save, as a share of the path's time, for ``auto`` to keep it.
    """

    id: str = ""
    title: str = ""
    start_en: tuple[float, float]
    start_heading_rad: float
    goal_en: tuple[float, float]
    goal_radius_m: float
    obstacles: tuple[shapely.Geometry, ...] = ()
    obstacle_names: tuple[str, ...] = ()
    fence: shapely.Geometry | None = None
    wind: Wind
    boat: BoatLimits
    delta_s: float = 0.5
    current: Current = NO_CURRENT
    adrift: Current = NO_CURRENT
    zone: Zone | None = None
    targets: tuple[Target, ...] = ()
    vessels_part: float | None = None
    risk: RiskLimit | None = None
    clearance_floor_m: float = 0.0
    leg_saving: float = LEG_SAVING
    beat: Beat | None = None
    tracking: Tracking | None = None
    notes: str = ""
    extra: Mapping[str, Any] = field(default_factory=dict, repr=False)

    @classmethod
    def from_json(cls, source: str | Path | Mapping[str, Any]) -> Problem:
        """Return the problem in a JSON file or an already parsed mapping.

        Raises:
            InputError: the file cannot be read, a field is missing or not of its type, a WKT does not parse.

        """
        return cls(**read_fields(source))

    def obstacle_name(self, index: int) -> str:
        """Return what an obstacle is called: by its name, else by its number from 1."""
        names = self.obstacle_names[index:index + 1]
        return names[0] if names and names[0] else f"obstacle {index + 1}"

    # ----------------------------------------------------------------------------------------- no-go
    @property
    def is_shared(self) -> bool:
        """Do uncertain targets share the promise with the wind?"""
        return any(t.spread is not None for t in self.targets)

    @property
    def vessels_share(self) -> float:
        """What uncertain targets get of 1 - delta_s; 0 without any."""
        if not self.is_shared:
            return 0.0
        return VESSELS_SHARE * (1.0 - self.delta_s) if self.vessels_part is None else self.vessels_part

    @cached_property
    def wind_delta_s(self) -> float:
        """The wind's own delta_s: 1 - delta_s less the part of uncertain targets; delta_s without them."""
        return self.delta_s + self.vessels_share

    @cached_property
    def k_delta(self) -> float:
        """Multiplier of sigma, sqrt(2) erfinv(2 delta_s - 1) >= 0 (Wolsieffer eq. 15 with its sign put right)."""
        # sqrt(2) erfinv(2 p - 1) is the standard normal quantile of p
        return NormalDist().inv_cdf(self.wind_delta_s) if 0.5 <= self.wind_delta_s < 1.0 else math.nan

    def widening_rad(self, t_s: float) -> float:
        """Return b(t): how much the no-go half angle is widened at ``t_s`` [rad]."""
        sigma = self.wind.sigma
        if sigma.model == "forecast" and sigma.half_width_rad is not None:
            return interpolated(t_s, sigma.horizon_s, sigma.half_width_rad)
        return self.k_delta * sigma.at(t_s)

    def no_go_half_rad(self, t_s: float) -> float:
        """Return the tightened no-go half angle at ``t_s`` [rad]."""
        return self.boat.no_go_half_rad + self.widening_rad(t_s)

    @cached_property
    def no_go_min_rad(self) -> float:
        """Infimum of the no-go half angle over all t >= 0 [rad]."""
        return self.boat.no_go_half_rad + min(self._widening_extremes())

    @cached_property
    def no_go_max_rad(self) -> float:
        """Supremum of the no-go half angle over all t >= 0 [rad]; may be infinite."""
        return self.boat.no_go_half_rad + max(self._widening_extremes())

    def _widening_extremes(self) -> tuple[float, ...]:
        sigma = self.wind.sigma
        if sigma.model == "kalman":
            grows = sigma.growth_rad_per_sqrt_s > 0.0 and self.k_delta > 0.0
            return (self.widening_rad(0.0), math.inf if grows else self.widening_rad(0.0))
        if sigma.model == "ar1":
            late = sigma.sigma_inf_rad if sigma.rho_hz > 0.0 else sigma.sigma0_rad
            return (self.k_delta * sigma.sigma0_rad, self.k_delta * late)
        if sigma.model == "forecast":
            return tuple(self.widening_rad(t) for t in sigma.horizon_s)
        return (0.0,)

    @property
    def is_time_varying(self) -> bool:
        """Does the no-go zone change with time?"""
        extremes = self._widening_extremes()
        return max(extremes) > min(extremes)

    # -------------------------------------------------------------------------------------- geometry
    @cached_property
    def obstacle_union(self) -> shapely.Geometry:
        """All obstacles as one repaired geometry, grown by the clearance floor."""
        parts = [g if g.is_valid else shapely.make_valid(g) for g in self.obstacles if not g.is_empty]
        union = shapely.union_all(parts) if parts else shapely.Polygon()
        return union.buffer(self.clearance_floor_m) if self.clearance_floor_m > 0.0 and parts else union

    @cached_property
    def fence_polygon(self) -> shapely.Geometry | None:
        """The fence, repaired and shrunk by the clearance floor; None without a fence."""
        if self.fence is None:
            return None
        fence = self.fence if self.fence.is_valid else shapely.make_valid(self.fence)
        return fence.buffer(-self.clearance_floor_m) if self.clearance_floor_m > 0.0 else fence

    @cached_property
    def solid(self) -> shapely.Geometry:
        """Obstacles and everything outside the fence."""
        solid, fence = self.obstacle_union, self.fence_polygon
        if fence is not None:
            x0, y0, x1, y1 = fence.bounds if not fence.is_empty else (0.0, 0.0, 0.0, 0.0)
            margin = 0.5 * max(x1 - x0, y1 - y0)
            frame = shapely.box(x0 - margin, y0 - margin, x1 + margin, y1 + margin)
            solid = shapely.union(solid, frame.difference(fence))
        return solid

    @cached_property
    def eval_solid(self) -> shapely.Geometry:
        """``solid`` shrunk by the numerical slack and prepared: a leg that intersects it collides."""
        shrunk = self.solid.buffer(-TOUCH_M, join_style="mitre", mitre_limit=5.0)
        shapely.prepare(shrunk)
        return shrunk

    @cached_property
    def beat_solid(self) -> shapely.Geometry:
        """``solid`` grown by what a leg beaten by the autopilot needs, prepared; round corners cut off a little."""
        clear = self.beat.clearance_m if self.beat is not None else 0.0
        grown = self.solid.buffer(BEAT_CLEAR_SHARE * clear - TOUCH_M)
        shapely.prepare(grown)
        return grown
