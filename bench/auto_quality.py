"""How good `auto` is after a given computing time: `python bench/auto_quality.py --budget 1 10 --seeds 3`.

Every problem of sailbench/problems is planned on one core with warm kernels; budgets and times are processor seconds,
so that what else the machine does does not matter. Costs are compared with sailbench/answers.json (the best path
that any run of any length has found; --update keeps a better one, a better bound, and why there is none) and with the
plan's own lower bound.
"""

from __future__ import annotations

import argparse
import json
import math
import time

import numpy as np

import companion.planner.effort as clock
from companion.planner import PlanStatus, Problem, plan
from sailbench.problem_set import ANSWERS, FOLDER

UNITS = {
    "best_s": "seconds, by the exact scorer: the best path that any run has found",
    "bound_s": "seconds: no path is faster",
    "waypoints": "metres east and north, of that path",
    "proof": "why no path is feasible",
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", help="problems (default: all)")
    parser.add_argument("--budget", type=float, nargs="+", default=[1.0], help="processor seconds")
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--update", action="store_true", help="write what is better to answers.json")
    args = parser.parse_args()
    clock.effort_s = time.process_time
    best = json.loads(ANSWERS.read_text(encoding="utf-8"))["answers"]
    names = args.names or sorted(p.stem for p in FOLDER.glob("*.json"))
    plan(Problem.from_json(FOLDER / f"{names[0]}.json"), expansions=100)
    for budget in args.budget:
        rows = []
        print(f"after {budget:g} s", f"{'over best %':>34}{'over bound %':>14}{'first ms':>10}{'legs':>6}")
        for name in names:
            for seed in range(args.seeds):
                problem = Problem.from_json(FOLDER / f"{name}.json")
                answer = plan(problem, budget_s=budget, seed=seed)
                if not answer.has_path:
                    print(f"{name:24}{seed:3}  {answer.status.value}: {answer.reason[:70]}", flush=True)
                    if "best_s" in best.get(name, {}):
                        rows.append((math.inf, math.inf, math.inf))
                    elif answer.status in {PlanStatus.INFEASIBLE, PlanStatus.INVALID}:
                        best[name] = {"proof": answer.reason}
                    continue
                known = best.setdefault(name, {"best_s": math.inf})
                if answer.cost_s < known["best_s"] - 1e-4:
                    known |= {"best_s": round(answer.cost_s, 4), "waypoints": answer.waypoints_en.tolist()}
                known["bound_s"] = max(known.get("bound_s", 0.0), math.floor(1e4 * answer.lower_bound_s) / 1e4)
                over = 100.0 * (answer.cost_s / known["best_s"] - 1.0)
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
        lines = ",\n".join(f"{json.dumps(k)}: {json.dumps(best[k], separators=(',', ':'))}" for k in sorted(best))
        ANSWERS.write_text(f'{{"units": {json.dumps(UNITS)},\n"answers": {{\n{lines}\n}}}}\n', encoding="utf-8")


if __name__ == "__main__":
    main()
