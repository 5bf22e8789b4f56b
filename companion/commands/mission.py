"""``companion mission``: check, make, draw, convert, upload and download missions."""

from __future__ import annotations

import argparse
import contextlib
import math
import sys
import tempfile
import time
import tomllib
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from companion.commands.output import (
    force_option,
    patience,
    print_findings,
    print_losses,
    refuse_existing,
    summary,
    write_files,
    write_out,
)
from companion.errors import InputError, JobError
from companion.program.arguments import (
    add_command,
    host_names_option,
    http_address,
    number,
    picture,
    place,
    system_id,
    wind,
)
from companion.words import counted

if TYPE_CHECKING:
    from companion.boat import ProposedMargin
    from companion.geofence import Document, Mission
    from companion.geofence.mission import MissionFiles
    from companion.planner import Plan, Problem


_EPILOG = """\
examples:
  companion mission check missions/archipelago.toml --plot archipelago.png
  companion mission new bay.toml --start 50.817,-1.31 --goal 50.8203,-1.31 --land islands.wkt --margin 12 --plot bay.png
  companion mission new bay.toml --from drawn-in-qgroundcontrol.plan
  companion mission edit bay.toml                      (draw it in a browser, checked and planned as you draw)
  companion mission convert bay.toml bay.plan          (also .gpx, .kml, .geojson)
  companion mission convert bay.toml bay.waypoints --part mission
  companion mission convert route.gpx route.waypoints
  companion mission upload route.waypoints --link udpin:0.0.0.0:14550
  companion mission download boat.plan --link /dev/ttyUSB0:57600

A mission TOML holds goals and an area; the companion plans the way itself (companion run). Waypoint files are sailed
by the autopilot as they are.
Exit codes: 0 in order, 1 faults found or a failed transfer, 2 an invalid file or option.
"""


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser], summary: str) -> None:
    """Add the command with its verbs."""
    from companion.commands.fence import link_options

    parser = add_command(subparsers, "mission", summary, _EPILOG)
    verbs = parser.add_subparsers(dest="verb", metavar="check|new|edit|example|convert|upload|download", required=True)
    check = verbs.add_parser("check", help="read a mission as the boat would and name what is wrong")
    check.add_argument("file", metavar="FILE")
    preview_options(check)
    check.set_defaults(run=_check)

    add_new(verbs)
    add_edit(verbs)

    example = verbs.add_parser("example", help="write ten missions to begin from, and say what each is")
    example.add_argument("folder", type=Path, metavar="DIR")
    example.set_defaults(run=_example)

    convert = verbs.add_parser("convert", help="write a mission in another format and say what it does not carry")
    convert.add_argument("file", metavar="FILE")
    convert.add_argument("out", metavar="OUT", help="its extension is the format")
    convert.add_argument(
        "--part",
        choices=("mission", "fence", "rally"),
        help="write this alone (a .waypoints file holds no more than one of them)",
    )
    convert.add_argument("--lossy", action="store_true", help="write even if zones are left out")
    point_radius_option(convert)
    force_option(convert)
    convert.set_defaults(run=_convert)

    upload = verbs.add_parser("upload", help="write a waypoint file to the autopilot, read back, compare")
    upload.add_argument("file", metavar="FILE")
    upload.add_argument("--part", choices=("mission", "rally"), default="mission")
    link_options(upload)
    upload.set_defaults(run=_upload)

    download = verbs.add_parser("download", help="read the autopilot's mission into a file")
    download.add_argument("out", metavar="OUT", help="its extension is the format")
    download.add_argument("--part", choices=("mission", "rally"), default="mission")
    force_option(download)
    link_options(download)
    download.set_defaults(run=_download)


def _example(args: argparse.Namespace) -> int:
    from companion import examples
    from companion.disk import Disk, reason

    if args.folder.is_file():
        raise InputError(str(args.folder), "", "is a file", "name a folder")
    missions = [examples.folder() / f"{name}.toml" for name in examples.NAMES]
    told = {path: path.read_text(encoding="utf-8") for path in missions}
    files = sorted(path for path in examples.folder().iterdir() if path.suffix in {".toml", ".wkt"})
    there = [path.name for path in files if (args.folder / path.name).exists()]
    if there:
        raise InputError(str(args.folder), there[0], "is there already", "name another folder: nothing is written over")
    try:
        args.folder.mkdir(parents=True, exist_ok=True)
        for path in files:
            Disk().replace(args.folder / path.name, path.read_bytes())
    except OSError as error:
        raise InputError(str(args.folder), "", f"cannot be written ({reason(error)})", "name another folder") from error
    width = max(len(path.name) for path in missions)
    for path, text in told.items():
        print(f"{path.name:{width}}  {tomllib.loads(text)['description']}")
    print(
        f"{counted(len(missions), 'mission')} in {args.folder}; next: companion mission check {args.folder}/"
        f"{missions[0].name} --plot {missions[0].stem}.png"
    )
    return 0


def _check(args: argparse.Namespace) -> int:
    from companion.geofence import FindingLevel
    from companion.geofence.mission import course_of, drawing_findings

    if Path(args.file).suffix.lower() != ".toml":
        document = read_mission_file(args.file)
        print_findings(document.findings, args.file)
        is_bad = print_findings(drawing_findings(document), args.file)
        refused = course_of(document.items).refusals if document.items else ()
        for finding in refused:
            text = f"the companion does not sail it: {finding.text}"
            print(replace(finding, severity=FindingLevel.WARNING, text=text).line(args.file))
        verdict = "NOT in order" if is_bad else "in order for the autopilot alone" if refused else "in order"
        print(f"{args.file}: {document.format}: {summary(document)}: {verdict}")
        return int(is_bad)
    from companion.compose import field_words
    from companion.mission_check import check_mission, current_words_of, margin_words, tide_words_of, wind_limit_words

    with patience("checking", "an area of many positions takes long"):
        judged = check_mission(Path(args.file), from_deg=args.wind[1] if args.wind else None, unix_s=time.time())
    if judged.mission is None or judged.refusals:
        raise judged.refusals[0]
    mission = judged.mission
    bad = print_findings(judged.findings, args.file)
    for line in margin_words(mission):
        print(f"{args.file}: note: {line}")
    for line in field_words(mission):
        print(f"{args.file}: {line}")
    if args.plot:
        preview(mission, args)
    if mission.is_passage:
        from companion.mission_check import passage_words

        print(passage_words(mission))
        print(
            f"{args.file}: note: a passage needs FENCE_TYPE 4 on the autopilot, its polygons alone: with bit 2 the "
            "circle round home would end it (companion doctor looks)"
        )
    limits = wind_limit_words(mission)
    if limits:
        print(f"{args.file}: {limits}")
    for line in (*current_words_of(mission, time.time()), tide_words_of(mission, time.time())):
        if line:
            print(f"{args.file}: {line}")
    print(
        f"{args.file}: {mission.name}: {counted(len(mission.goals), 'goal')}, "
        f"{counted(len(mission.area.solids), 'obstacle')}: "
        f"{'NOT in order' if bad else 'in order'}"
    )
    if bad:
        print(f"to see it on a chart and mend it: companion mission edit {args.file}")
    return int(bad)


def _only(document: Document, part: str) -> Document:
    """Return one part of a document, and say what else it holds."""
    from dataclasses import replace

    parts: dict[str, Document] = {
        "mission": replace(document, zones=(), marks=(), rally=(), return_point=None, tracks=()),
        "fence": replace(document, items=(), item_names=(), rally=(), home=None, tracks=()),
        "rally": replace(
            document, items=(), item_names=(), zones=(), marks=(), return_point=None, home=None, tracks=()
        ),
    }
    if summary(parts[part]) == "nothing":
        raise JobError(f"{document.source}: there is no {part} in it; it holds {summary(document)}")
    others = [summary(parts[p]) for p in parts if p != part]
    rest = ", ".join(words for words in others if words != "nothing")
    if rest:
        print(f"{document.source}: note: also holds {rest}: left out with --part {part}")
    return parts[part]


def _convert(args: argparse.Namespace) -> int:
    from companion.commands.fence import grown_marks
    from companion.geofence import load_mission, read
    from companion.geofence.formats import format_of, write
    from companion.geofence.mission import goal_losses, mission_files

    if Path(args.out).suffix.lower() != ".toml":
        format_of(args.out, also=(".toml",))
    document = read_mission_file(args.file)
    print_findings(document.findings, args.file)
    if args.point_radius is not None:
        document = grown_marks(document, args.point_radius)
    if Path(args.file).suffix.lower() == ".toml":
        print_losses(tuple(goal_losses(load_mission(args.file))), args.out)
    out = Path(args.out)
    if out.suffix.lower() == ".toml":
        try:
            made = mission_files(document, out.stem)
        except ValueError as error:
            raise InputError(args.file, "", str(error)) from None
        write_mission(made, out, force=args.force)
        return 0
    if args.part is not None:
        document = _only(document, args.part)
    write_out(
        write(document, args.out),
        args.out,
        lossy=args.lossy,
        force=args.force,
        remedy="choose another format, or what to write with --part",
    )
    print(f"{args.out}: written: {summary(read(args.out))}")  # what is in it, not what was meant to be
    return 0


def _upload(args: argparse.Namespace) -> int:
    from companion.commands.mavsdk_session import MavsdkSession, upload_and_compare
    from companion.messages import MissionType

    if Path(args.file).suffix.lower() == ".toml":
        raise InputError(
            args.file,
            "",
            "holds goals, not the way to them",
            "sail it with 'companion run', or convert it to .waypoints to sail straight lines",
        )
    document = _only(read_mission_file(args.file), args.part)
    kind = MissionType.RALLY if args.part == "rally" else MissionType.MISSION
    items = document.rally if kind is MissionType.RALLY else document.items
    if not items:
        raise JobError(f"{args.file}: there is no {args.part} to upload")
    with MavsdkSession(args.link, timeout_s=args.timeout, system=args.system) as session:
        name = upload_and_compare(session, kind, items, home=document.home)
    print(f"{args.part} of {counted(len(items), 'item')} uploaded and read back the same, hash {name}")
    return 0


def _download(args: argparse.Namespace) -> int:
    from companion.commands.mavsdk_session import MavsdkSession, download_list
    from companion.geofence import Document
    from companion.geofence.formats import format_of, write
    from companion.mavlink.wire import mission_hash
    from companion.messages import MissionType

    format_of(args.out)
    refuse_existing([args.out], force=args.force)
    kind = MissionType.RALLY if args.part == "rally" else MissionType.MISSION
    with MavsdkSession(args.link, timeout_s=args.timeout, system=args.system) as session:
        items = download_list(session, kind)
        home = session.home if kind is MissionType.MISSION else None
    if not items:
        print(f"the autopilot holds no {args.part}; nothing is written", file=sys.stderr)
        return 1
    document = Document(
        source="autopilot",
        format="autopilot",
        items=items if args.part == "mission" else (),
        rally=items if args.part == "rally" else (),
        home=home,
    )
    write_out(write(document, args.out, part=args.part), args.out, lossy=False, force=args.force)
    print(f"{args.out}: written: {summary(document)}, hash {mission_hash(items)}")
    return 0


def add_new(verbs: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the verb."""
    new = verbs.add_parser("new", help="make a mission TOML with its area files")
    new.add_argument("out", metavar="OUT.toml")
    new.add_argument("--from", dest="source", metavar="FILE", help="a drawing: .plan, .waypoints, GPX, KML, GeoJSON")
    new.add_argument(
        "--start", type=place, metavar="LAT,LON", help="where the boat will start (else the drawing's home)"
    )
    new.add_argument("--goal", type=place, metavar="LAT,LON", action="append", default=[], help="in order; repeat it")
    new.add_argument("--land", metavar="FILE", action="append", default=[], help="obstacles, any format; repeat it")
    new.add_argument("--fence", metavar="FILE", help="water to stay inside of, any format")
    new.add_argument("--axis", choices=("auto", "lonlat", "latlon"), default="auto", help="order of WKT coordinates")
    new.add_argument("--name", help="of the mission (else of the file)")
    new.add_argument(
        "--margin",
        type=number("m", at_least=0.0, at_most=1000.0),
        metavar="M",
        help="what plans keep clear of everything (what the autopilot's habits ask for)",
    )
    new.add_argument(
        "--link", metavar="LINK", help="ask the autopilot there for its habits (else ArduRover's defaults)"
    )
    new.add_argument(
        "--system", type=system_id, metavar="N", help="the autopilot's MAVLink system id (default: the only one heard)"
    )
    new.add_argument("--radius", type=number("m", above=0.0, at_most=5000.0), metavar="M", help="of the goals (10)")
    point_radius_option(new)
    force_option(new)
    preview_options(new)
    new.set_defaults(run=run_new)


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
        limits, speed_mps=boat.polar.max_speed_mps(WindOptions().preview_speed_mps), hull=boat.hull
    )
    print(f"{args.out}: note: margin_m = {proposed.margin_m:g}: {proposed.margin.describe()} ({source})")
    return proposed


def point_radius_option(parser: argparse.ArgumentParser) -> None:
    """Add --point-radius."""
    parser.add_argument(
        "--point-radius",
        type=number("m", above=0.0, at_most=5000.0),
        metavar="M",
        help="radius of an obstacle that is a point or line (a mission takes 10)",
    )


def run_new(args: argparse.Namespace) -> int:
    """Make the mission; return the exit code."""
    from dataclasses import replace

    from companion.geofence import Document, ZoneKind, read
    from companion.geofence.mission import mission_files

    out = Path(args.out)
    if out.is_dir():
        raise InputError(args.out, "", "is a folder", "name a file in it that ends in .toml")
    if out.suffix.lower() != ".toml":
        raise InputError(args.out, "", "a mission file ends in .toml", f"write {out.with_suffix('.toml')}")
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
            drawing,
            args.name or out.stem,
            start=args.start,
            goals=tuple(args.goal),
            land=land,
            radius_m=args.radius,
            margin_m=args.margin if proposed is None else proposed.margin_m,
            floor_m=None if proposed is None else proposed.floor_m,
            point_radius_m=args.point_radius,
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

    from companion.geofence import load_mission

    print_losses(made.losses, str(out))
    files = {str(out): made.toml, **{str(out.parent / name): data for name, data in made.files.items()}}
    refuse_existing(list(files), force=force)
    with tempfile.TemporaryDirectory() as folder:
        for name, data in files.items():
            (Path(folder) / Path(name).name).write_bytes(data)
        try:
            mission = load_mission(Path(folder) / out.name)
        except InputError as error:
            raise InputError(
                str(out.parent / Path(error.source).name),
                error.place,
                error.problem,
                error.remedy or "nothing is written",
            ) from None
    write_files(files, force=force)
    for name in files:
        print(f"{name}: written")
    return replace(mission, path=out)


_EDIT_EPILOG = """\
examples:
  companion mission edit missions/bay.toml
  companion mission edit new.toml --http 8765 --chart solent.mbtiles
  companion mission edit new.toml --chart US4MD81M.000      (drawn by it, and its water made the mission's)
  companion mission edit new.toml --http 0.0.0.0:8765       (for who is on the network and has the whole address)

The address that is printed ends in a token of this run: who has it may edit this file, nobody else. Nothing is written
until Save; then the mission file and the files of its area that were changed, each whole or not at all. What is not
drawn stays in the file as it stands, comments included. Ctrl-C ends it.
"""


def add_edit(verbs: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the verb."""
    edit = verbs.add_parser(
        "edit",
        help="draw a mission in a browser, checked and planned as you draw",
        description="Draw a mission in a browser: goals, gates, boxes, obstacles, fence, refuges, the start. What "
        "`companion mission check` finds and what a plan would be in a wind of your choice are shown as you draw. A "
        "file that is not there begins an empty mission.",
        epilog=_EDIT_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    edit.add_argument("file", metavar="FILE.toml")
    edit.add_argument(
        "--http",
        type=http_address,
        default=("127.0.0.1", 0),
        metavar="[HOST:]PORT",
        help="where to serve it (default: a free port of this machine, for this machine only)",
    )
    host_names_option(edit)
    edit.add_argument(
        "--chart",
        type=Path,
        action="append",
        default=[],
        metavar="FILE",
        help="a chart under the drawing: raster tiles (MBTiles, PMTiles), or what `companion chart import` reads (S-57 "
        "cells, coastlines, grids), of which obstacles and fence can be made; may be given more than once",
    )
    edit.set_defaults(run=run_edit)


def run_edit(args: argparse.Namespace) -> int:
    """Serve the editor until it is ended; return the exit code."""
    from companion.clock import run as run_loop
    from companion.editor import SourceFiles, editing, open_waters, read_base
    from companion.page import Address, is_tiles, open_charts

    path = Path(args.file)
    if path.is_dir():
        raise InputError(args.file, "", "is a folder", "name the TOML file of a mission in it")
    if path.suffix.lower() != ".toml":
        raise InputError(
            args.file,
            "",
            "a mission file ends in .toml",
            "make one of a drawing: companion mission new OUT.toml --from FILE",
        )
    import tomlkit  # noqa: F401 - said now where it is missing, and not when somebody saves

    base: SourceFiles = read_base(path)
    host, port = args.http
    charts = open_charts([path for path in args.chart if is_tiles(path)])
    waters = open_waters([path for path in args.chart if not is_tiles(path)])

    async def whole() -> None:
        from companion.commands.view import stopping

        stop = stopping()
        at = Address(host=host, port=port, names=tuple(args.http_name))
        async with editing(base, at, charts, waters) as place:
            print(f"{place.url}  (Ctrl-C ends it)", flush=True)
            await stop.wait()

    run_loop(whole())
    return 0


def preview_options(parser: argparse.ArgumentParser) -> None:
    """Add --plot and what it assumes."""
    parser.add_argument(
        "--plot", type=picture, metavar="P.png", help="draw obstacles, fence, margins, laylines and a plan"
    )
    parser.add_argument(
        "--wind", type=wind, metavar="SPEED@FROM", help="for the picture [m/s, degrees] (else the mission's, 5@0)"
    )
    parser.add_argument("--no-plan", action="store_true", help="draw no plan")


def preview(mission: Mission, args: argparse.Namespace) -> None:
    """Draw the mission in the wind that the arguments or the mission give."""
    from companion.mission_check import AssumedWind, layline_rad
    from companion.plots.drying import drying_picture
    from companion.plots.mission import save_mission

    tws_mps, from_deg = mission.wind.preview_speed_mps, mission.wind.preview_from_deg
    if args.wind:
        tws_mps, from_deg = args.wind
    twd_from_rad = math.radians(from_deg)
    with patience("planning and drawing"):
        lines = save_mission(
            mission,
            args.plot,
            tws_mps=tws_mps,
            twd_from_rad=twd_from_rad,
            beat_rad=layline_rad(mission, AssumedWind(from_deg=from_deg, speed_mps=tws_mps)),
            plans=[] if args.no_plan else _plans(mission, tws_mps, twd_from_rad),
            drying=drying_picture(mission, time.time()),
        )
    for line in lines:
        print(line)
    print(f"{args.plot}: written")


def _plans(mission: Mission, tws_mps: float, twd_from_rad: float) -> list[Plan]:
    """Return the planner's way from goal to goal, first lap, in a steady wind; and home, if the mission ends there."""
    from companion.compose import planner_of
    from companion.mission_check import AssumedWind, legs, planned_legs
    from companion.planner import plan

    by = planner_of(mission).about(mission.frame().origin)
    made: list[Plan] = []

    def answer(problem: Problem) -> Plan:
        made.append(
            plan(
                problem,
                budget_s=mission.skipper.planning_budget_s,
                seed=0,
                algorithm=by.algorithm,
                settings=by.settings,
            )
        )
        return made[-1]

    wind = AssumedWind(from_deg=math.degrees(twd_from_rad), speed_mps=tws_mps)
    with contextlib.suppress(InputError):  # a line without room: the check says it, and the picture shows where
        planned_legs(legs(mission, wind, unix_s=time.time()), answer)
    return made


def read_mission_file(path: str) -> Document:
    """Return what a mission TOML or a drawing holds, with its only line as the route. Raises InputError."""
    from companion.geofence import load_mission, read
    from companion.geofence.formats import lines_as_route
    from companion.geofence.mission import document_of

    if Path(path).suffix.lower() == ".toml":
        return document_of(load_mission(path))
    return lines_as_route(read(path)).require_clean()
