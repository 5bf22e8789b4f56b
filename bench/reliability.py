"""Is the promised risk true? 2,000 simulated winds against every plan of the problem set.

    python -m bench.reliability                       the problem set, as it is and under limits of 20 and 5 %
    python -m bench.reliability --step 0.1            a finer wind
    python -m bench.reliability my_problem.json ...   other problems

The winds are drawn here from the definitions of the models (a random walk, an Ornstein-Uhlenbeck process, a table
times a stationary process) without any code of the planner. A voyage counts as forced when, on some leg at some
step, |heading - true wind| is below the boat's own no-go half angle. Two promises are checked:

- the plan's: ``risk``, of the whole path. The share of forced voyages must be at most that, and where it binds at
  least a third of it.
- the problem's: 1 - delta_s at each instant. The share of winds inside the zone at the worst moment of the worst
  leg must be at most that within the noise of 2,000 draws; "held" says whether the plan lies on that limit.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

from companion.planner import Problem, plan
from companion.planner.problem import RiskLimit, defect_of
from companion.planner.risk import with_risk
from sailbench.problem_set import FOLDER

LIMITS = (None, 0.20, 0.05)
LEAST_PROMISE = 0.005  # below it 2,000 winds cannot tell a third from nothing


class Winds:
    """The deviation of many winds from the forecast mean [rad], moved forward together."""

    def __init__(self, problem, count, seed):
        self.sigma = problem.wind.sigma
        self.tau_s = problem.risk.correlation_time_s if problem.risk else 60.0
        self.random = np.random.default_rng(seed)
        self.t_s = 0.0
        self.z = self.random.standard_normal(count)
        self.x = self.z * self.sigma.at(0.0)

    def forward(self, d_s):
        s, noise = self.sigma, self.random.standard_normal(self.x.size)
        self.t_s += d_s
        if s.model == "kalman":
            self.x = self.x + s.growth_rad_per_sqrt_s * math.sqrt(d_s) * noise
        elif s.model == "ar1":
            keep = math.exp(-s.rho_hz * d_s)
            self.x = self.x * keep + s.sigma_inf_rad * math.sqrt(1.0 - keep * keep) * noise
        elif s.model == "forecast":
            keep = math.exp(-d_s / self.tau_s)
            self.z = self.z * keep + math.sqrt(1.0 - keep * keep) * noise
            self.x = self.z * s.at(self.t_s)

    def inside(self, problem, leg):
        off = leg.heading_rad - (problem.wind.twd_from_rad + self.x)
        off = (off + math.pi) % (2.0 * math.pi) - math.pi
        return np.abs(off) < problem.boat.no_go_half_rad - 1e-9


def sail(problem, answer, *, winds, step_s, seed):
    """Return which voyages were forced, and the largest share of winds inside the zone at one instant."""
    wind = Winds(problem, winds, seed)
    forced = np.zeros(winds, dtype=bool)
    worst = 0.0
    for leg in answer.legs:
        while wind.t_s < leg.start_s - 1e-12:
            wind.forward(min(step_s, leg.start_s - wind.t_s))
        while True:
            inside = wind.inside(problem, leg)
            worst = max(worst, float(np.mean(inside)))
            forced |= inside
            if wind.t_s >= leg.end_s - 1e-12:
                break
            wind.forward(min(step_s, leg.end_s - wind.t_s))
    return forced, worst


def check(path, limit, args):
    problem = Problem.from_json(path)
    if problem.wind.sigma.model == "none" or defect_of(problem) is not None:
        return None
    if limit is not None:
        tau_s = problem.risk.correlation_time_s if problem.risk else 60.0
        problem = replace(problem, risk=RiskLimit(max_path_risk=limit, correlation_time_s=tau_s))
    answer = plan(problem, budget_s=args.budget if limit is None else 3.0 * args.budget, seed=args.seed)
    row = {"problem": problem.id, "limit": limit, "status": answer.status.value, "reason": answer.reason}
    if not answer.has_path:
        return row
    answer = with_risk(problem, answer)
    forced, worst = sail(problem, answer, winds=args.winds, step_s=args.step, seed=args.seed + 1)
    share = float(np.mean(forced))
    margin_deg = min(math.degrees(leg.margin_rad) for leg in answer.legs)
    instant = 1.0 - problem.delta_s
    noise = 4.0 * math.sqrt(instant * (1.0 - instant) / args.winds)
    binds = answer.risk >= LEAST_PROMISE
    row |= {
        "cost_s": answer.cost_s,
        "legs": len(answer.legs),
        "promise": answer.risk,
        "share": share,
        "ratio": share / answer.risk if answer.risk > 0.0 else None,
        "binds": binds,
        "holds": share <= answer.risk and (not binds or share >= answer.risk / 3.0),
        "instant_promise": instant,
        "instant_share": worst,
        "held": limit is None and margin_deg < 0.1,
        "instant_holds": worst <= instant + noise,
    }
    return row


def main(argv=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("problems", nargs="*", help="problem files (default: sailbench/problems)")
    parser.add_argument("--winds", type=int, default=2000)
    parser.add_argument("--step", type=float, default=0.5, help="of the simulated wind [s]")
    parser.add_argument("--budget", type=float, default=1.0, help="of each plan [s]; thrice that under a limit")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--json", metavar="FILE", help="write the rows")
    args = parser.parse_args(argv)
    paths = args.problems or sorted(FOLDER.glob("*.json"))
    rows = []
    print(f"{args.winds} winds each, a step of {args.step:g} s")
    print(
        f"{'problem':22} {'limit':>6} {'cost s':>7} {'promise':>8} {'forced':>8} {'ratio':>6}      "
        f"{'instant':>8} {'worst':>7}"
    )
    for path in paths:
        for limit in LIMITS:
            row = check(path, limit, args)
            if row is None:
                break
            rows.append(row)
            name, given = row["problem"][:22], "-" if limit is None else f"{100 * limit:.0f} %"
            if "share" not in row:
                print(f"{name:22} {given:>6} {row['status']}: {row['reason'][:70]}")
                if limit is None:
                    break
                continue
            ratio = "-" if row["ratio"] is None else f"{row['ratio']:.2f}"
            verdict = "ok" if row["holds"] else "NO"
            print(
                f"{name:22} {given:>6} {row['cost_s']:7.0f} {100 * row['promise']:6.1f} % "
                f"{100 * row['share']:6.1f} % {ratio:>6} {verdict:>4} {100 * row['instant_promise']:6.1f} % "
                f"{100 * row['instant_share']:5.1f} %{' held' if row['held'] else ''}"
                f"{'' if row['instant_holds'] else ' NO'}",
                flush=True,
            )
    sailed = [r for r in rows if "share" in r]
    binding = [r for r in sailed if r["binds"]]
    print(
        f"{sum(r['holds'] for r in sailed)} of {len(sailed)} promises hold; "
        f"{len(binding)} bind, forced / promised from {min((r['ratio'] for r in binding), default=0):.2f} "
        f"to {max((r['ratio'] for r in binding), default=0):.2f}"
    )
    if args.json:
        Path(args.json).write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    return 0 if all(r["holds"] and r["instant_holds"] for r in sailed) else 1


if __name__ == "__main__":
    sys.exit(main())
