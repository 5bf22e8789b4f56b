"""``sitl baselines``: the companion against ArduRover alone and ArduRover with its own path planning."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from companion.program.arguments import number, shifts, whole
from sitl.commands.run import scenario_file
from sitl.options import add_options, options_of

USUAL = ("companion", "fixed", "companion-ardurover", "greedy", "alone-embedded", "alone", "dijkstra")
SAILORS = (*USUAL, "shifts", "no-shifts")
STEADY = (0.0, 60.0)


def wind_of(text: str) -> tuple[float, float]:
    """Read a wind of ``--winds``: DEG,S, or "steady"."""
    return STEADY if text == "steady" else shifts(text)


def add_voyages(parser: argparse.ArgumentParser, *, usual: str) -> None:
    """Add which scenarios are sailed (``usual``: what they are by default, in words), with which seeds, how fast."""
    parser.add_argument(
        "--scenarios",
        type=scenario_file,
        nargs="+",
        metavar="SCENARIO",
        help=f"scenario files, or names of ours (default: {usual})",
    )
    parser.add_argument("--seeds", type=whole(at_least=1), default=5, metavar="N", help="seeds 0..N-1 (default: 5)")
    parser.add_argument(
        "--speedup",
        type=number(above=0.0, at_most=1000.0),
        default=20.0,
        metavar="X",
        help="of the real ArduRover (default: 20)",
    )


def add_winds(parser: argparse.ArgumentParser) -> None:
    """Add the options that ``sitl regret`` has, too."""
    parser.add_argument(
        "--winds",
        nargs="+",
        type=wind_of,
        metavar="DEG,S",
        help="winds in place of the scenarios': spread and correlation time each, or steady",
    )
    parser.add_argument(
        "--against", choices=SAILORS, metavar="SAILOR", help="hold the others against this one, seed by seed"
    )


def add_parser(subparsers: Any, summary: str) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "baselines",
        help=summary,
        description="Sail six scenarios with the companion and with ArduRover alone, in the same weather, and print "
        "the table of arrivals, contacts, times, tacks and clearances. 'companion', 'fixed' (its first plan, never "
        "another), 'greedy' (the heading that makes most way now, Stelzer and Pröll 2008) and 'alone-embedded' use the "
        "embedded autopilot; 'companion-ardurover', 'alone' (a waypoint per "
        "goal) and 'dijkstra' (its own path planning) the real ArduRover; 'shifts' and 'no-shifts' are the companion "
        "with and without tacks on the wind's shifts, whatever the mission says. "
        "Voyages are appended to FILE, and the table is of everything in it.",
        epilog="Example: sitl baselines --who alone dijkstra --seeds 5 --out figures.jsonl",
    )
    parser.add_argument(
        "--who", nargs="+", choices=SAILORS, default=list(USUAL), help="sailors (default: all but the last two)"
    )
    add_voyages(parser, usual="the six")
    add_winds(parser)
    add_options(parser, workers=1, out=Path("baselines.jsonl"))
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    from lab.campaigns.baselines import SCENARIOS, baselines, jobs_of
    from sitl.run.compiled import compile_ahead
    from sitl.scenario import load_scenario

    for path in args.scenarios or ():
        load_scenario(path)
    compile_ahead()
    options = options_of(args)
    jobs = jobs_of(args.who, args.scenarios or SCENARIOS, args.seeds, args.speedup, args.winds)
    return baselines(jobs, results=options.file, against=args.against).run(options)
