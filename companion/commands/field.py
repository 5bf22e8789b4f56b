"""``companion field``: what a field that a mission composes would do, in words, as a picture, as a page."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING

from companion.commands.output import patience
from companion.geo.angles import direction
from companion.program.arguments import add_command, out_file, picture, whole, wind

if TYPE_CHECKING:
    from companion.geofence import Mission
    from companion.mission_check import FieldPreview

_EPILOG = """\
examples:
  companion field missions/field-ring.toml
  companion field missions/field-ring.toml --goal 1 --plot ring.png
  companion field missions/field-ring.toml --wind 5@40 --fans --plot fans.png
  companion field missions/field-ring.toml --page ring.html      (turn the wind, drag the boat)
  companion field missions/field-ring.toml --page ring.html --other avalon      (and switch to her)

FILE is a mission with a goal of kind = "field", or one of [skipper] guidance = "field". The wind is steady, there
are no vessels and no current; the boat is at the start, or where the goal before was.
Exit codes: 0 told or drawn, 2 the mission cannot be read, or has no field.
"""


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser], summary: str) -> None:
    """Add the command's options."""
    parser = add_command(subparsers, "field", summary, _EPILOG)
    parser.add_argument("file", metavar="FILE", help="a mission TOML")
    parser.add_argument("--goal", type=whole(at_least=1), metavar="N", help="its number (else the first by a field)")
    parser.add_argument(
        "--wind", type=wind, metavar="SPEED@FROM", help="[m/s, degrees] (else what the mission's previews assume)"
    )
    parser.add_argument("--plot", type=picture, metavar="P.png", help="draw it with the boat's fan, wind and obstacles")
    parser.add_argument("--fans", action="store_true", help="in the picture: Schmitt's fan at every arrow, too")
    parser.add_argument(
        "--page",
        type=out_file,
        metavar="P.html",
        help="write one file for a browser: turn the wind, drag the boat; it asks for nothing",
    )
    parser.add_argument(
        "--other", metavar="BOAT", help="in the page: a boat to switch to, a boat file or ardurover or avalon"
    )
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Tell of a field, and draw it."""
    from companion.geofence import load_mission
    from companion.mission_check import field_preview, field_track, heading_fan, require_sailable

    mission = require_sailable(load_mission(args.file))
    seen = field_preview(mission, number=args.goal, wind=args.wind)
    fan, track = heading_fan(seen), field_track(seen)
    other = None if args.other is None else (Path(args.other).stem, _with_boat(mission, args.other))
    print("\n".join([*_words(mission, seen), *_in_the_wind(seen)]))
    end = math.dist(track[-1, 1:3], seen.place_en)
    print(
        f"the boat at {seen.here_en[0]:.0f} m east, {seen.here_en[1]:.0f} m north: the field says "
        f"{_heading(fan.wanted_rad)}, she is steered {_heading(fan.chosen_rad)}"
    )
    print(f"sailed by it in a steady wind: {track[-1, 0]:.0f} s, ends {end:.0f} m from {seen.name}")
    if args.plot:
        from companion.plots.field import save_field

        with patience("drawing"):
            save_field(
                seen,
                fan,
                track,
                args.plot,
                has_fans=args.fans,
                title=f"{mission.name}, goal {seen.number}: {seen.tree.text}",
            )
        print(f"{args.plot}: written")
    if args.page:
        _write_page(args.page, mission, seen, other)
    return 0


def _with_boat(mission: Mission, name: str) -> Mission:
    """Return the mission, sailed by a boat of a file or of a polar's name."""
    from dataclasses import replace

    from msgspec.structs import replace as changed

    from companion.compose import POLARS
    from companion.geofence.mission import read_boat_file

    if name in POLARS:
        boat = changed(mission.boat, polar=name)
    else:
        boat = changed(read_boat_file(Path(name)).boat, polar=str(Path(name).absolute()))
    return replace(mission, options=changed(mission.options, boat=boat))


def _write_page(path: Path, mission: Mission, seen: FieldPreview, other: tuple[str, Mission] | None) -> None:
    from companion.disk import Disk, reason
    from companion.errors import InputError
    from companion.page.fields import field_page

    try:
        Disk().replace(path, field_page(mission, seen, _words(mission, seen), other))
    except OSError as error:
        raise InputError("--page", str(path), f"cannot be written ({reason(error)})", "name another place") from error
    print(f"{path}: written; open it in a browser, no server is needed")


def _words(mission: Mission, seen: FieldPreview) -> list[str]:
    """Return what the field is made of."""
    from companion.field.tree import Along, AwayFrom, AwayFromLine, Heading, OutOf, PointTo, Round, StayAt

    def place(at: tuple[float, float]) -> str:
        return f"{at[0]:.0f} m east, {at[1]:.0f} m north"

    out = [f"{mission.path}: goal {seen.number}, {seen.name}: {seen.tree.text}, {seen.composed.until_words}"]
    for name, atom in seen.tree.atoms:
        if isinstance(atom, Round):
            words = f"round a circle of {atom.radius_m:g} m about {place(atom.at_en)}, " + (
                "clockwise" if atom.is_clockwise else "anticlockwise"
            )
        elif isinstance(atom, PointTo | StayAt):
            words = f"{'to and about' if isinstance(atom, StayAt) else 'to'} {place(atom.at_en)}"
        elif isinstance(atom, Along):
            words = f"along the line from {place(atom.from_en)} to {place(atom.to_en)}"
        elif isinstance(atom, AwayFrom):
            words = f"away from {place(atom.at_en)}, within about {atom.range_m:g} m"
        elif isinstance(atom, AwayFromLine):
            ends = f"{place(atom.from_en)} and {place(atom.to_en)}"
            words = f"away from the line through {ends}, within about {atom.range_m:g} m"
        elif isinstance(atom, Heading):
            words = f"{_heading(atom.heading_rad)} everywhere"
        else:
            assert isinstance(atom, OutOf)
            words = f"out of {atom.water_en.area / 1e4:.1f} ha of water by the heading that is soonest out"
        out.append(f"  {name}: {words}")
    return out


def _in_the_wind(seen: FieldPreview) -> list[str]:
    """Return in which wind it is looked at, and how much of the water it says nothing of."""
    from companion.mission_check import without_value

    twd, out = seen.conditions.twd_from_rad, []
    out.append(
        "a motorboat: no wind is needed"
        if twd is None
        else f"wind {seen.conditions.seen.tws_mps:g} m/s from {_heading(twd)}, no-go zone "
        f"{math.degrees(seen.conditions.habits.no_go_half_rad):.0f}° to either side"
    )
    share = without_value(seen)
    if share > 0.0:
        out.append(
            f"without a value in {100.0 * share:.0f} % of the square of {2.0 * seen.half_m:.0f} m about it: "
            "there she would not be steered"
        )
    return out


def _heading(heading_rad: float) -> str:
    return f"{direction(heading_rad)}°"
