"""``sitl example``: a scenario with a comment at every key, to begin one's own from."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

EXAMPLE = """\
# A scenario: a mission, the weather, what befalls the boat, and what must hold in the end.
# Sail it: sitl run {name}.toml --seed 3   Over many seeds: sitl campaign {name}.toml --runs 20
# Every key: docs/reference/scenarios.md. A key that is not known is refused, with what it may have meant.
name = "{name}"
title = "A shift and a squall on the way between three rocks"
mission = "rocks.toml"            # beside this file; any mission will do
limit_s = 1800.0                  # [s] called off then: not arrived
# begins = 2026-06-09T10:14:00Z   # what is dark, and the tide
# set_auto = false                # the companion may not set modes: what an operator must do by hand

[wind]
model = "ou"                      # wanders about its mean; "constant": steady; "recorded": file = "wind.csv"
from_deg = 0.0                    # where it comes from
tws_mps = 5.0                     # true wind speed
sd_deg = 9.0                      # standard deviation of its direction
tau_s = 28.0                      # correlation time
tws_sd_mps = 0.3                  # standard deviation of its speed
# gust_spread = 0.2               # gusts: of the speed's logarithm

# [current]                       # that the plan does not know of
# set_deg = 90.0                  # where it sets to
# drift_mps = 0.2

[parameters]                      # of the autopilot, set before the boat sails
AVOID_ENABLE = 0.0                # as `companion doctor` advises; FENCE_TYPE is 4 (polygons alone) where none is set

[[events]]                        # in any number, in any order
at_s = 40.0                       # [s] after the simulation's start
kind = "wind_shift"
veer_deg = 15.0                   # clockwise; negative: it backs
over_s = 20.0                     # the time that it takes

[[events]]
at_s = 60.0
kind = "wind_speed"
tws_mps = 8.0
over_s = 10.0
for_s = 60.0                      # then as before

# [[events]]
# at_s = 50.0
# kind = "link_cut"               # the companion and the autopilot do not hear each other
# for_s = 5.0

[expect]                          # each is a check of the verdict; what is not asked for is not checked
arrived = true
contacts = 0                      # by the true track, not by what the boat believes
min_clearance_m = 6.0             # from what is solid, and inside the fence
max_time_s = 600.0
"""


def add_parser(subparsers: Any, summary: str) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "example",
        help=summary,
        description="Write a scenario with a comment at every key, and the mission that it sails beside it.",
        epilog="Example: sitl example squall && sitl run squall/squall.toml",
    )
    parser.add_argument("folder", type=Path, metavar="DIR", help="where; the scenario has its name")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    from companion import examples
    from companion.disk import Disk, reason
    from companion.errors import InputError
    from companion.words import file_name

    name = file_name(args.folder.resolve().name)
    files = {f"{name}.toml": EXAMPLE.format(name=name).encode()}
    files |= {file: (examples.folder() / file).read_bytes() for file in ("rocks.toml", "rocks.wkt")}
    there = [file for file in files if (args.folder / file).exists()]
    if there or name == "rocks":
        raise InputError(
            str(args.folder),
            (there or ["rocks.toml"])[0],
            "is there already, or would be the mission's",
            "name another folder: nothing is written over",
        )
    try:
        args.folder.mkdir(parents=True, exist_ok=True)
        for file, data in files.items():
            Disk().replace(args.folder / file, data)
    except OSError as error:
        raise InputError(str(args.folder), "", f"cannot be written ({reason(error)})", "name another folder") from error
    print(f"{args.folder / name}.toml; next: sitl run {args.folder / name}.toml")
    return 0
