"""What a passage costs to plan: ``python -m bench.passages``.

    python -m bench.passages                 250 NM, and 3,000 NM by an ensemble of 31 members
    python -m bench.passages --members 5     a shorter look

In files of made-up weather (``lab.climate``). Told is what planning takes of a processor, kernels warm and files read,
and what the whole command ``companion passage plan`` takes, run as a user runs it: its time and the most memory.
"""

from __future__ import annotations

import argparse
import datetime as dt
import os
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from companion.commands.passage import CANDIDATES, NODES, _read
from companion.passage import plan, sweep
from companion.words import counted
from lab.climate import Box, forecast
from lab.grib import grib_of

CRUISER = Path(__file__).parents[1] / "sailbench" / "passages" / "cruiser.pol"
BEGINS = dt.datetime(2026, 1, 15, tzinfo=dt.UTC)
SPEED_ERROR = 0.05
_START_S = 6.0  # of a processor: the program and its kernels are loaded
_BOAT = "polar = 'cruiser.pol'\nno_go_half_deg = 40\ntack_loss_s = 20\nspeed_error_percent = 5\n"


@dataclass(frozen=True, slots=True, kw_only=True)
class Asked:
    """A passage to plan, and how long it may take [s] and how much memory [MB]."""

    name: str
    start: tuple[float, float]
    goal: tuple[float, float]
    days: float
    box: Box
    most_s: float
    most_mb: float


SHORT = Asked(
    name="250 NM of the North Sea",
    start=(55.2, 0.5),
    goal=(59.0, 3.5),
    days=7.0,
    box=(-8.0, 50.0, 12.0, 64.0),
    most_s=2.0,
    most_mb=500.0,
)
LONG = Asked(
    name="3,160 NM of the South Atlantic",
    start=(-33.6, 17.5),
    goal=(-23.5, -42.0),
    days=28.0,
    box=(-55.0, -50.0, 30.0, -5.0),
    most_s=60.0,
    most_mb=500.0,
)


def main() -> int:
    """Plan both passages and print what each cost."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--members", type=int, default=31, help="of the long passage's forecast (default: 31)")
    members = parser.parse_args().members
    failed = False
    for asked, count in ((SHORT, 1), (LONG, members)):
        with tempfile.TemporaryDirectory() as folder:
            name = _write(asked, count, Path(folder))
            plan_s = min(_planned_s(name) for _ in range(3 if count == 1 else 1))
            wall_s, cpu_s, mb, said = _run(name)
        holds = plan_s < asked.most_s and cpu_s < asked.most_s + _START_S and mb < asked.most_mb
        failed |= not holds
        print(f"{asked.name}, {counted(count, 'member')}: {plan_s:.1f} s of a processor ({asked.most_s:g} asked)")
        print(f"  the command: {cpu_s:.1f} s, {wall_s:.1f} s by the clock, {mb:.0f} MB ({asked.most_mb:g} asked)")
        print(f"  {said}")
    return int(failed)


def _planned_s(name: Path) -> float:
    """Return what planning a file takes of a processor, the file and its weather read [s]."""
    asked, passage = _read(name)
    depart_s, begun_s = asked.depart.at.timestamp(), time.process_time()
    if len(passage.weather.members) == 1:
        plan(passage, depart_s, nodes=NODES)
    else:
        sweep(passage, [depart_s], SPEED_ERROR, nodes=NODES, candidates=CANDIDATES)
    return time.process_time() - begun_s


def _write(asked: Asked, members: int, folder: Path) -> Path:
    """Write a passage with its weather and boat; return its file."""
    times = BEGINS.timestamp() + np.arange(0.0, asked.days * 86_400.0 + 1.0, 6 * 3600.0)
    weather = forecast(1, times, asked.box, members=members)
    (folder / "weather.grb2").write_bytes(grib_of(weather.wind[0]))
    shutil.copy(CRUISER, folder)
    name = folder / "passage.toml"
    name.write_text(
        f"[start]\nlat = {asked.start[0]}\nlon = {asked.start[1]}\n"
        f"[goal]\nlat = {asked.goal[0]}\nlon = {asked.goal[1]}\nradius_m = 2000.0\n"
        f"[depart]\nat = {BEGINS:%Y-%m-%dT%H:%M:%SZ}\n[weather]\nfiles = ['weather.grb2']\n[boat]\n{_BOAT}"
    )
    return name


def _run(name: Path) -> tuple[float, float, float, str]:
    """Plan a file; return seconds by the clock and of a processor, megabytes, and its first line."""
    begun_s = time.monotonic()
    process = subprocess.Popen(
        [sys.executable, "-m", "companion", "passage", "plan", str(name)], stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    said = process.stdout.read()
    _, status, used = os.wait4(process.pid, 0)
    if status:
        raise SystemExit(f"companion passage plan {name} failed: {said}")
    return time.monotonic() - begun_s, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024.0, said.splitlines()[0]


if __name__ == "__main__":
    sys.exit(main())
