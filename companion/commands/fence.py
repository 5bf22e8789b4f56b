"""``companion fence``: check, convert, upload and download fences and obstacle files."""

from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from companion.commands.output import (
    force_option,
    patience,
    print_findings,
    print_losses,
    refuse_existing,
    summary,
    write_out,
)
from companion.errors import InputError, JobError
from companion.program.arguments import add_command, number, picture, place, radio_options
from companion.words import counted

if TYPE_CHECKING:
    from companion.geofence import Area, Document
    from companion.geofence.autopilot_fence import AutopilotFence
    from companion.messages import GeoPoint

_EPILOG = """\
examples:
  companion fence check islands.wkt --near 50.82,-1.31
  companion fence check missions/archipelago.toml          (with its start, goals, margin and wind)
  companion fence convert islands.wkt islands.plan
  companion fence convert crossing.wkt fixed.wkt --repair
  companion fence upload missions/archipelago.toml --link udpin:0.0.0.0:14550 --enable
  companion fence download boat.geojson --link /dev/ttyUSB0:57600

Formats: WKT, EWKT, GeoJSON, QGroundControl .plan, .waypoints, Mission Planner .fen and .poly, GPX, KML, KMZ; a
mission TOML stands for its area. The format is recognised by content, not by name.
Exit codes: 0 in order, 1 faults found or a failed transfer, 2 an invalid file or option.
"""


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser], summary: str) -> None:
    """Add the command with its four verbs."""
    parser = add_command(subparsers, "fence", summary, _EPILOG)
    verbs = parser.add_subparsers(dest="verb", metavar="check|convert|upload|download", required=True)
    check = verbs.add_parser("check", help="find and name what is wrong with a fence, an obstacle file, a mission")
    check.add_argument("file", metavar="FILE")
    reading_options(check)
    place_options(check)
    check.add_argument(
        "--wind-from",
        type=number("deg", at_least=-360.0, at_most=360.0),
        metavar="DEG",
        help="wind for which gaps must be wide enough",
    )
    check.add_argument(
        "--no-go",
        type=number("deg", at_least=0.0, at_most=89.0),
        default=47.0,
        metavar="DEG",
        help="half angle of the no-go zone (47)",
    )
    check.add_argument("--plot", type=picture, metavar="P.png", help="draw the area")
    check.set_defaults(run=_check)

    convert = verbs.add_parser("convert", help="write a file in another format and say what it does not carry")
    convert.add_argument("file", metavar="FILE")
    convert.add_argument("out", metavar="OUT", help="its extension is the format")
    reading_options(convert)
    place_options(convert)
    convert.add_argument(
        "--repair", action="store_true", help="write broken rings repaired: no repair makes the sea larger"
    )
    convert.add_argument("--lossy", action="store_true", help="write even if zones are left out")
    force_option(convert)
    convert.add_argument(
        "--simplify",
        action="store_true",
        help="write the 84 items for the autopilot (needs --margin and --start, or a mission)",
    )
    convert.set_defaults(run=_convert)

    upload = verbs.add_parser("upload", help="simplify to what the autopilot holds, write, read back, compare")
    upload.add_argument("file", metavar="FILE")
    link_options(upload)
    reading_options(upload)
    place_options(upload)
    upload.add_argument("--exact", action="store_true", help="never simplify: the zones as the file has them")
    upload.add_argument("--enable", action="store_true", help="also set FENCE_TYPE 4 (polygons) and FENCE_ENABLE 1")
    upload.set_defaults(run=_upload)

    download = verbs.add_parser("download", help="read the autopilot's fence into a file")
    download.add_argument("out", metavar="OUT", help="its extension is the format")
    link_options(download)
    download.add_argument("--lossy", action="store_true", help="write even if zones are left out")
    force_option(download)
    download.set_defaults(run=_download)


def link_options(parser: argparse.ArgumentParser) -> None:
    """Add --link, --system and --timeout."""
    radio_options(parser)
    parser.add_argument(
        "--timeout", type=number("s", above=0.0), default=10.0, metavar="S", help="wait this long for a heartbeat (10)"
    )


def reading_options(parser: argparse.ArgumentParser) -> None:
    """Add how a file is to be understood."""
    parser.add_argument(
        "--kind",
        choices=("inclusion", "exclusion"),
        default="exclusion",
        help="what zones are where the file does not say (exclusion)",
    )
    parser.add_argument(
        "--axis",
        choices=("auto", "lonlat", "latlon"),
        default="auto",
        help="order of WKT coordinates (longitude first, checked against the place)",
    )
    parser.add_argument(
        "--near", type=place, metavar="LAT,LON", help="where the file should lie: farther than 50 km is an error"
    )
    parser.add_argument(
        "--point-radius",
        type=number("m", above=0.0, at_most=5000.0),
        metavar="M",
        help="radius of an obstacle that is a point or line (10); a file is converted with it drawn",
    )


def place_options(parser: argparse.ArgumentParser) -> None:
    """Add start, goals and margin."""
    parser.add_argument("--start", type=place, metavar="LAT,LON")
    parser.add_argument("--goal", type=place, metavar="LAT,LON", action="append", default=[])
    parser.add_argument(
        "--margin", type=number("m", at_least=0.0, at_most=1000.0), metavar="M", help="what the planner keeps clear [m]"
    )


def read_input(args: argparse.Namespace) -> Document:
    """Return the document that the arguments name."""
    from companion.geofence import ZoneKind, load_mission, read
    from companion.geofence.mission import document_of

    if Path(args.file).suffix.lower() == ".toml":
        return document_of(load_mission(args.file))
    return read(args.file, kind=ZoneKind(args.kind), axis=args.axis, areas=True, near=args.near or args.start)


def point_radius_m(args: argparse.Namespace) -> float:
    """Return the radius of an obstacle without area [m]: the argument, or what a mission file takes by default."""
    from companion.geofence.mission import AreaOptions

    return AreaOptions().point_radius_m if args.point_radius is None else float(args.point_radius)


def places(args: argparse.Namespace) -> tuple[GeoPoint | None, tuple[GeoPoint, ...], float | None]:
    """Return start, goals and margin of the arguments, or of a mission TOML."""
    from companion.geofence import load_mission

    start, goals, margin_m = args.start, tuple(args.goal), args.margin
    if Path(args.file).suffix.lower() == ".toml":
        mission = load_mission(args.file)
        start = start or mission.origin
        goals = goals or mission.places
        margin_m = mission.margin_m if margin_m is None else margin_m
    return start, goals, margin_m


def area_of(document: Document, point_radius_m: float) -> Area:
    """Return a document's zones and marks as an area."""
    from companion.geofence import Area, Fence, ZoneKind

    return Area(
        obstacles=document.as_obstacles(point_radius_m),
        fence=Fence(tuple(z for z in document.zones if z.kind is ZoneKind.INCLUSION)),
    )


def grown_marks(document: Document, point_radius_m: float) -> Document:
    """Return the document with its points and lines to keep out of as zones of that radius."""
    from dataclasses import replace

    from companion.geofence import ZoneKind
    from companion.geofence.mission import zones_only

    return replace(
        document,
        zones=zones_only(document, point_radius_m),
        marks=tuple(m for m in document.marks if m.kind is not ZoneKind.EXCLUSION),
    )


def _check(args: argparse.Namespace) -> int:
    from companion.geofence.check import AreaConditions, check_area

    document = read_input(args)
    start, goals, margin_m = places(args)
    wind_deg = args.wind_from
    names: list[str] = []
    if Path(args.file).suffix.lower() == ".toml":
        from companion.geofence import load_mission

        mission = load_mission(args.file)
        wind_deg = mission.wind.preview_from_deg if wind_deg is None else wind_deg
        args.no_go = mission.boat.no_go_half_deg
        names = [goal.name for goal in mission.goals] if not args.goal else []
    area = area_of(document, point_radius_m(args))
    bad = print_findings(document.findings, args.file)
    bad |= print_findings(
        check_area(
            area,
            AreaConditions(
                start=start,
                goals=goals,
                near=args.near or document.home,
                drawing=Path(args.file).stem,
                margin_m=margin_m,
                no_go_half_rad=math.radians(args.no_go),
                twd_from_rad=math.radians(wind_deg) if wind_deg is not None else None,
            ),
        ),
        args.file,
    )
    if args.plot:
        from companion.plots.mission import save_area

        with patience("drawing"):
            save_area(
                area,
                args.plot,
                start=start,
                goals=goals,
                margin_m=margin_m or 0.0,
                twd_from_rad=math.radians(wind_deg) if wind_deg is not None else None,
                no_go_half_rad=math.radians(args.no_go),
                title=Path(args.file).name,
                names=names,
            )
    print(f"{args.file}: {document.format}: {summary(document)}: {'NOT in order' if bad else 'in order'}")
    return int(bad)


def simplified(args: argparse.Namespace, document: Document) -> AutopilotFence:
    """Return the autopilot's fence for the arguments. Raises JobError with the reason when there is none."""
    from companion.geofence.autopilot_fence import FenceStatus, fence_for_autopilot

    start, goals, margin_m = places(args)
    if start is None or margin_m is None:
        raise InputError(
            args.file,
            "",
            "simplifying needs a margin and a start",
            "give --margin M and --start LAT,LON, or a mission TOML",
        )
    result = fence_for_autopilot(area_of(document, point_radius_m(args)), margin_m, inside=[start, *goals])
    if result.status is not FenceStatus.OK:
        raise JobError(f"{args.file}: no fence for the autopilot: {result.reason}")
    for note in result.notes:
        print(f"{args.file}: note: {note}")
    if result.left_out:
        print(f"{args.file}: warning: {result.left_out}")
    print(f"{args.file}: {len(result.items)} fence items, which use {result.used_m:.1f} m of the {margin_m:g} m margin")
    return result


def _convert(args: argparse.Namespace) -> int:
    from companion.geofence import Document, read
    from companion.geofence.formats import write

    document = read_input(args)
    if not args.repair:
        document.require_clean()
    print_findings(document.findings, args.file)
    if args.point_radius is not None:
        document = grown_marks(document, args.point_radius)
    if args.simplify:
        document = Document(source=document.source, format="simplified", zones=simplified(args, document).zones)
    write_out(write(document, args.out, part="fence"), args.out, lossy=args.lossy, force=args.force)
    print(f"{args.out}: written: {summary(read(args.out, areas=True))}")  # what is in it, not what was meant to be
    return 0


def _upload(args: argparse.Namespace) -> int:
    from companion.commands.mavsdk_session import MavsdkSession, upload_and_compare
    from companion.geofence.formats import MAX_FENCE_ITEMS, STORAGE_BYTES, storage_bytes, zones_to_items
    from companion.geofence.mission import zones_only
    from companion.messages import MissionType

    document = read_input(args).require_clean()
    items, losses = zones_to_items(zones_only(document, point_radius_m(args)), return_point=document.return_point)
    if not items:
        raise JobError(f"{args.file}: there is no zone to upload")
    start, _, margin_m = places(args)
    if not args.exact and start is not None and margin_m is not None:
        items = simplified(args, document).items
    elif len(items) > MAX_FENCE_ITEMS or storage_bytes(items) > STORAGE_BYTES:
        raise JobError(
            f"{args.file}: takes {len(items)} fence items of {storage_bytes(items)} bytes, the autopilot holds "
            f"{MAX_FENCE_ITEMS} in {STORAGE_BYTES} bytes: simplify it with "
            "--margin and --start"
        )
    else:
        print_losses(tuple(losses), args.file)
    with MavsdkSession(args.link, timeout_s=args.timeout, system=args.system) as session:
        name = upload_and_compare(session, MissionType.FENCE, items)
        print(f"fence of {counted(len(items), 'item')} uploaded and read back the same, hash {name}")
        if args.enable:
            session.set_param("FENCE_TYPE", 4.0)  # polygons alone: the default's 300 m circle round home would breach
            session.set_param("FENCE_ENABLE", 1.0)
            print(f"fence enabled: FENCE_TYPE 4, FENCE_ACTION {session.get_param('FENCE_ACTION'):g}")
        else:
            enabled, kind = session.get_param("FENCE_ENABLE"), session.get_param("FENCE_TYPE")
            print(
                f"FENCE_ENABLE is {enabled:g} and FENCE_TYPE {kind:g}: "
                + ("in force" if enabled and int(kind) & 4 else "not in force; --enable sets both")
            )
    return 0


def _download(args: argparse.Namespace) -> int:
    from companion.commands.mavsdk_session import MavsdkSession, download_list
    from companion.geofence.formats import Findings, format_of, items_to_zones, write
    from companion.mavlink.wire import mission_hash
    from companion.messages import MissionType

    format_of(args.out)
    refuse_existing([args.out], force=args.force)
    with MavsdkSession(args.link, timeout_s=args.timeout, system=args.system) as session:
        items = download_list(session, MissionType.FENCE)
    findings = Findings()
    zones, return_point = items_to_zones(items, findings)
    document = _document(zones, return_point, findings)
    bad = print_findings(document.findings, "autopilot")
    if not items:
        print("the autopilot holds no fence; nothing is written", file=sys.stderr)
        return 1
    write_out(write(document, args.out, part="fence"), args.out, lossy=args.lossy, force=args.force)
    print(f"{args.out}: written: {summary(document)}, hash {mission_hash(items)}")
    return int(bad)


def _document(zones: Any, return_point: GeoPoint | None, findings: Any) -> Document:
    from companion.geofence import Document

    return Document(
        source="autopilot", format="autopilot", zones=zones, return_point=return_point, findings=tuple(findings)
    )
