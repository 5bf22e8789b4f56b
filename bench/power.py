"""The demo on a small computer's budget: ``python -m bench.power``, in real time, about six minutes.

The companion and its planner live in control groups with 25 % of one core and 200 MB, the simulated boat does not.
Needs the right to make control groups. Prints whether it arrived, and what it took.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
import time
from pathlib import Path

from bench.voyage import afloat

ROOT = Path("/sys/fs/cgroup")
PERIOD_US = 100_000


class Groups:
    """Control groups, of the kernel's second or first version: what processes in them may take, and took."""

    def __init__(self, share: float, megabytes: int) -> None:
        name, memory = f"companion-{os.getpid()}", str(megabytes * 10**6)
        self.is_second = (ROOT / "cgroup.controllers").exists()
        tops = (ROOT,) if self.is_second else (ROOT / "cpu", ROOT / "cpuacct", ROOT / "memory")
        self.folders = [top / name for top in dict.fromkeys(path.resolve() for path in tops)]
        for folder in self.folders:
            folder.mkdir()
        quota = str(int(share * PERIOD_US))
        if self.is_second:
            self.write("cpu.max", f"{quota} {PERIOD_US}")
            self.write("memory.max", memory)
        else:
            self.write("cpu.cfs_quota_us", quota)
            self.write("memory.limit_in_bytes", memory)

    def write(self, name: str, text: str) -> None:
        next(f / name for f in self.folders if (f / name).exists()).write_text(text)

    def read(self, name: str) -> str:
        return next((f / name).read_text() for f in self.folders if (f / name).exists())

    def enter(self) -> None:
        for folder in self.folders:
            (folder / "cgroup.procs").write_text("0")

    def took(self) -> str:
        stat = dict(line.split() for line in self.read("cpu.stat").splitlines())
        if self.is_second:
            used_s, held_s = int(stat["usage_usec"]) / 1e6, int(stat["throttled_usec"]) / 1e6
            peak = self.read("memory.peak")
        else:
            used_s, held_s = int(self.read("cpuacct.usage")) / 1e9, int(stat["throttled_time"]) / 1e9
            peak = self.read("memory.max_usage_in_bytes")
        return (
            f"processor {used_s:.1f} s, held back {held_s:.1f} s; memory at most {int(peak) / 1e6:.0f} MB "
            "with what the kernel keeps of its files"
        )

    def remove(self) -> None:
        for folder in self.folders:
            for _ in range(50):
                try:
                    folder.rmdir()
                    break
                except OSError:
                    time.sleep(0.2)


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m bench.power", description=__doc__.splitlines()[0])
    parser.add_argument("--share", type=float, default=0.25, help="of one core (default: 0.25)")
    parser.add_argument("--megabytes", type=int, default=200)
    args = parser.parse_args()
    groups = Groups(args.share, args.megabytes)
    try:
        with tempfile.TemporaryDirectory() as scratch:
            folder = Path(scratch) / "voyage"
            options = "--exit-on-arrival", "--wait", "120"
            with afloat(folder, *options, preexec_fn=groups.enter) as (companion, started_s):
                companion.wait(1200)
            summary = json.loads((folder / "summary.json").read_text())
            plans = [json.loads(line) for line in (folder / "decisions.jsonl").read_text().splitlines()]
            took = sorted(p["plan"]["elapsed_s"] for p in plans if p["kind"] == "plan" and p.get("plan"))
        print(
            f"arrived {summary['arrived']} after {summary['time_s']:.0f} s, contacts {summary['contacts']}, "
            f"smallest clearance {summary['min_clearance_m']} m"
        )
        print(
            f"first step after {started_s:.1f} s; planner restarts {summary['planner_restarts']}; "
            f"plans {len(took)}, the longest {took[-1] if took else 0:.1f} s"
        )
        print(groups.took())
        return 0 if summary["arrived"] else 1
    finally:
        groups.remove()


if __name__ == "__main__":
    sys.exit(main())
