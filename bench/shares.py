"""What a slow computer makes of a water: ``python -m bench.shares WATER... [--shares 1 0.25 0.1 0.05]``

    python -m bench.shares figures/slalom narrow-channel --shares 1 0.25 --seeds 5
    python -m bench.shares walls-ends --shares 0.1 --kills 50

Each voyage is ``sitl run WATER --cpu SHARE``: companion and planner under a share of one core, in real time (a voyage
takes as long as it takes), the simulated boat outside of it. With ``--kills`` the planner's process is killed (SIGKILL)
at so many moments of the voyage. One line a voyage, as a row of docs/lab/figures.md: waters are files of sitl/scenarios
by their name. Exit code 1 when a voyage did not pass. The share is of a core of this machine: run it on a quiet one.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from sitl.run.live import family_of

SCENARIOS = Path("sitl/scenarios")
SHARES = (1.0, 0.25, 0.1, 0.05)
KILL_EVERY_S = (2.0, 8.0)     # drawn evenly
HEAD = ("| water | share | seed | passed | time s | clearance m | plans | latency s, 50 / 90 % / worst | "
        "least budget s | first plan s | kills |\n|---|--:|--:|---|--:|--:|--:|--:|--:|--:|--:|")


@dataclass(frozen=True, slots=True, kw_only=True)
class Plans:
    """What a voyage's records tell of its plans: how long each took [s], the budgets, and when the first was there."""

    took_s: tuple[float, ...]
    budgets_s: tuple[float, ...]
    first_s: float | None

    @property
    def row(self) -> str:
        """Their columns of the table."""
        if not self.took_s:
            return "0 | - | - | -"
        ordered = sorted(self.took_s)
        late = ordered[int(0.9 * (len(ordered) - 1))]
        first = "-" if self.first_s is None else f"{self.first_s:.1f}"
        return (f"{len(ordered)} | {statistics.median(ordered):.1f} / {late:.1f} / {ordered[-1]:.1f} | "
                f"{min(self.budgets_s):.2f} | {first}")


def plans_of(decisions: Path) -> Plans:
    """Read them; ``first_s`` is from the first request to the first path."""
    asked: dict[int, tuple[float, float]] = {}
    took, budgets = [], []
    began_s = first_s = None
    for line in decisions.read_text(encoding="utf-8").splitlines():
        entry = json.loads(line)
        if entry["kind"] == "start":
            asked.clear()    # another process: its numbers begin anew
        elif entry.get("action") == "RequestPlan":
            asked[entry["request_id"]] = entry["t_s"], entry["budget_s"]
            began_s = entry["t_s"] if began_s is None else began_s
        elif entry["kind"] == "plan" and entry["request_id"] in asked:
            then_s, budget_s = asked.pop(entry["request_id"])
            took.append(entry["t_s"] - then_s)
            budgets.append(budget_s)
            if first_s is None and began_s is not None and entry["status"] in {"found", "optimal"}:
                first_s = entry["t_s"] - began_s
    return Plans(took_s=tuple(took), budgets_s=tuple(budgets), first_s=first_s)


def planners(pid: int) -> Iterator[int]:
    """Yield the planner's processes below ``sitl run``: the leaves below the companion."""
    for member in family_of(pid):
        try:
            words = Path(f"/proc/{member}/cmdline").read_bytes().split(b"\0")
        except OSError:
            continue
        if b"companion.cli" in words and b"run" in words:
            children = [child for child in family_of(member) if child != member]
            yield from (child for child in children if len(family_of(child)) == 1)


def sail(water: Path, share: float, seed: int, kills: int, out: Path) -> tuple[bool, str]:
    """Sail one voyage; return whether it passed, and its row."""
    draw, done = random.Random(seed), 0
    with subprocess.Popen(
            [sys.executable, "-c", "import sys; from sitl.cli import main; sys.exit(main())", "run", str(water),
             "--cpu", f"{share:g}", "--seed", str(seed), "--out", str(out)], stdout=subprocess.DEVNULL) as process:
        next_s = time.monotonic() + draw.uniform(*KILL_EVERY_S)
        while process.poll() is None:
            time.sleep(0.2)
            if done < kills and time.monotonic() >= next_s:
                next_s = time.monotonic() + draw.uniform(*KILL_EVERY_S)
                for pid in list(planners(process.pid))[:1]:
                    os.kill(pid, signal.SIGKILL)
                    done += 1
    if not (out / "verdict.json").is_file():
        return False, f"| {water.stem} | {share:g} | {seed} | no verdict | - | - | 0 | - | - | - | {done} |"
    verdict = json.loads((out / "verdict.json").read_bytes())
    figures = verdict["figures"]
    clear = figures["min_clearance_m"]
    return verdict["passed"], (
        f"| {water.stem} | {share:g} | {seed} | {'yes' if verdict['passed'] else 'NO'} | {figures['time_s']:.0f} | "
        f"{'-' if clear is None else f'{clear:.1f}'} | {plans_of(out / 'decisions.jsonl').row} | {done} |")


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m bench.shares", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("waters", nargs="+", metavar="WATER", help="files of sitl/scenarios, without .toml")
    parser.add_argument("--shares", nargs="+", type=float, default=SHARES, metavar="SHARE")
    parser.add_argument("--seeds", type=int, default=1, metavar="N", help="0 to N - 1 of each (default: 1)")
    parser.add_argument("--kills", type=int, default=0, metavar="N", help="of the planner's process in each voyage")
    args = parser.parse_args()
    waters = [SCENARIOS / f"{name}.toml" for name in args.waters]
    for water in waters:
        if not water.is_file():
            parser.error(f"there is no {water}")
    print(HEAD, flush=True)
    are_well = True
    with tempfile.TemporaryDirectory() as folder:
        for n, (water, share, seed) in enumerate(
                (w, s, k) for w in waters for s in args.shares for k in range(args.seeds)):
            passed, row = sail(water, share, seed, args.kills, Path(folder) / str(n))
            are_well = are_well and passed
            print(row, flush=True)
    return 0 if are_well else 1


if __name__ == "__main__":
    sys.exit(main())
