"""What `auto` makes of a small budget, on problems that nothing was tuned on: ``python -m bench.budgets``.

    python -m bench.budgets                       0.1, 0.3 and 1 s: three minutes
    python -m bench.budgets --reference 10        looks for better paths first, 10 s each, into held_out.json
    python -m bench.budgets --kinds gate channel  some kinds only
    python -m bench.budgets --overrun             what whole answers take, recorded requests included: three minutes

The problems are drawn by kind and seed (``KINDS``), so there are as many as one likes. Times are processor seconds on
warm kernels: what else the machine does matters little. Printed: cost over the best known (bench/held_out.json), the
time taken over the budget, cost over the plan's own bound by kind, and the first path past 10,000 vertices; three
figures are the median, 90 % and the worst.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from pathlib import Path

import numpy as np
import shapely
from shapely.geometry import LineString, Polygon, box

import companion.planner.effort as clock
from bench.make_problems import BOAT, NONE, SHIP, ar1, coast, islands, kalman, wkt
from bench.scaling import islands as board_of
from companion.planner import Problem, plan
from companion.planner.solve import warm
from sailbench.problem_set import FOLDER

KNOWN = Path(__file__).parent / "held_out.json"
BUDGETS_S = (0.1, 0.3, 1.0)
OVERRUN_S = (0.1, 0.3, 1.0, 2.0)


def problem(name, start, goal, obstacles=(), fence=None, *, wind_from, sigma=NONE, boat=BOAT, delta=0.7):
    return Problem.from_json(
        {
            "id": name,
            "title": "",
            "start": dict(zip(("x", "y", "heading_deg"), start, strict=True)),
            "goal": dict(zip(("x", "y", "radius"), goal, strict=True)),
            "obstacles": [wkt(g) for g in obstacles],
            "fence": None if fence is None else wkt(fence),
            "delta_s": delta,
            "boat": boat,
            "wind": {"from_deg": wind_from, "speed_mps": 6.0, "sigma": sigma},
        }
    )


def archipelago(name, random):
    count = int(random.integers(20, 300))
    size = 80.0 * math.sqrt(count)
    ends = [(10.0, 10.0), (size - 10.0, size - 10.0)]
    shapes = islands(random, count, (size, size), ends, size=(6.0, random.uniform(15.0, 32.0)))
    fence = box(-60, -60, size + 60, size + 60) if random.random() < 0.5 else None
    sigma = (NONE, ar1(2, 6, 0.003), ar1(3, 9, 0.03))[int(random.integers(3))]
    return problem(
        name,
        (*ends[0], 45),
        (*ends[1], 8),
        shapes,
        fence,
        sigma=sigma,
        wind_from=float(random.uniform(15.0, 75.0)),
        boat=SHIP if random.random() < 0.5 else BOAT,
    )


def downwind(name, random):
    count = int(random.integers(20, 300))
    size = 80.0 * math.sqrt(count)
    ends = [(10.0, 10.0), (size - 10.0, size - 10.0)]
    return problem(
        name,
        (*ends[0], 45),
        (*ends[1], 8),
        islands(random, count, (size, size), ends),
        wind_from=float(random.uniform(180.0, 270.0)),
        boat=SHIP,
    )


def channel(name, random):
    width, bends = random.uniform(12.0, 30.0), int(random.integers(3, 7))
    points = [(float(random.uniform(-60, 60)), 180.0 * i) for i in range(bends)]
    bed = LineString(points)
    banks = (
        bed.buffer(80)
        .difference(bed.buffer(width, cap_style="square"))
        .intersection(box(-300, 5, 300, 180.0 * (bends - 1) - 20))
    )
    top = points[-1]
    sigma = (NONE, ar1(2, 5, 0.01), kalman(2, 0.15))[int(random.integers(3))]
    return problem(
        name,
        (points[0][0], -25, 0),
        (top[0], top[1] + 25, 6),
        list(shapely.get_parts(banks)),
        box(-300, -80, 300, top[1] + 80),
        wind_from=float(random.uniform(-20.0, 20.0)),
        sigma=sigma,
        boat={**BOAT, "turn_rate_rad_s": 0.8},
        delta=0.65,
    )


def slalom(name, random):
    gap = random.uniform(30.0, 80.0)
    walls = [
        box(-250, 80 * k, 120 - gap, 80 * k + 15) if k % 2 else box(gap - 120, 80 * k, 250, 80 * k + 15)
        for k in range(1, int(random.integers(3, 8)))
    ]
    return problem(
        name,
        (0, 0, 0),
        (0, 80 * (len(walls) + 1.5), 6),
        walls,
        box(-120, -40, 120, 80 * len(walls) + 200),
        wind_from=float(random.uniform(-40.0, 40.0)),
        sigma=kalman(2, 0.1),
    )


def closing(name, random):
    quad = []
    for cx, cy in ((-45, 90), (40, 95), (-35, 180), (40, 185)):
        angles = np.sort(random.uniform(0, 2 * math.pi, 7))
        ring = np.column_stack([cx + 30 * np.cos(angles), cy + 30 * np.sin(angles)])
        quad.append(Polygon(ring).buffer(1.0))
    return problem(
        name,
        (0, 0, 0),
        (0, 260, 5),
        quad,
        box(-130, -40, 130, 310),
        sigma=kalman(4, random.uniform(0.6, 1.8)),
        wind_from=float(random.uniform(-10.0, 10.0)),
        delta=0.7,
    )


def gate(name, random):
    x, width = random.uniform(-100.0, 100.0), random.uniform(1.5, 6.0)
    walls = [box(-800, 200, x - width, 215), box(x + width, 200, 800, 215)]
    return problem(
        name,
        (random.uniform(-150.0, 150.0), 0, 0),
        (random.uniform(-100.0, 100.0), 420, 6),
        walls,
        box(-800, -200, 800, 700),
        wind_from=float(random.uniform(-30.0, 30.0)),
        sigma=ar1(2, 5, 0.02),
    )


def shore(name, random):
    x, y = coast(random, int(random.integers(1000, 5000)), 6000, 0, 300, (2, 3, 5, 9, 17, 33, 71))
    land = Polygon([*zip(x, y, strict=True), (6000, -3000), (0, -3000)]).buffer(0)
    first, last = float(np.interp(200, x, y)) + 25, float(np.interp(5800, x, y)) + 30
    return problem(
        name,
        (200, first, 90),
        (5800, last, 15),
        [land],
        box(0, -3000, 6000, float(y.max()) + 800),
        wind_from=float(random.uniform(70.0, 110.0)),
        boat=SHIP,
        sigma=ar1(3, 7, 0.002),
    )


def opened(name, random):
    return problem(
        name,
        (0, 0, float(random.uniform(0, 360))),
        (float(random.uniform(-100, 100)), 500, 6),
        wind_from=float(random.uniform(-20, 20)),
        sigma=kalman(4, random.uniform(0.2, 0.7)),
        delta=0.75,
    )


KINDS = {
    "archipelago": archipelago,
    "downwind": downwind,
    "channel": channel,
    "slalom": slalom,
    "closing": closing,
    "gate": gate,
    "shore": shore,
    "open": opened,
}


def drawn(kinds, count):
    """Yield (name, kind, problem) of those to be planned."""
    for number, kind in enumerate(KINDS):
        for seed in range(count if kind in kinds else 0):
            name = f"{kind}-{seed}"
            yield name, kind, KINDS[kind](name, np.random.default_rng([number, seed]))


def spread(values, digits=2):
    """Return median / 90 % / worst as words."""
    return " / ".join(f"{v:.{digits}f}" for v in (np.median(values), np.percentile(values, 90), np.max(values)))


def refer(problems, budget_s):
    """Look for better paths and keep their times."""
    known = json.loads(KNOWN.read_text(encoding="utf-8")) if KNOWN.exists() else {}
    for name, _, held_out in problems:
        for seed in (100, 101):
            answer = plan(held_out, budget_s=budget_s, seed=seed)
            if answer.has_path:
                known[name] = min(known.get(name, math.inf), round(answer.cost_s, 4))
    KNOWN.write_text(json.dumps(known, indent=0, sort_keys=True) + "\n", encoding="utf-8")


def budgets(problems, seeds):
    """Print a line for each budget, and the gap to the bound by kind."""
    known = json.loads(KNOWN.read_text(encoding="utf-8"))
    gaps = {}
    print(
        "| budget s | plans | found | over best known % | above 1 % | taken over budget | first path ms |\n"
        "|--:|--:|--:|--:|--:|--:|--:|"
    )
    for budget_s in BUDGETS_S:
        over, taken, first, plans = [], [], [], 0
        for name, kind, held_out in problems:
            for seed in range(seeds):
                began_s = time.process_time()
                answer = plan(held_out, budget_s=budget_s, seed=seed)
                taken.append((time.process_time() - began_s) / budget_s)
                plans += 1
                if not answer.has_path or name not in known:
                    if name in known:
                        print(f"{name}, seed {seed}: {answer.reason}", file=sys.stderr)
                    continue
                over.append(100.0 * max(0.0, answer.cost_s / known[name] - 1.0))
                first.append(1e3 * (answer.first_s or 0.0))
                gaps.setdefault((kind, budget_s), []).append(100.0 * answer.gap)
                if over[-1] > 2.0 or taken[-1] > 1.2:
                    print(
                        f"{name}, {budget_s:g} s, seed {seed}: {over[-1]:.2f} % over, {taken[-1]:.2f} of the budget",
                        file=sys.stderr,
                    )
        print(
            f"| {budget_s:g} | {plans} | {len(over)} | {spread(over)} | {sum(o > 1.0 for o in over)} | "
            f"{spread(taken)} | {spread(first, 0)} |",
            flush=True,
        )
    print("\n| kind | over the bound %, 1 s |\n|---|--:|")
    for kind in KINDS:
        if (kind, BUDGETS_S[-1]) in gaps:
            print(f"| {kind} | {spread(gaps[kind, BUDGETS_S[-1]], 1)} |")


def overrun(paths, budgets_s):
    """Print what whole answers take of the processor, and how many take more than 1.1 times their budget and 50 ms."""
    print(
        "| requests | budget s | plans | found | taken over budget | over 1.1 B + 50 ms | the most over, ms |\n"
        "|---|--:|--:|--:|--:|--:|--:|"
    )
    for folder in sorted({path.parent for path in paths}):
        asked = [(path.stem, Problem.from_json(path)) for path in sorted(paths) if path.parent == folder]
        for budget_s in budgets_s:
            taken, over, found = [], [], 0
            for name, problem in asked:
                began_s = time.process_time()
                found += plan(problem, budget_s=budget_s).has_path
                taken.append(time.process_time() - began_s)
                over.append(1e3 * (taken[-1] - 1.1 * budget_s - 0.05))
                if over[-1] > 0.0:
                    print(f"{name}, {budget_s:g} s: {over[-1]:.0f} ms over", file=sys.stderr)
            shares = spread([t / budget_s for t in taken])
            print(
                f"| {folder.name} | {budget_s:g} | {len(asked)} | {found} | {shares} | "
                f"{sum(o > 0.0 for o in over)} | {max(0.0, *over):.0f} |",
                flush=True,
            )


def firsts():
    """Print when the first path past many vertices comes, and what the plan took."""
    print("\n| obstacle vertices | first path ms | taken over 0.3 s |\n|--:|--:|--:|")
    for vertices in (100, 1000, 10_000):
        rows = []
        for seed in range(5):
            drawn_board = board_of(vertices, 2000.0, seed=seed)
            began_s = time.process_time()
            answer = plan(drawn_board, budget_s=0.3)
            rows.append((1e3 * (answer.first_s or math.nan), (time.process_time() - began_s) / 0.3))
        print(f"| {vertices} | {spread([r[0] for r in rows], 0)} | {spread([r[1] for r in rows])} |", flush=True)


def main(argv=None):
    parser = argparse.ArgumentParser(
        prog="python -m bench.budgets", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--kinds", nargs="+", choices=list(KINDS), default=list(KINDS))
    parser.add_argument("--count", type=int, default=3, help="problems of each kind")
    parser.add_argument("--seeds", type=int, default=2, help="of the planner")
    parser.add_argument(
        "--overrun",
        nargs="*",
        type=float,
        metavar="S",
        help="only what whole answers take, of sailbench/problems and the recorded bench/requests",
    )
    parser.add_argument("--reference", type=float, metavar="S", help="look for better paths first, so long each")
    args = parser.parse_args(argv)
    clock.effort_s = time.process_time
    if args.overrun is not None:
        here = Path(__file__).parent
        warm()
        overrun([*FOLDER.glob("*.json"), *here.glob("requests/*.json")], args.overrun or OVERRUN_S)
        return 0
    problems = list(drawn(args.kinds, args.count))
    for _, _, held_out in problems[:: args.count]:
        plan(held_out, budget_s=0.3)
    if args.reference:
        refer(problems, args.reference)
    budgets(problems, args.seeds)
    firsts()
    return 0


if __name__ == "__main__":
    sys.exit(main())
