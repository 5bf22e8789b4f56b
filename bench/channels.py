"""Wolsieffer's figure 7, sailed: by which channel, in a steady wind, under noise, and down wind.

python -m bench.channels --seeds 10 --out FOLDER [--autopilot ardurover]
"""

from __future__ import annotations

import argparse
import csv
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

from companion.geofence import load_mission
from companion.messages import GeoPoint

WATER = Path(__file__).parent / "figure-7"
CHANNEL = {"steady": "right", "noisy": "left", "down": "right"}  # as his picture has it, north up
MIDDLE_M = 200.0  # north of the origin: here there is nothing between the channels but the island


def channel(voyage: Path) -> str:
    """Return by which channel a recorded voyage passed the island: ``left``, ``right``, or what else it did."""
    frame = load_mission(WATER / "mission-up.toml").frame()
    with (voyage / "track.csv").open() as file:
        track = [
            frame.en_from_geo(GeoPoint(lat_deg=float(row["lat_deg"]), lon_deg=float(row["lon_deg"])))
            for row in csv.DictReader(file)
            if row["lat_deg"]
        ]
    sides = {
        "right" if a[0] + b[0] > 0.0 else "left"
        for a, b in pairwise(track)
        if (a[1] - MIDDLE_M) * (b[1] - MIDDLE_M) <= 0.0
    }
    return " and ".join(sorted(sides)) or "neither"


def main() -> int:
    """Sail each scenario with each seed, print its verdict and channel; 1 where one is not as it should be."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--autopilot", choices=("embedded", "ardurover"), default="embedded")
    args, wrong = parser.parse_args(), 0
    for name, wanted in CHANNEL.items():
        for seed in range(args.seeds):
            folder = args.out / f"{name}-{seed}"
            run = [
                sys.executable,
                "-m",
                "sitl.cli",
                "run",
                str(WATER / f"{name}.toml"),
                "--seed",
                str(seed),
                "--autopilot",
                args.autopilot,
                "--out",
                str(folder),
            ]
            done = subprocess.run(run, capture_output=True, text=True, check=False)
            taken = channel(folder)
            wrong += done.returncode != 0 or taken != wanted
            told = [line for line in done.stdout.splitlines() if line.startswith(("PASSED", "FAILED", "FAIL "))]
            print(f"{taken:<7} (wanted: {wanted})  {'; '.join(told)}", flush=True)
    print(f"{wrong} of {args.seeds * len(CHANNEL)} are not as they should be")
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
