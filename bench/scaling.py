"""How planning scales with obstacle vertices and with distance: ``python -m bench.scaling``, a minute."""

from __future__ import annotations

import math
import sys
import time

import numpy as np
import shapely

from companion.planner import Problem, plan

BUDGET_S = 1.0


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


def main():
    budget_s = BUDGET_S
    plan(islands(100, 500.0), budget_s=budget_s)  # the kernels are compiled or loaded before the clock starts
    print(f"\nauto, {budget_s:g} s: obstacle vertices on a board of 2 km, up wind\n")
    print("| obstacle vertices | first path s | in all s | over the bound % |\n|---|---|---|---|")
    for vertices in (10, 100, 1000, 10_000, 100_000):
        _scaled(vertices, islands(vertices, 2000.0), budget_s)
    print(f"\nauto, {budget_s:g} s: distance in metres, 300 islands of 10 vertices, up wind\n")
    print("| distance, 300 islands | first path s | in all s | over the bound % |\n|---|---|---|---|")
    for size_m in (100.0, 1000.0, 10_000.0, 40_000.0, 100_000.0):
        _scaled(size_m, islands(3000, size_m, per=10), budget_s)
    return 0


def _scaled(value, problem, budget_s):
    began = time.perf_counter()
    answer = plan(problem, budget_s=budget_s)
    took = time.perf_counter() - began
    first = f"{answer.first_s:.3f}" if answer.first_s is not None else answer.status.value
    gap = f"{100 * answer.gap:.2f}" if math.isfinite(answer.gap) else "-"
    print(f"| {value:,.0f} | {first} | {took:.2f} | {gap} |".replace(",", " "), flush=True)


if __name__ == "__main__":
    sys.exit(main())
