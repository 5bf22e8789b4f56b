"""What tacking on shifts gains in recorded winds: ``python -m bench.recorded``, the paragraph of docs/lab/regret.md.

    python -m bench.recorded                        # the CSV records in $COMPANION_WIND_DATA: a few minutes
    python -m bench.recorded FOLDER --out recorded.jsonl

Windows of the records are the simulator's wind, turned so that the mean of their first ten minutes is dead ahead on the
beat of 500 m (``sitl/scenarios/figures/beat-500.toml``): the companion by the shifts, ArduRover alone in its corridor,
one voyage each on the embedded autopilot. Windows begin ten minutes apart or more and are without gaps; there are eight
of a record at most. The interval is of resampling the records, whose windows are no strangers to each other.
"""

from __future__ import annotations

import argparse
import os
import statistics
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from companion.geo.angles import mean_direction_rad
from companion.wind.study.records import parse_csv
from lab.campaigns.baselines import NAMES, baselines, jobs_of
from sitl.options import CampaignOptions
from sitl.run.compiled import compile_ahead

BEAT = Path(__file__).parents[1] / "sitl" / "scenarios" / "figures" / "beat-500.toml"
WHO, AGAINST = "shifts", "alone-embedded"
APART_S, LASTS_S, GAP_S, MOST = 600.0, 1200.0, 20.0, 8
LEAST_S = 700.0  # of a window at a record's end: longer than most voyages
MEAN_MPS, CALMEST_MPS = 2.5, 0.8
RESAMPLED = 10_000


def windows(record):
    """Yield the windows of a record: their times from 0 on, the mean of the first ten minutes north."""
    found, begins_s = 0, float(record.t_s[0])
    while found < MOST and begins_s + LEAST_S <= record.t_s[-1]:
        inside = (record.t_s >= begins_s) & (record.t_s < begins_s + LASTS_S)
        part = replace(
            record,
            t_s=record.t_s[inside] - begins_s,
            twd_from_rad=record.twd_from_rad[inside],
            tws_mps=record.tws_mps[inside],
            turning=record.turning[inside],
            heading_rad=None,
            awa_rad=None,
        )
        begins_s += APART_S
        if len(part) < 2 or part.t_s[-1] < LEAST_S - GAP_S or np.diff(part.t_s).max() > GAP_S:
            continue
        if part.tws_mps.mean() >= MEAN_MPS and part.tws_mps.min() >= CALMEST_MPS:
            found += 1
            yield part.rotated(-mean_direction_rad(part.twd_from_rad[part.t_s < APART_S]))


def scenario(part, number, folder):
    """Write a window and the scenario of sailing in it; return the scenario's file."""
    name = f"{Path(part.name).stem}, window {number}"
    wind = folder / f"{name}.csv"
    with wind.open("w", encoding="utf-8") as stream:
        stream.write("t_s,wind_from_deg,wind_speed_ms\n")
        for t_s, twd_rad, tws_mps in zip(part.t_s, part.twd_from_rad, part.tws_mps, strict=True):
            stream.write(f"{t_s:.2f},{np.degrees(twd_rad) % 360.0:.3f},{tws_mps:.3f}\n")
    head, _, rest = BEAT.read_text(encoding="utf-8").partition("[wind]")
    _, _, tail = rest.partition("\n\n")
    mission = BEAT.parents[2] / "missions" / "beat-500.toml"
    text = head.replace('"beat-500"', f'"{name}"').replace('"../../missions/beat-500.toml"', f'"{mission}"')
    path = folder / f"{name}.toml"
    path.write_text(f'{text}[wind]\nmodel = "recorded"\nfile = "{wind.name}"\n\n{tail}', encoding="utf-8")
    return path


def main(argv=None):
    parser = argparse.ArgumentParser(
        prog="python -m bench.recorded", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "folder",
        type=Path,
        nargs="?",
        default=os.environ.get("COMPANION_WIND_DATA"),
        help="of CSV records (default: $COMPANION_WIND_DATA)",
    )
    parser.add_argument("--workers", type=int, metavar="W", help="voyages at a time (default: one per core)")
    parser.add_argument("--out", type=Path, metavar="FILE", help="keep the voyages; those in it are not sailed again")
    args = parser.parse_args(argv)
    files = sorted(args.folder.glob("*.csv")) if args.folder is not None else []
    if not files:
        parser.error("no CSV records: name their folder, or set COMPANION_WIND_DATA")
    compile_ahead()
    record_of = {}
    with tempfile.TemporaryDirectory() as temporary:
        for path in files:
            with path.open(encoding="utf-8") as lines:
                record = parse_csv(lines, path.name)
            for number, part in enumerate(windows(record)):
                record_of[scenario(part, number, Path(temporary))] = path.stem
        voyages = baselines(jobs_of([WHO, AGAINST], list(record_of), 1, 1.0, None), results=args.out)
        sailed = voyages.results(CampaignOptions(workers=args.workers, out=args.out))
    tell(sailed.records, {path.stem: stem for path, stem in record_of.items()})
    return sailed.exit_code(is_good=True)


def tell(records, record_of):
    """Print what was gained: over all windows, and by record."""
    times = {(r["who"], r["scenario"]): r["time_s"] for r in records if r["arrived"] and not r["contacts"]}
    shares = {
        name: times[NAMES[WHO], name] / times[NAMES[AGAINST], name]
        for name in record_of
        if {(NAMES[who], name) for who in (WHO, AGAINST)} <= times.keys()
    }
    logs = {
        stem: np.log([share for name, share in shares.items() if record_of[name] == stem])
        for stem in sorted({record_of[name] for name in shares})
    }
    print("| record | windows | mean % |\n|---|--:|--:|")
    for stem, of_it in logs.items():
        print(f"| {stem} | {len(of_it)} | {percent(of_it.mean()):+.1f} |")
    drawn = np.random.default_rng(0).integers(0, len(logs), (RESAMPLED, len(logs)))
    sums, counts = (np.array([f(x) for x in logs.values()])[drawn].sum(axis=1) for f in (np.sum, len))
    low, high = np.quantile(sums / counts, (0.025, 0.975))
    every = np.concatenate(list(logs.values()))
    print(
        f"{len(every)} of {len(record_of)} windows sailed clean by both, {sum(every < 0.0)} of them faster: "
        f"{percent(every.mean()):+.1f} % ({percent(low):+.1f} to {percent(high):+.1f}) on the mean, "
        f"median {percent(statistics.median(every)):+.1f}, worst window {percent(every.max()):+.1f}"
    )


def percent(log_share):
    return 100.0 * (np.exp(log_share) - 1.0)


if __name__ == "__main__":
    sys.exit(main())
