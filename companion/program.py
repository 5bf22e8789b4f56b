"""What the command lines of this project share: commands that load when they are asked for, and exit codes.

Every command is a module of the program's ``package`` with ``add_parser(subparsers, summary)``, which sets ``run``, a
function from the parsed arguments to an exit code. Modules are imported when asked for, so ``--help`` does not wait
for numba.
"""

from __future__ import annotations

import argparse
import importlib
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from companion import __version__
from companion.errors import CompanionError

INTERRUPTED = 130


def system_id(text: str) -> int:
    """Take the argument of ``--system``: a MAVLink system id."""
    if not (text.isascii() and text.isdigit() and 1 <= int(text) <= 255):
        raise argparse.ArgumentTypeError(f"{text!r} is not a system id from 1 to 255")
    return int(text)


@dataclass(frozen=True, slots=True, kw_only=True)
class Program:
    """A command line: its name, what it is for, and the summary of each command in the package of them."""

    name: str
    description: str
    package: str
    commands: Mapping[str, str]

    def parser(self, command: str | None = None) -> argparse.ArgumentParser:
        """Return the parser; only ``command``'s own options are loaded, or all of them when it is None."""
        parser = argparse.ArgumentParser(
            prog=self.name, description=self.description,
            epilog="Exit codes: 0 success, 1 failed job, 2 bad usage or input. "
            f"'{self.name} COMMAND --help' says more.",
        )
        parser.add_argument("--version", action="version", version=f"{self.name} {__version__}")
        subparsers = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
        for name, summary in self.commands.items():
            if command is None or name == command:
                importlib.import_module(f"{self.package}.{name}").add_parser(subparsers, summary)
            else:
                subparsers.add_parser(name, help=summary, add_help=False)
        return parser

    def run(self, argv: Sequence[str] | None = None) -> int:
        """Run one command of ``argv`` (None: of this process) and return its exit code."""
        arguments = list(sys.argv[1:] if argv is None else argv)
        command = next((a for a in arguments if not a.startswith("-")), None)
        args = self.parser(command if command in self.commands else "").parse_args(arguments)
        try:
            return int(args.run(args))
        except CompanionError as error:
            sys.stderr.write(f"{self.name} {args.command}: {error}\n")
            return error.exit_code
        except KeyboardInterrupt:
            return INTERRUPTED
        except BrokenPipeError:
            sys.stderr.close()
            return 0
