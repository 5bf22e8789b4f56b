"""What the planner makes of a mission in a wind that somebody assumes: from goal to goal, one lap."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator
from dataclasses import dataclass

from companion.compose import boat_of
from companion.geofence import LocalArea, Mission
from companion.planner import Plan, Problem
from companion.skipper.planning import HOME_RADIUS_M


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
    *, wind: Wind, title: str = "", local: LocalArea | None = None,
) -> Problem:
    """Return the problem of sailing to one goal of a mission [m in its frame] in a wind that is held steady."""
    local = mission.water() if local is None else local
    return Problem.from_json({
        "id": mission.name, "title": title,
        "start": {"x": here_en[0], "y": here_en[1], "heading_deg": heading_deg % 360.0},
        "goal": {"x": goal_en[0], "y": goal_en[1], "radius": radius_m},
        "obstacles": local.obstacles_wkt(mission.margin_m),
        "obstacle_names": local.obstacle_names(mission.margin_m), "fence": local.fence_wkt(mission.margin_m, here_en),
        "wind": {"from_deg": wind.from_deg, "speed_mps": wind.speed_mps, "sigma": wind.sigma()},
        "boat": boat_of(mission).problem_boat(wind.speed_mps), "delta_s": mission.risk.delta_s,
    })


def leg_names(mission: Mission) -> list[str]:
    """Return in words where each of the legs of ``legs`` leads."""
    words = [f"goal {n}" + (f", {goal.name}" if goal.name else "") for n, goal in enumerate(mission.goals, start=1)]
    return [*words, "home"] if mission.skipper.end == "home" else words


def legs(mission: Mission, wind: Wind, *, goes_home: bool = True) -> Generator[Problem, Plan, None]:
    """Yield the problem of each leg of one lap, and be sent its plan; end with the first that has no path.

    ``goes_home``: the leg home belongs to it, where the mission ends there. Home is taken to be the
    start: the autopilot's is where it was armed. Without a start there is no leg.

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
        answer = yield leg_problem(mission, here, heading_deg, frame.en_from_geo(point), radius_m, wind=wind,
                                   title=title, local=local)
        if not answer.has_path:
            return
        here = (float(answer.waypoints_en[-1][0]), float(answer.waypoints_en[-1][1]))
        heading_deg = math.degrees(answer.legs[-1].heading_rad) if answer.legs else heading_deg


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
