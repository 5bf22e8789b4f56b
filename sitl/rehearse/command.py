"""``companion rehearse``: a mission sailed a thousand times before it is sailed.

It is a command of the companion whose voyages are the simulator's. The companion does not know the simulator, so this
one is found by its entry point (pyproject.toml).
"""

from __future__ import annotations

import argparse
import datetime as dt
from argparse import ArgumentTypeError
from pathlib import Path
from typing import TYPE_CHECKING, Any

from companion.errors import InputError
from companion.program.arguments import duration, number, out_file, out_folder, whole
from companion.words import file_name
from sitl.options import add_options, options_of

if TYPE_CHECKING:
    from sitl.rehearse.prepared import PreparedRehearsal

SUMMARY = "sail a mission a thousand times before it is sailed"
FOLDER = Path("rehearsals")
_EPILOG = """\
examples:
  companion rehearse missions/archipelago.toml                         until chances are known within 10 %
  companion rehearse missions/archipelago.toml --wind 6@240 --sure 5   the forecast, and an answer twice as sharp
  companion rehearse missions/archipelago.toml --wind yesterday.csv    measured (t_s,wind_from_deg,wind_speed_ms)
  companion rehearse missions/archipelago.toml --wind july.csv         a climate (wind_from_deg,wind_speed_ms,share)
  companion rehearse across.toml --wind ensemble.grb2 --depart 2026-04-20T06:00Z    each voyage in a member of it
  companion rehearse missions/archipelago.toml --wind day.grb2 --depart 06:00..18:00 --every 2h    when to sail
  companion rehearse missions/archipelago.toml --faults --minutes 10   with trouble; what is known after ten minutes
  companion rehearse missions/archipelago.toml --try margin_m=20 --try later=2h --pairs 50
  companion rehearse missions/archipelago.toml --runs 5000 --sure 1 --dask tcp://HOST:8786

The answer stands on the terminal and, with a map of the tracks and of the trouble, in rehearsal.html, .png and .json of
the folder; the folders of the worst voyages are there for 'companion view' and 'companion replay'. The same command
goes on where it was; what was sailed is not sailed again. What is drawn and how sure it is: docs/guides/rehearse.md.
"""


def add_parser(subparsers: Any, summary: str) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "rehearse",
        help=summary,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        epilog=_EPILOG,
        description="Sail a mission in simulation, each voyage with a wind, a boat, a sea and sensors of its own, "
        "until the chances\nof arriving and of coming below the margin's floor are known well enough. Then tell times, "
        "watchdogs, the worst\nvoyages, where the trouble is, and what a change is worth by pairs of voyages.",
    )
    parser.add_argument("mission", type=Path, metavar="MISSION.toml", help="a mission with a [start], or a scenario")
    weather = parser.add_argument_group("what is sailed")
    weather.add_argument(
        "--wind",
        metavar="WIND",
        action="append",
        default=[],
        help="SPEED@FROM [m/s, degrees], a measured record or the table of a climate as CSV, or a forecast (GRIB), of "
        "which more may be given (default: the mission's preview wind)",
    )
    weather.add_argument(
        "--wind-error",
        type=_error,
        metavar="DEG,MPS",
        help="how far the mean wind that is given may be off, standard deviations (default: 10,0.5; of a climate or "
        "an ensemble 0,0)",
    )
    weather.add_argument(
        "--depart",
        type=_departure,
        metavar="TIME",
        help="when she sets sail, as 2026-11-24T08:00Z: for a forecast, a tide table and the dark (default: when the "
        "table begins, else now; of a scenario its own); a span compares departures: 06:00..18:00 (UTC, of that day) "
        "or TIME..TIME",
    )
    weather.add_argument(
        "--every", type=duration, default=7200.0, metavar="TIME", help="between the departures of a span (default: 2h)"
    )
    weather.add_argument(
        "--doubt",
        type=number(at_least=0.0, at_most=3.0),
        default=1.0,
        metavar="X",
        help="how far boat, sea and sensors may differ from the plan's: 0 not at all, 1 as a small "
        "boat meets them (default: 1)",
    )
    weather.add_argument(
        "--faults",
        action="store_true",
        help="trouble befalls each voyage: links, sensors, calms, a companion that is killed, an operator",
    )
    weather.add_argument(
        "--limit",
        type=duration,
        metavar="TIME",
        help="call a voyage off after 90m, 2h (default: three times what is planned to be sailed, at least 15m; on top "
        "comes what is waited for guns and in boxes, and 1h where there is a box, a search or a field)",
    )
    ends = parser.add_argument_group("when it ends, what is tried")
    ends.add_argument(
        "--sure",
        type=number("percent", above=0.0, at_most=100.0),
        default=10.0,
        metavar="PERCENT",
        help="end when the intervals of arriving and of the floor are no wider (default: 10)",
    )
    ends.add_argument(
        "--runs", type=whole(at_least=1), default=1000, metavar="N", help="voyages at most (default: 1000)"
    )
    ends.add_argument(
        "--minutes",
        type=number("minutes", above=0.0, at_most=100_000.0),
        metavar="M",
        help="have the whole answer in so many minutes: the chances first, then what "
        "changes are worth, then the worst voyages again",
    )
    ends.add_argument(
        "--try",
        action="append",
        dest="tries",
        default=[],
        metavar="NAME=VALUE",
        help="what a change is worth: margin_m, delta_s, SAIL_XTRACK_MAX, or later=1h; may be given more "
        "than once (default: a usual set)",
    )
    ends.add_argument(
        "--pairs",
        type=whole(),
        default=20,
        metavar="N",
        help="voyages with each change, of the first seeds; 0: none (default: 20)",
    )
    parser.add_argument(
        "--out", type=out_folder, metavar="DIR", help=f"the folder of results (default: {FOLDER}/NAME of the mission)"
    )
    parser.add_argument("--json", type=out_file, metavar="FILE", help="write the figures there, too")
    add_options(parser, has_out=False)
    parser.set_defaults(run=run)


def _departure(text: str) -> Any:
    from sitl.rehearse.departures import departure

    return departure(text)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    from sitl.rehearse import departures
    from sitl.rehearse.changes import change_of, usual
    from sitl.rehearse.prepared import prepared
    from sitl.rehearse.rehearsal import Limits, rehearse
    from sitl.rehearse.report import PAGE, RESULTS
    from sitl.run.compiled import compile_ahead
    from sitl.scenario import load_scenario

    folder = args.out or FOLDER / file_name(load_scenario(args.mission).name)
    compile_ahead()
    limits = Limits(width=args.sure / 100.0, runs=args.runs, minutes=args.minutes)  # whose minutes begin here

    def make(place: Path, depart: dt.datetime | None) -> PreparedRehearsal:
        return prepared(
            args.mission,
            place,
            wind=args.wind,
            wind_error=args.wind_error,
            doubt=args.doubt,
            faults=args.faults,
            depart=depart,
            limit_s=args.limit,
        )

    if isinstance(args.depart, departures.Span):
        if args.tries or args.json is not None:
            raise InputError(
                "--depart", "", "compares departures, and tries no change and writes no figures", "leave those out"
            )
        return departures.compare(args, limits, folder, make)
    made = make(folder, args.depart)
    changes = [change_of(text, made.mission) for text in args.tries] or usual(
        made.mission, tells_the_hour=made.tells_the_hour
    )
    waited = f", {made.waits_s:.0f} s of them waiting for a gun or staying" if made.waits_s else ""
    planned = f"; planned {made.planned_s:.0f} s{waited}" if made.plans else ""
    print(
        f"{made.mission.name}: {made.doubts.wind.told}; doubt {args.doubt:g}{', with trouble' if args.faults else ''}"
        f"; sets sail {made.scenario.begins:%Y-%m-%d %H:%M} UTC"
        f"{planned}, called off after {made.scenario.limit_s:.0f} s; "
        f"the page, from the first voyage on: {folder / PAGE}",
        flush=True,
    )
    return rehearse(made, folder, limits, changes, args.pairs, options_of(args, out=folder / RESULTS), args.json)


def _error(text: str) -> tuple[float, float]:
    try:
        from_deg, tws_mps = (float(part) for part in text.split(","))
    except ValueError:
        raise ArgumentTypeError(f"{text[:40]!r} is no error of a wind; write DEG,MPS, as 10,0.5") from None
    if not (0.0 <= from_deg <= 180.0 and 0.0 <= tws_mps <= 20.0):
        raise ArgumentTypeError(f"{text[:40]} is out of range: 0..180 degrees, 0..20 m/s")
    return from_deg, tws_mps
