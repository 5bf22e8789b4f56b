"""What ``companion mission`` reads and draws: any mission or drawing, and the picture of what would be sailed."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING

from companion.commands.output import patience
from companion.program.arguments import picture, wind

if TYPE_CHECKING:
    from companion.geofence import Document, Mission
    from companion.planner import Plan, Problem


def preview_options(parser: argparse.ArgumentParser) -> None:
    """Add --plot and what it assumes."""
    parser.add_argument("--plot", type=picture, metavar="P.png",
                        help="draw obstacles, fence, margins, laylines and a plan")
    parser.add_argument("--wind", type=wind, metavar="SPEED@FROM",
                        help="for the picture [m/s, degrees] (else the mission's, 5@0)")
    parser.add_argument("--no-plan", action="store_true", help="draw no plan")


def preview(mission: Mission, args: argparse.Namespace) -> None:
    """Draw the mission in the wind that the arguments or the mission give."""
    from companion.compose import boat_of
    from companion.plots.mission import save_mission

    tws_mps, from_deg = mission.wind.preview_speed_mps, mission.wind.preview_from_deg
    if args.wind:
        tws_mps, from_deg = args.wind
    twd_from_rad, boat = math.radians(from_deg), boat_of(mission)
    with patience("planning and drawing"):
        lines = save_mission(
            mission, args.plot, tws_mps=tws_mps, twd_from_rad=twd_from_rad,
            beat_rad=boat.polar.best_beat(tws_mps, no_go_half_rad=boat.no_go_half_rad).twa_rad,
            plans=[] if args.no_plan else _plans(mission, tws_mps, twd_from_rad),
        )
    for line in lines:
        print(line)
    print(f"{args.plot}: written")


def _plans(mission: Mission, tws_mps: float, twd_from_rad: float) -> list[Plan]:
    """Return the planner's way from goal to goal, first lap, in a steady wind; and home, where the mission ends there.

    Home is taken to be the start: the autopilot's is where it was armed.
    """
    from companion.compose import planner_of
    from companion.planner import plan
    from companion.skipper.planning import HOME_RADIUS_M

    by = planner_of(mission)

    if mission.start is None:
        return []
    frame = mission.frame()
    here = frame.en_from_geo(mission.start)
    heading_deg = mission.options.start.heading_deg if mission.options.start else 0.0
    plans = []
    targets = [(goal.point, goal.radius_m) for goal in mission.goals]
    if mission.skipper.end == "home":
        targets.append((mission.start, HOME_RADIUS_M))
    for point, radius_m in targets:
        east_m, north_m = frame.en_from_geo(point)
        problem = leg_problem(mission, here, heading_deg, (east_m, north_m), radius_m, tws_mps=tws_mps,
                              from_deg=math.degrees(twd_from_rad))
        answer = plan(problem, budget_s=mission.skipper.planning_budget_s, seed=0, algorithm=by.algorithm,
                      settings=by.settings)
        plans.append(answer)
        if not answer.has_path:
            break
        here = (float(answer.waypoints_en[-1][0]), float(answer.waypoints_en[-1][1]))
        heading_deg = math.degrees(answer.legs[-1].heading_rad) if answer.legs else heading_deg
    return plans


def leg_problem(
    mission: Mission, here_en: tuple[float, float], heading_deg: float, goal_en: tuple[float, float], radius_m: float,
    *, tws_mps: float, from_deg: float, title: str = "",
) -> Problem:
    """Return the problem of sailing to one goal of a mission [m in its frame] in a wind that is held steady."""
    from companion.compose import boat_of
    from companion.planner import Problem

    local = mission.area.local(mission.frame())
    return Problem.from_json({
        "id": mission.name, "title": title,
        "start": {"x": here_en[0], "y": here_en[1], "heading_deg": heading_deg % 360.0},
        "goal": {"x": goal_en[0], "y": goal_en[1], "radius": radius_m},
        "obstacles": local.obstacles_wkt(mission.margin_m),
        "obstacle_names": local.obstacle_names(mission.margin_m), "fence": local.fence_wkt(mission.margin_m, here_en),
        "wind": {"from_deg": from_deg, "speed_mps": tws_mps, "sigma": {"model": "none"}},
        "boat": boat_of(mission).problem_boat(tws_mps), "delta_s": mission.risk.delta_s,
    })


def read_mission_file(path: str) -> Document:
    """Return what a mission TOML or a drawing holds, with its only line as the route. Raises InputError."""
    from companion.geofence import read
    from companion.geofence.formats import lines_as_route
    from companion.geofence.mission import document_of, load_mission

    if Path(path).suffix.lower() == ".toml":
        return document_of(load_mission(path))
    return lines_as_route(read(path)).require_clean()
