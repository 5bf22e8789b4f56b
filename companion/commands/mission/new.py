"""``companion mission new``: a mission TOML with its area files, from a drawing or from places."""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from companion.commands.mission.picture import preview, preview_options, read_mission_file
from companion.commands.output import force_option, print_findings, print_losses, refuse_existing, write_files
from companion.errors import InputError
from companion.program.arguments import number, place, system_id

if TYPE_CHECKING:
    from companion.boat import ProposedMargin
    from companion.geofence import Mission
    from companion.geofence.mission import MissionFiles


def add_parser(verbs: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the verb."""
    new = verbs.add_parser("new", help="make a mission TOML with its area files")
    new.add_argument("out", metavar="OUT.toml")
    new.add_argument("--from", dest="source", metavar="FILE", help="a drawing: .plan, .waypoints, GPX, KML, GeoJSON")
    new.add_argument("--start", type=place, metavar="LAT,LON",
                     help="where the boat will start (else the drawing's home)")
    new.add_argument("--goal", type=place, metavar="LAT,LON", action="append", default=[], help="in order; repeat it")
    new.add_argument("--land", metavar="FILE", action="append", default=[], help="obstacles, any format; repeat it")
    new.add_argument("--fence", metavar="FILE", help="water to stay inside of, any format")
    new.add_argument("--axis", choices=("auto", "lonlat", "latlon"), default="auto", help="order of WKT coordinates")
    new.add_argument("--name", help="of the mission (else of the file)")
    new.add_argument("--margin", type=number("m", at_least=0.0, at_most=1000.0), metavar="M",
                     help="what plans keep clear of everything (what the autopilot's habits ask for)")
    new.add_argument("--link", metavar="LINK",
                     help="ask the autopilot there for its habits (else ArduRover's defaults)")
    new.add_argument("--system", type=system_id, metavar="N",
                     help="the autopilot's MAVLink system id (default: the only one heard)")
    new.add_argument("--radius", type=number("m", above=0.0, at_most=5000.0), metavar="M", help="of the goals (10)")
    point_radius_option(new)
    force_option(new)
    preview_options(new)
    new.set_defaults(run=run)


def _proposed_margin(args: argparse.Namespace) -> ProposedMargin | None:
    """Return the margin that the doctor will find enough, and say what it is made of; None when one is given."""
    if args.margin is not None:
        return None
    from companion.boat import AutopilotLimits, Boat, ardurover_sitl, proposed_margin
    from companion.geofence.mission import WindOptions

    if args.link is not None:
        from companion.commands.doctor import limits_at

        limits, source = limits_at(args.link, system=args.system), f"the parameters at {args.link}"
    else:
        limits, source = AutopilotLimits(), "ArduRover's default parameters; --link asks the autopilot"
    boat = Boat(polar=ardurover_sitl())
    proposed = proposed_margin(
        limits, speed_mps=boat.polar.max_speed_mps(WindOptions().preview_speed_mps), hull=boat.hull)
    print(f"{args.out}: note: margin_m = {proposed.margin_m:g}: {proposed.margin.describe()} ({source})")
    return proposed


def point_radius_option(parser: argparse.ArgumentParser) -> None:
    """Add --point-radius."""
    parser.add_argument("--point-radius", type=number("m", above=0.0, at_most=5000.0), metavar="M",
                        help="radius of an obstacle that is a point or line (a mission takes 10)")


def run(args: argparse.Namespace) -> int:
    """Make the mission; return the exit code."""
    from dataclasses import replace

    from companion.geofence import Document, ZoneKind, read
    from companion.geofence.mission import mission_files

    out = Path(args.out)
    if out.suffix.lower() != ".toml":
        raise InputError(args.out, "", "a mission file ends in .toml")
    drawing = read_mission_file(args.source) if args.source else Document(source="--goal")
    print_findings(drawing.findings, drawing.source)
    near = args.start or drawing.home or (args.goal[0] if args.goal else None)
    land = Document()
    sources = [(f, ZoneKind.EXCLUSION) for f in args.land] + [(f, ZoneKind.INCLUSION) for f in [args.fence] if f]
    for name, kind in sources:
        more = read(name, kind=kind, axis=args.axis, near=near, areas=True).require_clean()
        print_findings(more.findings, name)
        land = replace(land, zones=(*land.zones, *more.zones), marks=(*land.marks, *more.marks))
    proposed = _proposed_margin(args)
    try:
        made = mission_files(
            drawing, args.name or out.stem, start=args.start, goals=tuple(args.goal), land=land, radius_m=args.radius,
            margin_m=args.margin if proposed is None else proposed.margin_m,
            floor_m=None if proposed is None else proposed.floor_m, point_radius_m=args.point_radius,
        )
    except ValueError as error:
        raise InputError(args.source or "companion mission new", "", str(error)) from None
    mission = write_mission(made, out, force=args.force)
    print(f"{args.out}: note: [operator] permits nothing yet: with set_auto = true the companion uploads and sets AUTO")
    print(f"{args.out}: note: to see and change it on a chart: companion mission edit {args.out}")
    if args.plot:
        preview(mission, args)
    return 0


def write_mission(made: MissionFiles, out: Path, *, force: bool) -> Mission:
    """Write a mission with its area files once it has been read as the boat will read it, and return it.

    Nothing is left behind when it cannot be sailed.
    """
    from dataclasses import replace

    from companion.geofence.mission import load_mission

    print_losses(made.losses, str(out))
    files = {str(out): made.toml, **{str(out.parent / name): data for name, data in made.files.items()}}
    refuse_existing(list(files), force=force)
    with tempfile.TemporaryDirectory() as folder:
        for name, data in files.items():
            (Path(folder) / Path(name).name).write_bytes(data)
        try:
            mission = load_mission(Path(folder) / out.name)
        except InputError as error:
            raise InputError(str(out.parent / Path(error.source).name), error.place, error.problem,
                             error.remedy or "nothing is written") from None
    write_files(files, force=force)
    for name in files:
        print(f"{name}: written")
    return replace(mission, path=out)
