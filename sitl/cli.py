"""The simulator's command line: argument parsing only.

Every command is a module of ``sitl.commands`` with ``add_parser(subparsers, summary)``, which sets ``run``, a
function from the parsed arguments to an exit code.
"""

from __future__ import annotations

import argparse
import importlib
import importlib.util
import sys
from collections.abc import Sequence

from companion import __version__
from companion.errors import CompanionError

COMMANDS = {
    "boat": "the simulated autopilot alone, for any MAVLink client",
    "run": "sail a scenario: autopilot, weather, companion, verdict",
    "campaign": "a scenario over many seeds: success, risk, time",
    "faults": "a short voyage a thousand times, each with trouble of its own",
    "baselines": "the companion against ArduRover alone and with its own path planning",
    "fetch": "download the official ArduRover simulator",
}


def build_parser(command: str | None = None) -> argparse.ArgumentParser:
    """Return the parser; only ``command``'s own options are loaded, or all of them when it is None."""
    parser = argparse.ArgumentParser(
        prog="sitl",
        description="A simulated ArduRover sailboat, weather, and scenarios for the companion.",
        epilog="Exit codes: 0 success, 1 failed job, 2 bad usage or input. 'sitl COMMAND --help' says more.",
    )
    parser.add_argument("--version", action="version", version=f"sitl {__version__}")
    subparsers = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    for name, summary in COMMANDS.items():
        module = f"sitl.commands.{name}"
        if importlib.util.find_spec(module) is None:
            continue
        if command is None or name == command:
            importlib.import_module(module).add_parser(subparsers, summary)
        else:
            subparsers.add_parser(name, help=summary, add_help=False)
    return parser


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    command = next((a for a in arguments if not a.startswith("-")), None)
    parser = build_parser(command if command in COMMANDS else "")
    args = parser.parse_args(arguments)
    try:
        return int(args.run(args))
    except CompanionError as error:
        sys.stderr.write(f"sitl {args.command}: {error}\n")
        return error.exit_code
    except KeyboardInterrupt:
        return 130
    except BrokenPipeError:
        sys.stderr.close()
        return 0


if __name__ == "__main__":
    sys.exit(main())
