"""The planning problem as a value: where from, where to, what is in the way, which wind, which boat.

The JSON format (metres, degrees) and its extensions are in docs/problem-format.md. Inside, angles are radians and
geometry is shapely's, in local east-north metres. ``Problem.from_json`` raises ``InputError`` for what cannot be
read; what can be read but not planned (zero wind, NaN, delta_s out of range, a start inside an obstacle) is found
by ``Problem.defect`` and becomes ``PlanStatus.INVALID``.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from statistics import NormalDist
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from numpy.typing import ArrayLike

from companion.errors import InputError

if TYPE_CHECKING:
    from companion.planner.problem.evaluate import Evaluation
    from companion.planner.problem.shore import Shore
    from companion.traffic.occupancy import Spread

TOUCH_M = 1e-3
"""A path may be this deep in an obstacle [m]: numerical slack for touching."""
NO_GO_SLACK_RAD = math.radians(0.01)
"""A leg may be this far inside the no-go zone [rad]: numerical slack."""

BEAT_CLEAR_SHARE = 0.98
"""Of a beaten leg's clearance that is checked: the arcs of a grown obstacle are polygons inside the circle."""

LEAST_MPS = 1e-6
"""A boat that is never faster than this [m/s] cannot move."""
CLEAR_TURN_RAD = math.radians(10.0)
"""A boat that cannot tack turns through dead down wind only where that is the shorter way by twice this [rad]."""
ROUND_RADII = 5.0
"""Turning radii in the leg of a round: from close-hauled to dead down wind and on, 2 tan(135°/2) of them."""

SIGMA_MODELS = ("none", "kalman", "ar1", "forecast")


@dataclass(frozen=True, slots=True, kw_only=True)
class Sigma:
    """How uncertain the wind direction is, t seconds from now.

    ``none``: 0. ``kalman``: s² = sigma0² + growth² t. ``ar1``: s² = sigma_inf² + (sigma0² - sigma_inf²) e^(-2 rho t).
    ``forecast``: a table over ``horizon_s``, linear between and flat beyond; where ``half_width_rad`` is given it
    is the widening of the no-go zone itself (the half width of the central interval that the direction keeps with
    probability 2 delta_s - 1) and k sigma is not used.
    """

    model: str = "none"
    sigma0_rad: float = 0.0
    growth_rad_per_sqrt_s: float = 0.0
    sigma_inf_rad: float = 0.0
    rho_hz: float = 0.0
    horizon_s: tuple[float, ...] = ()
    sigma_rad: tuple[float, ...] = ()
    half_width_rad: tuple[float, ...] | None = None

    def at(self, t_s: float) -> float:
        """Return sigma [rad] at ``t_s`` >= 0 from now."""
        if self.model == "kalman":
            return math.sqrt(self.sigma0_rad**2 + self.growth_rad_per_sqrt_s**2 * t_s)
        if self.model == "ar1":
            v0, vi = self.sigma0_rad**2, self.sigma_inf_rad**2
            return math.sqrt(vi + (v0 - vi) * math.exp(-2.0 * self.rho_hz * t_s))
        if self.model == "forecast":
            return float(np.interp(t_s, self.horizon_s, self.sigma_rad))
        return 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Wind:
    """The wind: from where [rad, true], how fast [m/s or None], how sure. A polar is already at this speed."""

    twd_from_rad: float
    tws_mps: float | None = None
    sigma: Sigma = Sigma()


@dataclass(frozen=True, slots=True, kw_only=True)
class BoatLimits:
    """What the boat can do: no-go half angle, deepest angle, turn rate, speed by |TWA| (linear between nodes).

    ``can_tack`` False: no turn goes through the wind's eye, so the boat gybes round. ``gybe_room_m`` is the leg that
    turning round the long way needs; None: five turning radii at full speed.
    """

    no_go_half_rad: float
    max_twa_rad: float = math.pi
    turn_rate_radps: float
    polar_twa_rad: tuple[float, ...]
    polar_mps: tuple[float, ...]
    tack_loss_s: float = 0.0
    gybe_loss_s: float = 0.0
    can_tack: bool = True
    gybe_room_m: float | None = None

    @property
    def room_m(self) -> float:
        """Length [m] that a leg needs to let the boat turn on by more than half a circle in all.

        0 where it makes no difference: a boat that tacks and gybes without loss always turns the shorter way.
        """
        if self.can_tack and self.tack_loss_s == 0.0 and self.gybe_loss_s == 0.0:
            return 0.0
        if self.gybe_room_m is not None:
            return self.gybe_room_m
        return ROUND_RADII * max(self.polar_mps) / self.turn_rate_radps

    @property
    def most_turn_rad(self) -> float:
        """How far the boat may turn [rad] between two legs of that length; the first turn of all is free of it."""
        return math.pi if self.can_tack else math.pi - CLEAR_TURN_RAD

    def speed_mps(self, twa_rad: float) -> float:
        """Return the speed [m/s] at the true wind angle."""
        return float(np.interp(abs(twa_rad), self.polar_twa_rad, self.polar_mps))


@dataclass(frozen=True, slots=True, kw_only=True)
class Current:
    """A constant current over the ground, towards ``set_rad`` at ``drift_mps``.

    The wind is then the wind on the water, headings are through the water and legs are over the ground.
    """

    set_rad: float = 0.0
    drift_mps: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Target:
    """A moving disc to keep out of: at (x + vx t, y + vy t), radius ``radius_m + growth_mps t``, in its window.

    With a ``spread`` it is a vessel's prediction: the radius is that without any doubt, and how much doubt is added
    follows from the promise (``companion.planner.risk.vessels``).
    """

    x_m: float
    y_m: float
    vx_mps: float = 0.0
    vy_mps: float = 0.0
    radius_m: float
    growth_mps: float = 0.0
    from_s: float = 0.0
    until_s: float = math.inf
    name: str = ""
    spread: Spread | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class RiskLimit:
    """Bound on the accumulated risk of the whole path, and the wind's correlation time it assumes."""

    max_path_risk: float
    correlation_time_s: float = 60.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Beat:
    """What the autopilot makes of a leg inside its no-go zone (``companion.planner.problem.beat``).

    It sails at ``no_go_half_rad`` off the wind and tacks ``corridor_m`` (above 0) off the line, in ``tack_s`` each.
    A leg is left to it only where nothing solid is within ``clearance_m`` (0 or more) of the line.
    """

    no_go_half_rad: float
    corridor_m: float
    clearance_m: float
    tack_s: float = 0.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Problem:
    """One planning problem (see the module's text). Times count from the start of the plan, t = 0.

    ``vessels_part`` is what uncertain targets get of 1 - delta_s, at each instant and together; None: a tenth of it.
    ``leg_saving`` is what a leg must save, as a share of the path's time, for ``auto`` to keep it.
    """

    id: str = ""
    title: str = ""
    start_en: tuple[float, float]
    start_heading_rad: float
    goal_en: tuple[float, float]
    goal_radius_m: float
    obstacles: tuple[shapely.Geometry, ...] = ()
    fence: shapely.Geometry | None = None
    wind: Wind
    boat: BoatLimits
    delta_s: float = 0.5
    current: Current = Current()
    targets: tuple[Target, ...] = ()
    vessels_part: float | None = None
    risk: RiskLimit | None = None
    clearance_floor_m: float = 0.0
    leg_saving: float = 1e-5
    beat: Beat | None = None
    notes: str = ""
    extra: Mapping[str, Any] = field(default_factory=dict, repr=False)

    # ------------------------------------------------------------------------------------- in and out
    @classmethod
    def from_json(cls, source: str | Path | Mapping[str, Any]) -> Problem:
        """Return the problem in a JSON file or an already parsed mapping.

        Raises:
            InputError: the file cannot be read, a field is missing or not of its type, a WKT does not parse.

        """
        from companion.planner.problem.json_form import parse

        if isinstance(source, Mapping):
            return parse(source, str(source.get("id", "problem")))
        path = Path(source)
        try:
            raw = json.loads(path.read_text(encoding="utf-8"))
        except OSError as error:
            raise InputError(str(path), "", f"cannot be read ({error.strerror})", "name a problem file") from error
        except (ValueError, RecursionError) as error:
            raise InputError(str(path), "", f"is not JSON ({error})", "see docs/problem-format.md") from error
        if not isinstance(raw, Mapping):
            raise InputError(str(path), "", "is not a JSON object", "see docs/problem-format.md")
        return parse(raw, str(path))

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON form; ``from_json`` of it is the same problem."""
        from companion.planner.problem.json_form import unparse

        return unparse(self)

    # ----------------------------------------------------------------------------------------- no-go
    @cached_property
    def wind_delta_s(self) -> float:
        """The wind's own delta_s: 1 - delta_s less the part of uncertain targets; delta_s without them."""
        if not self.is_shared:
            return self.delta_s
        from companion.planner.risk.vessels import part_of

        return self.delta_s + part_of(self)

    @property
    def is_shared(self) -> bool:
        """Do uncertain targets share the promise with the wind?"""
        return any(t.spread is not None for t in self.targets)

    @cached_property
    def resolved(self) -> Problem:
        """The same with its promise shared out: the wind's delta_s, and uncertain targets as discs of their size."""
        if not self.is_shared:
            return self
        from companion.planner.risk.vessels import part_of, sigmas_for, sized, vessel_count

        sigmas = sigmas_for(part_of(self), vessel_count(self.targets))
        return replace(self, delta_s=self.wind_delta_s, targets=sized(self.targets, sigmas), vessels_part=None)

    @cached_property
    def k_delta(self) -> float:
        """Multiplier of sigma, sqrt(2) erfinv(2 delta_s - 1) >= 0 (Wolsieffer eq. 15 with its sign put right)."""
        # sqrt(2) erfinv(2 p - 1) is the standard normal quantile of p
        return NormalDist().inv_cdf(self.wind_delta_s) if 0.5 <= self.wind_delta_s < 1.0 else math.nan

    def widening_rad(self, t_s: float) -> float:
        """Return b(t): how much the no-go half angle is widened at ``t_s`` [rad]."""
        sigma = self.wind.sigma
        if sigma.model == "forecast" and sigma.half_width_rad is not None:
            return float(np.interp(t_s, sigma.horizon_s, sigma.half_width_rad))
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

    @cached_property
    def shore(self) -> Shore:
        """The exact test of legs against all that is solid."""
        from companion.planner.problem.shore import Shore

        return Shore(self)

    # ---------------------------------------------------------------------------------------- judging
    @cached_property
    def defect(self) -> str | None:
        """Why nobody can plan this (numbers only, geometry is checked by the search), or None."""
        from companion.planner.problem.defects import defect_of

        return defect_of(self)

    def evaluate(self, waypoints_en: ArrayLike) -> Evaluation:
        """Return cost, legs and every reason why the path (n, 2) is not feasible: the exact scorer."""
        from companion.planner.problem.evaluate import evaluate

        return evaluate(self.resolved, np.asarray(waypoints_en, dtype=np.float64))
