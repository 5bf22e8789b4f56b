"""The simulated autopilot of a live scenario as a process of its own: ``python -m sitl.run.live_boat``.

Differs from ``sitl boat`` only in that its weather, start and parameters come from the scenario file, and that it
ends with the process that began it, which may be killed and then ends nobody.
"""

from __future__ import annotations

import argparse
import asyncio
import datetime as dt
import math
import os
import sys
from pathlib import Path

import msgspec

from companion.clock import run
from companion.geofence import load_mission
from sitl.autopilot import EPOCH_S, AutopilotConfig, SimulatedAutopilot, serve
from sitl.run.depths import spoken_depths
from sitl.scenario import (
    load_scenario,
    own_polar,
    recentre_m,
    scenario_departures,
    scenario_seabed,
    scenario_sounder,
    scenario_waters,
    scenario_wind,
)


def main() -> int:
    """Run until terminated, or alone."""
    parser = argparse.ArgumentParser(prog="python -m sitl.run.live_boat", description=__doc__)
    parser.add_argument("scenario", type=Path)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--speedup", type=float, default=1.0)
    parser.add_argument("--epoch", type=float, default=EPOCH_S, metavar="UNIX_S")
    parser.add_argument("--endpoint", action="append", required=True, metavar="LINK")
    parser.add_argument("--depths-port", type=int, default=0, metavar="UDP", help="its sounder speaks NMEA there")
    parser.add_argument("--parent", type=int, default=os.getppid(), metavar="PID", help="end with this process")
    args = parser.parse_args()
    begins = dt.datetime.fromtimestamp(args.epoch, dt.UTC)
    scenario = msgspec.structs.replace(load_scenario(args.scenario), begins=begins)
    mission = load_mission(scenario.mission_path(args.scenario))
    heading_deg = mission.options.start.heading_deg if mission.options.start else 0.0
    home, wind = mission.start or mission.origin, scenario_wind(scenario, args.scenario, args.seed)
    seabed = scenario_seabed(scenario, args.scenario, mission.frame())
    sounder = scenario_sounder(scenario, seabed, args.seed)
    autopilot = SimulatedAutopilot(
        AutopilotConfig(
            home=home,
            heading_rad=math.radians(heading_deg),
            is_warm=True,
            is_moored=True,
            parameters=scenario.parameters,
            polar=own_polar(mission),
            epoch_s=args.epoch,
            is_motorboat=mission.autopilot.frame == "motor",
            departures=scenario_departures(scenario),
            waters=scenario_waters(scenario, wind, mission.frame().en_from_geo(home)),
            recentre_m=recentre_m(mission),
            sounder=sounder,
            hears_sounder=not args.depths_port,
        ),
        wind,
        args.seed,
    )

    async def sail() -> None:
        async with (
            serve(autopilot, args.endpoint) as server,
            spoken_depths(
                lambda: autopilot.core.sounding_m, args.depths_port, 0.0 if sounder is None else sounder.below_m
            ),
        ):
            while await server.wait(args.speedup) and os.getppid() == args.parent:  # each second of the wall
                pass

    try:
        run(sail(), speedup=args.speedup)
    except (KeyboardInterrupt, asyncio.CancelledError):
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
