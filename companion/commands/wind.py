"""``companion wind``: forecast recorded wind and say how good the forecasts were."""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from companion.commands.output import write_files
from companion.errors import InputError
from companion.program.arguments import add_command, out_file, picture
from companion.words import counted

if TYPE_CHECKING:
    from companion.wind.study import Ar1Fit, Characterisation, HorizonScore, Record, Score


_EPILOG = """\
examples:
  companion wind afternoon.csv
  companion wind afternoon.csv --estimator all --plot afternoon.png
  companion wind 2026-07-14.tlog                  WIND as ArduRover sent it; or an ArduPilot .bin
  companion wind records/ --estimator all         every CSV in the folder, and the averages
  companion wind afternoon.csv --cost             microseconds per update and forecast
  companion wind records/ --filter filter.png     Wolsieffer's filter by its noise R and window N

A CSV record has a header and the columns t_s,wind_from_deg,wind_speed_ms (where the true wind comes from, degrees
clockwise from true north); turning (1 in manoeuvres), heading_deg and awa_deg are used when they are there. Every
reading is fed; a forecast is made every 30 s after ten minutes and scored against the reading at t + h unless the
boat was turning or the wind was below 1 m/s. CRPS is the circular continuous ranked probability score: like a mean
error, but of the whole forecast; smaller is better.
"""

_LONG_ROWS = 5000  # from here on a progress bar is worth its line
_REFERENCES = ("kalman", "mean90")  # drawn beside whatever was asked for


def add_parser(subparsers: argparse._SubParsersAction[argparse.ArgumentParser], summary: str) -> None:
    """Add the command's options."""
    parser = add_command(subparsers, "wind", summary, _EPILOG)
    parser.add_argument(
        "record", metavar="RECORD", nargs="+", type=Path, help="CSV, tlog, ArduPilot .bin, or a folder of CSV"
    )
    parser.add_argument(
        "--estimator",
        default="default",
        metavar="NAME",
        help="the estimator, or all of them; an unknown name lists what there is",
    )
    instead = parser.add_mutually_exclusive_group()
    instead.add_argument(
        "--plot", type=picture, metavar="P.png", help="draw the (first) record, its forecasts and their scores"
    )
    instead.add_argument("--cost", action="store_true", help="time update and forecast instead of scoring")
    instead.add_argument(
        "--filter",
        type=picture,
        metavar="P.png",
        help="score and draw Wolsieffer's filter for a grid of R and N instead (half a minute for an hour at 1 Hz)",
    )
    parser.add_argument("--json", type=out_file, metavar="FILE", help="write the figures")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Score, print, write and draw; return the exit code."""
    from companion.wind import NAMES, make
    from companion.wind.study import fit_ar1

    names = list(NAMES) if args.estimator == "all" else [args.estimator]
    if args.filter is not None and names != ["default"]:
        raise InputError("--estimator", args.estimator, "--filter scores Wolsieffer's alone", "leave one of them out")
    for name in names:
        make(name)  # an unknown name is refused before anything is read
    records = [read_record(path) for path in _files(args.record)]
    if args.cost:
        _print_cost(records[0], names)
        return 0
    if args.filter is not None:
        from companion.wind.study import runs

        with _progress(runs() * sum(len(r) for r in records)) as advance:
            grid = characterised(records, advance)
        print_grid(grid)
        if args.json is not None:
            _write_json(grid_document(grid), args.json)
        draw(grid, args.filter)
        return 0
    wanted = names + [n for n in _REFERENCES if args.plot is not None and n not in names]
    scores: list[list[Score]] = []
    fits: list[Ar1Fit] = []
    total = sum(len(r) for r in records) * len(wanted)
    with _progress(total) as advance:
        for i, record in enumerate(records):
            drawn = wanted if i == 0 else names
            scores.append([_score(record, name, advance) for name in drawn])
            fits.append(fit_ar1(record))
    for record, found, ar1 in zip(records, scores, fits, strict=True):
        _print_record(record, found[: len(names)], ar1)
    if len(records) > 1:
        from companion.wind.study import average

        print(f"mean of {counted(len(records), 'record')}")
        _print_table([(name, list(average([s[i] for s in scores]))) for i, name in enumerate(names)])
    if args.json is not None:
        document = {
            "records": [_document(r, s[: len(names)], f) for r, s, f in zip(records, scores, fits, strict=True)]
        }
        _write_json(document, args.json)
    if args.plot is not None:
        from companion.plots.wind import save_wind

        save_wind(records[0], scores[0], args.plot)
        print(f"drawn in {args.plot}")
    return 0


def _write_json(document: dict[str, Any], path: Path) -> None:
    write_files({str(path): json.dumps(document, indent=1).encode() + b"\n"}, force=True)


def _score(record: Record, name: str, advance: Any) -> Score:
    from companion.wind import make
    from companion.wind.study import score

    done = 0

    def progress(row: int) -> None:
        nonlocal done
        advance(row - done)
        done = row

    found = score(record, make(name), progress=progress)
    advance(len(record) - done)
    return found


@contextmanager
def _progress(total: int) -> Iterator[Any]:
    """Yield a function that advances a bar on stderr, when there is a person to see it and enough to wait for."""
    from rich.console import Console
    from rich.progress import Progress

    console = Console(stderr=True)
    with Progress(console=console, transient=True, disable=total < _LONG_ROWS or not console.is_terminal) as bar:
        task = bar.add_task("forecasting", total=total)
        yield lambda rows: bar.advance(task, rows)


# ----------------------------------------------------------------------------------------------- reading
def _files(paths: Sequence[Path]) -> list[Path]:
    found: list[Path] = []
    for path in paths:
        if path.is_dir():
            inside = sorted(path.glob("*.csv"))
            if not inside:
                raise InputError(str(path), "", "no CSV records in the folder", "name a record or another folder")
            found.extend(inside)
        else:
            found.append(path)
    return found


def read_record(path: Path) -> Record:
    """Return the wind in a CSV file, a tlog or an ArduPilot .bin.

    Raises InputError when the file cannot be read or holds no wind.
    """
    from companion.wind.study import parse_csv

    if not path.is_file():
        raise InputError(str(path), "", "no such file", "name a CSV, tlog or .bin")
    if path.suffix.lower() in {".tlog", ".bin"}:
        from companion.boat_logs import read_wind

        return read_wind(path)
    if not path.stat().st_size:
        raise InputError(str(path), "", "is empty", "name a CSV, tlog or .bin")
    try:
        with path.open(newline="", encoding="utf-8") as lines:
            return parse_csv(lines, path.name)
    except UnicodeDecodeError as error:
        raise InputError(str(path), "", f"is not text ({error.reason})", "name a CSV, tlog or .bin") from error


# ---------------------------------------------------------------------------------------------- printing
def _print_record(record: Record, found: Sequence[Score], ar1: Ar1Fit) -> None:
    minutes = record.duration_s / 60.0
    speed = record.tws_mps
    print(
        f"{record.name}: {counted(len(record), 'reading')}, {minutes:.0f} min, wind {np.mean(speed):.1f} m/s "
        f"({np.percentile(speed, 5):.1f}..{np.percentile(speed, 95):.1f}) from "
        f"{math.degrees(ar1.mean_twd_from_rad) % 360.0:.0f} deg"
    )
    print(
        f"AR(1) by maximum likelihood (step {ar1.step_s:.2g} s): rho {ar1.rho_hz:.4f} ± {ar1.rho_error_hz:.4f} Hz, "
        f"noise {ar1.noise_radps:.4f} ± {ar1.noise_error_radps:.4f} rad/s; "
        f"so sd {math.degrees(ar1.sigma_rad):.1f} deg, correlation time {ar1.correlation_time_s:.0f} s"
    )
    if not any(s.horizons for s in found):
        print("too short to score: a horizon needs 20 forecasts, the first after ten minutes")
        return
    _print_table([(s.estimator, list(s.horizons)) for s in found])


def _print_table(rows: Sequence[tuple[str, Sequence[HorizonScore]]]) -> None:
    head = "  ".join(f"{text:>7}" for text in ("h s", "n", "CRPS", "MAE", "sigma", "width95"))
    tail = "  ".join(f"{text:>5}" for text in ("50 %", "80 %", "95 %"))
    print(f"{'estimator':10}{head}  {tail}  speed CRPS   (deg, % inside, m/s)")
    for name, horizons in rows:
        for s in horizons:
            degrees = [math.degrees(v) for v in (s.crps_rad, s.mae_rad, s.sigma_rad, s.width95_rad)]
            print(
                f"{name:10}{s.horizon_s:7.0f}  {s.count:7d}  "
                + "  ".join(f"{v:7.2f}" for v in degrees)
                + "  "
                + "  ".join(f"{100 * c:5.1f}" for c in s.coverage)
                + f"  {s.speed_crps_mps:10.3f}"
            )
    sys.stdout.flush()


def _document(record: Record, found: Sequence[Score], ar1: Ar1Fit) -> dict[str, Any]:
    from companion.wind.study import SCORED_LEVELS

    return {
        "record": record.name,
        "readings": len(record),
        "duration_s": record.duration_s,
        "ar1": {
            "step_s": ar1.step_s,
            "rho_hz": ar1.rho_hz,
            "rho_error_hz": ar1.rho_error_hz,
            "noise_radps": ar1.noise_radps,
            "noise_error_radps": ar1.noise_error_radps,
        },
        "scores": [
            {
                "estimator": s.estimator,
                "horizon_s": h.horizon_s,
                "count": h.count,
                "crps_deg": math.degrees(h.crps_rad),
                "mae_deg": math.degrees(h.mae_rad),
                "width95_deg": math.degrees(h.width95_rad),
                "speed_crps_mps": h.speed_crps_mps,
                "coverage": {f"{p:g}": c for p, c in zip(SCORED_LEVELS, h.coverage, strict=True)},
            }
            for s in found
            for h in s.horizons
        ],
    }


def _print_cost(record: Record, names: Sequence[str]) -> None:
    """Time every estimator over the record; the Kalman filter of filterpy is timed in the same run, as the unit."""
    from companion.wind import make

    rows = min(len(record), 5000)
    cost: dict[str, tuple[float, float]] = {}
    for name in dict.fromkeys(["kalman", *names]):
        estimator = make(name)
        update_s = forecast_s = 0.0
        asked = 0
        for i in range(rows):
            t, d, v = float(record.t_s[i]), float(record.twd_from_rad[i]), float(record.tws_mps[i])
            begin = time.perf_counter()
            estimator.update(t, d, v)
            update_s += time.perf_counter() - begin
            if i % 10 == 9:
                begin = time.perf_counter()
                estimator.forecast(120.0)
                forecast_s += time.perf_counter() - begin
                asked += 1
        cost[name] = (1e6 * update_s / rows, 1e6 * forecast_s / max(1, asked))
    unit = cost["kalman"][0]
    print(f"{'estimator':10}{'update us':>11}{'of kalman':>11}{'forecast us':>13}   ({counted(rows, 'reading')})")
    for name, (update_us, forecast_us) in cost.items():
        print(f"{name:10}{update_us:11.1f}{update_us / unit:11.2f}{forecast_us:13.1f}")


def characterised(records: Sequence[Record], advance: Callable[[int], None]) -> Characterisation:
    """Return the grid over ``records``; raise InputError where none of them is long enough to score."""
    from companion.wind.study import characterise

    found = characterise(records, advance=advance)
    if not found.horizons_s:
        raise InputError(
            ", ".join(found.records),
            "",
            "too short to score",
            "a horizon needs 20 forecasts, one every 30 s after ten minutes",
        )
    return found


def print_grid(found: Characterisation) -> None:
    """Print a table for each horizon, R downwards and N across, then the best cell beside the forecaster."""
    windows = sorted({cell.window for cell in found.cells})
    cells = {(cell.r_deg, cell.window): cell for cell in found.cells}
    for horizon in found.default:
        h = horizon.horizon_s
        print(f"{h:.0f} s ahead: CRPS of direction [deg] / inside the 95 % band [%]")
        print(f"{'R [deg]':>8}" + "".join(f"{f'N = {n}':>14}" for n in windows))
        for r_deg in sorted({cell.r_deg for cell in found.cells}):
            print(f"{r_deg:8g}" + "".join(f"{_words(cells[r_deg, n].at(h)):>14}" for n in windows))
        best = found.best(h)
        print(
            f"best: R = {best.r_deg:g} deg, N = {best.window}: {_words(best.at(h))}; "
            f"the default forecaster {_words(horizon)}"
        )


def _words(score: HorizonScore | None) -> str:
    return "-" if score is None else f"{math.degrees(score.crps_rad):.2f} / {100.0 * score.coverage[-1]:.0f}"


def grid_document(found: Characterisation) -> dict[str, Any]:
    """Return the grid as a JSON document."""
    return {
        "records": list(found.records),
        "default": [_figures(s) for s in found.default],
        "filter": [
            {"r_deg": cell.r_deg, "window": cell.window, **_figures(s)} for cell in found.cells for s in cell.horizons
        ],
    }


def _figures(score: HorizonScore) -> dict[str, float]:
    return {
        "horizon_s": score.horizon_s,
        "count": score.count,
        "crps_deg": math.degrees(score.crps_rad),
        "mae_deg": math.degrees(score.mae_rad),
        "sigma_deg": math.degrees(score.sigma_rad),
        "coverage95": score.coverage[-1],
    }


def draw(found: Characterisation, picture: Path) -> None:
    """Draw the grid, and say where."""
    from companion.plots.wind import save_filter

    save_filter(found, picture)
    print(f"drawn in {picture}")
