"""The options of ``companion run``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from companion.commands.run.command import run
from companion.program.arguments import chart_option, host_name, http_address, number, out_folder, system_id, whole


def add_parser(subparsers: Any, summary: str) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "run", help=summary,
        description="Sail a mission: estimate the wind, plan, upload, and plan again at each waypoint. Nothing is "
        "sent to the boat that the mission's [operator] table does not allow.",
        epilog="Exit codes: 0 arrived, 1 not, 2 an order that gets no better by trying again, 66 a file that is not "
        "there or cannot be read, a drawing that is not there or cannot be sailed. Examples: companion run "
        "missions/archipelago.toml --link udpin:127.0.0.1:14551; companion run --from-autopilot boat.toml --link "
        "udpin:127.0.0.1:14551",
    )
    parser.add_argument("mission", type=Path, nargs="?", metavar="MISSION.toml",
                        help="the mission file; beside a drawing its boat, margins, wind and permissions")
    parser.add_argument("--from-autopilot", action="store_true",
                        help="sail what was drawn in a ground station and uploaded: waypoints are goals, the fence is "
                        "the area, rally points are refuges (in the file: from_autopilot = true)")
    parser.add_argument("--link", required=True, metavar="LINK",
                        help="/dev/serial0:921600, udpin:HOST:PORT, udpout:HOST:PORT, tcp:HOST:PORT")
    parser.add_argument("--system", type=system_id, metavar="N",
                        help="the autopilot's MAVLink system id (default: the mission's, else the only one heard)")
    parser.add_argument("--out", type=Path, metavar="DIR",
                        help="the voyage folder (default: voyages/<UTC time>-<mission>)")
    parser.add_argument("--dry-run", action="store_true", help="look, plan and speak; touch nothing")
    parser.add_argument("--seed", type=whole(), default=None, help="of the planner (default: the mission's)")
    parser.add_argument("--state", type=Path, metavar="FILE",
                        help="where the state for a restart is kept (default: voyages/<mission>.state.json); its "
                        "folder is one boat's, and locked")
    parser.add_argument("--socket", type=Path, metavar="PATH", help="take orders from on board at this Unix socket: "
                        "companion order VERB --socket PATH, as [operator] local_orders permits")
    parser.add_argument("--http", type=http_address, metavar="[HOST:]PORT",
                        help="serve the live page here; without HOST to this machine alone (127.0.0.1). It shows; it "
                        "takes orders only with --http-token")
    parser.add_argument("--http-token", type=Path, metavar="FILE",
                        help="let who has the token in this file (made, mode 0600, where there is none) give orders "
                        "from the page, as [operator] local_orders permits")
    parser.add_argument("--http-name", type=host_name, action="append", default=[], metavar="NAME",
                        help="a further name under which this machine's page may be asked for")
    chart_option(parser)
    parser.add_argument("--far", type=out_folder, metavar="DIR", help="the folder shared with the program of a "
                        "satellite modem: the newest status in DIR/out, orders in DIR/in, as [operator] far_orders "
                        "permits; `companion far` is its end ashore")
    parser.add_argument("--far-key", type=Path, metavar="FILE",
                        help="the key of that link, made by `companion key new` (default: the signing key)")
    parser.add_argument("--far-every", type=number("min", at_least=1.0, at_most=1440.0), default=10.0, metavar="MIN",
                        help="a new status this often (default: 10), and after each order")
    parser.add_argument("--again", action="store_true",
                        help="sail the mission again when its state says that it has arrived (asked at a terminal)")
    parser.add_argument("--keep-gb", type=number("GB", above=0.0), metavar="GB",
                        help="what all voyages in the folder may take together; the oldest finished ones give way, "
                        "telemetry logs first, decisions last (default: 5, and without end where --out is given)")
    parser.add_argument("--wait", type=number("s", above=0.0), default=30.0, metavar="S",
                        help="give up when no autopilot is heard for this long (default: 30)")
    parser.add_argument("--limit", type=number("s", above=0.0), metavar="S", help="end after this many seconds")
    parser.add_argument("--exit-on-arrival", action="store_true",
                        help="end when the voyage is over; by default the boat is watched in its loiter until SIGINT "
                        "or SIGTERM")
    parser.add_argument("--feed", action="append", default=[], metavar="FEED",
                        help="hear other vessels here too, besides the mission's [traffic] feeds: udpin:HOST:PORT, "
                        "tcp:HOST:PORT, /dev/NAME:BAUD; may be given more than once")
    parser.add_argument("--nmea", action="append", default=[], metavar="OUT",
                        help="tell OpenCPN and its like in NMEA 0183, besides the mission's [output] nmea: "
                        "udp:HOST:PORT, or tcp:[HOST:]PORT to be a server; may be given more than once")
    parser.add_argument("--signalk", action="append", default=[], metavar="SERVER",
                        help="tell a Signal K server, besides the mission's [output] signalk: ws://HOST:3000 or "
                        "tcp:HOST:8375; may be given more than once")
    parser.add_argument("--signalk-token", type=Path, metavar="FILE",
                        help="the token that the Signal K server asks for (mode 0600)")
    parser.add_argument("--signing-key", type=Path, metavar="FILE", help="MAVLink signing key (32 bytes, mode 0600)")
    parser.add_argument("--speedup", type=number(above=0.0, at_most=1000.0), default=1.0, metavar="N",
                        help="the autopilot is a simulator that runs N times as fast as time (default: 1)")
    parser.set_defaults(run=run)
