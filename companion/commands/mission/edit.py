"""``companion mission edit``: draw a mission in a browser, with what the checker finds and what a plan would be."""

from __future__ import annotations

import argparse
from pathlib import Path

from companion.errors import InputError
from companion.program.arguments import chart_option, host_name, http_address

_EPILOG = """\
examples:
  companion mission edit missions/bay.toml
  companion mission edit new.toml --http 8765 --chart solent.mbtiles
  companion mission edit new.toml --http 0.0.0.0:8765       (for who is on the network and has the whole address)

The address that is printed ends in a token of this run: who has it may edit this file, nobody else. Nothing is written
until Save; then the mission file and the files of its area that were changed, each whole or not at all. What is not
drawn stays in the file as it stands, comments included. Ctrl-C ends it.
"""


def add_parser(verbs: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the verb."""
    edit = verbs.add_parser(
        "edit", help="draw a mission in a browser, checked and planned as you draw",
        description="Draw a mission in a browser: goals, gates, boxes, obstacles, fence, refuges, the start. What "
        "`companion mission check` finds and what a plan would be in a wind of your choice are shown as you draw. A "
        "file that is not there begins an empty mission.",
        epilog=_EPILOG, formatter_class=argparse.RawDescriptionHelpFormatter)
    edit.add_argument("file", metavar="FILE.toml")
    edit.add_argument("--http", type=http_address, default=("127.0.0.1", 0), metavar="[HOST:]PORT",
                      help="where to serve it (default: a free port of this machine, for this machine only)")
    edit.add_argument("--http-name", type=host_name, action="append", default=[], metavar="NAME",
                      help="a further name under which this machine's page may be asked for")
    chart_option(edit)
    edit.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Serve the editor until it is ended; return the exit code."""
    from companion.clock import run as run_loop
    from companion.editor import Base, editing, read_base
    from companion.page import Address, open_charts

    path = Path(args.file)
    if path.suffix.lower() != ".toml":
        raise InputError(args.file, "", "a mission file ends in .toml",
                         "make one of a drawing: companion mission new OUT.toml --from FILE")
    import tomlkit  # noqa: F401 - said now where it is missing, and not when somebody saves

    base: Base = read_base(path)
    host, port = args.http
    charts = open_charts(args.chart)

    async def whole() -> None:
        from companion.commands.view.serving import stopping

        stop = stopping()
        async with editing(base, Address(host=host, port=port, names=tuple(args.http_name)), charts) as place:
            print(f"{place.url}  (Ctrl-C ends it)", flush=True)
            await stop.wait()

    run_loop(whole())
    return 0
