"""``sitl boat``: the simulated autopilot alone, for any MAVLink client."""

from __future__ import annotations

import argparse
import datetime as dt
import math
import sys
from pathlib import Path

from companion.errors import InputError
from companion.program.arguments import moment, number, place, whole

_EXAMPLE = """examples:
  sitl boat                                  TCP on 5760 (as SITL's SERIAL0), UDP on 14555; real time
  sitl boat --warm --wind ar1:5@200 --seed 7 --speedup 8
  sitl boat --udp-out 127.0.0.1:14550        a ground station or companion listens there
  companion status --link tcp:127.0.0.1:5760
"""


# What `companion doctor` asks for in place of ArduPilot's defaults: this boat is one that was set up to be sailed.
SET_UP = {"FS_THR_ENABLE": 2.0, "AVOID_ENABLE": 0.0}


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser], summary: str) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "boat", help=summary, description=summary, epilog=_EXAMPLE, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--port", type=_port, default=5760, help="TCP port on 127.0.0.1, 0 for none (default 5760)")
    parser.add_argument("--udp", type=_port, default=14555, help="UDP port to listen on, 0 for none (default 14555)")
    parser.add_argument("--udp-out", metavar="HOST:PORT", action="append", default=[], help="also send there first")
    parser.add_argument("--host", default="127.0.0.1", help="address to listen on (default 127.0.0.1)")
    parser.add_argument(
        "--speedup",
        type=number(above=0.0, at_most=1000.0),
        default=1.0,
        metavar="N",
        help="simulated seconds per second",
    )
    parser.add_argument(
        "--wind",
        default="5@0",
        metavar="WIND",
        help="SPEED@FROM in m/s and degrees, ar1:SPEED@FROM[,sd=DEG][,rho=HZ][,gust=MPS], or FILE.csv (default 5@0)",
    )
    parser.add_argument(
        "--home", type=place, default="51.1,-1.3", metavar="LAT,LON", help="place of the boat (default 51.1,-1.3)"
    )
    parser.add_argument(
        "--heading",
        type=number("deg", at_least=-360.0, at_most=360.0),
        default=0.0,
        metavar="DEG",
        help="of the bow at power-up",
    )
    parser.add_argument("--seed", type=whole(), default=0, help="of the wind and of faults (default 0)")
    parser.add_argument("--warm", action="store_true", help="powered up long ago: no EKF wait of 42 s")
    parser.add_argument(
        "--moored",
        action=argparse.BooleanOptionalAction,
        default=True,
        help="lies still until it is armed (default); --no-moored: drifts",
    )
    parser.add_argument(
        "--at", type=moment, metavar="TIME", help="the time that its GPS tells, as 2026-11-24T08:00Z (default: now)"
    )
    parser.add_argument("--sysid", type=whole(at_least=1, at_most=255), default=1, help="MAVLink system id (default 1)")
    parser.add_argument(
        "--param",
        metavar="NAME=VALUE",
        action="append",
        default=[],
        help="set a parameter; it has been set up as 'companion doctor' asks: "
        + ", ".join(f"{name}={value:g}" for name, value in SET_UP.items()),
    )
    parser.add_argument("--polar", type=Path, metavar="FILE", help="a boat that sails by this polar, or boat file")
    parser.add_argument(
        "--for", dest="for_s", type=number("s", above=0.0), metavar="S", help="end after S simulated seconds"
    )
    parser.set_defaults(run=run)


def _port(text: str) -> int:
    if not text.isdigit() or int(text) > 65535:
        raise argparse.ArgumentTypeError(f"{text!r} is not a port")
    return int(text)


def run(args: argparse.Namespace) -> int:
    """Run until interrupted."""
    import asyncio

    from companion import clock
    from companion.compose import whole_polar
    from companion.errors import LinkError
    from companion.mavlink.transports import parse_link
    from sitl.autopilot import AutopilotConfig, SimulatedAutopilot, check_parameters, serve
    from sitl.world import parse_wind

    parameters: dict[str, float] = {}
    for text in args.param:
        name, sign, value = text.partition("=")
        try:
            parameters[name] = float(value)
        except ValueError:
            sign = ""
        if not sign or not name:
            raise InputError("--param", text, "is not a parameter", "write NAME=VALUE")
    check_parameters(parameters)
    parameters = SET_UP | parameters
    begins = args.at or dt.datetime.now(dt.UTC).replace(microsecond=0)
    config = AutopilotConfig(
        home=args.home,
        heading_rad=math.radians(args.heading),
        is_warm=args.warm,
        is_moored=args.moored,
        sysid=args.sysid,
        parameters=parameters,
        polar=None if args.polar is None else whole_polar(args.polar),
        epoch_s=begins.timestamp(),
    )
    autopilot = SimulatedAutopilot(config, parse_wind(args.wind, seed=args.seed), args.seed)
    endpoints = [f"tcpin:{args.host}:{args.port}"] if args.port else []
    endpoints += [f"udpin:{args.host}:{args.udp}"] if args.udp else []
    for target in args.udp_out:
        endpoints.append(f"udpout:{target}")
        try:
            parse_link(endpoints[-1])
        except InputError as error:
            raise InputError("--udp-out", target, error.problem, "write HOST:PORT") from None
    if not endpoints:
        raise InputError("--port", "0", "nobody could reach the boat", "leave a port open or give --udp-out")

    async def sail() -> None:
        try:
            async with serve(autopilot, endpoints) as server:
                sys.stdout.write(
                    f"sitl boat: {', '.join(endpoints)}, {args.speedup:g}x, it is "
                    f"{begins:%Y-%m-%d %H:%M} UTC there; Ctrl-C ends\n"
                )
                sys.stdout.flush()
                await server.wait(args.for_s)
        except LinkError as error:
            raise LinkError(f"{error}; another boat may be running, give --port and --udp") from error

    try:
        clock.run(sail(), speedup=args.speedup)
    except asyncio.CancelledError:
        return 130
    return 0
