"""What ``companion mission`` reads and draws: any mission or drawing, and the picture of what would be sailed."""

from __future__ import annotations

import argparse
import math
import time
from pathlib import Path
from typing import TYPE_CHECKING

from companion.commands.output import patience
from companion.program.arguments import picture, wind

if TYPE_CHECKING:
    from companion.geofence import Document, Mission
    from companion.planner import Plan


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
    """Return the planner's way from goal to goal, first lap, in a steady wind; and home, if the mission ends there."""
    from companion.compose import planner_of
    from companion.planner import plan
    from companion.sailable.previews import Wind, legs, walked

    by = planner_of(mission).about(mission.frame().origin)
    return walked(
        legs(mission, Wind(from_deg=math.degrees(twd_from_rad), speed_mps=tws_mps), unix_s=time.time()),
        lambda problem: plan(problem, budget_s=mission.skipper.planning_budget_s, seed=0, algorithm=by.algorithm,
                             settings=by.settings))


def read_mission_file(path: str) -> Document:
    """Return what a mission TOML or a drawing holds, with its only line as the route. Raises InputError."""
    from companion.geofence import read
    from companion.geofence.formats import lines_as_route
    from companion.geofence.mission import document_of, load_mission

    if Path(path).suffix.lower() == ".toml":
        return document_of(load_mission(path))
    return lines_as_route(read(path)).require_clean()
