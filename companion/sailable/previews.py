"""What the planner makes of a mission in a wind that somebody assumes: from goal to goal, one lap."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from dataclasses import dataclass, replace
from itertools import pairwise

from companion.compose import RECENTRE_M, boat_of, voyage_of, water_of
from companion.current import STILL_WATER, WaterCurrent, over_water
from companion.geo.frame import LocalFrame
from companion.geofence import LocalArea, Mission
from companion.planner import Plan, Problem
from companion.planner.problem import assumed, strength_dict
from companion.skipper.planning import HOME_RADIUS_M

PROBE_M = 100.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Wind:
    """A wind that is held: from where [deg], how strong [m/s], and by how much its direction is uncertain [deg]."""

    from_deg: float
    speed_mps: float
    spread_deg: float = 0.0

    def sigma(self) -> dict[str, object]:
        """Return its uncertainty as a planning problem has it."""
        if self.spread_deg <= 0.0:
            return {"model": "none"}
        return {"model": "kalman", "sigma0_deg": self.spread_deg, "growth_deg_per_sqrt_s": 0.0}


def leg_problem(
    mission: Mission, here_en: tuple[float, float], heading_deg: float, goal_en: tuple[float, float], radius_m: float,
    *, wind: Wind, title: str = "", local: LocalArea | None = None, current: WaterCurrent = STILL_WATER,
) -> Problem:
    """Return the problem of sailing to one goal of a mission [m in its frame] in a wind that is held steady.

    Where ``current`` is planned for the wind, which is that over the ground, is carried over to the water.
    """
    local = mission.water() if local is None else local
    boat, sails = boat_of(mission), mission.autopilot.frame == "sailboat"
    water: dict[str, object] = {}
    if current.is_significant:
        from_rad, speed_mps = over_water(math.radians(wind.from_deg), wind.speed_mps, current.en_mps)
        wind = replace(wind, from_deg=math.degrees(from_rad), speed_mps=speed_mps)
        water["current"] = {"set_deg": math.degrees(current.set_rad), "drift_mps": current.drift_mps}
    return Problem.from_json({
        "id": mission.name, "title": title,
        "start": {"x": here_en[0], "y": here_en[1], "heading_deg": heading_deg % 360.0},
        "goal": {"x": goal_en[0], "y": goal_en[1], "radius": radius_m},
        "obstacles": local.obstacles_wkt(mission.margin_m),
        "obstacle_names": local.obstacle_names(mission.margin_m), "fence": local.fence_wkt(mission.margin_m, here_en),
        "wind": {"from_deg": wind.from_deg, "speed_mps": wind.speed_mps, "sigma": wind.sigma(),
                 **({"strength": strength_dict(assumed(wind.speed_mps))} if sails else {})},
        "boat": {**boat.problem_boat(wind.speed_mps), **({"speeds": boat.problem_speeds()} if sails else {})},
        "delta_s": mission.risk.delta_s, **water,
    })


def expected_current(mission: Mission, unix_s: float | None) -> WaterCurrent:
    """Return the current that a plan reckons with which is made as the voyage begins, by the mission alone.

    ``unix_s``: when; without it a tide table tells nothing. Raises InputError as ``water_of``.
    """
    expected = water_of(mission).at(unix_s)
    found = WaterCurrent(east_mps=expected.east_mps, north_mps=expected.north_mps, var_ee=expected.sigma_mps**2,
                         var_nn=expected.sigma_mps**2)
    return replace(found, is_significant=found.is_worth_planning(was=True))


def leg_names(mission: Mission) -> list[str]:
    """Return in words where each of the legs of ``legs`` leads."""
    words = [f"goal {n}" + (f", {goal.name}" if goal.name else "") for n, goal in enumerate(mission.goals, start=1)]
    return [*words, "home"] if mission.skipper.end == "home" else words


def legs(
    mission: Mission, wind: Wind, *, goes_home: bool = True, unix_s: float | None = None,
) -> Generator[Problem, Plan, None]:
    """Yield the problem of each leg of one lap, and be sent its plan; end with the first that has no path.

    ``goes_home``: the leg home belongs to it, where the mission ends there. Home is taken to be the
    start: the autopilot's is where it was armed. Without a start there is no leg. ``unix_s``: when the voyage begins,
    for the row of a tide table that each leg begins in; without it tables are left out.

    Raises:
        ValueError: no water is left inside the fence at the margin.
    """
    if mission.start is None:
        return
    frame = mission.frame()
    here, local = frame.en_from_geo(mission.start), mission.water()
    heading_deg = mission.options.start.heading_deg if mission.options.start else 0.0
    targets = [(goal.point, goal.radius_m, goal.name) for goal in mission.goals]
    if goes_home and mission.skipper.end == "home":
        targets.append((mission.start, HOME_RADIUS_M, "home"))
    for point, radius_m, title in targets:
        blows = replace(wind, from_deg=wind.from_deg + _north_deg(frame, here)) if mission.is_passage else wind
        answer = yield leg_problem(mission, here, heading_deg, frame.en_from_geo(point), radius_m, wind=blows,
                                   title=title, local=local, current=expected_current(mission, unix_s))
        if not answer.has_path:
            return
        unix_s = None if unix_s is None else unix_s + answer.cost_s
        here = (float(answer.waypoints_en[-1][0]), float(answer.waypoints_en[-1][1]))
        heading_deg = math.degrees(answer.legs[-1].heading_rad) if answer.legs else heading_deg


def _north_deg(frame: LocalFrame, here_en: tuple[float, float]) -> float:
    """Return where true north is on the grid of a frame at a place far from its origin [deg, clockwise]."""
    there = LocalFrame(frame.geo_from_en(*here_en)).geo_from_en(0.0, PROBE_M)
    east_m, north_m = frame.en_from_geo(there)
    return math.degrees(math.atan2(east_m - here_en[0], north_m - here_en[1]))


def passage_words(mission: Mission) -> str:
    """Return in words what a passage is: how far, in which waters, how far a plan looks."""
    if mission.start is None:
        return "a passage from wherever she lies"
    places = [mission.start, *(goal.point for goal in mission.goals)]
    lengths_km = [math.hypot(*LocalFrame(a).en_from_geo(b)) / 1000.0 for a, b in pairwise(places)]
    bands = sorted({goal.bandwidth_m for goal in voyage_of(mission).goals if goal.bandwidth_m is not None})
    widths = " and ".join(f"{band / 1000.0:g}" for band in bands)
    band = f"bands of {widths} km to either side" if bands else "no band"
    return (f"a passage of {sum(lengths_km):.0f} km, the longest leg {max(lengths_km):.0f} km, {band}; "
            f"plans for {mission.skipper.horizon_m / 1000.0:g} km at a time, the frame moves along every "
            f"{(mission.passage.recentre_m or RECENTRE_M) / 1000.0:g} km")


def wind_limit_words(mission: Mission) -> str:
    """Return in words the winds that she sets sail in, empty: in any."""
    boat = mission.boat
    limits = [f"{word} {limit:g} m/s" for word, limit in (
        ("more than", boat.max_tws_mps), ("less than", boat.min_tws_mps)) if limit is not None]
    if not limits:
        return ""
    allowed = 100.0 * (1.0 - mission.risk.delta_s)
    return (f"she does not set sail where {' or '.join(limits)} of wind is forecast with over {allowed:.0f} % at any "
            f"instant of the plan; under way [safety] has {mission.safety.strong_wind!r} for strong wind and "
            f"{mission.safety.light_wind!r} for light")


def walked(walk: Generator[Problem, Plan, None], answer: Callable[[Problem], Plan]) -> list[Plan]:
    """Return the plans of all legs, each answered in place."""
    plans: list[Plan] = []
    problem = next(walk, None)
    while problem is not None:
        plans.append(answer(problem))
        problem = onwards(walk, plans[-1])
    return plans


def onwards(walk: Generator[Problem, Plan, None], plan: Plan) -> Problem | None:
    """Send the plan of a leg; return the problem of the next, None: there is none."""
    try:
        return walk.send(plan)
    except StopIteration:
        return None
