"""Compare the planners on the problem set: ``python -m bench`` (make bench).

    python -m bench                                  0.1, 1 and 10 s, two seeds (one at 10 s); says first how long
    python -m bench --budgets 0.1 1 --seeds 1        a few minutes
    python -m bench --rows rows.json                 keeps each result there; a run broken off goes on from it
    python -m bench --planners auto rrtstar          without OMPL
    python -m bench --scaling                        time against obstacle vertices and distance only

For each planner and budget: of the problems that can be solved how many were, in every seed; how many of the others
were recognised as such; when the first path came; cost / bound (the best lower bound that any run proved) and
cost / best (the cheapest path that any run found): median, 90th percentile and worst over problems and seeds. The
table comes out ready for docs/reference/planner.md. AVALON's A* and OMPL's planners run at 1 s only, unless --all.
OMPL's (optional: requirements-bench.lock) run in a process of their own; see bench/ompl_planners.py.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import math
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import shapely

from bench.ompl_planners import PLANNERS as OMPL
from companion.planner import ALGORITHMS, Problem, plan
from companion.planner.problem import evaluate

HERE = Path(__file__).resolve().parent
OURS = tuple(ALGORITHMS)


def warm():
    """Compile or load every kernel before any clock starts."""
    for name in ("four-run", "open-beat", "channel-bend-kalman"):
        problem = Problem.from_json(HERE / "problems" / f"{name}.json")
        for algorithm in OURS:
            plan(problem, algorithm=algorithm, budget_s=2.0)


def run_one(path, problem, planner, budget_s, seed):
    began = time.perf_counter()
    if planner in OURS:
        answer = plan(problem, algorithm=planner, budget_s=budget_s, seed=seed)
        return {
            "status": answer.status.value,
            "cost_s": answer.cost_s if answer.has_path else None,
            "bound_s": answer.lower_bound_s if math.isfinite(answer.lower_bound_s) else None,
            "first_s": answer.first_s,
            "elapsed_s": time.perf_counter() - began,
        }
    command = [sys.executable, "-m", "bench.ompl_planners", str(path), planner[5:], str(budget_s), str(seed)]
    way = None
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=budget_s + 60.0, check=False, cwd=HERE.parent
        )
        lines = done.stdout.strip().splitlines()
        way = json.loads(lines[-1]) if done.returncode == 0 and lines else None
    except subprocess.TimeoutExpired:
        pass
    judged = evaluate(problem, way) if way else None
    good = judged is not None and judged.is_feasible
    return {
        "status": "found" if good else "timeout",
        "cost_s": judged.time_s if good else None,
        "bound_s": None,
        "first_s": None,
        "elapsed_s": time.perf_counter() - began,
    }


def schedule(args, planners):
    """Return the runs to make: (path, planner, budget [s], seed)."""
    paths = sorted(Path(p) for p in args.problems) or sorted((HERE / "problems").glob("*.json"))
    once = max([b for b in args.budgets if b <= 1.0], default=min(args.budgets))
    runs = []
    for path in paths:
        for planner in planners:
            budgets = args.budgets if args.all or planner in {"auto", "rrtstar"} else [once]
            for budget_s in budgets:
                seeds = args.seeds if budget_s < 5.0 and planner != "astar" else 1
                runs += [(path, planner, budget_s, seed) for seed in range(seeds)]
    return runs


def compare(args, planners):
    """Make the runs, with progress on the error output, and return their rows."""
    runs = schedule(args, planners)
    kept = Path(args.rows) if args.rows else None
    rows = json.loads(kept.read_text(encoding="utf-8"))["rows"] if kept is not None and kept.exists() else []
    known = {(r["problem"], r["planner"], r["budget_s"], r["seed"]) for r in rows}
    longest = _longest_s(runs)
    print(
        f"{len(runs)} runs, {len(known)} of them made already: at most {longest / 60.0:.0f} minutes and usually half "
        "of that (a run ends when its path is proved good enough)",
        file=sys.stderr,
        flush=True,
    )
    began, problem, last = time.monotonic(), None, None
    for i, (path, planner, budget_s, seed) in enumerate(runs):
        if path != last:
            problem, last = Problem.from_json(path), path
        if (problem.id, planner, budget_s, seed) in known:
            continue
        row = run_one(path, problem, planner, budget_s, seed)
        rows.append({"problem": problem.id, "planner": planner, "budget_s": budget_s, "seed": seed, **row})
        if i + 1 == len(runs) or runs[i + 1][0] != path or time.monotonic() - began > 60.0 * (1 + len(rows)):
            left = _longest_s(runs[i + 1 :])
            print(
                f"{i + 1:5}/{len(runs)}  {problem.id:24} {(time.monotonic() - began) / 60.0:5.1f} min, "
                f"at most {left / 60.0:.0f} more",
                file=sys.stderr,
                flush=True,
            )
            if kept is not None:
                kept.write_text(json.dumps({"rows": rows}) + "\n", encoding="utf-8")
    return rows


def _longest_s(runs):
    start_s = {True: 0.05, False: 1.5}  # OMPL's planners start a process each
    return sum(budget_s + start_s[planner in OURS] for _, planner, budget_s, _ in runs)


def summary(rows):
    """Return one line of figures for each planner and budget."""
    best, bound = {}, {}
    for row in rows:
        name = row["problem"]
        if row["cost_s"] is not None:
            best[name] = min(best.get(name, math.inf), row["cost_s"])
        if row["bound_s"] is not None and row["status"] in {"found", "optimal"}:
            bound[name] = max(bound.get(name, 0.0), row["bound_s"])
    names = sorted({row["problem"] for row in rows})
    hopeless = [n for n in names if n not in best]
    out = []
    for planner in dict.fromkeys(row["planner"] for row in rows):
        for budget_s in sorted({row["budget_s"] for row in rows}):
            mine = [r for r in rows if r["planner"] == planner and r["budget_s"] == budget_s]
            if not mine:
                continue
            solved = [n for n in best if all(r["cost_s"] is not None for r in mine if r["problem"] == n)]
            known = [
                n for n in hopeless if all(r["status"] in {"infeasible", "invalid"} for r in mine if r["problem"] == n)
            ]
            with_path = [r for r in mine if r["cost_s"] is not None]
            first = [r["first_s"] for r in with_path if r["first_s"] is not None]
            out.append(
                {
                    "planner": planner,
                    "budget_s": budget_s,
                    "solved": len(solved),
                    "solvable": len(best),
                    "recognised": len(known),
                    "hopeless": len(hopeless),
                    "first_ms": _spread([1000.0 * f for f in first]),
                    "over_bound": _spread(
                        [
                            r["cost_s"] / bound[r["problem"]] - 1.0
                            for r in with_path
                            if bound.get(r["problem"], 0.0) > 0.0
                        ]
                    ),
                    "over_best": _spread([r["cost_s"] / best[r["problem"]] - 1.0 for r in with_path]),
                }
            )
    return out


def _spread(values):
    if not values:
        return None
    return [float(np.median(values)), float(np.percentile(values, 90)), float(np.max(values))]


NAMES = {"ompl-rrtstar-se2": "OMPL RRT* in SE(2)", "ompl-informed": "OMPL Informed RRT*", "ompl-bitstar": "OMPL BIT*"}


def show(lines):
    """Print the table in Markdown, as docs/reference/planner.md has it."""
    if not lines:
        return
    print(f"of {lines[0]['solvable']} solvable and {lines[0]['hopeless']} hopeless; median / 90th percentile / worst\n")
    print("| planner | s | solved | known | first path ms | over the bound % | over best % |")
    print("|---|---|---|---|---|---|---|")
    for line in lines:
        name = NAMES.get(line["planner"], f"`{line['planner']}`")
        cells = (_cell(line["first_ms"], 1.0), _cell(line["over_bound"], 100.0), _cell(line["over_best"], 100.0))
        print(f"| {name} | {line['budget_s']:g} | {line['solved']} | {line['recognised']} | {' | '.join(cells)} |")


def _cell(spread, by):
    if spread is None:
        return "-"
    digits = [2 if by > 1.0 and by * v < 10.0 else 0 for v in spread]
    return " / ".join(f"{by * v:.{d}f}" for v, d in zip(spread, digits, strict=True))


# ---------------------------------------------------------------------------------------- scaling
def islands(vertices, size_m, seed=0, per=None):
    """Return a problem with that many obstacle vertices, on a board of size_m, up wind."""
    random = np.random.default_rng(seed)
    per = per or (10 if vertices <= 1000 else 100)
    count = max(1, vertices // per)
    radius = 0.25 * size_m / math.sqrt(count)
    shapes = []
    while len(shapes) < count:
        x, y = random.uniform(-0.5 * size_m, 0.5 * size_m), random.uniform(0.0, size_m)
        if min(math.hypot(x, y), math.hypot(x, y - size_m)) < 2.0 * radius + 0.02 * size_m:
            continue
        angles = np.linspace(0.0, 2.0 * math.pi, per, endpoint=False)
        r = radius * random.uniform(0.5, 1.0, per) if per <= 10 else radius * (0.75 + 0.2 * np.sin(5.0 * angles + x))
        shapes.append(shapely.Polygon(np.column_stack([x + r * np.cos(angles), y + r * np.sin(angles)])))
    return board(size_m, shapes)


def board(size_m, shapes):
    return Problem.from_json(
        {
            "id": "",
            "title": "",
            "start": {"x": 0, "y": 0, "heading_deg": 0},
            "goal": {"x": 0, "y": size_m, "radius": max(5.0, 0.002 * size_m)},
            "obstacles": shapes,
            "fence": None,
            "wind": {
                "from_deg": 10.0,
                "speed_mps": 5.0,
                "sigma": {"model": "ar1", "sigma0_deg": 3.0, "sigma_inf_deg": 9.0, "rho_hz": 0.03},
            },
            "boat": {
                "no_go_half_deg": 45.0,
                "max_twa_deg": 180.0,
                "turn_rate_rad_s": 0.5,
                "speed": {"model": "constant", "v_mps": 1.5},
            },
            "delta_s": 0.7,
        }
    )


def scaling(budget_s):
    rows = []
    print(f"\nauto, {budget_s:g} s: obstacle vertices on a board of 2 km, up wind\n")
    print("| obstacle vertices | first path s | in all s | over the bound % |\n|---|---|---|---|")
    for vertices in (10, 100, 1000, 10_000, 100_000):
        rows.append(_scaled("vertices", vertices, islands(vertices, 2000.0), budget_s))
    print(f"\nauto, {budget_s:g} s: distance in metres, 300 islands of 10 vertices, up wind\n")
    print("| distance, 300 islands | first path s | in all s | over the bound % |\n|---|---|---|---|")
    for size_m in (100.0, 1000.0, 10_000.0, 40_000.0, 100_000.0):
        rows.append(_scaled("distance_m", size_m, islands(3000, size_m, per=10), budget_s))
    return rows


def _scaled(kind, value, problem, budget_s):
    began = time.perf_counter()
    answer = plan(problem, budget_s=budget_s)
    took = time.perf_counter() - began
    first = f"{answer.first_s:.3f}" if answer.first_s is not None else answer.status.value
    gap = f"{100 * answer.gap:.2f}" if math.isfinite(answer.gap) else "-"
    print(f"| {value:,.0f} | {first} | {took:.2f} | {gap} |".replace(",", " "), flush=True)
    return {
        "kind": kind,
        "value": value,
        "first_s": answer.first_s,
        "elapsed_s": took,
        "status": answer.status.value,
        "gap": answer.gap if math.isfinite(answer.gap) else None,
    }


def main(argv=None):
    has_ompl = importlib.util.find_spec("ompl") is not None
    every = [*OURS, *(f"ompl-{name}" for name in OMPL)]
    parser = argparse.ArgumentParser(
        prog="python -m bench", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("problems", nargs="*", help="problem files (default: bench/problems)")
    parser.add_argument("--budgets", nargs="+", type=float, default=[0.1, 1.0, 10.0], metavar="S")
    parser.add_argument("--seeds", type=int, default=2, help="at budgets below 5 s; one above")
    parser.add_argument("--planners", nargs="+", choices=every, default=every if has_ompl else list(OURS))
    parser.add_argument("--all", action="store_true", help="every planner at every budget")
    parser.add_argument("--scaling", action="store_true", help="only the scaling tables")
    parser.add_argument("--json", metavar="FILE", help="write all rows")
    parser.add_argument("--rows", metavar="FILE", help="keep results there as they come, and do not repeat them")
    parser.add_argument("--table", nargs="+", metavar="FILE", help="only print the table of rows written before")
    args = parser.parse_args(argv)
    if args.table:
        show(summary([row for name in args.table for row in json.loads(Path(name).read_text())["rows"]]))
        return 0
    if not has_ompl and any(p.startswith("ompl-") for p in args.planners):
        print("bench: OMPL is not installed: make env EXTRAS=bench, or leave it out", file=sys.stderr)
        return 2
    if not has_ompl:
        print("OMPL is not installed (make env EXTRAS=bench): left out", file=sys.stderr)
    warm()
    rows, lines = [], []
    if not args.scaling:
        rows = compare(args, args.planners)
        lines = summary(rows)
        show(lines)
    scaled = scaling(1.0) if args.scaling or not args.problems else []
    if args.json:
        Path(args.json).write_text(
            json.dumps({"rows": rows, "summary": lines, "scaling": scaled}, indent=1) + "\n", encoding="utf-8"
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
