"""``sitl run``: one scenario, with a verdict."""

from __future__ import annotations

import argparse
import difflib
import math
import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from companion.program.arguments import chart_option, http_address, moment, number, out_folder, whole
from companion.program.commands import missing
from companion.words import file_name

if TYPE_CHECKING:
    from sitl.scenario import Scenario, ScenarioVerdict

OURS = {path.stem: path for path in (Path(__file__).resolve().parents[1] / "scenarios").rglob("*.toml")}


def scenario_file(text: str) -> Path:
    """Return the file, or the scenario of ours with that name."""
    path = Path(text)
    if path.is_file() or path.suffix or (path.exists() and text not in OURS):
        return path
    if text not in OURS:
        close = difflib.get_close_matches(text, OURS, n=1)
        raise argparse.ArgumentTypeError(
            f"there is neither a file nor a scenario {text}; {f'did you mean {close[0]}?' if close else 'see --help'}"
        )
    return OURS[text]


def add_parser(subparsers: Any, summary: str) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "run",
        help=summary,
        description="Run a scenario: autopilot, weather, companion, and a verdict on what the boat really did. The "
        "embedded autopilot runs under the virtual clock in this process; with --live it is a process of its own "
        "over UDP, as is the companion; with --autopilot ardurover it is the real program.",
        epilog="Exit codes: 0 passed, 1 a check failed, 2 bad usage or input, 130 ended by Ctrl-C: no verdict, "
        "and what was recorded is kept. Examples: sitl run demo --seed 3, sitl run my-mission.toml --live",
    )
    parser.add_argument(
        "scenario",
        type=scenario_file,
        metavar="SCENARIO",
        help=f"a scenario or a mission file, or one of ours: {', '.join(sorted(OURS))}",
    )
    add_options(parser)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add all but the scenario."""
    parser.add_argument("--autopilot", choices=("embedded", "ardurover"), default="embedded")
    parser.add_argument(
        "--ardurover",
        type=Path,
        metavar="PATH",
        help="the ArduRover program (default: $ARDUROVER, the PATH, what `sitl fetch` brought)",
    )
    parser.add_argument("--live", action="store_true", help="separate processes over UDP, in (sped-up) real time")
    parser.add_argument(
        "--speedup",
        type=number(above=0.0, at_most=1000.0),
        metavar="N",
        help="with --live or ardurover (default: the scenario's)",
    )
    parser.add_argument(
        "--cpu",
        type=number(above=0.0, at_most=1.0),
        metavar="SHARE",
        help="companion and planner get this share of one core, in real time: a slow computer",
    )
    parser.add_argument(
        "--http",
        type=http_address,
        metavar="[HOST:]PORT",
        help="with --live or ardurover: the companion serves its live page here",
    )
    parser.add_argument("--http-token", type=Path, metavar="FILE", help="orders from the page, as of companion run")
    chart_option(parser)
    parser.add_argument("--seed", type=whole(), default=0, metavar="N", help="random seed of the weather (default: 0)")
    parser.add_argument(
        "--at",
        type=moment,
        metavar="TIME",
        help="when it begins, as 2026-11-24T08:00Z: what is dark, "
        "and the tide (default: a scenario's own time, of a mission file now)",
    )
    parser.add_argument("--out", type=out_folder, metavar="DIR", help="the voyage folder")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    import msgspec

    from companion.errors import InputError
    from companion.geofence import load_mission
    from companion.program import INTERRUPTED
    from companion.telemetry.folder import DECISIONS
    from sitl.run.compiled import compile_ahead
    from sitl.run.embedded import mission_of
    from sitl.scenario import beginning, load_scenario, own_polar, scenario_wind

    if args.speedup is not None and not is_live(args):
        raise InputError(
            "--speedup",
            f"{args.speedup:g}",
            "is for a voyage in real time; this one is as fast as the computer",
            "leave it out, or add --live",
        )
    scenario = load_scenario(args.scenario)
    scenario = msgspec.structs.replace(scenario, begins=beginning(scenario, args.scenario, args.at))
    folder = args.out or Path("voyages") / f"{datetime.now(UTC):%Y%m%dT%H%M%SZ}-{file_name(scenario.name)}"
    if (folder / DECISIONS).exists():
        raise InputError(
            "--out",
            str(folder),
            "holds a voyage already, which this one would resume",
            "name another folder, or remove that one",
        )
    # What cannot be sailed is told before anything is compiled for a minute.
    mission = mission_of(scenario, args.scenario)
    scenario_wind(scenario, args.scenario, args.seed)
    if own_polar(mission) is not None and args.autopilot == "ardurover":
        sys.stderr.write("sitl run: note: ArduRover's simulator has a hull of its own, not the one of [boat] polar\n")
    page = page_words(args)
    print(
        f"{scenario.name} begins {scenario.begins:%Y-%m-%d %H:%M} UTC{'' if args.at else '; --at names another time'}"
        + (
            f"; the wind is {scenario.wind.tws_mps:g} m/s from {scenario.wind.from_deg:03.0f}° in the mean, as [wind] "
            "preview_from_deg and preview_speed_mps say"
            if scenario.mission_path(args.scenario) == args.scenario.resolve()
            else ""
        ),
        flush=True,
    )
    own = load_mission(scenario.mission_path(args.scenario)).options.operator
    if not (own.arm and own.set_auto) and scenario.set_auto:
        print(
            "the simulated boat may be armed and set to AUTO; on the water [operator] of the mission forbids it",
            flush=True,
        )
    if args.http is not None:
        host, port = args.http
        print(f"the page: http://{f'[{host}]' if ':' in host else host}:{port}/ once the companion is up", flush=True)
    compile_ahead(mission.skipper.planner)
    try:
        verdict = _sailed(args, scenario, folder, page)
    except KeyboardInterrupt:
        kept = f"what was recorded is in {folder}" if (folder / DECISIONS).exists() else "nothing was recorded yet"
        sys.stderr.write(f"sitl run: interrupted, so there is no verdict; {kept}\n")
        return INTERRUPTED
    print_verdict(verdict)
    print(folder)
    return 0 if verdict.passed else 1


def _sailed(args: argparse.Namespace, scenario: Scenario, folder: Path, page: list[str]) -> ScenarioVerdict:
    """Sail it, in real time or under the virtual clock, and draw that."""
    from companion.clock import run_virtual
    from companion.telemetry.console import ProgressLine
    from sitl.run.embedded import run_embedded

    if is_live(args):
        from sitl.run.live import run_live

        return run_live(
            scenario,
            args.scenario,
            args.seed,
            folder,
            autopilot=args.autopilot,
            program=args.ardurover,
            speedup=args.speedup or (1.0 if args.cpu is not None else None),
            page=page,
            cpu=args.cpu,
        )
    with ProgressLine(sys.stdout) as progress:
        verdict = run_virtual(run_embedded(scenario, args.scenario, args.seed, folder, on_status=progress.show))
    draw(folder)
    return verdict


def is_live(args: argparse.Namespace) -> bool:
    """Return whether the scenario runs in real time, in processes of its own."""
    return bool(args.live or args.autopilot == "ardurover" or args.cpu is not None)


def page_words(args: argparse.Namespace) -> list[str]:
    """Return what the companion is told of its live page. Raises InputError: it cannot be served."""
    from companion.errors import InputError

    if args.http is None:
        for name, value in (("--http-token", args.http_token), ("--chart", next(iter(args.chart), None))):
            if value is not None:
                raise InputError(name, str(value), "there is no page to use it on", "say --http PORT")
        return []
    if not is_live(args):
        raise InputError("--http", "", "no browser can be waited for under the virtual clock", "say --live, too")
    host, port = args.http
    return [
        "--http",
        f"{f'[{host}]' if ':' in host else host}:{port}",
        *([] if args.http_token is None else ["--http-token", str(args.http_token)]),
        *(word for path in args.chart for word in ("--chart", str(path))),
    ]


def draw(folder: Path) -> None:
    """Draw the voyage; a picture that fails must not hide the verdict."""
    try:
        from companion.plots.voyage import plot_voyage
        from companion.telemetry.folder import PICTURE, read_voyage

        plot_voyage(read_voyage(folder), folder / PICTURE)
    except Exception as error:
        from companion.errors import CompanionError

        refusal: Exception | None = error if isinstance(error, CompanionError) else None
        if isinstance(error, ModuleNotFoundError):
            refusal = missing(error)
        sys.stderr.write(f"sitl run: the picture could not be drawn: {refusal or repr(error)}\n")


def words(figure: Any) -> str:
    """Return a figure of a verdict, or what was wanted of it, as a person reads it.

    >>> words([]), words(["TRAFFIC", "WIND"]), words(True), words({"ferry": 41.27}), words(float("inf"))
    ('none', 'TRAFFIC, WIND', 'yes', 'ferry 41.3', 'nothing near')
    >>> words([0.983]), words(0.0)  # a share, or less than a metre
    ('0.98', '0.0')
    """
    if figure is None:
        return "not measured"
    if isinstance(figure, bool):
        return "yes" if figure else "no"
    if isinstance(figure, float):
        return f"{figure:.{2 if 0.0 < abs(figure) < 1.0 else 1}f}" if math.isfinite(figure) else "nothing near"
    if isinstance(figure, dict):
        figure = [f"{name} {words(value)}" for name, value in figure.items()]
    if isinstance(figure, list):
        return ", ".join(words(part) for part in figure) or "none"
    return str(figure)


def print_verdict(verdict: Any) -> None:
    """Print the checks, each with its figure."""
    from sitl.scenario import verdict_line

    for check in verdict.checks:
        print(
            f"{'pass' if check.passed else 'FAIL'}  {check.name}: {words(check.figure)} "
            f"(wanted: {words(check.required)})"
        )
    print(verdict_line(verdict.to_dict()))
