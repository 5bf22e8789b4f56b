"""The plans of a mission's legs before it is sailed: their problems in a wind that is held, and the waits between."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, replace
from itertools import zip_longest
from statistics import NormalDist

from companion.compose import boat_of, config_of, drying_of, tide_of, water_of
from companion.current import STILL_WATER, WaterCurrent, over_water
from companion.errors import InputError
from companion.geo.frame import LocalFrame
from companion.geofence import LocalArea, Mission
from companion.mission_check.lines import NO_ROOM_REMEDY, crowded_lines
from companion.planner import Plan, Problem
from companion.planner.problem import assumed
from companion.skipper.planning import HOME_RADIUS_M, aim_near
from companion.skipper.way import timed

PROBE_M = 100.0


@dataclass(frozen=True, slots=True, kw_only=True)
class AssumedWind:
    """A wind that is held: from where [deg], how strong [m/s], and by how much its direction is uncertain [deg]."""

    from_deg: float
    speed_mps: float
    spread_deg: float = 0.0

    def sigma(self, no_go_error_rad: float = 0.0) -> dict[str, object]:
        """Return its uncertainty as a planning problem has it, and with it that of the boat's no-go zone."""
        spread_deg = self.spread_deg
        if no_go_error_rad > 0.0:
            spread_deg = math.hypot(spread_deg, math.degrees(no_go_error_rad))
        if spread_deg <= 0.0:
            return {"model": "none"}
        return {"model": "kalman", "sigma0_deg": spread_deg, "growth_deg_per_sqrt_s": 0.0}


def leg_problem(
    mission: Mission,
    here_en: tuple[float, float],
    heading_deg: float,
    goal_en: tuple[float, float],
    radius_m: float,
    *,
    wind: AssumedWind,
    title: str = "",
    local: LocalArea | None = None,
    current: WaterCurrent = STILL_WATER,
    unix_s: float | None = None,
) -> Problem:
    """Return the problem of sailing to one goal of a mission [m in its frame] in a wind that is held steady.

    Where ``current`` is planned for the wind, which is that over the ground, is carried over to the water. ``unix_s``:
    when it begins, for water that dries; without it that is solid.
    """
    local = mission.water() if local is None else local
    boat, sails = boat_of(mission), mission.autopilot.frame == "sailboat"
    water: dict[str, object] = {}
    if current.is_significant:
        from_rad, speed_mps = over_water(math.radians(wind.from_deg), wind.speed_mps, current.en_mps)
        wind = replace(wind, from_deg=math.degrees(from_rad), speed_mps=speed_mps)
        water["current"] = {"set_deg": math.degrees(current.set_rad), "drift_mps": current.drift_mps}
    dries = timed(
        drying_of(mission, mission.frame()),
        tide_of(mission) if mission.drying else None,
        unix_s,
        margin_m=mission.margin_m,
        start_en=here_en,
    )
    if dries.solid:
        local = local.also(
            tuple(w.name for w in dries.solid),
            tuple(w.polygon for w in dries.solid),
            tuple(w.margin_m for w in dries.solid),
        )
    problem = Problem.from_json(
        {
            "id": mission.name,
            "title": title,
            "start": {"x": here_en[0], "y": here_en[1], "heading_deg": heading_deg % 360.0},
            "goal": {"x": goal_en[0], "y": goal_en[1], "radius": radius_m},
            "obstacles": local.obstacles_wkt(mission.margin_m),
            "obstacle_names": local.obstacle_names(mission.margin_m),
            "fence": local.fence_wkt(mission.margin_m, here_en),
            "wind": {
                "from_deg": wind.from_deg,
                "speed_mps": wind.speed_mps,
                "sigma": wind.sigma(boat.no_go_error_rad),
                **({"strength": assumed(wind.speed_mps).to_dict()} if sails else {}),
            },
            "boat": {
                **boat.problem_boat(wind.speed_mps),
                **({"speeds": boat.problem_speeds(), "tack_fails": boat.tack_fails} if sails else {}),
            },
            "delta_s": mission.risk.delta_s,
            **water,
        }
    )
    return replace(problem, targets=dries.targets) if dries.targets else problem


def layline_rad(mission: Mission, wind: AssumedWind) -> float:
    """Return the angle to the wind of the course by which a mark to windward is laid in the plans of ``legs`` [rad]."""
    boat = boat_of(mission)
    bow_rad = boat.best_beat(wind.speed_mps).twa_rad
    sigma_rad = math.hypot(math.radians(wind.spread_deg), boat.no_go_error_rad)
    edge_rad = boat.made_good_rad(boat.no_go_half_rad, wind.speed_mps)
    edge_rad += NormalDist().inv_cdf(mission.risk.delta_s) * sigma_rad
    return max(edge_rad, boat.made_good_rad(bow_rad, wind.speed_mps))


def expected_current(mission: Mission, unix_s: float | None) -> WaterCurrent:
    """Return the current that a plan reckons with which is made as the voyage begins, by the mission alone.

    ``unix_s``: when; without it a tide table tells nothing. Raises InputError as ``water_of``.
    """
    expected = water_of(mission).at(unix_s)
    found = WaterCurrent(
        east_mps=expected.east_mps,
        north_mps=expected.north_mps,
        var_ee=expected.sigma_mps**2,
        var_nn=expected.sigma_mps**2,
    )
    return replace(found, is_significant=found.is_worth_planning(was=True))


def leg_names(mission: Mission) -> list[str]:
    """Return in words where each of the legs of ``legs`` leads."""
    words = [f"goal {n}" + (f", {goal.name}" if goal.name else "") for n, goal in enumerate(mission.goals, start=1)]
    return [*words, "home"] if mission.skipper.end == "home" else words


def legs(
    mission: Mission, wind: AssumedWind, *, goes_home: bool = True, unix_s: float | None = None
) -> Generator[Problem, Plan, None]:
    """Yield the problem of each leg of one lap, and be sent its plan; end with the first that has no path.

    ``goes_home``: the leg home belongs to it, where the mission ends there. Home is taken to be the
    start: the autopilot's is where it was armed. Without a start there is no leg. ``unix_s``: when the voyage begins,
    for the row of a tide table that each leg begins in; without it tables are left out. A goal by something solid is
    aimed at as the skipper does, where its radius has room.

    Raises:
        ValueError: no water is left inside the fence at the margin.
        InputError: a line has not even the margin's floor of room beyond or before it: it is never sailed.
    """
    if mission.start is None:
        return
    frame = mission.frame()
    here, local = frame.en_from_geo(mission.start), mission.water()
    heading_deg = mission.options.start.heading_deg if mission.options.start else 0.0
    targets = [(goal.point, goal.radius_m, goal.name or f"goal {n}") for n, goal in enumerate(mission.goals, start=1)]
    if goes_home and mission.skipper.end == "home":
        targets.append((mission.start, HOME_RADIUS_M, "home"))
    floor_m = min(mission.margin_floor_m, mission.margin_m)
    closed = {n: words for n, _, words in crowded_lines(mission, floor_m)}
    for number, (point, radius_m, title) in enumerate(targets, start=1):
        if number in closed:
            raise InputError(str(mission.path), f"[[goal]] {number}", closed[number], NO_ROOM_REMEDY)
        blows = replace(wind, from_deg=wind.from_deg + _north_deg(frame, here)) if mission.is_passage else wind
        goal_en, within_m = frame.en_from_geo(point), radius_m
        if number <= len(mission.goals) and mission.goals[number - 1].is_plain:
            goal_en, within_m = _aim(mission, goal_en, radius_m, local)
        answer = yield leg_problem(
            mission,
            here,
            heading_deg,
            goal_en,
            within_m,
            wind=blows,
            title=title,
            local=local,
            current=expected_current(mission, unix_s),
            unix_s=unix_s,
        )
        if not answer.has_path:
            return
        unix_s = None if unix_s is None else unix_s + answer.cost_s
        here = (float(answer.waypoints_en[-1][0]), float(answer.waypoints_en[-1][1]))
        heading_deg = math.degrees(answer.legs[-1].heading_rad) if answer.legs else heading_deg


def _aim(
    mission: Mission, goal_en: tuple[float, float], radius_m: float, local: LocalArea
) -> tuple[tuple[float, float], float]:
    """Return where a leg to a plain goal ends and within what [m]: there, or where its radius has room beside it."""
    aim = aim_near(local, config_of(mission), goal_en, radius_m, mission.margin_m, gate=0)
    return (goal_en, radius_m) if aim is None or aim.en_m == goal_en else (aim.en_m, aim.radius_m)


def _north_deg(frame: LocalFrame, here_en: tuple[float, float]) -> float:
    """Return where true north is on the grid of a frame at a place far from its origin [deg, clockwise]."""
    there = LocalFrame(frame.geo_from_en(*here_en)).geo_from_en(0.0, PROBE_M)
    east_m, north_m = frame.en_from_geo(there)
    return math.degrees(math.atan2(east_m - here_en[0], north_m - here_en[1]))


def planned_legs(walk: Generator[Problem, Plan, None], answer: Callable[[Problem], Plan]) -> list[Plan]:
    """Return the plans of all legs, each answered in place."""
    plans: list[Plan] = []
    problem = next(walk, None)
    while problem is not None:
        plans.append(answer(problem))
        problem = continued_plans(walk, plans[-1])
    return plans


def continued_plans(walk: Generator[Problem, Plan, None], plan: Plan) -> Problem | None:
    """Send the plan of a leg; return the problem of the next, None: there is none."""
    try:
        return walk.send(plan)
    except StopIteration:
        return None


def waits_s(mission: Mission, sailed_s: Sequence[float], *, laps: int = 1, unix_s: float | None = None) -> list[float]:
    """Return how long the boat waits at the end of each leg, lap by lap [s]: for a gun, in a box, by a field.

    ``sailed_s``: what the plans of one lap take, goal by goal, empty where none are made. ``unix_s``: when she sets
    sail; without it a gun at an hour of the day is left out. So is what nobody knows beforehand: a search, and a box or
    a field that is left when somebody says so.
    """
    now_s, waits = 0.0, []
    for _ in range(laps):
        for goal, leg_s in zip_longest(mission.goals, sailed_s, fillvalue=None):
            now_s += leg_s or 0.0
            wait_s = 0.0
            if goal is not None and goal.gate is not None:
                hour_s, gun_s = goal.gate.not_before_s, goal.gate.after_s
                if hour_s is not None:
                    gun_s = None if unix_s is None else hour_s - unix_s
                wait_s = max(0.0, gun_s - now_s) if gun_s is not None else 0.0
            elif goal is not None and (task := goal.box or goal.field) is not None:
                wait_s = task.for_s or 0.0
            now_s += wait_s
            waits.append(wait_s)
    return waits
