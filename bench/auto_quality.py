"""How good `auto` is after a given computing time: `python bench/auto_quality.py --budget 1 10 --seeds 3`.

Every problem of bench/problems is planned on one core with warm kernels; budgets and times are processor seconds,
so that what else the machine does does not matter. Costs are compared with bench/best_known.json (the best path
that any run of any length has found; --update keeps a better one) and with the plan's own lower bound.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from pathlib import Path

import numpy as np

import companion.planner.effort as clock
from companion.planner import Problem, plan

HERE = Path(__file__).parent


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", help="problems (default: all)")
    parser.add_argument("--budget", type=float, nargs="+", default=[1.0], help="processor seconds")
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--update", action="store_true", help="write better paths to best_known.json")
    args = parser.parse_args()
    clock.effort_s = time.process_time
    best = json.loads((HERE / "best_known.json").read_text(encoding="utf-8"))
    names = args.names or sorted(p.stem for p in (HERE / "problems").glob("*.json"))
    plan(Problem.from_json(HERE / "problems" / f"{names[0]}.json"), expansions=100)
    for budget in args.budget:
        rows = []
        print(f"after {budget:g} s", f"{'over best %':>34}{'over bound %':>14}{'first ms':>10}{'legs':>6}")
        for name in names:
            for seed in range(args.seeds):
                problem = Problem.from_json(HERE / "problems" / f"{name}.json")
                answer = plan(problem, budget_s=budget, seed=seed)
                if not answer.has_path:
                    print(f"{name:24}{seed:3}  {answer.status.value}: {answer.reason[:70]}", flush=True)
                    if name in best:
                        rows.append((math.inf, math.inf, math.inf))
                    continue
                if name not in best or answer.cost_s < best[name]["time_s"] - 1e-4:
                    points = answer.waypoints_en.tolist()
                    best[name] = {"time_s": round(answer.cost_s, 4), "waypoints": points}
                over = 100.0 * (answer.cost_s / best[name]["time_s"] - 1.0)
                first = 1e3 * (answer.first_s or 0.0)
                rows.append((over, 100.0 * answer.gap, first))
                print(
                    f"{name:24}{seed:3}{over:17.3f}{100.0 * answer.gap:14.2f}{first:10.1f}{len(answer.legs):6}",
                    flush=True,
                )
        table = np.array(rows)
        if len(table):
            for label, column, share in (
                ("cost over best known, %", 0, 90),
                ("cost over lower bound, %", 1, 90),
                ("first path, ms", 2, 90),
            ):
                middle, high = np.percentile(table[:, column], [50, share])
                print(
                    f"  {label:26} median {middle:8.3f}   p90 {high:8.3f}   worst {table[:, column].max():8.3f}"
                    f"   ({len(table)} runs)"
                )
    if args.update:
        lines = [json.dumps(k) + ":" + json.dumps(best[k], separators=(",", ":")) for k in sorted(best)]
        (HERE / "best_known.json").write_text("{" + ",\n".join(lines) + "}\n", encoding="utf-8")


if __name__ == "__main__":
    main()
