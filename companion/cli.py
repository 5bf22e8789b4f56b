"""The command line of the companion: argument parsing only.

Every command is a module of ``companion.commands`` with ``add_parser(subparsers)``, which sets ``run``, a
function from the parsed arguments to an exit code. Modules are imported when asked for, so ``companion --help``
does not wait for numba.
"""

from __future__ import annotations

import argparse
import importlib
import sys
from collections.abc import Sequence

from companion import __version__
from companion.errors import CompanionError

COMMANDS = {
    "run": "sail a mission",
    "plan": "plan a path on a problem",
    "wind": "forecast a wind record and score the forecasts",
    "status": "what the companion says over the radio",
    "fence": "check, convert, upload, download fences",
    "mission": "check, make, convert, upload, download missions",
    "doctor": "is this autopilot set up to be sailed?",
    "replay": "fold a recorded voyage again",
    "report": "pictures and a summary of a voyage",
}


def build_parser(command: str | None = None) -> argparse.ArgumentParser:
    """Return the parser; only ``command``'s own options are loaded, or all of them when it is None."""
    parser = argparse.ArgumentParser(
        prog="companion",
        description="Wind, planning and a skipper for an autonomous sailboat beside ArduPilot.",
        epilog="Exit codes: 0 success, 1 failed job, 2 bad usage or input. 'companion COMMAND --help' says more.",
    )
    parser.add_argument("--version", action="version", version=f"companion {__version__}")
    subparsers = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    for name, summary in COMMANDS.items():
        if command is None or name == command:
            importlib.import_module(f"companion.commands.{name}").add_parser(subparsers, summary)
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
        sys.stderr.write(f"companion {args.command}: {error}\n")
        return error.exit_code
    except KeyboardInterrupt:
        return 130
    except BrokenPipeError:
        sys.stderr.close()
        return 0


if __name__ == "__main__":
    sys.exit(main())
