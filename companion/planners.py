"""The planners by name, as one table: the module that searches, the numbers that a mission may set, what it bounds.

A planner is registered here and nowhere else: missions (``[skipper] planner``), ``companion plan --algorithm``, the
campaigns' draws, methods and variations, and the benchmark take it from this table. Its module is imported when it is
asked for, and has a function ``search(problem, effort, seed) -> Outcome`` (``companion.planner.effort``). ``auto`` is
the project's own, and sets its numbers itself; ``rrtstar`` is Wolsieffer's, ``astar`` Büsser's.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields, replace
from typing import TYPE_CHECKING, Any, TypeVar

from companion.geo import MPS_PER_KNOT

if TYPE_CHECKING:
    from companion.messages import GeoPoint

T = TypeVar("T")


@dataclass(frozen=True, slots=True, kw_only=True)
class MissionKey:
    """How a mission's ``[planner]`` sets a number: its key, and its bounds or the words for it.

    A key in ``_deg`` sets a number in radians, one in ``_kn`` one in m/s, of which 0 is None. Of two words for a number
    that is yes or no the second is yes.
    """

    key: str
    is_flag: bool = False
    above: float | None = None
    least: float | None = None
    most: float | None = None
    below: float | None = None
    words: tuple[str, ...] = ()

    def value_of(self, told: Any, default: object) -> Any:
        """Return the number that a mission's value says; ``default`` is the one without it."""
        if self.key.endswith("_deg"):
            return math.radians(told)
        if self.key.endswith("_kn"):
            return told * MPS_PER_KNOT or None
        return told == self.words[1] if self.words and isinstance(default, bool) else told


def _set_by(key: str, default: T, **bounds: Any) -> T:
    """Return a field of settings that a mission sets by ``key``."""
    return field(default=default, metadata={"key": MissionKey(key=key, is_flag=isinstance(default, bool), **bounds)})


@dataclass(frozen=True, slots=True, kw_only=True)
class AstarSettings:
    """A*'s numbers; the defaults are those the thesis ends with (5.3: no tunnel, no extra tack cost).

    Attributes:
        grid_m: GRID SIZE [m]; None: a fortieth of the distance, not below 2 m, and coarser where that does not fit.
        room_m: How far beyond start and goal the grid reaches at the least [m], where no fence ends it; None: half
            the distance, in which a boat between two gates of a buoy has no room to tack.
        turn_s_per_rad: f of eq. 4.4 [s/rad]; 0 for Figure 5.1.
        tack_s, gybe_s: Added cost of a manoeuvre [s].
        tunnel_width_m: TUNNEL WIDTH of eq. 4.6 [m]; None for no tunnel.
        tunnel: ``linear``: a cost that grows with the distance from the direct line (eq. 4.6, the first form of 4.3.2);
            ``abrupt``: none within half the width, ``BORDER_S`` a step beyond it (the third); ``convex``: little in the
            middle and rising to that at the borders (2.V.F.5).
        heuristic_mps: Speed of the estimate [m/s]; None for Dijkstra.
        min_twa_rad, max_twa_rad: The sailable range of headings off the wind.
        max_turn_rad: The greatest heading change from step to step (4.1.1). With his 90 degrees there is no tack
            unless the wind blows along the grid and the no-go zone is not widened: it gybes round.
        ship_match_s: Tolerance of eq. 4.7 [s].
        memory_bytes: What the grid may take; one that is asked for and takes more is refused.
        projection: ``local``: planned in the problem's metres; ``flat``: in those of eq. 4.2 (docs/lab/frames.md).
        origin: Where the problem's metres count from; the flat projection needs it (``PlannerChoice.about``).
        goal_heading: ``bearing``: the goal is a place and a heading, nearest to the bearing from start to goal;
            ``any``: the place alone, the other way that 4.1.4 names, where the bearing's heading cannot arrive.
        goal_heading_rad: The heading at the goal where it is set by hand (4.1.4): the sailable one nearest to it is
            taken; None: as ``goal_heading`` says.

    """

    grid_m: float | None = _set_by("grid_m", None, above=0.0)
    room_m: float | None = _set_by("room_m", None, above=0.0)
    turn_s_per_rad: float = _set_by("turn_s_per_rad", 8.0, least=0.0)
    tack_s: float = _set_by("tack_s", 0.0, least=0.0)
    gybe_s: float = _set_by("gybe_s", 0.0, least=0.0)
    tunnel_width_m: float | None = _set_by("tunnel_width_m", None, above=0.0)
    tunnel: str = _set_by("tunnel", "linear", words=("linear", "abrupt", "convex"))
    heuristic_mps: float | None = _set_by("heuristic_kn", 7.0 * MPS_PER_KNOT, least=0.0)
    min_twa_rad: float = _set_by("min_twa_deg", math.radians(45.0), least=0.0, below=90.0)
    max_twa_rad: float = _set_by("max_twa_deg", math.radians(160.0), above=90.0, most=180.0)
    max_turn_rad: float = _set_by("max_turn_deg", 0.5 * math.pi, above=0.0, most=180.0)
    ship_match_s: float = _set_by("ship_match_s", 20.0, above=0.0)
    goal_heading: str = _set_by("goal_heading", "bearing", words=("bearing", "any"))
    memory_bytes: int = 256_000_000
    projection: str = _set_by("projection", "local", words=("local", "flat"))
    origin: GeoPoint | None = None
    goal_heading_rad: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class RrtstarSettings:
    """RRT*'s numbers; the defaults are OMPL's, which Wolsieffer used.

    Attributes:
        goal_bias: Share of the samples that are the goal.
        range_m: eta, the longest branch that is grown [m]; None: a fifth of the search box's diagonal.
        is_rewired: Whether states are given better parents (RRT*); without it the tree is an RRT that chooses its
            parents.
        risk_weight_s: Cost of certain failure [s], with a limit on the path's risk: enough to prefer the safer of
            two equal paths.
        state_risk_weight_s: Cost of the greatest risk of any state [s per unit of probability]: the second risk
            term of CC-RRT* (Luders, Karaman and How 2013), which Wolsieffer leaves out.

    """

    goal_bias: float = _set_by("goal_bias", 0.05, least=0.0, below=1.0)
    range_m: float | None = _set_by("range_m", None, above=0.0)
    is_rewired: bool = _set_by("rewiring", True)
    risk_weight_s: float = _set_by("risk_weight_s", 10.0, least=0.0)
    state_risk_weight_s: float = _set_by("state_risk_weight_s", 0.0, least=0.0)


Settings = AstarSettings | RrtstarSettings


@dataclass(frozen=True, slots=True, kw_only=True)
class Algorithm:
    """One row: the module of a planner, its numbers (None: it has none), and what its own search answers for."""

    module: str
    settings: type[Settings] | None = None
    bounds_path_risk: bool = False  # its tree keeps a limit on the path's risk; of others a path is judged, and redone
    carries_vessels: bool = False  # other vessels are under its tree's own bound
    warm_expansions: int = 2000  # what compiles or loads all of its kernels, before a budget begins

    @property
    def keys(self) -> dict[str, MissionKey]:
        """The numbers that a mission may set, by their names among the settings."""
        own = () if self.settings is None else fields(self.settings)
        return {each.name: each.metadata["key"] for each in own if "key" in each.metadata}

    def settings_of(self, told: dict[str, Any]) -> Settings | None:
        """Return the settings in which these keys of a mission are said, each of which is the planner's own."""
        if self.settings is None:
            return None
        defaults = {each.name: each.default for each in fields(self.settings)}
        return self.settings(
            **{name: key.value_of(told[key.key], defaults[name]) for name, key in self.keys.items() if key.key in told}
        )


ALGORITHMS = {
    "auto": Algorithm(module="companion.planner.search.auto", warm_expansions=20_000),
    "rrtstar": Algorithm(
        module="companion.planner.reference.rrtstar",
        settings=RrtstarSettings,
        bounds_path_risk=True,
        carries_vessels=True,
    ),
    "astar": Algorithm(module="companion.planner.reference.astar", settings=AstarSettings),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannerChoice:
    """An algorithm by name, its numbers (None: its defaults), and its effort in its own steps (None: the voyage's)."""

    algorithm: str = "auto"
    settings: Settings | None = None
    expansions: int | None = None

    def about(self, origin: GeoPoint, goal_heading_rad: float | None = None) -> PlannerChoice:
        """Return the same for a problem whose metres count from there and whose goal has that heading set by hand."""
        if not isinstance(self.settings, AstarSettings):
            return self
        if self.settings.projection == "local" and goal_heading_rad is None:
            return self
        return replace(self, settings=replace(self.settings, origin=origin, goal_heading_rad=goal_heading_rad))


AUTO = PlannerChoice()
